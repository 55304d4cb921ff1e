//! Plans a scan before the robot moves: the most informative path for time offset, hand-eye and line.
//!
//! ```text
//! Cell ─┬─ Design ─▶ Motion ─┬─▶ Prediction (information of every frame → sigmas)
//!       │                    └─▶ Constraints (how much of every limit is used)
//!       └───────── search over designs: most accurate of those within all limits ─▶ Plan
//! ```
//!
//! A design is a handful of numbers: where the sweeps of seam, stand-off and attitude begin, how wide and how fast they are.
//! The predicted covariance of a design is the inverse of the Fisher information at the guess, frame by frame, with the
//! noise that the estimator itself expects. Its use of every limit is measured on the sampled motion. The loss by a wrong
//! guess is measured on a sample of such cells. The search needs all of it as numbers only, so any criterion, sensor or
//! limit is one function.
//!
//! ```
//! use std::path::Path;
//! use trueline_plan::{PlanRequest, Shape, cell_toml, plan};
//!
//! let sensor = trueline_dataset::sensor_toml::parse(Path::new("sensor.toml"), cell_toml::EXAMPLE_SENSOR)?;
//! let cell = cell_toml::parse(Path::new("cell.toml"), cell_toml::EXAMPLE, sensor)?;
//! let request = PlanRequest { shapes: vec![Shape::TwoPasses], evaluations: 300, ..PlanRequest::default() };
//! let planned = plan(&cell, &request, &|| ())?;
//! assert!(planned.prediction.shows_all(), "time offset, hand-eye and line");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod axis_course;
mod axis_goal;
pub mod cell;
pub mod cell_axis;
pub mod cell_files;
pub mod cell_toml;
pub mod constraints;
pub mod course;
mod covariances;
pub mod criterion;
pub mod design;
mod evenly_swung;
mod evidence;
pub mod expected_accuracy;
pub mod expected_axes;
pub mod guess_error;
pub mod joint;
pub mod limits;
pub mod motion;
pub mod mounted_arm;
mod pattern;
pub mod plan;
pub mod planner;
mod plate_rows;
pub mod predicted_frames;
pub mod prediction;
pub mod rehearsal;
pub mod rehearsed_plan;
pub mod robot_program;
pub mod robustness_to_guess;
pub mod seam;
pub mod seam_goal;
pub mod search;
pub mod sensor_pose;
pub mod shape;
pub mod shortest;
pub mod stand_off;
mod stripes_ahead;
pub mod surroundings;
pub mod sweep;
pub mod target;
pub mod truth;
pub mod view;

pub use axis_course::AxisCourse;
pub use cell::{Cell, ExpectedNoise, NotThisCell};
pub use cell_axis::CellAxis;
pub use cell_files::CellFiles;
pub use course::{Course, NoCourse};
pub use criterion::{Criterion, Goal};
pub use guess_error::GuessError;
pub use joint::{Joint, NoJoint};
pub use limits::Limits;
pub use motion::Motion;
pub use mounted_arm::{JointPath, MountedArm};
pub use plan::{Plan, PlanError, PlanRequest};
pub use planner::plan;
pub use prediction::Prediction;
pub use rehearsal::Rehearsal;
pub use robustness_to_guess::{Loss, SeenBy};
pub use seam::Seam;
pub use seam_goal::SeamGoal;
pub use shape::Shape;
pub use surroundings::Surroundings;
pub use target::Target;
pub use truth::Truth;
pub use view::View;
