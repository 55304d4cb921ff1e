//! The functions about a placer.

use crate::plain::{CalibrationPlain, HealthPlain, PlacedPlain, PosePlain, SettingsPlain};
use crate::status::{self, BAD_SETTING, NULL_POINTER, OTHER_SENSOR, Status, guarded};
use trueline_rt::{ExternalAxis, Placer, PlacerCalibration, Points, Settings};

/// `TRUELINE_RT_ABI`.
const ABI: u32 = 2;

/// `trueline_placer`: the target of a handle.
#[derive(Debug)]
pub struct PlacerHandle {
    pub(crate) placer: Placer,
    sensor: i32,
}

/// The version of the header that this library goes with.
#[unsafe(no_mangle)]
pub extern "C" fn trueline_rt_abi() -> u32 {
    ABI
}

/// Writes the default settings.
///
/// # Safety
/// `settings` is null or leads to a `trueline_settings` that may be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn trueline_settings_default(settings: *mut SettingsPlain) -> Status {
    guarded(|| {
        // SAFETY: the caller's part is that a pointer that is not null leads to a struct that may be written.
        let settings = unsafe { settings.as_mut() }.ok_or(NULL_POINTER)?;
        *settings = SettingsPlain::of(&Settings::default());
        Ok(())
    })
}

/// Makes a placer; it must be freed by [`trueline_placer_free`].
///
/// # Safety
/// Each pointer is null or points to its type; `placer` may be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn trueline_placer_new(
    calibration: *const CalibrationPlain,
    settings: *const SettingsPlain,
    placer: *mut *mut PlacerHandle,
) -> Status {
    guarded(|| {
        // SAFETY: the caller's part, for each of the three that is not null; they are of different types, so none of them is written
        // through another.
        let (calibration, settings, placer) =
            unsafe { (calibration.as_ref(), settings.as_ref(), placer.as_mut()) };
        made_of(calibration, || Ok(Vec::new()), settings, placer)
    })
}

/// Makes a placer from the pointers' targets.
pub(crate) fn made_of(
    calibration: Option<&CalibrationPlain>,
    axes: impl FnOnce() -> Result<Vec<ExternalAxis>, Status>,
    settings: Option<&SettingsPlain>,
    placer: Option<&mut *mut PlacerHandle>,
) -> Result<(), Status> {
    let placer = placer.ok_or(NULL_POINTER)?;
    *placer = std::ptr::null_mut();
    let calibration = calibration.ok_or(NULL_POINTER)?;
    let known = PlacerCalibration { axes: axes()?, ..calibration.calibration()? };
    let settings = settings.ok_or(NULL_POINTER)?.settings()?;
    let made = Placer::new(&known, &settings).map_err(|_| BAD_SETTING)?;
    *placer = Box::into_raw(Box::new(PlacerHandle { placer: made, sensor: calibration.sensor }));
    Ok(())
}

/// Frees a placer; null is allowed.
///
/// # Safety
/// `placer` is null or was made by [`trueline_placer_new`] and not freed yet; no other thread uses it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn trueline_placer_free(placer: *mut PlacerHandle) {
    if placer.is_null() {
        return;
    }
    guarded(|| {
        // SAFETY: it came from `Box::into_raw` in `trueline_placer_new`, and the caller frees it once.
        drop(unsafe { Box::from_raw(placer) });
        Ok(())
    });
}

/// Takes a pose.
///
/// # Safety
/// `placer` is null or a live handle that no other thread uses; `base_from_tool` is null or leads to a pose.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn trueline_placer_push_pose(
    placer: *mut PlacerHandle,
    stamp_ns: i64,
    base_from_tool: *const PosePlain,
) -> Status {
    guarded(|| {
        // SAFETY: the caller's part: a live handle that nobody else uses, and a pose, wherever they are not null.
        let (placer, pose) = unsafe { (placer.as_mut(), base_from_tool.as_ref()) };
        let (placer, pose) = placer.zip(pose).ok_or(NULL_POINTER)?;
        placer.placer.push_pose(stamp_ns, &pose.pose()?).map_err(status::of_pose)
    })
}

/// Places points.
///
/// # Safety
/// `placer` is null or a live handle that no other thread uses. `points` points to `count` points of 2 or 3
/// numbers as the sensor reports them, and `base_points_m` to 3 `count` numbers. `sigma_m` points to `count`
/// numbers that may be written and do not overlap `points`. Each may be null. `placed` is null or may be
/// written.
#[unsafe(no_mangle)]
#[allow(clippy::too_many_arguments, reason = "C has no slices: each is a pointer and shares the count")]
pub unsafe extern "C" fn trueline_placer_place(
    placer: *mut PlacerHandle,
    stamp_ns: i64,
    points: *const f64,
    count: usize,
    base_points_m: *mut f64,
    sigma_m: *mut f64,
    placed: *mut PlacedPlain,
) -> Status {
    guarded(|| {
        // SAFETY: the caller's part, for what is not null.
        let placer = unsafe { placer.as_mut() }.ok_or(NULL_POINTER)?;
        // SAFETY: likewise; the arrays are not written through each other. An array of [f64; N] is laid out as N times as many f64.
        let (base_points, sigma_m) =
            unsafe { (parts_mut(base_points_m.cast::<[f64; 3]>(), count)?, parts_mut(sigma_m, count)?) };
        let points = match placer.sensor {
            // SAFETY: as above; these are only read.
            0 => Points::Profile(unsafe { parts(points.cast::<[f64; 2]>(), count)? }),
            // SAFETY: as above.
            1 => Points::Pixels(unsafe { parts(points.cast::<[f64; 2]>(), count)? }),
            // SAFETY: as above.
            2 => Points::Camera(unsafe { parts(points.cast::<[f64; 3]>(), count)? }),
            _ => return Err(OTHER_SENSOR),
        };
        let told = placer.placer.place(stamp_ns, points, base_points, sigma_m).map_err(status::of_place)?;
        // SAFETY: the caller's part; null is allowed here.
        if let Some(placed) = unsafe { placed.as_mut() } {
            *placed = told.into();
        }
        Ok(())
    })
}

/// Returns the state of both streams.
///
/// # Safety
/// `placer` is null or a live handle that no other thread uses; `health` is null or may be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn trueline_placer_health(
    placer: *const PlacerHandle,
    now_ns: i64,
    health: *mut HealthPlain,
) -> Status {
    guarded(|| {
        // SAFETY: the caller's part, for what is not null.
        let (placer, health) = unsafe { (placer.as_ref(), health.as_mut()) };
        let (placer, health) = placer.zip(health).ok_or(NULL_POINTER)?;
        *health = placer.placer.health(now_ns).into();
        Ok(())
    })
}

/// No array is longer than this, in elements.
fn is_too_long<T>(count: usize) -> bool {
    count > isize::MAX as usize / size_of::<T>()
}

/// A slice; an empty one may be null.
///
/// # Safety
/// `first` points to `count` elements that nothing writes meanwhile, unless it is null.
pub(crate) unsafe fn parts<'a, T>(first: *const T, count: usize) -> Result<&'a [T], Status> {
    match () {
        () if count == 0 => Ok(&[]),
        () if first.is_null() || !first.is_aligned() || is_too_long::<T>(count) => Err(NULL_POINTER),
        // SAFETY: it is aligned and not null, no longer than an allocation can be, and leads to so many elements by the caller's part.
        () => Ok(unsafe { std::slice::from_raw_parts(first, count) }),
    }
}

/// A slice that may be written; an empty one may be null.
///
/// # Safety
/// `first` points to `count` elements that nothing else uses meanwhile, unless it is null.
unsafe fn parts_mut<'a, T>(first: *mut T, count: usize) -> Result<&'a mut [T], Status> {
    match () {
        () if count == 0 => Ok(&mut []),
        () if first.is_null() || !first.is_aligned() || is_too_long::<T>(count) => Err(NULL_POINTER),
        // SAFETY: as in `parts`, and nobody else uses it by the caller's part.
        () => Ok(unsafe { std::slice::from_raw_parts_mut(first, count) }),
    }
}
