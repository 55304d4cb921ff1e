//! The result as a file: one type, written by `calibrate --json` and read by every command that takes a calibration.
//!
//! Schema version 3; files of versions 1 and 2 are read as well: their transform holds together with the shape. Lengths are
//! in millimetres, times in seconds and angles in radians, as the names say. An unobservable quantity is null, never a
//! made-up number. So is the sigma of a quantity held fixed. `docs/result.schema.json` is its JSON Schema.

mod answer;
mod axis;
mod checks;
mod curve;
mod errors;
mod fact;
mod models;
mod options;
mod rival;
mod seam_error;
mod sensor;
mod sensors;
mod stamps;
mod stripes;
mod time_offset_use;

pub use answer::{
    Covariance, CylinderEntry, IterationEntry, IterationLine, LineEntry, LinePosition, Observability,
    PoseEntry, Sigma, SphereEntry, TargetEntry, UnobservableEntry,
};
pub use axis::{AxisEntry, AxisSigma};
pub use checks::{
    AtTorch, Checks, ClockStep, CrossValidation, Disruption, Ellipsoid, LeftOut, Moved, OutlierEntry,
    Residuals, RunnerUp,
};
pub use curve::{CadEntry, CadPose, CurveEntry, SymmetryEntry};
pub use errors::ErrorsFoundEntry;
pub use fact::Fact;
pub use models::ModelEntry;
pub use options::{DrawnLineOptions, Options, PartMovesOptions, RequireOptions};
pub use rival::RivalEntry;
pub use seam_error::{BudgetEntry, FieldEntry, SeamErrorEntry};
pub use sensor::{RigidPartEntry, SensorEntry, SensorFileEntry};
pub use sensors::{BetweenEntry, BetweenSigma, SensorAmongEntry, SensorAmongSigma};
pub use stamps::{FeatureStream, RobotStream, Stamps, StepEntry, Stream};
pub use stripes::{AngleEntry, AnswerEntry, HeightStepEntry, PlaneEntry, StripesEntry};
pub use time_offset_use::TimeOffsetUse;

use crate::error::{Error, Problem};
use crate::source_file;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;

/// Version of the schema that is written.
pub const SCHEMA_VERSION: u32 = 3;

/// A whole result.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct ResultFile {
    /// Version of this schema.
    #[serde(default)]
    pub schema_version: u32,
    /// Which program wrote it.
    #[serde(default)]
    pub tool: Tool,
    /// Whether it can be used; absent in files written by hand.
    #[serde(default)]
    pub status: Option<Status>,
    /// Why it is not accepted; empty if it is.
    #[serde(default)]
    pub reasons: Vec<Fact>,
    /// The mistake in the data that explains these; absent where none was found.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub probable_cause: Option<String>,
    /// Usable, but look here.
    #[serde(default)]
    pub warnings: Vec<Fact>,
    /// The image stamped t was exposed at t − this; null if it is not observable.
    #[serde(default)]
    pub time_offset_s: Option<f64>,
    /// How to use it; absent if it is not observable, or if the result is not accepted.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub time_offset_use: Option<TimeOffsetUse>,
    /// The hand-eye transform: camera coordinates to tool coordinates. It belongs to the sensor file that `sensor.file` names.
    pub tool_from_camera: PoseEntry,
    /// The lines in base.
    #[serde(default)]
    pub lines: Vec<LineEntry>,
    /// Pose of the target of pose sightings in base, or with `mounted` fixed in the tool; absent if no target was sighted.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub base_from_target: Option<TargetEntry>,
    /// The cylinder of `--target cylinder`; absent for other targets.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cylinder: Option<CylinderEntry>,
    /// The sphere of `--target sphere`; absent for other targets.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sphere: Option<SphereEntry>,
    /// The curves in base, if no straight line explains the scan; `lines` is empty then.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub curves: Vec<CurveEntry>,
    /// If several sensors were calibrated together, each of them. The rest of the result is that of the first one alone.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub sensors: Vec<SensorAmongEntry>,
    /// Each other sensor in the frame of the first; likewise.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub between: Vec<BetweenEntry>,
    /// The external axes, where the cell has some.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub axes: Vec<AxisEntry>,
    /// The plates in base, where whole stripes were used.
    #[serde(default)]
    pub planes: Vec<PlaneEntry>,
    /// Use of the whole stripes; null if there are none, or only seam points were requested.
    #[serde(default)]
    pub stripes: Option<StripesEntry>,
    /// One standard deviation of everything that is accounted for.
    #[serde(default)]
    pub sigma: Sigma,
    /// The part of it that is random: noise of features, robot and stamps.
    #[serde(default)]
    pub sigma_noise: Sigma,
    /// Covariance of everything estimated.
    #[serde(default)]
    pub covariance: Covariance,
    /// Observability in this scan.
    #[serde(default)]
    pub observability: Observability,
    /// The residuals.
    #[serde(default)]
    pub residuals: Residuals,
    /// The streams' clocks.
    #[serde(default)]
    pub stamps: Stamps,
    /// Checks of the estimate.
    #[serde(default)]
    pub checks: Checks,
    /// Answers that the scan does not separate from this one; empty if there are none.
    #[serde(default)]
    pub rivals: Vec<RivalEntry>,
    /// Basis of the decision between them: `guess` or `statement`; null if nothing decided, or there was nothing to
    /// decide.
    #[serde(default)]
    pub decided_by: Option<String>,
    /// `fixed` if the sensor stands beside the robot: then `tool_from_camera` is base_from_camera, and lines are in the
    /// tool.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mounted: Option<String>,
    /// Error of a seam point that is measured later; null if the hand-eye transform is not fully observable.
    #[serde(default)]
    pub seam_error: Option<SeamErrorEntry>,
    /// Estimates of errors that are not noise; null if the answer was not adjusted with them.
    #[serde(default)]
    pub errors_found: Option<ErrorsFoundEntry>,
    /// The scan's information on the sensor's own calibration.
    #[serde(default)]
    pub sensor: SensorEntry,
    /// Result of `--align-clocks`: the lead of image stamps over the robot's. The time offset contains it; absent where
    /// clocks were not aligned.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub images_ahead_s: Option<f64>,
    /// Error of a seam point in use; null if the hand-eye transform is not fully observable.
    #[serde(default)]
    pub at_torch: Option<AtTorch>,
    /// Why the solver ended.
    #[serde(default)]
    pub termination: String,
    /// Every step of the solver.
    #[serde(default)]
    pub iterations: Vec<IterationEntry>,
    /// SHA-256 of every file that was read, by name.
    #[serde(default)]
    pub inputs: BTreeMap<String, String>,
    /// The options of the command.
    #[serde(default)]
    pub options: Options,
    /// The models that were fitted, that of the answer first.
    #[serde(default)]
    pub models_tried: Vec<ModelEntry>,
}

/// A program and its version.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default)]
pub struct Tool {
    /// Its name.
    pub name: String,
    /// Its version.
    pub version: String,
}

/// Whether a result can be used.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum Status {
    /// Yes.
    Accepted,
    /// There is a result, but see the reasons.
    NotAccepted,
}

impl ResultFile {
    /// Reads a result from JSON.
    ///
    /// # Errors
    /// Text that is not a result, or a result of an unknown schema; the error names `file`.
    pub fn parse(file: &Path, text: &str) -> Result<Self, Error> {
        let result: Self = serde_json::from_str(text).map_err(|error| Error {
            line: Some(error.line() as u64),
            ..Error::in_file(file, Problem::NoResult(error.to_string()))
        })?;
        if result.schema_version > SCHEMA_VERSION {
            let problem = Problem::NewerResult { found: result.schema_version, known: SCHEMA_VERSION };
            return Err(Error::in_file(file, problem));
        }
        Ok(result)
    }

    /// Reads the file of a result.
    ///
    /// # Errors
    /// A file that is not there, and as [`Self::parse`].
    pub fn read(file: &Path) -> Result<Self, Error> {
        Self::parse(file, &text_of(file)?)
    }

    /// The text of the file: indented JSON.
    ///
    /// # Errors
    /// None that a result can cause: every key is text and every value a JSON value.
    pub fn to_json(&self) -> Result<String, serde_json::Error> {
        serde_json::to_string_pretty(self)
    }
}

/// The text of a calibration's file.
pub(crate) fn text_of(file: &Path) -> Result<String, Error> {
    source_file::text(file).map_err(|error| match error.problem {
        Problem::Missing => Error::in_file(file, Problem::MissingCalibration),
        _ => error,
    })
}

/// The JSON Schema of a result.
#[cfg(feature = "schema")]
#[must_use]
pub fn json_schema() -> serde_json::Value {
    let settings = schemars::generate::SchemaSettings::draft2020_12().for_serialize();
    settings.into_generator().into_root_schema_for::<ResultFile>().to_value()
}
