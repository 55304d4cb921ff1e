//! A web address that receives messages by POST.

use super::receiver::{Receiver, ReceiverError};
use std::time::Duration;
use ureq::http::Uri;

/// A web address.
pub(crate) struct Webhook {
    address: String,
    host: String,
    agent: ureq::Agent,
}

impl Webhook {
    /// The webhook at an address.
    pub(super) fn at(address: &str, patience: Duration) -> Result<Self, ReceiverError> {
        let uri: Uri = address
            .parse()
            .map_err(|e: ureq::http::uri::InvalidUri| ReceiverError::Malformed(e.to_string()))?;
        let host =
            uri.host().filter(|host| !host.is_empty()).ok_or(ReceiverError::Missing("host"))?.to_owned();
        // A redirected message would report on this cell to a receiver that nobody chose.
        let config = ureq::Agent::config_builder()
            .timeout_global(Some(patience))
            .max_redirects(0)
            .max_redirects_will_error(false)
            .http_status_as_error(false)
            .build();
        Ok(Self { address: address.to_owned(), host, agent: config.into() })
    }
}

impl Receiver for Webhook {
    fn address(&self) -> &str {
        &self.address
    }

    fn name(&self) -> String {
        self.host.clone()
    }

    /// Only the status of the answer is used.
    fn tell(&self, body: &str) -> Result<(), String> {
        let sent = self.agent.post(&self.address).header("content-type", "application/json").send(body);
        let status = sent.map_err(|error| error.to_string())?.status();
        if status.is_success() { Ok(()) } else { Err(format!("it answered {status}")) }
    }
}
