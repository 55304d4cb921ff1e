//! A topic of an MQTT broker: publishes at least once (QoS 1), until the broker acknowledges.

use super::receiver::{Receiver, ReceiverError};
use super::topic_address::TopicAddress;
use rumqttc::tokio_rustls::rustls::crypto::ring;
use rumqttc::tokio_rustls::rustls::pki_types::CertificateDer;
use rumqttc::tokio_rustls::rustls::pki_types::pem::PemObject;
use rumqttc::tokio_rustls::rustls::{ClientConfig, RootCertStore};
use rumqttc::{Client, Event, MqttOptions, Packet, PublishOptions, TlsConfiguration, Transport};
use std::fs;
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Requests that wait for the connection: one message and the farewell.
const CAPACITY: usize = 4;

/// A topic.
pub(super) struct Topic {
    to: TopicAddress,
    transport: Transport,
    patience: Duration,
}

impl Topic {
    /// The topic at `mqtt://[USER@]HOST[:PORT]/TOPIC[?KEY=VALUE&…]`, or `mqtts://…`.
    pub(super) fn at(address: &str, patience: Duration) -> Result<Self, ReceiverError> {
        let to = TopicAddress::read(address)?;
        let transport = if to.is_tls { tls(to.ca.as_deref())? } else { Transport::tcp() };
        Ok(Self { to, transport, patience })
    }

    fn options(&self) -> MqttOptions {
        let name = format!("trueline-{}", std::process::id());
        let mut options = MqttOptions::new(name, (self.to.host.as_str(), self.to.port));
        options.set_transport(self.transport.clone());
        options.set_keep_alive(u16::try_from(self.patience.as_secs()).unwrap_or(u16::MAX));
        if let Some(login) = &self.to.login {
            options.set_credentials(&login.user, login.password.clone());
        }
        options
    }
}

/// TLS that trusts the certificates of a file, or those of the system.
fn tls(ca: Option<&Path>) -> Result<Transport, ReceiverError> {
    let Some(file) = ca else {
        return Transport::try_tls_with_default_config().map_err(|error| {
            ReceiverError::Malformed(format!("the system's certificates cannot be used: {error}"))
        });
    };
    let unusable = |why: String| ReceiverError::File { file: file.to_owned(), why };
    let bytes = fs::read(file).map_err(|error| unusable(error.to_string()))?;
    let mut roots = RootCertStore::empty();
    for certificate in CertificateDer::pem_slice_iter(&bytes) {
        let certificate = certificate.map_err(|error| unusable(error.to_string()))?;
        roots.add(certificate).map_err(|error| unusable(error.to_string()))?;
    }
    if roots.is_empty() {
        return Err(unusable("holds no certificate in PEM form".to_owned()));
    }
    let config = ClientConfig::builder_with_provider(Arc::new(ring::default_provider()))
        .with_safe_default_protocol_versions()
        .map_err(|error| unusable(error.to_string()))?
        .with_root_certificates(roots)
        .with_no_client_auth();
    Ok(Transport::tls_with_config(TlsConfiguration::Rustls(Arc::new(config))))
}

impl Receiver for Topic {
    fn address(&self) -> &str {
        &self.to.identity
    }

    fn name(&self) -> String {
        self.to.host.clone()
    }

    fn tell(&self, body: &str) -> Result<(), String> {
        let built = Client::builder(self.options()).capacity(CAPACITY).try_build();
        let (client, mut connection) = built.map_err(|error| error.to_string())?;
        // Later subscribers learn the last state as well.
        let publish = PublishOptions::at_least_once().retained();
        client.publish(self.to.topic.clone(), body.to_owned(), publish).map_err(|error| error.to_string())?;
        let end = Instant::now() + self.patience;
        loop {
            let left = end.saturating_duration_since(Instant::now());
            match connection.recv_timeout(left) {
                Ok(Ok(Event::Incoming(Packet::PubAck(_)))) => {
                    let _gone_already = client.disconnect();
                    return Ok(());
                }
                Ok(Ok(_)) => {}
                Ok(Err(error)) => return Err(error.to_string()),
                Err(_) => return Err("the broker did not acknowledge in time".to_owned()),
            }
        }
    }
}
