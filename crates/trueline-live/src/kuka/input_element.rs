//! Which element of a message holds the digital inputs: the name that its Ethernet configuration gives it (`TAG`).

use std::fmt;
use std::str::FromStr;

/// The name that KUKA's own example gives to a byte of inputs, and `trueline robot-program` to one.
const USUAL: &str = "DiL";

/// An element, or an attribute of one.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct InputElement {
    name: String,
    attribute: Option<String>,
}

/// Not a `TAG`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("an input of KUKA is a TAG of the SEND section, for example DiL or Out.01")]
pub struct NoTag;

impl Default for InputElement {
    fn default() -> Self {
        Self { name: USUAL.to_owned(), attribute: None }
    }
}

impl InputElement {
    /// The attribute that holds the inputs, if this element has them so.
    #[must_use]
    pub(crate) fn attribute_of(&self, element: &str) -> Option<&str> {
        self.attribute.as_deref().filter(|_| self.name == element)
    }

    /// Whether the text in this element is the inputs.
    #[must_use]
    pub(crate) fn is_text_of(&self, element: &str) -> bool {
        self.attribute.is_none() && self.name == element
    }
}

impl FromStr for InputElement {
    type Err = NoTag;

    fn from_str(text: &str) -> Result<Self, NoTag> {
        let is_name = |name: &str| {
            !name.is_empty() && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_' || c == '-')
        };
        let (name, attribute) = text.split_once('.').map_or((text, None), |(name, at)| (name, Some(at)));
        if !is_name(name) || !attribute.is_none_or(is_name) || ["IPOC", "RIst", "Rob"].contains(&name) {
            return Err(NoTag);
        }
        Ok(Self { name: name.to_owned(), attribute: attribute.map(str::to_owned) })
    }
}

impl fmt::Display for InputElement {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.attribute {
            Some(attribute) => write!(f, "{}.{attribute}", self.name),
            None => f.write_str(&self.name),
        }
    }
}
