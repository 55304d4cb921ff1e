//! State of a camera's inputs with a picture.

use std::fmt;

/// State of a camera's inputs with a picture, if the camera sends it (chunk data); `None` is not sent.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FrameSignals {
    /// Count of an encoder that is wired to it.
    pub encoder: Option<i64>,
    /// Its lines, inputs and outputs, the first in the lowest bit.
    pub lines: Option<u64>,
    /// A counter; a setting of the camera determines its events.
    pub counter: Option<i64>,
    /// The camera's own number of the picture.
    pub camera_frame: Option<u64>,
}

impl FrameSignals {
    /// Whether nothing is reported.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }
}

impl fmt::Display for FrameSignals {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let told = [
            self.encoder.map(|count| format!("encoder {count}")),
            self.lines.map(|bits| format!("lines 0b{bits:04b}")),
            self.counter.map(|count| format!("counter {count}")),
            self.camera_frame.map(|number| format!("camera's number {number}")),
        ];
        f.write_str(&told.into_iter().flatten().collect::<Vec<_>>().join(", "))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_told_is_said_and_nothing_else() {
        assert!(FrameSignals::default().is_empty());
        let some = FrameSignals { encoder: Some(-3), lines: Some(5), ..FrameSignals::default() };
        assert_eq!((some.to_string().as_str(), some.is_empty()), ("encoder -3, lines 0b0101", false));
    }
}
