//! The address of a topic: `mqtt://[USER@]HOST[:PORT]/TOPIC[?KEY=VALUE&…]`; `mqtts` is the same over TLS. Keys: `password-file=FILE`,
//! `password-env=NAME`, `ca=FILE`.

use super::receiver::ReceiverError;
use std::path::{Path, PathBuf};
use std::{env, fmt, fs};

const PORT: u16 = 1883;
const PORT_TLS: u16 = 8883;
/// A password is a line; a longer file is another one, bytes.
const LONGEST_PASSWORD: u64 = 4096;

/// An address in its parts.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct TopicAddress {
    /// The address without keys, which identifies this receiver. Its password may change.
    pub identity: String,
    /// Whether the connection is encrypted.
    pub is_tls: bool,
    /// Who publishes.
    pub login: Option<Login>,
    pub host: String,
    pub port: u16,
    pub topic: String,
    /// The certificates (PEM) that are trusted in place of the system's.
    pub ca: Option<PathBuf>,
}

/// A user and the password.
#[derive(Clone, PartialEq, Eq)]
pub(super) struct Login {
    pub user: String,
    /// Empty without one.
    pub password: String,
}

impl fmt::Debug for Login {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Login").field("user", &self.user).finish_non_exhaustive()
    }
}

impl TopicAddress {
    /// Reads an address, and the password from its place.
    ///
    /// # Errors
    /// A missing or invalid part; a password in the address itself, or a missing one.
    pub(super) fn read(address: &str) -> Result<Self, ReceiverError> {
        let (identity, keys) = address.split_once('?').map_or((address, None), |(a, keys)| (a, Some(keys)));
        let (scheme, rest) = identity.split_once("://").ok_or(ReceiverError::Kind)?;
        let is_tls = scheme == "mqtts";
        let (server, topic) = rest.split_once('/').ok_or(ReceiverError::Missing("topic"))?;
        if topic.is_empty() {
            return Err(ReceiverError::Missing("topic"));
        }
        if topic.contains(['+', '#', '\0']) {
            return Err(ReceiverError::Malformed("a topic to publish to has no +, # or null".to_owned()));
        }
        let (user, server) =
            server.rsplit_once('@').map_or((None, server), |(user, rest)| (Some(user), rest));
        let (host, port) = match server.rsplit_once(':') {
            Some((host, port)) => {
                (host, port.parse().map_err(|_| ReceiverError::Malformed(format!("{port:?} is not a port")))?)
            }
            None => (server, if is_tls { PORT_TLS } else { PORT }),
        };
        if host.is_empty() {
            return Err(ReceiverError::Missing("host"));
        }
        let keys = Keys::read(keys)?;
        if keys.ca.is_some() && !is_tls {
            return Err(ReceiverError::Malformed("ca=FILE requires TLS: mqtts://".to_owned()));
        }
        Ok(Self {
            identity: identity.to_owned(),
            is_tls,
            login: login(user, keys.password)?,
            host: host.to_owned(),
            port,
            topic: topic.to_owned(),
            ca: keys.ca,
        })
    }
}

fn login(user: Option<&str>, password: Option<String>) -> Result<Option<Login>, ReceiverError> {
    match (user, password) {
        (None, None) => Ok(None),
        (None, Some(_)) => Err(ReceiverError::Missing("user for the password: mqtts://USER@HOST/TOPIC")),
        (Some(""), _) => Err(ReceiverError::Missing("user before the @")),
        (Some(user), _) if user.contains(':') => Err(ReceiverError::PasswordInAddress),
        (Some(user), password) => {
            Ok(Some(Login { user: user.to_owned(), password: password.unwrap_or_default() }))
        }
    }
}

/// The part after the `?`.
#[derive(Default)]
struct Keys {
    password: Option<String>,
    ca: Option<PathBuf>,
}

impl Keys {
    fn read(text: Option<&str>) -> Result<Self, ReceiverError> {
        let mut keys = Self::default();
        for pair in text.into_iter().flat_map(|text| text.split('&')) {
            let (key, value) = pair.split_once('=').unwrap_or((pair, ""));
            let is_twice = match key {
                "password-file" => keys.password.replace(from_file(Path::new(value))?).is_some(),
                "password-env" => keys.password.replace(from_variable(value)?).is_some(),
                "ca" => keys.ca.replace(PathBuf::from(value)).is_some(),
                "password" => return Err(ReceiverError::PasswordInAddress),
                _ => return Err(ReceiverError::UnknownKey(key.to_owned())),
            };
            if is_twice {
                return Err(ReceiverError::Malformed(format!("{key}: there are two of them")));
            }
        }
        Ok(keys)
    }
}

/// The first line of a file.
fn from_file(file: &Path) -> Result<String, ReceiverError> {
    let unusable = |why: String| ReceiverError::File { file: file.to_owned(), why };
    let bytes = fs::metadata(file).map_err(|error| unusable(error.to_string()))?.len();
    if bytes > LONGEST_PASSWORD {
        return Err(unusable(format!(
            "is not a password: it has {bytes} bytes, and the limit is {LONGEST_PASSWORD}"
        )));
    }
    let text = fs::read_to_string(file).map_err(|error| unusable(error.to_string()))?;
    let line = text.trim_end_matches(['\r', '\n']);
    if line.is_empty() || line.contains(['\r', '\n']) {
        let lines = line.lines().count();
        return Err(unusable(format!("has {lines} lines, and a password is one")));
    }
    Ok(line.to_owned())
}

fn from_variable(name: &str) -> Result<String, ReceiverError> {
    let missing = || ReceiverError::Variable(name.to_owned());
    env::var(name).ok().filter(|value| !value.is_empty()).ok_or_else(missing)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;

    fn why(address: &str) -> String {
        TopicAddress::read(address).unwrap_err().to_string()
    }

    #[test]
    fn an_address_has_user_port_topic_and_keys() {
        let plain = TopicAddress::read("mqtt://broker/cells/7").unwrap();
        assert_eq!((plain.is_tls, plain.port, plain.login), (false, 1883, None));
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("broker.pw");
        fs::write(&file, "s3cr=t\r\n").unwrap();
        let text = format!("mqtts://cell@plant@broker/cells/7?password-file={}&ca=ca.pem", file.display());
        let full = TopicAddress::read(&text).unwrap();
        assert_eq!((full.is_tls, full.port, full.topic.as_str()), (true, 8883, "cells/7"));
        // With another password it is the same receiver, and nothing that is printed shows it.
        assert_eq!(full.identity, "mqtts://cell@plant@broker/cells/7");
        assert!(!format!("{full:?}").contains("s3cr"));
        let login = full.login.unwrap();
        assert_eq!((login.user.as_str(), login.password.as_str()), ("cell@plant", "s3cr=t"));
        assert_eq!(full.ca.unwrap(), Path::new("ca.pem"));
    }

    #[test]
    fn a_password_stands_in_no_address_and_is_of_a_user() {
        let folder = tempfile::tempdir().unwrap();
        let (empty, lines) = (folder.path().join("empty"), folder.path().join("lines"));
        fs::write(&empty, "\n").unwrap();
        fs::write(&lines, "a\nb\n").unwrap();
        for wrong in ["mqtts://cell:secret@broker/a", "mqtts://cell@broker/a?password=secret"] {
            assert!(matches!(TopicAddress::read(wrong), Err(ReceiverError::PasswordInAddress)), "{wrong}");
            assert!(!why(wrong).contains("secret"));
        }
        assert!(why("mqtts://cell@broker/a?password-file=/none/pw").contains("/none/pw"));
        assert!(
            why(&format!("mqtts://c@broker/a?password-file={}", empty.display())).contains("has 0 lines")
        );
        assert!(
            why(&format!("mqtts://c@broker/a?password-file={}", lines.display())).contains("has 2 lines")
        );
        assert!(why("mqtts://cell@broker/a?password-env=TRUELINE_NO_SUCH").contains("TRUELINE_NO_SUCH"));
        assert!(why("mqtts://broker/a?password-env=PATH").contains("user"));
        assert!(why("mqtts://c@broker/a?password-env=PATH&password-env=PATH").contains("two"));
        assert!(why("mqtt://broker/a?ca=ca.pem").contains("mqtts://"));
        assert!(why("mqtts://broker/a?cafile=ca.pem").contains("cafile"));
        assert!(why("mqtts://@broker/a").contains("user"));
    }
}
