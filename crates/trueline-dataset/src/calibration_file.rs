//! A finished calibration as a file: the result that `calibrate --json` wrote, or a TOML like `initial.toml`.

use crate::error::{Error, Problem};
use crate::known_toml;
use crate::recording::{Guess, Truth};
use crate::robot_csv::unit_quaternion;
use crate::unit::MM_PER_M;
use nalgebra::{UnitVector3, Vector3};
use serde::Deserialize;
use std::fs;
use std::path::Path;
use trueline_geometry::{Line, se3};

/// What a calibration file says.
#[derive(Clone, Debug, PartialEq)]
pub struct KnownCalibration {
    /// Time offset, hand-eye transform and lines.
    pub known: Truth,
    /// Largest standard deviations of hand-eye rotation (rad) and translation (m), where the file tells them.
    pub hand_eye_sigma: Option<[f64; 2]>,
    /// The same of the first line's turn about its point (rad) and its offset there (m).
    pub line_sigma: Option<[f64; 2]>,
    /// Whether it was accepted, where the file tells.
    pub accepted: Option<bool>,
    /// Whether its time offset is that of stamps that were made regular, or freed of a drift, and not of those recorded.
    pub stamps_treated: bool,
}

/// The part of a result that is read back; the rest is for people.
#[derive(Deserialize)]
struct ResultFile {
    time_offset_s: Option<f64>,
    tool_from_camera: PoseObject,
    #[serde(default)]
    lines: Vec<LineObject>,
    sigma: Option<SigmaObject>,
    status: Option<String>,
    stamps: Option<StampsObject>,
    covariance: Option<CovarianceObject>,
}

#[derive(Deserialize)]
struct StampsObject {
    robot: StreamObject,
    features: StreamObject,
}

#[derive(Deserialize)]
struct StreamObject {
    used: Option<String>,
    #[serde(default)]
    drift_taken_out: bool,
}

impl StreamObject {
    fn is_treated(&self) -> bool {
        self.drift_taken_out || self.used.as_deref() == Some("regular")
    }
}

#[derive(Deserialize)]
struct CovarianceObject {
    order: Vec<String>,
    matrix: Vec<Vec<Option<f64>>>,
}

impl CovarianceObject {
    /// Standard deviation of a component, in the unit of its name.
    fn sigma(&self, name: &str) -> Option<f64> {
        let k = self.order.iter().position(|known| known == name)?;
        self.matrix.get(k)?.get(k).copied().flatten().map(f64::sqrt)
    }
}

#[derive(Deserialize)]
struct PoseObject {
    translation_mm: [Option<f64>; 3],
    rotation_wxyz: Option<[f64; 4]>,
}

#[derive(Deserialize)]
struct LineObject {
    point_mm: Option<[f64; 3]>,
    direction: Option<[f64; 3]>,
}

#[derive(Deserialize)]
struct SigmaObject {
    rotation_rad: [Option<f64>; 3],
    translation_mm: [Option<f64>; 3],
}

/// Reads a calibration: JSON if the file's name ends in `.json`, else TOML.
///
/// # Errors
/// A file that is missing or broken, or a result in which offset or hand-eye could not be seen.
pub fn read(file: &Path) -> Result<KnownCalibration, Error> {
    let text = fs::read_to_string(file).map_err(|error| {
        let missing = error.kind() == std::io::ErrorKind::NotFound;
        Error::in_file(file, if missing { Problem::MissingCalibration } else { Problem::Io(error) })
    })?;
    if file.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("json")) {
        return parse_result(file, &text);
    }
    Ok(KnownCalibration {
        known: known_toml::parse_truth(file, &text)?,
        hand_eye_sigma: None,
        line_sigma: None,
        accepted: None,
        stamps_treated: false,
    })
}

/// Reads a result of `calibrate --json`.
///
/// # Errors
/// As [`read`].
pub fn parse_result(file: &Path, text: &str) -> Result<KnownCalibration, Error> {
    let at = |problem| Error::in_file(file, problem);
    let wire: ResultFile = serde_json::from_str(text).map_err(|error| Error {
        line: Some(error.line() as u64),
        ..Error::in_file(file, Problem::NoResult(error.to_string()))
    })?;
    let unseen = |key| at(Problem::NotCalibrated { key });
    let [x, y, z] = wire.tool_from_camera.translation_mm;
    let (Some(x), Some(y), Some(z)) = (x, y, z) else {
        return Err(unseen("tool_from_camera.translation_mm"));
    };
    let wxyz = wire.tool_from_camera.rotation_wxyz.ok_or_else(|| unseen("tool_from_camera.rotation_wxyz"))?;
    let parameters = Guess {
        time_offset_s: wire.time_offset_s.ok_or_else(|| unseen("time_offset_s"))?,
        tool_from_camera: se3::from_parts(
            unit_quaternion(wxyz).map_err(at)?,
            Vector3::new(x, y, z) / MM_PER_M,
        ),
    };
    let lines = wire.lines.iter().filter_map(|line| {
        let direction = UnitVector3::try_new(Vector3::from(line.direction?), 1e-6)?;
        Some(Line::new(Vector3::from(line.point_mm?) / MM_PER_M, &direction))
    });
    let largest =
        |of: [Option<f64>; 3]| of.into_iter().collect::<Option<Vec<f64>>>()?.into_iter().reduce(f64::max);
    let hand_eye_sigma = wire
        .sigma
        .and_then(|sigma| Some([largest(sigma.rotation_rad)?, largest(sigma.translation_mm)? / MM_PER_M]));
    let line_sigma = wire.covariance.as_ref().and_then(|covariance| {
        let larger = |a: &str, b: &str| Some(covariance.sigma(a)?.max(covariance.sigma(b)?));
        let turn = larger("line_0_turn_2_rad", "line_0_turn_3_rad")?;
        Some([turn, larger("line_0_offset_2_mm", "line_0_offset_3_mm")? / MM_PER_M])
    });
    Ok(KnownCalibration {
        known: Truth { parameters, lines: lines.collect() },
        hand_eye_sigma,
        line_sigma,
        accepted: wire.status.map(|status| status == "accepted"),
        stamps_treated: wire.stamps.is_some_and(|s| s.robot.is_treated() || s.features.is_treated()),
    })
}
