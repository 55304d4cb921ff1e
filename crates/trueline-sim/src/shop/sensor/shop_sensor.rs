//! The true sensor: the place of its view on a seam, and its reading there.

use super::super::drawn_errors::DrawnErrors;
use super::super::seam::RoundedEdge;
use super::bent_sheet::BentSheet;
use super::linearity::Linearity;
use super::profile_shape::ProfileShape;
use super::{intrinsics, laser_plane, lens_terms, rolling_shutter};
use crate::capture::{SheetAxes, measure, point_on_sheet_beside};
use crate::scenario::SensorModel;
use nalgebra::Vector3;
use trueline_dataset::{Measured, Sensor};
use trueline_geometry::{Line, Pose};

/// Rounds of the search for the seam in a bent sheet: its slope gains a factor of 200 a round.
const BENT_ROUNDS: usize = 5;
/// Rounds of the search for the row that sees the seam; each gains the rows' speed over the seam's.
const ROLLING_ROUNDS: usize = 4;

/// View of a sensor on a seam.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Seen {
    /// Its reading, without noise.
    pub(crate) measured: Measured,
    /// The point in the camera frame, m.
    pub(crate) point_in_camera: Vector3<f64>,
}

/// The true seam: a line, its displacement, and its edge.
pub(crate) struct TrueSeam<'a> {
    pub(crate) line: &'a Line,
    pub(crate) displacement: &'a dyn Fn(f64) -> Vector3<f64>,
    pub(crate) rounded: Option<RoundedEdge>,
}

/// The sensor of a cell.
pub(crate) struct ShopSensor {
    pub(crate) model: SensorModel,
    pub(crate) axes: SheetAxes,
    bend: Option<BentSheet>,
    shape: Option<ProfileShape>,
    linearity: Option<Linearity>,
    errors: DrawnErrors,
}

impl ShopSensor {
    /// The sensor with the design `design`.
    pub(crate) fn new(design: &SensorModel, errors: &DrawnErrors) -> Self {
        let mut model = design.clone();
        let (mut shape, mut linearity) = (None, None);
        match &mut model {
            SensorModel::CameraLaser { camera, .. } => *camera = lens_terms::with_terms(*camera, errors),
            SensorModel::Profiler { range_m, .. } => {
                shape = ProfileShape::of(errors);
                linearity = Linearity::of(errors, range_m[1] - range_m[0]);
            }
            SensorModel::Points { .. } => shape = ProfileShape::of(errors),
        }
        let axes = SheetAxes::of(&model);
        Self { model, axes, bend: BentSheet::of(errors), shape, linearity, errors: errors.clone() }
    }

    /// The sensor as its file has it, for a true one of this design.
    pub(crate) fn stated(&self, design: &SensorModel) -> Option<Sensor> {
        Some(match design {
            SensorModel::CameraLaser { camera, laser_plane_in_camera } => Sensor::CameraLaser {
                camera: intrinsics::stated(*camera, &self.errors),
                laser_plane_in_camera: laser_plane::stated(laser_plane_in_camera, &self.axes, &self.errors)?,
            },
            SensorModel::Profiler { .. } => Sensor::Profiler,
            SensorModel::Points { .. } => Sensor::Points { laser_plane_in_camera: None },
        })
    }

    /// View of a seam in an image with its middle row exposed at a time, s, from the camera's pose then; `None` out of view.
    pub(crate) fn see(
        &self,
        seam: &TrueSeam<'_>,
        base_from_camera: &dyn Fn(f64) -> Pose,
        exposed_s: f64,
    ) -> Option<Seen> {
        let mut seen = self.see_from(seam, &base_from_camera(exposed_s))?;
        let mut delay_s = 0.0;
        for _ in 0..ROLLING_ROUNDS {
            let next_s = self.row_delay_s(&seen.measured);
            if next_s == delay_s {
                break;
            }
            delay_s = next_s;
            seen = self.see_from(seam, &base_from_camera(exposed_s + delay_s))?;
        }
        Some(seen)
    }

    /// How much later than the middle row the row of a feature is exposed, s.
    pub(crate) fn row_delay_s(&self, seen: &Measured) -> f64 {
        match &self.model {
            SensorModel::CameraLaser { camera, .. } => rolling_shutter::delay_s(&self.errors, camera, seen),
            _ => 0.0,
        }
    }

    /// Its view at rest.
    pub(crate) fn see_from(&self, seam: &TrueSeam<'_>, base_from_camera: &Pose) -> Option<Seen> {
        let along = seam.line.direction();
        let to_sensor = base_from_camera.translation.vector - seam.line.anchor();
        let shift = seam.rounded.map_or_else(Vector3::zeros, |edge| edge.shift(&to_sensor, &along));
        let beside = |along_m: f64| (seam.displacement)(along_m) + shift;
        let on = |axes: &SheetAxes| point_on_sheet_beside(axes, base_from_camera, seam.line, &beside);
        let mut point = on(&self.axes)?;
        if let Some(bend) = &self.bend {
            let mut bent = SheetAxes { ..self.axes };
            for _ in 0..BENT_ROUNDS {
                let stripe_m = self.in_sheet(&point).x;
                bent.offset = self.axes.offset + bend.off_plane_m(stripe_m);
                point = on(&bent)?;
            }
        }
        let measured = self.distorted(measure(&self.model, &point)?, &point);
        Some(Seen { measured, point_in_camera: point })
    }

    /// A point by the axes of the sheet (stripe, normal, range), from the middle of the field, m.
    fn in_sheet(&self, point: &Vector3<f64>) -> Vector3<f64> {
        self.axes.camera_from_sheet.inverse() * (point - self.axes.middle)
    }

    /// Distorted form of a reading in lengths.
    fn distorted(&self, measured: Measured, point: &Vector3<f64>) -> Measured {
        let at = self.in_sheet(point);
        let mut read = [at.x, at.z];
        if let Some(shape) = &self.shape {
            read = shape.read(read);
        }
        if let Some(linearity) = &self.linearity {
            read = linearity.read(read);
        }
        let by = [read[0] - at.x, read[1] - at.z];
        match measured {
            Measured::Pixel(_) => measured,
            Measured::Profile([x, z]) => Measured::Profile([x + by[0], z + by[1]]),
            Measured::Point(_) => Measured::Point(
                (point + self.axes.camera_from_sheet * Vector3::new(by[0], 0.0, by[1])).into(),
            ),
        }
    }
}
