//! Tests of the program `trueline` as its user runs it, a file a subject. One program: it links once, and its tests share the processors.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

mod answers;
mod axes;
mod bench;
mod board;
mod bombs;
mod certificate;
mod clouds;
mod common;
mod curves;
mod encoder;
mod evaluate;
mod foreign;
mod habits;
mod help;
mod imports;
mod log_file;
mod outputs;
mod pictures;
mod plan;
mod plan_axes;
mod plate;
mod program;
mod schemas;
mod sensor;
mod several_sensors;
mod sightings;
mod sphere;
mod stops;
mod stripes;
mod terminal;
mod told;
mod wall;
