//! trueline's own messages and topics, on their way into a file and back.

pub(crate) mod about;
pub(crate) mod decode;
pub(crate) mod encode;
pub(crate) mod frame_names;
mod proto;
mod schemas;
pub(crate) mod topics;
