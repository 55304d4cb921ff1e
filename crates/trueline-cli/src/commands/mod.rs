//! One command a file.

pub mod calibrate;
pub mod demo;
pub mod doctor;
pub mod evaluate;
pub mod features;
pub mod import;
pub mod plan;
pub mod reproduce;
pub mod simulate;
pub mod simulate_images;
