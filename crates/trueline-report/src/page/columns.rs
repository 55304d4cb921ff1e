//! Numbers of charts, in single precision: seven digits, four bytes each, and read by a browser without parsing.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde_json::Value;

/// A column of a page.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Column(pub(super) usize);

/// All columns of a page.
#[derive(Debug, Default)]
pub struct Columns {
    columns: Vec<Vec<f32>>,
}

impl Columns {
    /// Adds a column; a value that is not finite is a gap.
    pub fn add(&mut self, values: impl IntoIterator<Item = f64>) -> Column {
        self.columns.push(values.into_iter().map(|value| value as f32).collect());
        Column(self.columns.len() - 1)
    }

    /// Number of values in a column.
    #[must_use]
    pub fn len(&self, column: Column) -> usize {
        self.columns[column.0].len()
    }

    /// Values of a column.
    #[must_use]
    pub fn values(&self, column: Column) -> &[f32] {
        &self.columns[column.0]
    }

    /// Values that can be drawn.
    pub(super) fn finite(&self, y: Column) -> usize {
        self.columns[y.0].iter().filter(|value| value.is_finite()).count()
    }

    /// Each column's bytes, little-endian, as text.
    pub(super) fn json(&self) -> Value {
        let text = |column: &Vec<f32>| {
            let bytes: Vec<u8> = column.iter().flat_map(|value| value.to_le_bytes()).collect();
            Value::from(STANDARD.encode(bytes))
        };
        self.columns.iter().map(text).collect()
    }
}
