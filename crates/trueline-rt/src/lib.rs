//! Pose of the sensor at the exposure, while it runs.
//!
//! ```text
//! poses ──push_pose──▶ stream: clock, period, noise ──┐
//! axes ───push_axis──▶ a stream for each axis ────────┼─ pose at stamp − time offset ─▶ points in base ±
//! frames ──place──────▶ clock of the frames ──────────┘
//! seam points ──push──▶ SeamTrack ──ahead(torch, speed, delay)──▶ target ±
//! ```
//!
//! No files and no estimator: a [`PlacerCalibration`] comes from `trueline calibrate`. Metre, radian, second; stamps are
//! nanoseconds of one clock. Nothing is allocated after the constructors, and nothing waits. A frame or a point without a
//! known pose is refused or flagged, each by its reason.

mod axis_stream;
mod calibration;
mod chain;
mod envelope_clock;
mod error;
mod external_axis;
mod frame_clock;
mod interpolation;
mod lift;
mod located;
mod placer;
mod points;
mod pose_stream;
mod prediction;
mod repeats;
mod seam_fit;
mod seam_track;
mod settings;
mod spread;
mod stamps;
mod steps;
mod sweep;
mod track_settings;

pub use calibration::{Carrier, LinksCovariance, PlacerCalibration, SensorModel};
pub use error::{AxisError, AxisProblem, BadSetting, PlaceError, PoseError};
pub use external_axis::{AxisCarries, AxisCovariance, ExternalAxis};
pub use placer::{AxisHealth, Health, Placed, Placer};
pub use points::Points;
pub use seam_track::{SeamTrack, Target};
pub use settings::{Readout, Settings, StampRule};
pub use track_settings::{AheadError, SeamPointError, TrackSettings};
