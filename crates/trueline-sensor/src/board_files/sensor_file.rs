//! A sensor's calibration as its file.

use crate::intrinsics::CameraFit;
use crate::laser_plane::plate::PlateFit;
use crate::laser_plane::{JointFit, PlaneFit};
use nalgebra::SMatrix;
use trueline_dataset::Sensor;
use trueline_dataset::sensor_setup::{SensorCovariance, SensorSetup, SensorUncertainty};
use trueline_dataset::sensor_toml::{CameraFile, SensorFile};

/// A camera, and its uncertainty.
#[must_use]
pub fn of_camera(fit: &CameraFit) -> CameraFile {
    let (camera, sigma) = (fit.state.camera, fit.sigma());
    let uncertainty = SensorUncertainty {
        focal: Some((sigma[0] / camera.focal.x).max(sigma[1] / camera.focal.y)),
        principal_point_px: Some(sigma[2].max(sigma[3])),
        covariance: Some(SensorCovariance::of_free(&fit.covariance)),
        ..SensorUncertainty::default()
    };
    CameraFile {
        camera,
        laser_plane_in_camera: None,
        setup: SensorSetup { uncertainty: Some(uncertainty), ..SensorSetup::default() },
    }
}

/// A camera's file with camera, laser plane and their joint covariance.
#[must_use]
pub fn with_joint_plane(before: &CameraFile, fit: &JointFit) -> CameraFile {
    let stated = before.setup.uncertainty.clone().unwrap_or_default();
    let uncertainty = stated.with_joint(SensorCovariance::of_free(&fit.covariance));
    CameraFile {
        camera: fit.state.camera,
        laser_plane_in_camera: fit.plane(),
        setup: SensorSetup { uncertainty: Some(uncertainty), ..before.setup.clone() },
    }
}

/// A camera's file with camera, laser plane and their joint covariance, from a plain plate.
#[must_use]
pub fn with_plate_plane(before: &CameraFile, fit: &PlateFit) -> CameraFile {
    let stated = before.setup.uncertainty.clone().unwrap_or_default();
    let of_sensor: SMatrix<f64, 12, 12> = fit.covariance.fixed_view::<12, 12>(0, 0).into();
    let uncertainty = stated.with_joint(SensorCovariance::of_free(&of_sensor));
    CameraFile {
        camera: fit.state.camera,
        laser_plane_in_camera: Some(fit.plane()),
        setup: SensorSetup { uncertainty: Some(uncertainty), ..before.setup.clone() },
    }
}

/// A camera's file with a separately measured laser plane.
#[must_use]
pub fn with_plane(before: CameraFile, fit: &PlaneFit) -> CameraFile {
    let stated = before.setup.uncertainty.clone().unwrap_or_default();
    let setup = SensorSetup { uncertainty: Some(stated.with_plane(&fit.covariance)), ..before.setup };
    CameraFile { laser_plane_in_camera: Some(fit.plane), setup, ..before }
}

/// A sensor that measures points on a laser plane.
#[must_use]
pub fn of_points(fit: &PlaneFit) -> SensorFile {
    let uncertainty = SensorUncertainty::default().with_plane(&fit.covariance);
    SensorFile {
        sensor: Sensor::Points { laser_plane_in_camera: Some(fit.plane) },
        setup: SensorSetup { uncertainty: Some(uncertainty), ..SensorSetup::default() },
    }
}
