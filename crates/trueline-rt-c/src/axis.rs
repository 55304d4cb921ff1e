//! The structs and functions about external axes.

use crate::placer::{PlacerHandle, made_of, parts};
use crate::plain::{CalibrationPlain, SettingsPlain};
use crate::status::{self, BAD_SETTING, NO_AXIS, NULL_POINTER, Status, guarded};
use nalgebra::{UnitVector3, Vector3};
use trueline_geometry::{Axis, AxisKind};
use trueline_rt::{AxisCarries, AxisCovariance, AxisHealth, ExternalAxis};

/// A direction may be off unit length by this.
const UNIT: f64 = 1e-3;

/// `trueline_axis`.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct AxisPlain {
    /// Rotary or linear.
    pub kind: i32,
    /// The body that it moves.
    pub carries: i32,
    /// Direction, in base, or in the tool if it carries the sensor.
    pub direction: [f64; 3],
    /// A point of it, m.
    pub point_m: [f64; 3],
    /// How far it moves for a value of one.
    pub scale: f64,
    /// How late its stamps are, s.
    pub time_offset_s: f64,
    /// Whether the poses contain it already, as the following numbers say.
    pub in_pose: i32,
    /// 0.
    pub reserved: i32,
    /// Direction as the controller has it.
    pub pose_direction: [f64; 3],
    /// A point of it, m.
    pub pose_point_m: [f64; 3],
    /// Its scale.
    pub pose_scale: f64,
    /// Of direction (2, rad), point (2, m), scale, time offset (s).
    pub covariance: [f64; 36],
}

impl AxisPlain {
    fn axis(&self) -> Result<ExternalAxis, Status> {
        let kind = match self.kind {
            0 => AxisKind::Rotary,
            1 => AxisKind::Linear,
            _ => return Err(BAD_SETTING),
        };
        let axis = |direction: [f64; 3], point_m: [f64; 3], scale, time_offset_s| {
            let direction = Vector3::from(direction);
            let is_unit = (direction.norm() - 1.0).abs() <= UNIT;
            let direction = UnitVector3::new_normalize(direction);
            let axis = Axis::new(kind, direction, Vector3::from(point_m));
            is_unit.then_some(Axis { scale, time_offset_s, ..axis }).ok_or(BAD_SETTING)
        };
        Ok(ExternalAxis {
            axis: axis(self.direction, self.point_m, self.scale, self.time_offset_s)?,
            carries: match self.carries {
                0 => AxisCarries::Part,
                1 => AxisCarries::Robot,
                2 => AxisCarries::Sensor,
                _ => return Err(BAD_SETTING),
            },
            in_pose: (self.in_pose != 0)
                .then(|| axis(self.pose_direction, self.pose_point_m, self.pose_scale, 0.0))
                .transpose()?,
            covariance: AxisCovariance::from_row_slice(&self.covariance),
        })
    }
}

/// `trueline_axis_health`.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct AxisHealthPlain {
    /// Whether its period is known.
    pub is_settled: i32,
    /// Whether values are missing.
    pub is_stalled: i32,
    /// Since the last value, s; NaN before the first.
    pub silent_s: f64,
    /// Usual time between values, s.
    pub period_s: f64,
    /// Noise of a value, rad or m.
    pub noise: f64,
    /// Jumps of its clock.
    pub jumps: u32,
    /// 0.
    pub reserved: u32,
}

impl From<AxisHealth> for AxisHealthPlain {
    fn from(health: AxisHealth) -> Self {
        Self {
            is_settled: i32::from(health.is_settled),
            is_stalled: i32::from(health.is_stalled),
            silent_s: health.silent_s.unwrap_or(f64::NAN),
            period_s: health.period_s,
            noise: health.noise,
            jumps: health.jumps,
            reserved: 0,
        }
    }
}

/// Makes a placer of a cell with external axes; it must be freed by `trueline_placer_free`.
///
/// # Safety
/// Each pointer is null or points to its type, `axes` to `axis_count` of them; `placer` may be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn trueline_placer_new_with_axes(
    calibration: *const CalibrationPlain,
    axes: *const AxisPlain,
    axis_count: usize,
    settings: *const SettingsPlain,
    placer: *mut *mut PlacerHandle,
) -> Status {
    guarded(|| {
        // SAFETY: the caller's part, for each that is not null; they are of different types, so none of them is written through another.
        let (calibration, settings, placer) =
            unsafe { (calibration.as_ref(), settings.as_ref(), placer.as_mut()) };
        // SAFETY: likewise; these are only read.
        let axes = unsafe { parts(axes, axis_count) };
        made_of(calibration, || axes?.iter().map(AxisPlain::axis).collect(), settings, placer)
    })
}

/// Takes a value of an axis.
///
/// # Safety
/// `placer` is null or a live handle that no other thread uses.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn trueline_placer_push_axis(
    placer: *mut PlacerHandle,
    axis: u32,
    stamp_ns: i64,
    value: f64,
) -> Status {
    guarded(|| {
        // SAFETY: the caller's part: a live handle that nobody else uses, if it is not null.
        let placer = unsafe { placer.as_mut() }.ok_or(NULL_POINTER)?;
        placer.placer.push_axis(axis as usize, stamp_ns, value).map_err(status::of_axis)
    })
}

/// Returns the state of an axis's stream.
///
/// # Safety
/// `placer` is null or a live handle that no other thread uses; `health` is null or may be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn trueline_placer_axis_health(
    placer: *const PlacerHandle,
    axis: u32,
    now_ns: i64,
    health: *mut AxisHealthPlain,
) -> Status {
    guarded(|| {
        // SAFETY: the caller's part, for what is not null.
        let (placer, health) = unsafe { (placer.as_ref(), health.as_mut()) };
        let (placer, health) = placer.zip(health).ok_or(NULL_POINTER)?;
        *health = placer.placer.axis_health(axis as usize, now_ns).ok_or(NO_AXIS)?.into();
        Ok(())
    })
}
