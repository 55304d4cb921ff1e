//! Tests of `trueline-sensor` by its public interface, a file a subject. One program: it links once, and its tests share the processors.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

mod board_hand_eye;
mod cylinder;
mod intrinsics;
mod jacobians;
mod laser_plane;
mod laser_plane_plate;
mod pose_hand_eye;
mod real_pictures;
mod rendered;
mod round;
mod scenes;
mod short_stripe;
mod sighted;
mod sphere;
