//! The functions about a seam track.

use crate::plain::{PosePlain, TargetPlain, TrackSettingsPlain};
use crate::status::{self, BAD_SETTING, NULL_POINTER, Status, guarded};
use nalgebra::Vector3;
use trueline_rt::{SeamTrack, TrackSettings};

/// Writes the default settings.
///
/// # Safety
/// `settings` is null or leads to a `trueline_track_settings` that may be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn trueline_track_settings_default(settings: *mut TrackSettingsPlain) -> Status {
    guarded(|| {
        // SAFETY: the caller's part is that a pointer that is not null leads to a struct that may be written.
        let settings = unsafe { settings.as_mut() }.ok_or(NULL_POINTER)?;
        *settings = TrackSettingsPlain::of(&TrackSettings::default());
        Ok(())
    })
}

/// Makes a track; it must be freed by [`trueline_seam_track_free`].
///
/// # Safety
/// Each pointer is null or points to its type; `track` may be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn trueline_seam_track_new(
    settings: *const TrackSettingsPlain,
    track: *mut *mut SeamTrack,
) -> Status {
    guarded(|| {
        // SAFETY: the caller's part, for each that is not null; they are of different types.
        let (settings, track) = unsafe { (settings.as_ref(), track.as_mut()) };
        let track = track.ok_or(NULL_POINTER)?;
        *track = std::ptr::null_mut();
        let made = SeamTrack::new(&settings.ok_or(NULL_POINTER)?.settings()).map_err(|_| BAD_SETTING)?;
        *track = Box::into_raw(Box::new(made));
        Ok(())
    })
}

/// Frees a track; null is allowed.
///
/// # Safety
/// `track` is null or was made by [`trueline_seam_track_new`] and not freed yet; no other thread uses it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn trueline_seam_track_free(track: *mut SeamTrack) {
    if track.is_null() {
        return;
    }
    guarded(|| {
        // SAFETY: it came from `Box::into_raw` in `trueline_seam_track_new`, and the caller frees it once.
        drop(unsafe { Box::from_raw(track) });
        Ok(())
    });
}

/// Forgets all points.
///
/// # Safety
/// `track` is null or a live handle that no other thread uses.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn trueline_seam_track_clear(track: *mut SeamTrack) -> Status {
    guarded(|| {
        // SAFETY: the caller's part: a live handle that nobody else uses, if it is not null.
        unsafe { track.as_mut() }.ok_or(NULL_POINTER)?.clear();
        Ok(())
    })
}

/// Takes a seam point.
///
/// # Safety
/// `track` is null or a live handle that no other thread uses; `point_m` is null or leads to 3 numbers.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn trueline_seam_track_push(
    track: *mut SeamTrack,
    point_m: *const f64,
    sigma_m: f64,
) -> Status {
    guarded(|| {
        // SAFETY: the caller's part, for what is not null; an array of [f64; 3] is laid out as three f64.
        let (track, point) = unsafe { (track.as_mut(), point_m.cast::<[f64; 3]>().as_ref()) };
        let (track, point) = track.zip(point).ok_or(NULL_POINTER)?;
        track.push(&Vector3::from(*point), sigma_m).map_err(status::of_seam_point)
    })
}

/// Returns the target of the torch.
///
/// # Safety
/// `track` is null or a live handle that no other thread uses. `base_from_torch` is null or points to a pose.
/// `target` is null or may be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn trueline_seam_track_ahead(
    track: *const SeamTrack,
    base_from_torch: *const PosePlain,
    speed_m_s: f64,
    delay_s: f64,
    target: *mut TargetPlain,
) -> Status {
    guarded(|| {
        // SAFETY: the caller's part, for what is not null; they are of different types.
        let (track, pose, target) = unsafe { (track.as_ref(), base_from_torch.as_ref(), target.as_mut()) };
        let (track, pose, target) = track
            .zip(pose)
            .zip(target)
            .map(|((track, pose), target)| (track, pose, target))
            .ok_or(NULL_POINTER)?;
        *target = track.ahead(&pose.pose()?, speed_m_s, delay_s).map_err(status::of_ahead)?.into();
        Ok(())
    })
}
