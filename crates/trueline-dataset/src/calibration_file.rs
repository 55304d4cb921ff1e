//! A finished calibration as a file: the result that `calibrate --json` wrote, or a TOML like `initial.toml`.

use crate::error::{Error, Problem};
use crate::known_toml::{self, mounted_at_m};
use crate::recording::{Guess, Recording, Truth};
use crate::result_file::{
    self, Covariance, CurveEntry, ResultFile, RigidPartEntry, SensorEntry, SensorFileEntry, Status,
};
use crate::robot_csv::unit_quaternion;
use crate::sensor_setup::{Mounted, SheetShape};
use crate::sensor_toml;
use crate::unit::MM_PER_M;
use nalgebra::{SMatrix, UnitVector3, Vector3};
use std::path::Path;
use trueline_geometry::{Axis, Line, Polyline, Pose, se3};

/// Content of a calibration file.
#[derive(Clone, Debug, PartialEq)]
pub struct KnownCalibration {
    /// Time offset, hand-eye transform and lines.
    pub known: Truth,
    /// The curve of each seam in base, m, if the seams are not straight and the file states their places.
    pub curves: Vec<Polyline>,
    /// Largest standard deviations of hand-eye rotation (rad) and translation (m), if the file states them.
    pub hand_eye_sigma: Option<[f64; 2]>,
    /// Covariance of time offset (s), hand-eye rotation (rad) and translation (m), in this order, if the file states it.
    pub links_covariance: Option<SMatrix<f64, 7, 7>>,
    /// The same of the first line's turn about its point (rad) and its offset there (m).
    pub line_sigma: Option<[f64; 2]>,
    /// Stated error of a seam point, root mean square, m, if the file states it.
    pub seam_error_m: Option<f64>,
    /// The correction of the sensor's sheet beyond the part in the transform of [`Self::known`].
    pub correction: Option<SheetCorrection>,
    /// The kind of sensor that was calibrated, as in `sensor.toml`, where the result tells.
    pub sensor_kind: Option<String>,
    /// The sensor file that the transform belongs to, where the result tells.
    pub sensor_file: Option<SensorFileEntry>,
    /// Whether it was accepted, where the file tells.
    pub accepted: Option<bool>,
    /// The body that carries the sensor, if the file states it. If the sensor stands beside the robot, the transform is
    /// base_from_camera.
    pub mounted: Option<Mounted>,
    /// Whether its time offset is that of stamps with jitter or drift removed, not of the recorded ones.
    pub stamps_treated: bool,
    /// Whether the robot stood at each reading. Then there is no time offset, and the one in `known` is zero.
    pub at_stops: bool,
    /// The external axes in it, by name.
    pub axes: Vec<(String, Axis)>,
}

/// Reads a calibration: JSON if it begins with `{`, as no TOML does, under any file name; else TOML.
///
/// # Errors
/// A file that is missing or broken, or a result in which offset or hand-eye could not be seen.
pub fn read(file: &Path) -> Result<KnownCalibration, Error> {
    with_time_offset(file, read_without_time_offset(file)?)
}

/// The same, also for a robot that stood at each reading, without a time offset.
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
        curves: Vec::new(),
        hand_eye_sigma: None,
        links_covariance: None,
        line_sigma: None,
        seam_error_m: None,
        correction: None,
        sensor_kind: None,
        sensor_file: None,
        accepted: None,
        mounted: None,
        stamps_treated: false,
        at_stops: false,
        axes: Vec::new(),
    })
}

/// Whether a text is a result, and no TOML.
#[must_use]
pub fn is_json(text: &str) -> bool {
    text.trim_start_matches('\u{feff}').trim_start().starts_with('{')
}

/// Knowledge from a result; the error names `file`.
///
/// # Errors
/// A result in which offset or hand-eye could not be seen.
pub fn known_of(file: &Path, result: &ResultFile) -> Result<KnownCalibration, Error> {
    with_time_offset(file, known(file, result)?)
}

fn known(file: &Path, result: &ResultFile) -> Result<KnownCalibration, Error> {
    let at = |problem| Error::in_file(file, problem);
    let unseen = |key| at(Problem::NotCalibrated { key });
    if !result.sensors.is_empty() {
        let names: Vec<&str> = result.sensors.iter().map(|sensor| sensor.name.as_str()).collect();
        return Err(at(Problem::SeveralSensors { names: names.join(", ") }));
    }
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
        curves: result.curves.iter().map(curve).collect::<Option<_>>().unwrap_or_default(),
        hand_eye_sigma,
        links_covariance: links_covariance(&result.covariance),
        line_sigma: line_sigma(&result.covariance),
        seam_error_m: result.seam_error.as_ref().map(|error| error.rms_mm / MM_PER_M),
        correction: correction_of(&result.sensor),
        sensor_kind: result.sensor.kind.clone(),
        sensor_file: result.sensor.file.clone().or_else(|| stated_file(result)),
        accepted: result.status.map(|status| status == Status::Accepted),
        mounted: Some(match result.mounted.as_deref() {
            Some("fixed") => Mounted::Fixed,
            _ => Mounted::Tool,
        }),
        stamps_treated: result.stamps.are_treated(),
        at_stops,
        axes: result.axes.iter().filter_map(|axis| Some((axis.name.clone(), axis.known()?))).collect(),
    })
}

/// The curve of a result, m; `None` if the result does not state its place.
fn curve(entry: &CurveEntry) -> Option<Polyline> {
    Polyline::new(entry.points_mm.iter().map(|point| Vector3::from(*point) / MM_PER_M).collect())
}

/// The sensor's file among the inputs of a result and of a recording.
const SENSOR: &str = "sensor.toml";

/// A result's correction of the sensor, and the part of it that its transform contains.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SheetCorrection {
    /// The whole correction, which replaces that of sensor.toml.
    pub shape: SheetShape,
    /// Maps the sensor file's points to the corrected ones, as far as a rigid motion does: the transform contains it.
    /// Identity in results of schema 2 and before.
    pub corrected_from_file: Pose,
}

impl KnownCalibration {
    /// The sensor file that its transform belongs to, if a recording was made with another one; `None` also if one of the
    /// two is unknown.
    #[must_use]
    pub fn belongs_to_another_file(&self, recording: &Recording) -> Option<&SensorFileEntry> {
        let read = recording.inputs.get(SENSOR)?;
        self.sensor_file.as_ref().filter(|file| file.sha256 != *read)
    }

    /// Refuses a recording with another carrier than the calibrated sensor's: its transform starts from another frame. The
    /// error names `file`, that of the calibration.
    ///
    /// # Errors
    /// A sensor on the tool with a calibration beside the robot, or the other way round.
    pub fn check_mounting(&self, file: &Path, recorded: Mounted) -> Result<(), Error> {
        match self.mounted {
            Some(calibrated) if calibrated != recorded => {
                let [calibrated, recorded] = [calibrated, recorded].map(Mounted::in_words);
                Err(Error::in_file(file, Problem::OtherMounting { calibrated, recorded }))
            }
            _ => Ok(()),
        }
    }

    /// Refuses a recording that this calibration cannot place: of a sensor with another frame or on something else, or without an axis
    /// that it needs. The error names `file`, that of the calibration.
    ///
    /// # Errors
    /// The first difference of these.
    pub fn check_recording(&self, file: &Path, recording: &Recording) -> Result<(), Error> {
        self.check_mounting(file, recording.setup.mounted)?;
        self.check_frame(file, recording.sensor.kind())?;
        self.check_axes(file, recording)
    }

    /// The frame of a profiler lies in its sheet, that of a camera in its lens. Points may be in either.
    fn check_frame(&self, file: &Path, recorded: &'static str) -> Result<(), Error> {
        const PROFILER: &str = "profiler";
        const POINTS: &str = "points";
        let is_other = |calibrated: &str| {
            let either = calibrated == POINTS || recorded == POINTS;
            !either && (calibrated == PROFILER) != (recorded == PROFILER)
        };
        match &self.sensor_kind {
            Some(calibrated) if is_other(calibrated) => {
                let calibrated = calibrated.clone();
                Err(Error::in_file(file, Problem::OtherSensor { calibrated, recorded }))
            }
            _ => Ok(()),
        }
    }

    /// Checks that a recording has the axes that this calibration places seam points with.
    fn check_axes(&self, file: &Path, recording: &Recording) -> Result<(), Error> {
        let is_there = |name: &String| recording.axes.iter().any(|axis| axis.name == *name);
        match self.axes.iter().find(|(name, _)| !is_there(name)) {
            Some((name, _)) => Err(Error::in_file(file, Problem::AxisNotRecorded { name: name.clone() })),
            None => Ok(()),
        }
    }

    /// Whether another calibration belongs to another sensor file, where both tell.
    #[must_use]
    pub fn is_of_another_file(&self, other: &Self) -> bool {
        let both = self.sensor_file.as_ref().zip(other.sensor_file.as_ref());
        both.is_some_and(|(a, b)| a.sha256 != b.sha256)
    }

    /// A recording of the stated sensor, corrected by this calibration's shape, with the external axes at its places. With
    /// [`Self::with_correction`] its readings match it.
    #[must_use]
    pub fn corrected(&self, mut recording: Recording) -> Recording {
        recording.setup.shape = self.correction.map(|correction| correction.shape).or(recording.setup.shape);
        for axis in &mut recording.axes {
            let own = self.axes.iter().find(|(name, _)| *name == axis.name);
            axis.known = own.map(|(_, known)| *known).or(axis.known);
        }
        recording
    }

    /// Time offset and hand-eye transform of the corrected sensor.
    #[must_use]
    pub fn with_correction(&self) -> Guess {
        let Guess { time_offset_s, mut tool_from_camera } = self.known.parameters;
        if let Some(correction) = &self.correction {
            tool_from_camera *= correction.corrected_from_file.inverse();
        }
        Guess { time_offset_s, tool_from_camera }
    }
}

/// The sensor file of results that do not name the one they belong to.
fn stated_file(result: &ResultFile) -> Option<SensorFileEntry> {
    let sha256 = result.inputs.get(SENSOR)?.clone();
    Some(SensorFileEntry { name: SENSOR.to_owned(), sha256, corrected: false })
}

fn correction_of(sensor: &SensorEntry) -> Option<SheetCorrection> {
    if sensor.file.as_ref().is_some_and(|file| file.corrected) {
        return None;
    }
    let shape = shape_of(sensor)?;
    let rigid = sensor.rigid_part.as_ref().and_then(RigidPartEntry::corrected_from_file);
    Some(SheetCorrection { shape, corrected_from_file: rigid.unwrap_or_else(Pose::identity) })
}

fn shape_of(sensor: &SensorEntry) -> Option<SheetShape> {
    let [h1, h2, h3, h4_per_mm, h5_per_mm] = sensor.shape?;
    Some(SheetShape {
        h: [h1, h2, h3, h4_per_mm * MM_PER_M, h5_per_mm * MM_PER_M],
        origin_m: sensor.shape_origin_mm?.map(|mm| mm / MM_PER_M),
    })
}

/// Names of time offset, rotation and translation in a covariance.
const LINKS: [&str; 7] = [
    "time_offset_s",
    "rotation_x_rad",
    "rotation_y_rad",
    "rotation_z_rad",
    "translation_x_mm",
    "translation_y_mm",
    "translation_z_mm",
];

fn links_covariance(covariance: &Covariance) -> Option<SMatrix<f64, 7, 7>> {
    let in_si = |name: &str| if name.ends_with("_mm") { MM_PER_M } else { 1.0 };
    let mut matrix = SMatrix::zeros();
    for (i, row) in LINKS.iter().enumerate() {
        for (j, column) in LINKS.iter().enumerate() {
            matrix[(i, j)] = covariance.entry(row, column)? / in_si(row) / in_si(column);
        }
    }
    Some(matrix)
}

/// Largest standard deviations of the first line: its turn, rad, and its offset, m.
fn line_sigma(covariance: &Covariance) -> Option<[f64; 2]> {
    let larger = |a: &str, b: &str| Some(covariance.sigma(a)?.max(covariance.sigma(b)?));
    let turn = larger("line_0_turn_2_rad", "line_0_turn_3_rad")?;
    Some([turn, larger("line_0_offset_2_mm", "line_0_offset_3_mm")? / MM_PER_M])
}
