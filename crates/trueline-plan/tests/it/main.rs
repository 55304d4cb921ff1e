//! Tests of `trueline-plan` by its public interface, a file a subject. One program: it links once, and its tests share the processors.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

mod arms;
mod cells;
mod curves;
mod joints;
mod limits;
mod planned_axes;
mod predictions;
mod refusals;
mod robot_programs;
mod seam_errors;
mod stripes;
