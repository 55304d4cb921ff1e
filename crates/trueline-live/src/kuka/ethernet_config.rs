//! The configuration of a controller's ETHERNET object: the sent and the awaited elements.

use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};

/// Longest file, bytes: KUKA's object has 64 channels each way.
const LONGEST_BYTES: usize = 256 << 10;

/// Content of a configuration, as far as an answer needs it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct EthernetConfig {
    /// `PORT`: where the PC listens.
    pub port: u16,
    /// `SENTYPE`: the name that answers must have.
    pub sentype: String,
    /// `ONLYSEND`: no answers are awaited.
    pub only_sends: bool,
    /// `TAG` of each element that the controller takes.
    pub receives: Vec<String>,
}

/// Why a configuration is not one.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ConfigError {
    /// Not XML, or longer than any configuration.
    #[error("it is not an Ethernet configuration of RSI (XML with ROOT, CONFIG, SEND and RECEIVE)")]
    NoConfig,
    /// An element that is needed.
    #[error("it has no {0} under CONFIG")]
    Missing(&'static str),
    /// An element with an unknown content.
    #[error("its {name} is `{text}`")]
    Odd {
        /// Which.
        name: &'static str,
        /// Its content.
        text: String,
    },
}

impl EthernetConfig {
    /// Reads a configuration.
    ///
    /// # Errors
    /// Missing or invalid elements.
    pub fn read(text: &str) -> Result<Self, ConfigError> {
        if text.len() > LONGEST_BYTES {
            return Err(ConfigError::NoConfig);
        }
        let mut reader = Reader::from_str(text.trim_start_matches('\u{feff}'));
        let mut open: Vec<String> = Vec::new();
        let mut config = Found::default();
        loop {
            match reader.read_event().map_err(|_| ConfigError::NoConfig)? {
                Event::Start(tag) => {
                    config.element(&tag, &open)?;
                    open.push(tag.name().as_ref().to_owned());
                }
                Event::Empty(tag) => config.element(&tag, &open)?,
                Event::Text(text) => config.text(text.trim(), &open),
                Event::End(_) => drop(open.pop()),
                Event::DocType(_) | Event::GeneralRef(_) => return Err(ConfigError::NoConfig),
                Event::Eof if open.is_empty() => break,
                Event::Eof => return Err(ConfigError::NoConfig),
                _ => {}
            }
        }
        config.checked()
    }
}

#[derive(Default)]
struct Found {
    port: Option<String>,
    sentype: Option<String>,
    only_sends: Option<String>,
    receives: Vec<String>,
}

impl Found {
    fn element(&mut self, tag: &BytesStart<'_>, open: &[String]) -> Result<(), ConfigError> {
        let place: Vec<&str> = open.iter().map(String::as_str).collect();
        if place != ["ROOT", "RECEIVE", "ELEMENTS"] || tag.name().as_ref() != "ELEMENT" {
            return Ok(());
        }
        let named = tag.try_get_attribute("TAG").map_err(|_| ConfigError::NoConfig)?;
        self.receives.push(named.ok_or(ConfigError::NoConfig)?.value.trim().to_owned());
        Ok(())
    }

    fn text(&mut self, text: &str, open: &[String]) {
        let [root, config, name] = open else { return };
        let field = match (root.as_str(), config.as_str(), name.as_str()) {
            ("ROOT", "CONFIG", "PORT") => &mut self.port,
            ("ROOT", "CONFIG", "SENTYPE") => &mut self.sentype,
            ("ROOT", "CONFIG", "ONLYSEND") => &mut self.only_sends,
            _ => return,
        };
        *field = Some(text.to_owned());
    }

    fn checked(self) -> Result<EthernetConfig, ConfigError> {
        let port = self.port.ok_or(ConfigError::Missing("PORT"))?;
        let port = port.parse().map_err(|_| ConfigError::Odd { name: "PORT", text: port })?;
        let sentype = self.sentype.ok_or(ConfigError::Missing("SENTYPE"))?;
        // Such a text needs no escaping.
        let is_plain = |c: char| c.is_ascii_alphanumeric() || "_-. ".contains(c);
        if sentype.is_empty() || sentype.len() > 64 || !sentype.chars().all(is_plain) {
            return Err(ConfigError::Odd { name: "SENTYPE", text: sentype });
        }
        // KUKA's default is FALSE.
        let only_sends = match self.only_sends.as_deref() {
            Some("TRUE" | "true" | "True" | "1") => true,
            Some("FALSE" | "false" | "False" | "0") | None => false,
            Some(text) => return Err(ConfigError::Odd { name: "ONLYSEND", text: text.to_owned() }),
        };
        Ok(EthernetConfig { port, sentype, only_sends, receives: self.receives })
    }
}
