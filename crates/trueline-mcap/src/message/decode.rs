//! Which decoder understands a message: by its encoding and schema.

use crate::message::content::{Content, Kind};
use crate::message::content_error::ContentError;
use crate::message::{foxglove, ros};
use crate::wire::decode as own;

/// Kind of the messages of a schema in an encoding.
#[must_use]
pub fn kind(schema: &str, encoding: &str) -> Kind {
    match encoding {
        "protobuf" => match foxglove::kind(schema) {
            Kind::Other => own::kind(schema),
            known => known,
        },
        "cdr" | "ros1" => ros::kind(schema),
        _ => Kind::Other,
    }
}

/// Understands a message.
///
/// # Errors
/// Bytes that are not such a message, and messages that cannot be used.
pub fn decode(schema: &str, encoding: &str, bytes: &[u8]) -> Result<Content, ContentError> {
    match encoding {
        "protobuf" if foxglove::kind(schema) != Kind::Other => foxglove::decode(schema, bytes),
        "protobuf" => own::decode(schema, bytes),
        "cdr" => ros::decode_ros2(schema, bytes),
        "ros1" => ros::decode_ros1(schema, bytes),
        _ => Ok(Content::Other),
    }
}
