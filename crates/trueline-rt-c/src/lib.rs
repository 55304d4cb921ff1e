//! `trueline-rt` for C and C++: see `include/trueline_rt.h`, which explains each function.
//!
//! Nothing unwinds into C: a panic becomes [`status::PANIC`]. Every pointer is checked before use. Whether it
//! points to an object of its type cannot be checked: that is the caller's part, stated in the header.
#![allow(unsafe_code, reason = "C has raw pointers; each use of one proves itself")]

mod axis;
mod placer;
mod plain;
pub mod status;
mod track;

pub use axis::{
    AxisHealthPlain, AxisPlain, trueline_placer_axis_health, trueline_placer_new_with_axes,
    trueline_placer_push_axis,
};
pub use placer::{
    PlacerHandle, trueline_placer_free, trueline_placer_health, trueline_placer_new, trueline_placer_place,
    trueline_placer_push_pose, trueline_rt_abi, trueline_settings_default,
};
pub use plain::{
    CalibrationPlain, HealthPlain, PlacedPlain, PosePlain, SettingsPlain, TargetPlain, TrackSettingsPlain,
};
pub use status::trueline_status_text;
pub use track::{
    trueline_seam_track_ahead, trueline_seam_track_clear, trueline_seam_track_free, trueline_seam_track_new,
    trueline_seam_track_push, trueline_track_settings_default,
};
