//! trueline's own messages and topics, on their way into a file and back.

pub(crate) mod about;
pub(crate) mod decode;
pub(crate) mod encode;
pub(crate) mod frame_names;
/// Made of `proto/trueline/recording.proto` by `tests/protobuf.rs`, and so are the descriptors that a file holds.
#[rustfmt::skip]
#[allow(unreachable_pub, reason = "generated code is public")]
mod proto;
pub(crate) mod topics;
