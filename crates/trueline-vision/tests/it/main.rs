//! Tests of `trueline-vision` by its public interface, a file a subject. One program: it links once, and its tests share the processors.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

mod accuracy;
mod bands;
mod bowed_ends;
mod calibration;
mod daylight;
mod daylight_colour;
mod daylight_scene;
mod drawn;
mod invariance;
mod laws;
mod picture_faults;
mod pinned;
mod profile;
mod profile_ends;
mod round_faces;
mod scenes;
mod stripe_choice;
mod stripe_rank;
mod stripes;
mod targets;
