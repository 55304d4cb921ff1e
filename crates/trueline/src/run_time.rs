//! A result and its sensor file → the inputs of a [`trueline_rt::Placer`].

use crate::run_time_error::RunTimeError;
use std::path::Path;
use trueline_dataset::calibration_file;
use trueline_dataset::result_file::{AxisEntry, ResultFile};
use trueline_dataset::sensor_setup::Mounted;
use trueline_dataset::unit::MM_PER_M;
use trueline_dataset::{Sensor, SensorFile};
use trueline_geometry::Axis;
use trueline_rt::{AxisCarries, Carrier, ExternalAxis, PlacerCalibration, SensorModel, Settings, StampRule};

/// Standard deviation of a reading if neither the caller nor the result states one, m.
const READING_SIGMA_M: f64 = 20e-6;

/// Inputs of a placer beside a result.
#[derive(Clone, Debug)]
pub struct RunTime<'a> {
    /// The sensor that was calibrated.
    pub sensor: &'a SensorFile,
    /// SHA-256 of the sensor's file: another one than the result belongs to is refused. `None` does not compare.
    pub sensor_sha256: Option<&'a str>,
    /// Standard deviation of a reading along each axis of the sheet, m; `None` takes the residuals of the result.
    pub reading_sigma_m: Option<f64>,
    /// Axes that the result does not place because they stood in its scan, and still stand there.
    pub standing: &'a [String],
    /// Axes in the controller's poses, at the controller's places.
    pub in_pose: &'a [(String, Axis)],
}

/// Parts of a placer, and the names of its external axes by number.
#[derive(Clone, Debug)]
pub struct PlacerSetup {
    /// The calibration.
    pub calibration: PlacerCalibration,
    /// The settings for it: stamps are treated as in the result.
    pub settings: Settings,
    /// Names of the axes.
    pub axes: Vec<String>,
}

impl RunTime<'_> {
    /// A placer's calibration and settings.
    ///
    /// # Errors
    /// A result without time offset, hand-eye transform or an axis; a result of another sensor, or of clocks that drift.
    pub fn placer(&self, result: &ResultFile) -> Result<PlacerSetup, crate::Error> {
        let known = calibration_file::known_of(Path::new("result"), result)?;
        if let Some((file, sha256)) = known.sensor_file.as_ref().zip(self.sensor_sha256)
            && file.sha256 != sha256
        {
            return Err(RunTimeError::OtherSensorFile { name: file.name.clone() }.into());
        }
        let stamps = &result.stamps;
        if stamps.features.drift_taken_out {
            return Err(
                RunTimeError::Drift { drift_ppm: stamps.features.drift_ppm.unwrap_or(f64::NAN) }.into()
            );
        }
        let guess = known.with_correction();
        let residual_m = result.residuals.rms_mm.map(|mm| mm / MM_PER_M);
        let calibration = PlacerCalibration {
            sensor: match &self.sensor.sensor {
                Sensor::CameraLaser { camera, laser_plane_in_camera } => SensorModel::CameraLaser {
                    camera: *camera,
                    laser_plane_in_camera: *laser_plane_in_camera,
                },
                Sensor::Profiler => SensorModel::Profiler,
                Sensor::Points { laser_plane_in_camera } => {
                    SensorModel::Points { laser_plane_in_camera: *laser_plane_in_camera }
                }
            },
            shape: known.correction.map(|correction| correction.shape).or(self.sensor.setup.shape),
            tool_from_camera: guess.tool_from_camera,
            time_offset_s: guess.time_offset_s,
            covariance: known.links_covariance.ok_or(RunTimeError::NoCovariance)?,
            reading_sigma_m: self.reading_sigma_m.or(residual_m).unwrap_or(READING_SIGMA_M),
            carrier: match known.mounted.unwrap_or_default() {
                Mounted::Tool => Carrier::Tool,
                Mounted::Fixed => Carrier::Fixed,
            },
            axes: Vec::new(),
        };
        let (axes, names) = self.axes(result)?;
        let calibration = PlacerCalibration { axes, ..calibration };
        Ok(PlacerSetup { calibration, settings: settings(result), axes: names })
    }

    fn axes(&self, result: &ResultFile) -> Result<(Vec<ExternalAxis>, Vec<String>), RunTimeError> {
        let named = self.standing.iter().chain(self.in_pose.iter().map(|(name, _)| name));
        for name in named {
            if !result.axes.iter().any(|entry| entry.name == *name) {
                return Err(RunTimeError::NoSuchAxis { name: name.clone() });
            }
        }
        let moving = result.axes.iter().filter(|entry| !self.standing.contains(&entry.name));
        let axis = |entry: &AxisEntry| {
            let unknown = || RunTimeError::AxisUnknown { name: entry.name.clone() };
            Ok((self.axis(entry).ok_or_else(unknown)?, entry.name.clone()))
        };
        let both: Result<Vec<_>, RunTimeError> = moving.map(axis).collect();
        Ok(both?.into_iter().unzip())
    }

    fn axis(&self, entry: &AxisEntry) -> Option<ExternalAxis> {
        let sigma = &entry.sigma;
        let covariance = ExternalAxis::covariance_of(
            sigma.direction_deg?.to_radians(),
            sigma.point_mm.unwrap_or(0.0) / MM_PER_M,
            sigma.scale,
            // Of an axis that only stood at its places nothing shows it, and nothing needs it.
            sigma.time_offset_s.unwrap_or(0.0),
        );
        Some(ExternalAxis {
            axis: entry.known()?,
            carries: match entry.carries.as_str() {
                "robot" => AxisCarries::Robot,
                "sensor" => AxisCarries::Sensor,
                _ => AxisCarries::Part,
            },
            in_pose: self.in_pose.iter().find(|(name, _)| *name == entry.name).map(|(_, axis)| *axis),
            covariance,
        })
    }
}

/// Stamps as the result used them. A stream with one-sided delays is dated by its clock. Stamps with errors
/// to both sides are used unchanged, with the jitter in the ±.
fn settings(result: &ResultFile) -> Settings {
    let streams = [&result.stamps.robot.stream, &result.stamps.features.stream];
    let [pose_stamps, frame_stamps] =
        streams.map(|stream| match stream.used == "regular" && stream.one_sided {
            true => StampRule::LowerEnvelope,
            false => StampRule::AsStamped,
        });
    let frames = &result.stamps.features.stream;
    let jitter_s = match frames.used == "regular" && !frames.one_sided {
        true => frames.jitter_s.unwrap_or(0.0),
        false => 0.0,
    };
    Settings { pose_stamps, frame_stamps, stamp_sigma_s: jitter_s, ..Settings::default() }
}
