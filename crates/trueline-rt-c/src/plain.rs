//! The structs of the header, and their meaning in Rust.

use crate::status::{BAD_SETTING, NOT_FINITE, Status};
use nalgebra::{Quaternion, UnitQuaternion, Vector2, Vector3};
use trueline_geometry::{Plane, Pose, se3};
use trueline_model::{BrownConrady, Camera, SheetShape};
use trueline_rt::{
    Carrier, Health, LinksCovariance, Placed, PlacerCalibration, Readout, SensorModel, Settings, StampRule,
    Target, TrackSettings,
};

/// Allowed deviation of a quaternion from unit length.
const UNIT: f64 = 1e-3;

/// `trueline_pose`.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct PosePlain {
    /// Translation, m.
    pub translation_m: [f64; 3],
    /// Quaternion w, x, y, z.
    pub rotation_wxyz: [f64; 4],
}

impl PosePlain {
    pub(crate) fn pose(&self) -> Result<Pose, Status> {
        let [w, x, y, z] = self.rotation_wxyz;
        let rotation = Quaternion::new(w, x, y, z);
        let is_unit = (rotation.norm() - 1.0).abs() <= UNIT;
        if !(is_unit && self.translation_m.iter().all(|number| number.is_finite())) {
            return Err(NOT_FINITE);
        }
        Ok(se3::from_parts(UnitQuaternion::new_normalize(rotation), Vector3::from(self.translation_m)))
    }

    fn of(pose: &Pose) -> Self {
        let rotation = pose.rotation.quaternion();
        Self {
            translation_m: pose.translation.vector.into(),
            rotation_wxyz: [rotation.w, rotation.i, rotation.j, rotation.k],
        }
    }
}

/// `trueline_calibration`.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct CalibrationPlain {
    /// Kind of readings of the sensor.
    pub sensor: i32,
    /// Its carrier.
    pub carrier: i32,
    /// Whether points have a laser plane.
    pub has_plane: i32,
    /// Whether the shape counts.
    pub has_shape: i32,
    /// Width and height, px.
    pub image_size_px: [u32; 2],
    /// Focal lengths, px.
    pub focal_px: [f64; 2],
    /// Principal point, px.
    pub centre_px: [f64; 2],
    /// k1, k2, p1, p2, k3.
    pub distortion: [f64; 5],
    /// Normal of the laser plane in the camera frame.
    pub plane_normal: [f64; 3],
    /// Its offset, m.
    pub plane_offset_m: f64,
    /// h1 … h5.
    pub shape_h: [f64; 5],
    /// Origin of the shape, m.
    pub shape_origin_m: [f64; 2],
    /// Hand-eye transform.
    pub tool_from_camera: PosePlain,
    /// Time offset, s.
    pub time_offset_s: f64,
    /// Of time offset (s), rotation (rad), translation (m).
    pub covariance: [f64; 49],
    /// Standard deviation of a reading, m.
    pub reading_sigma_m: f64,
}

impl CalibrationPlain {
    pub(crate) fn calibration(&self) -> Result<PlacerCalibration, Status> {
        let plane = || Plane::new(Vector3::from(self.plane_normal), self.plane_offset_m).ok_or(BAD_SETTING);
        let sensor = match self.sensor {
            0 => SensorModel::Profiler,
            1 => SensorModel::CameraLaser { camera: self.camera()?, laser_plane_in_camera: plane()? },
            2 => {
                SensorModel::Points { laser_plane_in_camera: (self.has_plane != 0).then(plane).transpose()? }
            }
            _ => return Err(BAD_SETTING),
        };
        let carrier = match self.carrier {
            0 => Carrier::Tool,
            1 => Carrier::Fixed,
            _ => return Err(BAD_SETTING),
        };
        let shape = SheetShape { h: self.shape_h, origin_m: self.shape_origin_m };
        Ok(PlacerCalibration {
            sensor,
            shape: (self.has_shape != 0).then_some(shape),
            tool_from_camera: self.tool_from_camera.pose().map_err(|_| BAD_SETTING)?,
            time_offset_s: self.time_offset_s,
            covariance: LinksCovariance::from_row_slice(&self.covariance),
            reading_sigma_m: self.reading_sigma_m,
            carrier,
            axes: Vec::new(),
        })
    }

    fn camera(&self) -> Result<Camera, Status> {
        let numbers = [&self.focal_px[..], &self.centre_px, &self.distortion];
        let are_finite = numbers.iter().all(|list| list.iter().all(|number| number.is_finite()));
        if !(are_finite && self.focal_px.iter().all(|focal| *focal > 0.0)) {
            return Err(BAD_SETTING);
        }
        Ok(Camera {
            size: self.image_size_px,
            focal: Vector2::from(self.focal_px),
            centre: Vector2::from(self.centre_px),
            distortion: BrownConrady::from_opencv(self.distortion),
        })
    }
}

/// `trueline_settings`.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct SettingsPlain {
    /// Kind of stamps of poses.
    pub pose_stamps: i32,
    /// Kind of stamps of frames.
    pub frame_stamps: i32,
    /// When the points of one frame are exposed.
    pub readout: i32,
    /// Poses, and values of each axis, that are remembered.
    pub poses_kept: u32,
    /// Kind of stamps of external axes.
    pub axis_stamps: i32,
    /// 0.
    pub reserved: i32,
    /// Time from one index, row or column to the next, s.
    pub readout_step_s: f64,
    /// Standard deviation of a frame's time, s.
    pub stamp_sigma_s: f64,
    /// Half the window of the local fit, s.
    pub half_window_s: f64,
    /// Longest prediction, s.
    pub longest_prediction_s: f64,
    /// m/s².
    pub acceleration_m_s2: f64,
    /// rad/s².
    pub angular_acceleration_rad_s2: f64,
    /// m/s.
    pub fastest_m_s: f64,
    /// rad/s.
    pub fastest_rad_s: f64,
}

impl SettingsPlain {
    pub(crate) fn of(settings: &Settings) -> Self {
        let rule = |rule| i32::from(rule == StampRule::LowerEnvelope);
        let (readout, readout_step_s) = match settings.readout {
            Readout::AtOnce => (0, 0.0),
            Readout::ByIndex(step_s) => (1, step_s),
            Readout::ByRow(step_s) => (2, step_s),
            Readout::ByColumn(step_s) => (3, step_s),
        };
        Self {
            pose_stamps: rule(settings.pose_stamps),
            frame_stamps: rule(settings.frame_stamps),
            readout,
            poses_kept: u32::try_from(settings.poses_kept).unwrap_or(u32::MAX),
            axis_stamps: rule(settings.axis_stamps),
            reserved: 0,
            readout_step_s,
            stamp_sigma_s: settings.stamp_sigma_s,
            half_window_s: settings.half_window_s,
            longest_prediction_s: settings.longest_prediction_s,
            acceleration_m_s2: settings.acceleration_m_s2,
            angular_acceleration_rad_s2: settings.angular_acceleration_rad_s2,
            fastest_m_s: settings.fastest_m_s,
            fastest_rad_s: settings.fastest_rad_s,
        }
    }

    pub(crate) fn settings(&self) -> Result<Settings, Status> {
        let rule = |number| match number {
            0 => Ok(StampRule::AsStamped),
            1 => Ok(StampRule::LowerEnvelope),
            _ => Err(BAD_SETTING),
        };
        let readout = match self.readout {
            0 => Readout::AtOnce,
            1 => Readout::ByIndex(self.readout_step_s),
            2 => Readout::ByRow(self.readout_step_s),
            3 => Readout::ByColumn(self.readout_step_s),
            _ => return Err(BAD_SETTING),
        };
        Ok(Settings {
            pose_stamps: rule(self.pose_stamps)?,
            frame_stamps: rule(self.frame_stamps)?,
            axis_stamps: rule(self.axis_stamps)?,
            stamp_sigma_s: self.stamp_sigma_s,
            readout,
            half_window_s: self.half_window_s,
            longest_prediction_s: self.longest_prediction_s,
            acceleration_m_s2: self.acceleration_m_s2,
            angular_acceleration_rad_s2: self.angular_acceleration_rad_s2,
            fastest_m_s: self.fastest_m_s,
            fastest_rad_s: self.fastest_rad_s,
            poses_kept: self.poses_kept as usize,
        })
    }
}

/// `trueline_placed`.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct PlacedPlain {
    /// Points that were placed.
    pub placed: u64,
    /// Points that were not.
    pub flagged: u64,
    /// When the first was exposed, ns.
    pub exposed_ns: i64,
    /// How long before the last pose, s.
    pub age_s: f64,
}

impl From<Placed> for PlacedPlain {
    fn from(placed: Placed) -> Self {
        Self {
            placed: placed.placed as u64,
            flagged: placed.flagged as u64,
            exposed_ns: placed.exposed_ns,
            age_s: placed.age_s,
        }
    }
}

/// `trueline_health`.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct HealthPlain {
    /// Whether frames can be placed.
    pub is_settled: i32,
    /// Whether poses are missing.
    pub is_stalled: i32,
    /// Since the last pose, s; NaN before the first.
    pub silent_s: f64,
    /// Usual time between poses, s.
    pub pose_period_s: f64,
    /// Noise of a pose, m.
    pub pose_noise_m: f64,
    /// Noise of an attitude, rad.
    pub pose_noise_rad: f64,
    /// Usual delay of poses and frames, s.
    pub usual_late_s: [f64; 2],
    /// Jumps of their clocks.
    pub jumps: [u32; 2],
}

impl From<Health> for HealthPlain {
    fn from(health: Health) -> Self {
        Self {
            is_settled: i32::from(health.is_settled),
            is_stalled: i32::from(health.is_stalled),
            silent_s: health.silent_s.unwrap_or(f64::NAN),
            pose_period_s: health.pose_period_s,
            pose_noise_m: health.pose_noise_m,
            pose_noise_rad: health.pose_noise_rad,
            usual_late_s: health.usual_late_s,
            jumps: health.jumps,
        }
    }
}

/// `trueline_track_settings`.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct TrackSettingsPlain {
    /// Half the window, m.
    pub half_window_m: f64,
    /// Longest extrapolation, m.
    pub longest_extrapolation_m: f64,
    /// Unknown curvature, 1/m.
    pub curvature_per_m: f64,
    /// Points further off do not belong to the seam, m.
    pub jump_m: f64,
    /// Points that are remembered.
    pub points_kept: u32,
    /// 0.
    pub reserved: u32,
}

impl TrackSettingsPlain {
    pub(crate) fn of(settings: &TrackSettings) -> Self {
        Self {
            half_window_m: settings.half_window_m,
            longest_extrapolation_m: settings.longest_extrapolation_m,
            curvature_per_m: settings.curvature_per_m,
            jump_m: settings.jump_m,
            points_kept: u32::try_from(settings.points_kept).unwrap_or(u32::MAX),
            reserved: 0,
        }
    }

    pub(crate) fn settings(&self) -> TrackSettings {
        TrackSettings {
            half_window_m: self.half_window_m,
            longest_extrapolation_m: self.longest_extrapolation_m,
            curvature_per_m: self.curvature_per_m,
            jump_m: self.jump_m,
            points_kept: self.points_kept as usize,
        }
    }
}

/// `trueline_target`.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct TargetPlain {
    /// The torch in base.
    pub base_from_torch: PosePlain,
    /// Way along the seam, m.
    pub along_m: f64,
    /// Direction of the seam.
    pub tangent: [f64; 3],
    /// Direction across it.
    pub across: [f64; 3],
    /// The third direction.
    pub upward: [f64; 3],
    /// Standard deviation across the seam, m.
    pub sigma_m: f64,
    /// How far off the seam the torch is now, m.
    pub off_m: [f64; 2],
}

impl From<Target> for TargetPlain {
    fn from(target: Target) -> Self {
        Self {
            base_from_torch: PosePlain::of(&target.base_from_torch),
            along_m: target.along_m,
            tangent: target.tangent.into(),
            across: target.across.into(),
            upward: target.upward.into(),
            sigma_m: target.sigma_m,
            off_m: target.off_m,
        }
    }
}
