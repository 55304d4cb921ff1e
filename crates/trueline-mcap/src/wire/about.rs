//! A recording's statements about itself.

use std::collections::BTreeMap;
use trueline_dataset::folder::sha256;

/// A recording's statements about itself.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct About {
    /// The text of `sensor.toml`, if the sensor is known.
    pub sensor_toml: Option<String>,
    /// Meaning of a frame's stamp, in words.
    pub stamp_meaning: String,
    /// The command that records.
    pub command: String,
    /// Which frame of the robot is the tool, in words.
    pub tool: String,
}

/// Name of the attachment that holds the sensor.
pub(crate) const SENSOR_ATTACHMENT: &str = "sensor.toml";
/// Name of the record that holds the rest of [`About`].
pub(crate) const ABOUT_RECORD: &str = "trueline";

const CHECKSUM: &str = "sha256";

impl About {
    /// The words of the record. Unlike everything else in an unfinished file it has no checksum, so it brings its own.
    #[must_use]
    pub fn record(&self) -> BTreeMap<String, String> {
        let facts = [
            ("format", "1"),
            ("version", env!("CARGO_PKG_VERSION")),
            ("command", &self.command),
            ("stamp_meaning", &self.stamp_meaning),
            ("tool", &self.tool),
        ];
        let mut record: BTreeMap<_, _> = facts.map(|(key, value)| (key.to_owned(), value.to_owned())).into();
        record.insert(CHECKSUM.to_owned(), checksum(&record));
        record
    }
}

/// Whether a record is as it was written.
#[must_use]
pub(crate) fn is_whole(record: &BTreeMap<String, String>) -> bool {
    record.get(CHECKSUM).is_some_and(|found| *found == checksum(record))
}

fn checksum(record: &BTreeMap<String, String>) -> String {
    let facts = record.iter().filter(|(key, _)| *key != CHECKSUM);
    // Lengths, so that nothing can move from one word to the next.
    let text: String =
        facts.map(|(key, value)| format!("{} {key} {} {value}\n", key.len(), value.len())).collect();
    sha256(text.as_bytes())
}
