//! One command a file.

pub mod calibrate;
pub mod demo;
pub mod doctor;
pub mod import;
pub mod simulate;
