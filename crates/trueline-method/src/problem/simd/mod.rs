//! The inner loop: four samples of a line side by side.
//!
//! `problem` defines the computation, one sample at a time. This module computes the same fast. The tests require agreement to 1e-12.
#![allow(clippy::needless_range_loop, reason = "a lane is the same index in several arrays")]
#![allow(clippy::inline_always, reason = "only what is inlined is compiled for the wide instructions")]

mod bend;
mod displacement_rows;
mod distort;
mod lanes;
mod located;
mod robust;
mod rows;
mod samples;
mod sums;
mod sweep;
mod view;
mod whiten;

pub(crate) use rows::{Rows, WhitenedRow};
pub(crate) use samples::{Gathering, Samples};
pub(crate) use sums::{Cost, Equations, Squared, SquaredLengths};
pub(crate) use sweep::{CHUNK, Scan, Visit, sweep, sweep_chunks};
pub(crate) use view::Mounting;
pub(crate) use whiten::Whitening;
