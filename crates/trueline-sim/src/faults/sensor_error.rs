//! A sensor that is not the stated one.

use super::fault::SensorError;
use crate::capture::SheetAxes;
use crate::scenario::SensorModel;
use nalgebra::{Rotation3, Unit, Vector3};
use trueline_dataset::{Measured, Recording, Sensor};
use trueline_geometry::Plane;

impl SensorError {
    /// Spoils the stated sensor or, for a sensor without statements, its measurements; `None` for a kind of sensor
    /// that cannot have this error.
    pub(crate) fn apply(self, recording: &mut Recording, model: &SensorModel) -> Option<()> {
        match self {
            Self::ProfileWidth { .. } | Self::ProfileDepth { .. } | Self::ProfileShear { .. } => {
                self.distort_profiles(recording, model)
            }
            _ => self.misstate(&mut recording.sensor, model),
        }
    }

    fn misstate(self, sensor: &mut Sensor, model: &SensorModel) -> Option<()> {
        let (plane, camera) = match sensor {
            Sensor::CameraLaser { camera, laser_plane_in_camera } => (laser_plane_in_camera, Some(camera)),
            Sensor::Points { laser_plane_in_camera: Some(plane) } => (plane, None),
            Sensor::Points { laser_plane_in_camera: None } | Sensor::Profiler => return None,
        };
        let axes = SheetAxes::of(model);
        match self {
            Self::PlaneOffset { offset_m } => {
                *plane = Plane::new(plane.normal().into_inner(), plane.offset() + offset_m)?;
            }
            Self::PlaneTiltAboutStripe { angle_rad } => *plane = turned(plane, &axes, 0, angle_rad)?,
            Self::PlaneTiltAboutRange { angle_rad } => *plane = turned(plane, &axes, 2, angle_rad)?,
            Self::Focal { share } => camera?.focal *= 1.0 + share,
            Self::PrincipalPointU { shift_px } => camera?.centre.x += shift_px,
            Self::PrincipalPointV { shift_px } => camera?.centre.y += shift_px,
            Self::Distortion { k1 } => camera?.distortion.k1 -= k1,
            Self::ProfileWidth { .. } | Self::ProfileDepth { .. } | Self::ProfileShear { .. } => return None,
        }
        Some(())
    }

    fn distort_profiles(self, recording: &mut Recording, model: &SensorModel) -> Option<()> {
        let SensorModel::Profiler { range_m, .. } = model else { return None };
        let middle_m = 0.5 * (range_m[0] + range_m[1]);
        for feature in &mut recording.features {
            if let Measured::Profile([x, z]) = &mut feature.measured {
                match self {
                    Self::ProfileWidth { share } => *x *= 1.0 + share,
                    Self::ProfileDepth { share } => *z += (*z - middle_m) * share,
                    Self::ProfileShear { angle_rad } => *x += (*z - middle_m) * angle_rad.tan(),
                    _ => {}
                }
            }
        }
        Some(())
    }
}

/// The plane turned about one axis of the sheet through the middle of the field of view.
fn turned(plane: &Plane, axes: &SheetAxes, axis: usize, angle_rad: f64) -> Option<Plane> {
    let axis = axes.camera_from_sheet * Vector3::ith(axis, 1.0);
    let normal =
        Rotation3::from_axis_angle(&Unit::new_normalize(axis), angle_rad) * plane.normal().into_inner();
    Plane::new(normal, normal.dot(&axes.middle))
}
