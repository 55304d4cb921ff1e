//! A finished calibration as a file: the result that `calibrate --json` wrote, or a TOML like `initial.toml`.

use crate::error::{Error, Problem};
use crate::known_toml::{self, mounted_at_m};
use crate::recording::{Guess, Recording, Truth};
use crate::result_file::{self, Covariance, PoseEntry, ResultFile, SensorEntry, Status};
use crate::robot_csv::unit_quaternion;
use crate::sensor_setup::{Mounted, SheetShape};
use crate::sensor_toml;
use crate::unit::MM_PER_M;
use nalgebra::{UnitVector3, Vector3};
use std::path::Path;
use trueline_geometry::{Line, Pose, se3};

/// What a calibration file says.
#[derive(Clone, Debug, PartialEq)]
pub struct KnownCalibration {
    /// Time offset, hand-eye transform and lines.
    pub known: Truth,
    /// Largest standard deviations of hand-eye rotation (rad) and translation (m), where the file tells them.
    pub hand_eye_sigma: Option<[f64; 2]>,
    /// The same of the first line's turn about its point (rad) and its offset there (m).
    pub line_sigma: Option<[f64; 2]>,
    /// The correction of the sensor's sheet that goes with the hand-eye transform, in place of what sensor.toml corrects.
    pub shape: Option<SheetShape>,
    /// The hand-eye transforms that go with other files of the sensor.
    pub poses: PosesBySensor,
    /// SHA-256 of the sensor.toml that `shape` corrects, where the file tells.
    pub sensor_sha256: Option<String>,
    /// Whether it was warned that the sensor is not as its file says, so that `shape` is no small correction.
    pub sensor_is_off: bool,
    /// Whether it was accepted, where the file tells.
    pub accepted: Option<bool>,
    /// What carries the sensor, where the file tells; if it stands beside the robot, the transform is base_from_camera.
    pub mounted: Option<Mounted>,
    /// Whether its time offset is that of stamps that were made regular, or freed of a drift, and not of those recorded.
    pub stamps_treated: bool,
    /// Whether the robot stood at each reading: then there is no time offset, and the one in `known` is zero.
    pub at_stops: bool,
}

/// The sensor that a hand-eye transform goes with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SensorAs {
    /// As its file says, with the result's correction of its shape.
    Found,
    /// As the file of `calibrate --write-sensor` says.
    Corrected,
    /// As its file says, without any correction: the transform is then the best of all that are wrong.
    Uncorrected,
}

/// The hand-eye transforms of a result that go with other sensors than the one found.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PosesBySensor {
    /// With the corrected file.
    pub corrected: Option<Pose>,
    /// With the file as it was, for a sensor that takes no correction.
    pub uncorrected: Option<Pose>,
}

impl PosesBySensor {
    fn of(sensor: &SensorEntry) -> Result<Self, Problem> {
        let pose = |entry: Option<&PoseEntry>| entry.and_then(pose_of).transpose();
        let uncorrected = sensor.uncorrected.as_ref().map(|uncorrected| &uncorrected.tool_from_camera);
        Ok(Self {
            corrected: pose(sensor.corrected_tool_from_camera.as_ref())?,
            uncorrected: pose(uncorrected)?,
        })
    }
}

/// `None` where a part is not observable.
fn pose_of(entry: &PoseEntry) -> Option<Result<Pose, Problem>> {
    let [x, y, z] = entry.translation_mm;
    let (translation_mm, wxyz) = ([x?, y?, z?], entry.rotation_wxyz?);
    Some(
        unit_quaternion(wxyz)
            .and_then(|rotation| Ok(se3::from_parts(rotation, mounted_at_m(translation_mm)?))),
    )
}

/// Reads a calibration: JSON if it begins with `{`, which no TOML does, whatever the file is called; else TOML.
///
/// # Errors
/// A file that is missing or broken, or a result in which offset or hand-eye could not be seen.
pub fn read(file: &Path) -> Result<KnownCalibration, Error> {
    with_time_offset(file, read_without_time_offset(file)?)
}

/// The same, also of a robot that stood at each reading, so that there is no time offset.
///
/// # Errors
/// As [`read`].
pub fn read_without_time_offset(file: &Path) -> Result<KnownCalibration, Error> {
    parse(file, &result_file::text_of(file)?)
}

fn with_time_offset(file: &Path, known: KnownCalibration) -> Result<KnownCalibration, Error> {
    if known.at_stops {
        return Err(Error::in_file(file, Problem::NotCalibrated { key: "time_offset_s" }));
    }
    Ok(known)
}

/// Reads a guess, from the same files.
///
/// # Errors
/// As [`read`].
pub fn read_guess(file: &Path) -> Result<Guess, Error> {
    parse_guess(file, &sensor_toml::read_text(file)?)
}

/// Parses a guess, from the text of the same files; the error names `file`.
///
/// # Errors
/// As [`read`].
pub fn parse_guess(file: &Path, text: &str) -> Result<Guess, Error> {
    Ok(parse(file, text)?.known.parameters)
}

fn parse(file: &Path, text: &str) -> Result<KnownCalibration, Error> {
    if is_json(text) {
        return known(file, &ResultFile::parse(file, text)?);
    }
    Ok(KnownCalibration {
        known: known_toml::parse_truth(file, text)?,
        hand_eye_sigma: None,
        line_sigma: None,
        shape: None,
        poses: PosesBySensor::default(),
        sensor_sha256: None,
        sensor_is_off: false,
        accepted: None,
        mounted: None,
        stamps_treated: false,
        at_stops: false,
    })
}

/// Whether a text is a result, and no TOML.
#[must_use]
pub fn is_json(text: &str) -> bool {
    text.trim_start_matches('\u{feff}').trim_start().starts_with('{')
}

/// What a result tells; the error names `file`.
///
/// # Errors
/// A result in which offset or hand-eye could not be seen.
pub fn known_of(file: &Path, result: &ResultFile) -> Result<KnownCalibration, Error> {
    with_time_offset(file, known(file, result)?)
}

fn known(file: &Path, result: &ResultFile) -> Result<KnownCalibration, Error> {
    let at = |problem| Error::in_file(file, problem);
    let unseen = |key| at(Problem::NotCalibrated { key });
    let [x, y, z] = result.tool_from_camera.translation_mm;
    let (Some(x), Some(y), Some(z)) = (x, y, z) else {
        return Err(unseen("tool_from_camera.translation_mm"));
    };
    let wxyz =
        result.tool_from_camera.rotation_wxyz.ok_or_else(|| unseen("tool_from_camera.rotation_wxyz"))?;
    let at_stops = result.options.at_stops && result.time_offset_s.is_none();
    let time_offset_s = result.time_offset_s.or(at_stops.then_some(0.0));
    let parameters = Guess {
        time_offset_s: time_offset_s.ok_or_else(|| unseen("time_offset_s"))?,
        tool_from_camera: se3::from_parts(
            unit_quaternion(wxyz).map_err(at)?,
            mounted_at_m([x, y, z]).map_err(at)?,
        ),
    };
    let lines = result.lines.iter().filter_map(|line| {
        let direction = UnitVector3::try_new(Vector3::from(line.direction?), 1e-6)?;
        Some(Line::new(Vector3::from(line.point_mm?) / MM_PER_M, &direction))
    });
    let largest =
        |of: [Option<f64>; 3]| of.into_iter().collect::<Option<Vec<f64>>>()?.into_iter().reduce(f64::max);
    let sigma = &result.sigma;
    let hand_eye_sigma = largest(sigma.rotation_rad)
        .and_then(|rotation| Some([rotation, largest(sigma.translation_mm)? / MM_PER_M]));
    Ok(KnownCalibration {
        known: Truth { parameters, lines: lines.collect() },
        hand_eye_sigma,
        line_sigma: line_sigma(&result.covariance),
        shape: shape_of(&result.sensor),
        poses: PosesBySensor::of(&result.sensor).map_err(at)?,
        sensor_sha256: result.inputs.get(SENSOR).cloned(),
        sensor_is_off: result.warnings.iter().any(|warning| OF_SENSOR.contains(&warning.code.as_str())),
        accepted: result.status.map(|status| status == Status::Accepted),
        mounted: Some(match result.mounted.as_deref() {
            Some("fixed") => Mounted::Fixed,
            _ => Mounted::Tool,
        }),
        stamps_treated: result.stamps.are_treated(),
        at_stops,
    })
}

/// The sensor's file among the inputs of a result and of a recording.
const SENSOR: &str = "sensor.toml";

/// Warnings of a sensor that is not as its file says.
const OF_SENSOR: [&str; 2] = ["sensor-off", "lens-off"];

impl KnownCalibration {
    /// Whether it corrects the sensor of another file than that of a recording: of the same sensor that file may be corrected
    /// already. Where one of the files is not known, this is not known either, and false.
    #[must_use]
    pub fn corrects_another_file(&self, recording: &Recording) -> bool {
        let both = self.sensor_sha256.as_ref().zip(recording.inputs.get(SENSOR));
        self.shape.is_some() && both.is_some_and(|(corrected, read)| corrected != read)
    }

    /// Refuses what something else carries than the sensor that was calibrated: its transform goes from another frame. The error
    /// names `file`, that of the calibration.
    ///
    /// # Errors
    /// A sensor on the tool where one beside the robot was calibrated, or the other way round.
    pub fn check_mounting(&self, file: &Path, recorded: Mounted) -> Result<(), Error> {
        match self.mounted {
            Some(calibrated) if calibrated != recorded => {
                let [calibrated, recorded] = [calibrated, recorded].map(Mounted::in_words);
                Err(Error::in_file(file, Problem::OtherMounting { calibrated, recorded }))
            }
            _ => Ok(()),
        }
    }

    /// Whether another sensor file was read for it than for another calibration, where both tell.
    #[must_use]
    pub fn is_of_another_file(&self, other: &Self) -> bool {
        self.sensor_sha256.as_ref().zip(other.sensor_sha256.as_ref()).is_some_and(|(a, b)| a != b)
    }

    /// The hand-eye transform that goes with a sensor; `None` where the file does not have it.
    #[must_use]
    pub fn tool_from_camera(&self, sensor: SensorAs) -> Option<Pose> {
        match sensor {
            SensorAs::Found => Some(self.known.parameters.tool_from_camera),
            SensorAs::Corrected => self.poses.corrected,
            SensorAs::Uncorrected => self.poses.uncorrected,
        }
    }

    /// The recording of a sensor that is corrected as this calibration found it to be.
    #[must_use]
    pub fn corrected(&self, mut recording: Recording) -> Recording {
        recording.setup.shape = self.shape.or(recording.setup.shape);
        recording
    }
}

fn shape_of(sensor: &SensorEntry) -> Option<SheetShape> {
    let [h1, h2, h3, h4_per_mm, h5_per_mm] = sensor.shape?;
    Some(SheetShape {
        h: [h1, h2, h3, h4_per_mm * MM_PER_M, h5_per_mm * MM_PER_M],
        origin_m: sensor.shape_origin_mm?.map(|mm| mm / MM_PER_M),
    })
}

/// Largest standard deviations of the first line: its turn, rad, and its offset, m.
fn line_sigma(covariance: &Covariance) -> Option<[f64; 2]> {
    let larger = |a: &str, b: &str| Some(covariance.sigma(a)?.max(covariance.sigma(b)?));
    let turn = larger("line_0_turn_2_rad", "line_0_turn_3_rad")?;
    Some([turn, larger("line_0_offset_2_mm", "line_0_offset_3_mm")? / MM_PER_M])
}
