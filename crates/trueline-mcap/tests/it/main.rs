//! Tests of `trueline-mcap` by its public interface, a file a subject. One program: it links once, and its tests share the processors.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

mod axes;
mod bytes;
mod clouds;
mod common;
mod common_clock;
mod damaged;
mod datagram;
mod fixtures;
mod interop;
mod killed;
mod profiles;
mod protobuf;
mod recorder;
mod schema;
mod seam_points;
mod sensor_messages;
mod unpacking;
mod viewer;
