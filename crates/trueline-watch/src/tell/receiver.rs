//! Receiver of alarms: a web address or a topic of an MQTT broker.

/// A receiver of messages.
pub trait Receiver: Send {
    /// Its address, whole: what makes it this receiver and no other.
    fn address(&self) -> &str;

    /// Its name for people: the host, without what may be secret.
    fn name(&self) -> String;

    /// Sends it a JSON message.
    ///
    /// # Errors
    /// A sentence with the reason why delivery is not certain.
    fn tell(&self, body: &str) -> Result<(), String>;
}

/// Reason why an address cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum ReceiverError {
    /// Not an address of a kind that is known.
    #[error("an address begins with {}", known())]
    Kind,
    /// No host, or no topic.
    #[error("the address has no {0}")]
    Missing(&'static str),
    /// Not an address at all.
    #[error("it is not an address: {0}")]
    Malformed(String),
}

fn known() -> &'static str {
    match (cfg!(feature = "webhook"), cfg!(feature = "mqtt")) {
        (true, true) => "http://, https:// or mqtt://",
        (true, false) => "http:// or https:// (this program was built without MQTT)",
        (false, true) => "mqtt:// (this program was built without webhooks)",
        (false, false) => "nothing: this program was built without webhooks and MQTT",
    }
}
