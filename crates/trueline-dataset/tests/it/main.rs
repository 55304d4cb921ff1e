//! Tests of `trueline-dataset` by its public interface, a file a subject. One program: it links once, and its tests share the processors.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

mod encoder_log;
mod keyence;
mod logs;
mod pictures;
mod profiles;
mod refusals;
mod result_file;
mod robots;
mod round_trip;
mod sensor_setup;
mod stops;
mod tables_of_programs;
mod written_form;
