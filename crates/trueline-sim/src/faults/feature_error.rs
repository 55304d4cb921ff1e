//! A detector that does not report the seam.

use super::fault::{Fault, FeatureError};
use crate::capture::SheetAxes;
use crate::noise::Noise;
use crate::scenario::{Scenario, SensorModel};
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, UnitVector3, Vector3};
use std::f64::consts::PI;
use trueline_dataset::Measured;
use trueline_geometry::{Line, Pose};

/// Errors of the features of one scan, frame by frame.
pub(crate) struct FeatureErrors {
    errors: Vec<FeatureError>,
    chance: Noise,
    /// Rotation from the sheet's axes as they stand square to the seam to base.
    base_from_square_sheet: Rotation3<f64>,
    correlated: Vec<Correlated>,
    /// Displacement of the seam in this frame: across and in height, m.
    shift_m: [f64; 2],
    duration_s: f64,
}

/// Correlation from frame to frame of a real weld's residuals, across and in height.
const FRAME_CORRELATION: [f64; 2] = [0.63, 0.48];

/// First-order autoregressive noise.
struct Correlated {
    sigma_m: [f64; 2],
    value_m: [f64; 2],
    noise: Noise,
}

/// Length of one pixel for features in lengths, m.
const M_PER_PX: f64 = 5e-5;

impl FeatureErrors {
    pub(crate) fn new(scenario: &Scenario, faults: &[Fault], seed: u64) -> Self {
        let mut errors = Vec::new();
        let mut correlated = Vec::new();
        for (index, fault) in faults.iter().enumerate() {
            let Fault::Feature(error) = *fault else { continue };
            errors.push(error);
            if let FeatureError::CorrelatedNoise { sigma_m } = error {
                let mut noise = Noise::for_fault(seed, index);
                let sigma_m = [sigma_m, 0.5 * sigma_m];
                let value_m = sigma_m.map(|sigma| noise.normal(sigma));
                correlated.push(Correlated { sigma_m, value_m, noise });
            }
        }
        let along = scenario.seam_direction();
        let approach = scenario.cell.approach.into_inner();
        let range = (approach - along * along.dot(&approach)).normalize();
        let axes = Matrix3::from_columns(&[along.cross(&range), along, range]);
        Self {
            errors,
            chance: Noise::new(seed, FEATURE_STREAM),
            base_from_square_sheet: Rotation3::from_matrix_unchecked(axes),
            correlated,
            shift_m: [0.0; 2],
            duration_s: scenario.timing.duration_s,
        }
    }

    /// Begins another frame.
    pub(crate) fn next_frame(&mut self) {
        self.shift_m = [0.0; 2];
        for Correlated { sigma_m, value_m, noise } in &mut self.correlated {
            for axis in 0..2 {
                let keep = FRAME_CORRELATION[axis];
                value_m[axis] =
                    keep * value_m[axis] + noise.normal(sigma_m[axis] * (1.0 - keep * keep).sqrt());
                self.shift_m[axis] += value_m[axis];
            }
        }
    }

    /// Distance of this frame's seam point from the seam, across and in height, m.
    pub(crate) fn shift_m(&self) -> [f64; 2] {
        self.shift_m
    }

    /// Distance of this frame's feature from its line, m; 0 is on it.
    pub(crate) fn beside_m(&mut self, exposed_s: f64) -> f64 {
        let mut beside = 0.0;
        for error in &self.errors {
            match *error {
                FeatureError::ParallelLine { beside_m, share } if self.chance.happens(share) => {
                    beside = beside_m
                }
                FeatureError::ParallelLineAtEnd { beside_m, share }
                    if exposed_s > (1.0 - share) * self.duration_s =>
                {
                    beside = beside_m;
                }
                _ => {}
            }
        }
        beside
    }

    /// How much later than the middle of the image the row of a feature is exposed, s.
    pub(crate) fn row_delay_s(&self, seen: &Measured, sensor: &SensorModel) -> f64 {
        let (Measured::Pixel([_, v]), SensorModel::CameraLaser { camera, .. }) = (seen, sensor) else {
            return 0.0;
        };
        let from_middle = (v + 0.5) / f64::from(camera.size[1]) - 0.5;
        let delay = |error: &FeatureError| match *error {
            FeatureError::RollingShutter { readout_s } => readout_s * from_middle,
            _ => 0.0,
        };
        self.errors.iter().map(delay).sum()
    }

    /// A feature with the detector's bias.
    pub(crate) fn biased(
        &self,
        seen: Measured,
        sensor: &SensorModel,
        sheet: &SheetAxes,
        base_from_camera: &Pose,
    ) -> Measured {
        let base_from_sheet = base_from_camera.rotation.to_rotation_matrix() * sheet.camera_from_sheet;
        let tilt = own_tilt(&(self.base_from_square_sheet.inverse() * base_from_sheet));
        let bias_px: f64 = self
            .errors
            .iter()
            .map(|error| match *error {
                FeatureError::BiasByWorkAngle { px_per_rad } => px_per_rad * tilt.y,
                FeatureError::BiasByTravelAngle { px_per_rad } => px_per_rad * tilt.x,
                FeatureError::BiasBySpin { px_per_rad } => px_per_rad * tilt.z,
                FeatureError::BiasBySide { bias_px } => bias_px * side(&seen, sensor),
                _ => 0.0,
            })
            .sum();
        shifted(seen, bias_px, sheet)
    }
}

/// Rotations about the stripe, about the seam and about the range direction, in the sensor's own axes: spun by half a turn
/// about its view, it is tilted the other way. A half turn is not a tilt.
fn own_tilt(turn: &Rotation3<f64>) -> Vector3<f64> {
    let turn = UnitQuaternion::from_rotation_matrix(turn);
    let spin_rad = 2.0 * turn.k.atan2(turn.w);
    let swing = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), -spin_rad) * turn;
    let swing = swing.scaled_axis();
    Vector3::new(swing.x, swing.y, spin_rad - PI * (spin_rad / PI).round())
}

/// Stream of random numbers for random errors of features.
const FEATURE_STREAM: u64 = 21;

/// On which side of the middle a feature is, −1 or 1.
fn side(seen: &Measured, sensor: &SensorModel) -> f64 {
    match (seen, sensor) {
        (Measured::Pixel([u, _]), SensorModel::CameraLaser { camera, .. }) => (u - camera.centre.x).signum(),
        (Measured::Pixel([u, _]), _) => u.signum(),
        (Measured::Profile([x, _]) | Measured::Point([x, _, _]), _) => x.signum(),
    }
}

/// Down the image and half as much to the right.
fn shifted(seen: Measured, bias_px: f64, sheet: &SheetAxes) -> Measured {
    let bias_m = bias_px * M_PER_PX;
    match seen {
        Measured::Pixel([u, v]) => Measured::Pixel([u + 0.5 * bias_px, v + bias_px]),
        Measured::Profile([x, z]) => Measured::Profile([x + 0.5 * bias_m, z + bias_m]),
        Measured::Point(point) => {
            let shift = sheet.camera_from_sheet * Vector3::new(0.5 * bias_m, 0.0, bias_m);
            Measured::Point((Vector3::from(point) + shift).into())
        }
    }
}

/// The line parallel to one, sideways as the sensor looks.
pub(crate) fn line_beside(scenario: &Scenario, line: &Line, beside_m: f64) -> Line {
    let across = scenario.cell.approach.cross(&line.direction()).normalize();
    Line::new(line.anchor() + across * beside_m, &UnitVector3::new_normalize(line.direction()))
}
