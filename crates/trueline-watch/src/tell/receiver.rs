//! Receiver of alarms: a web address or a topic of an MQTT broker.

use std::path::PathBuf;

/// A receiver of messages.
pub trait Receiver: Send {
    /// Its whole address, which identifies this receiver.
    fn address(&self) -> &str;

    /// Its name for people: the host, without secrets.
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
    /// Not an address of a known kind.
    #[error("an address begins with {}", known())]
    Kind,
    /// No host, or no topic.
    #[error("the address has no {0}")]
    Missing(&'static str),
    /// Not an address at all.
    #[error("it is not an address: {0}")]
    Malformed(String),
    /// Every program of this PC can read the command line of every other.
    #[error("an address must not contain a password")]
    PasswordInAddress,
    /// A key that no address has.
    #[error("an address has no key `{0}`")]
    UnknownKey(String),
    /// A password or certificate that cannot be read.
    #[error("{}: {why}", file.display())]
    File {
        /// The file.
        file: PathBuf,
        /// Why.
        why: String,
    },
    /// A password that is not there.
    #[error("the environment has no variable {0}, or it is empty")]
    Variable(String),
}

impl ReceiverError {
    /// The remedy.
    #[must_use]
    pub fn hint(&self) -> &'static str {
        match self {
            Self::Kind | Self::Missing(_) | Self::Malformed(_) => {
                "http://HOST/PATH, https://HOST/PATH, mqtt://[USER@]HOST[:PORT]/TOPIC or mqtts://…"
            }
            Self::PasswordInAddress => {
                "name a file or a variable: mqtts://USER@HOST/TOPIC?password-file=FILE or ?password-env=NAME"
            }
            Self::UnknownKey(_) => "keys are password-file=FILE, password-env=NAME and ca=FILE",
            Self::File { .. } => "check the path; a password is one line, certificates are in PEM form",
            Self::Variable(_) => "set it, or name a file: ?password-file=FILE",
        }
    }
}

fn known() -> &'static str {
    match (cfg!(feature = "webhook"), cfg!(feature = "mqtt")) {
        (true, true) => "http://, https://, mqtt:// or mqtts://",
        (true, false) => "http:// or https:// (this program was built without MQTT)",
        (false, true) => "mqtt:// or mqtts:// (this program was built without webhooks)",
        (false, false) => "nothing: this program was built without webhooks and MQTT",
    }
}
