//! Place of a value in a TOML file.

use crate::error::{Error, Problem};
use std::path::Path;
use toml::de::{DeTable, DeValue};

/// A problem of a value, with its line where its key is in the text once.
pub(crate) fn in_toml(file: &Path, text: &str, problem: Problem) -> Error {
    let line = match &problem {
        Problem::Value { key, .. } => line_of(text, key),
        Problem::QuaternionNotUnit { .. } => line_of(text, "tool_from_camera.rotation_wxyz"),
        _ => None,
    };
    Error { file: file.to_owned(), line, column: None, problem }
}

/// The line, from 1, of a dotted key.
fn line_of(text: &str, dotted: &str) -> Option<u64> {
    let root = DeTable::parse(text).ok()?;
    let mut table = root.get_ref();
    let mut start = None;
    for part in dotted.split('.') {
        let (key, value) = table.get_key_value(part)?;
        start = Some(key.span().start);
        let inner = match value.get_ref() {
            // Of several tables it is not known which.
            DeValue::Array(tables) if tables.len() == 1 => tables.first()?.get_ref(),
            DeValue::Array(tables) if tables.iter().any(|t| t.get_ref().is_table()) => return None,
            other => other,
        };
        if let DeValue::Table(next) = inner {
            table = next;
        }
    }
    Some(1 + text[..start?].matches('\n').count() as u64)
}

#[cfg(test)]
mod tests {
    use super::line_of;

    #[test]
    fn keys_are_found_where_they_are() {
        let text =
            "kind = \"x\"\n\n[camera]\n# fx = 2\nfx = 1.0\nfy = 2.0\n[[lines]]\npoint_mm = [1, 2, 3]\n";
        assert_eq!(line_of(text, "kind"), Some(1));
        assert_eq!(line_of(text, "camera"), Some(3));
        assert_eq!(line_of(text, "camera.fy"), Some(6));
        assert_eq!(line_of(text, "lines.point_mm"), Some(8));
        assert_eq!(line_of(text, "camera.cx"), None);
        let two = format!("{text}[[lines]]\npoint_mm = [nan, 2, 3]\n");
        assert_eq!(line_of(&two, "lines.point_mm"), None);
    }
}
