//! Why a message cannot be used.

/// Fault of a message.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ContentError {
    /// The bytes end inside a field.
    #[error("the message ends inside {field}")]
    CutOff {
        /// The field.
        field: &'static str,
    },
    /// Bytes are left that belong to no field.
    #[error("{bytes} bytes are left behind the last field")]
    TooLong {
        /// How many.
        bytes: usize,
    },
    /// The first bytes do not match the encoding.
    #[error("the message is in no known representation of CDR ({found:#06x})")]
    Representation {
        /// The first two bytes.
        found: u16,
    },
    /// Bytes that are not text.
    #[error("{field} is not UTF-8 text")]
    NotText {
        /// The field.
        field: &'static str,
    },
    /// Bytes that are not a protocol-buffer message.
    #[error("not a protocol-buffer message: {why}")]
    Protobuf {
        /// Error of the decoder.
        why: String,
    },
    /// A field that is needed.
    #[error("{field} is missing")]
    Missing {
        /// The field.
        field: &'static str,
    },
    /// NaN or infinity.
    #[error("{field} is not finite")]
    NotFinite {
        /// The field.
        field: &'static str,
    },
    /// A quaternion with another length than one.
    #[error("expected a quaternion of length 1, found length {norm}")]
    QuaternionNotUnit {
        /// Its length.
        norm: f64,
    },
    /// An invalid time.
    #[error("the stamp is out of range")]
    Stamp,
    /// Numbers that do not belong to one another.
    #[error("{field} has {found} values, expected {expected}")]
    Count {
        /// The field.
        field: &'static str,
        /// The number of values that would be right.
        expected: usize,
        /// The number of values there are.
        found: usize,
    },
    /// A seam point of no form, or of several.
    #[error("the seam point has not exactly one of pixel, point and profile, or a senseless number")]
    Feature,
    /// A picture compressed with losses.
    #[error("the picture is a JPEG")]
    Jpeg,
    /// A cloud of points that are not in the sheet of a profiler.
    #[error("the points are not a profile: expected y = 0 in the sensor's frame, found {y_m} m")]
    NoProfile {
        /// Its value, m.
        y_m: f64,
    },
    /// A picture in colour or in another form.
    #[error("expected a gray picture of 8 or 16 bits, found `{found}`")]
    NotGray {
        /// Its stated type.
        found: String,
    },
    /// A picture with a size that does not fit its bytes.
    #[error("a picture of {width} x {height} pixels with rows of {step} bytes does not fit {bytes} bytes")]
    PictureSize {
        /// Columns, px.
        width: u32,
        /// Rows, px.
        height: u32,
        /// Bytes of a row.
        step: u32,
        /// Bytes there are.
        bytes: usize,
    },
}

impl ContentError {
    /// Remedy for the user.
    #[must_use]
    pub fn hint(&self) -> String {
        let text = match self {
            Self::Jpeg => {
                "JPEG moves edges by fractions of a pixel, the very quantity measured: record raw \
                pictures, or PNG (image_transport: `format: png`); --allow-jpeg accepts them"
            }
            Self::NotGray { .. } => {
                "record mono8, mono16, rgb8, bgr8, a bayer pattern, colours of 16 bits, PNG of 8 or 16 bits, or JPEG"
            }
            Self::NoProfile { .. } => {
                "publish the profile in the sensor's own frame, not in that of the robot"
            }
            Self::QuaternionNotUnit { .. } | Self::NotFinite { .. } => {
                "was the sender not ready yet? cut the recording, or choose another topic"
            }
            Self::Missing { .. } | Self::Stamp => "the sender does not fill the message",
            _ => "check whether the recording is damaged, or the topic has another type",
        };
        text.to_owned()
    }
}
