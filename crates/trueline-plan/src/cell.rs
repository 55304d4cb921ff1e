//! Prior knowledge of a scan: sensor, rough mounting, rough line, limits, noise.

use crate::cell_axis::CellAxis;
use crate::course::{Course, NoCourse};
use crate::guess_error::GuessError;
use crate::limits::Limits;
use crate::mounted_arm::MountedArm;
use crate::seam::Seam;
use crate::sensor_pose::SensorPose;
use crate::surroundings::Surroundings;
use crate::view::View;
use nalgebra::{UnitVector3, Vector3};
use std::sync::Arc;
use trueline_dataset::{KnownCalibration, Sensor, Truth};
use trueline_geometry::Pose;
use trueline_model::LaserSheet;

/// Standard deviations of the future recording.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExpectedNoise {
    /// A feature, px along u and v; for cameras.
    pub feature_px: f64,
    /// A feature, m along both axes of the sheet; for profilers and points.
    pub feature_m: f64,
    /// A recorded robot position, per axis, m.
    pub robot_m: f64,
    /// A recorded robot attitude, about each axis, rad.
    pub robot_rad: f64,
    /// An image's stamp, s.
    pub stamp_s: f64,
}

impl Default for ExpectedNoise {
    fn default() -> Self {
        Self { feature_px: 0.3, feature_m: 0.02e-3, robot_m: 0.03e-3, robot_rad: 2e-5, stamp_s: 0.1e-3 }
    }
}

/// Inputs of planning.
#[derive(Clone, Debug)]
pub struct Cell {
    /// The sensor and its own calibration.
    pub sensor: Sensor,
    /// Its field of view.
    pub view: View,
    /// Its sheet.
    pub sheet: LaserSheet,
    /// Rough hand-eye transform.
    pub tool_from_camera: Pose,
    /// Rough line.
    pub seam: Seam,
    /// Curved seam; `seam` is then its tangent in the middle. `None` for a straight seam.
    pub course: Option<Arc<Course>>,
    /// Pose of the sensor over the seam without tilt.
    pub sensor_pose: SensorPose,
    /// How rough the guess is.
    pub guess_error: GuessError,
    /// Limits of the motion.
    pub limits: Limits,
    /// Disturbances of the measurement.
    pub noise: ExpectedNoise,
    /// Time between images, s.
    pub frame_period_s: f64,
    /// Time between robot samples, s.
    pub robot_period_s: f64,
    /// The arm; without one reach and joints are not checked.
    pub arm: Option<MountedArm>,
    /// Bodies that must not touch.
    pub surroundings: Surroundings,
    /// External axes that move in the scan, in the order of the chain.
    pub axes: Vec<CellAxis>,
}

/// Why a calibration is of no use for planning in a cell.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum NotThisCell {
    /// No line, or none that runs along the seam.
    #[error("none of its lines runs along the cell's seam")]
    NoLine,
    /// Its line or its hand-eye is further from the guess than the guess can be wrong.
    #[error(
        "its hand-eye differs by {shift_mm:.1} mm and {turn_deg:.1}° and its line by {line_mm:.1} mm from \
         the cell's guess: more than [guess_error] states"
    )]
    TooFar {
        /// Shift of the hand-eye, mm.
        shift_mm: f64,
        /// Turn of the hand-eye, degrees.
        turn_deg: f64,
        /// Distance of the line at the seam's ends, mm.
        line_mm: f64,
    },
}

impl Cell {
    /// Whether nothing of the guess can be wrong.
    #[must_use]
    pub fn has_exact_guess(&self) -> bool {
        self.guess_error.is_none() && self.axes.iter().all(|axis| axis.error == [0.0; 2])
    }

    /// Replaces the straight seam by a curve through points in base, m, with the same approach.
    ///
    /// # Errors
    /// [`NoCourse`] if no scan over it is possible.
    pub fn follow(&mut self, points: &[Vector3<f64>]) -> Result<(), NoCourse> {
        let approach = UnitVector3::new_normalize(self.sensor_pose.range_in_base());
        let course = Course::along(points, approach)?;
        let before = self.seam.direction();
        self.seam = course.straight();
        if let Some((before, along)) = before.zip(self.seam.direction()) {
            let turned = self.sensor_pose.turned(&before, &along);
            // No course runs along its approach.
            self.sensor_pose = turned.ok_or(NoCourse::Steep { at_mm: 0.0 })?;
        }
        self.course = Some(Arc::new(course));
        Ok(())
    }

    /// Takes over a calibration's hand-eye, and of its lines the one that the seam is nearest to. The camera stands as it
    /// did: the nominal attitude is that of the sheet.
    ///
    /// # Errors
    /// A calibration that the guess, with all its error, rules out: it is of another cell.
    pub fn believe(&mut self, known: &Truth) -> Result<(), NotThisCell> {
        let along = self.seam.direction().ok_or(NotThisCell::NoLine)?;
        let middle = 0.5 * (self.seam.from_m + self.seam.to_m);
        let line = known
            .lines
            .iter()
            .filter(|line| line.direction().dot(&along).abs() > std::f64::consts::FRAC_1_SQRT_2)
            .min_by(|a, b| a.distance(&middle).total_cmp(&b.distance(&middle)))
            .ok_or(NotThisCell::NoLine)?;
        let (now, error) = (&known.parameters.tool_from_camera, &self.guess_error);
        let shift_m = (now.translation.vector - self.tool_from_camera.translation.vector).norm();
        let turn_rad = now.rotation.angle_to(&self.tool_from_camera.rotation);
        let line_m = line.distance(&self.seam.from_m).max(line.distance(&self.seam.to_m));
        if shift_m > error.translation_m || turn_rad > error.rotation_rad || line_m > error.line_m {
            let (shift_mm, turn_deg) = (shift_m * 1e3, turn_rad.to_degrees());
            return Err(NotThisCell::TooFar { shift_mm, turn_deg, line_mm: line_m * 1e3 });
        }
        let onto = |point: &Vector3<f64>| *line.anchored_near(point).anchor();
        self.seam = Seam { from_m: onto(&self.seam.from_m), to_m: onto(&self.seam.to_m) };
        self.tool_from_camera = *now;
        self.sensor_pose = self.sensor_pose.carried_by(&self.tool_from_camera);
        Ok(())
    }

    /// The same with a calibration's own uncertainty, some sigmas of it, as the error that the plan allows for.
    ///
    /// # Errors
    /// A calibration that was not accepted, has no information on its uncertainty, or is of another cell.
    pub fn believe_calibration(&mut self, known: &KnownCalibration) -> Result<(), NotBelieved> {
        if known.accepted == Some(false) {
            return Err(NotBelieved::NotAccepted);
        }
        let (Some([rotation_rad, translation_m]), Some([line_rad, line_m])) =
            (known.hand_eye_sigma, known.line_sigma)
        else {
            return Err(NotBelieved::NoUncertainty);
        };
        self.believe(&known.known)?;
        self.guess_error = GuessError {
            translation_m: SIGMAS * translation_m,
            rotation_rad: SIGMAS * rotation_rad,
            // At the seam's ends.
            line_m: SIGMAS * (line_m + 0.5 * line_rad * self.seam.length_m()),
        };
        Ok(())
    }
}

/// Assumed error of the calibration that a plan begins from, in its own sigmas.
const SIGMAS: f64 = 5.0;

/// Why a plan cannot begin from a calibration.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum NotBelieved {
    /// It was not accepted.
    #[error("the calibration was not accepted")]
    NotAccepted,
    /// It has no sigma.
    #[error("does not state its uncertainty")]
    NoUncertainty,
    /// It is of another cell.
    #[error(transparent)]
    NotThisCell(#[from] NotThisCell),
}

impl NotBelieved {
    /// Hint for the user.
    #[must_use]
    pub fn hint(&self) -> &'static str {
        match self {
            Self::NotAccepted => "plan with the guess, and calibrate from that scan",
            Self::NoUncertainty => "give the JSON that `trueline calibrate --json` wrote",
            Self::NotThisCell(_) => {
                "check that it belongs to this cell, and that [guess_error] is large \
                enough"
            }
        }
    }
}
