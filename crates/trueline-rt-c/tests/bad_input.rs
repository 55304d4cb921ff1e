//! Poses that end, stamps that jump and numbers that are none, through the functions of the header: a status for each, and no wrong point with a
//! small ±.
#![allow(unsafe_code, reason = "the functions of the header are called as C calls them")]
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::mem::MaybeUninit;
use std::ptr::{from_mut, from_ref, null_mut};
use trueline_rt_c::*;

const PERIOD_NS: i64 = 4_000_000;
/// Poses of the stream: 0.8 s.
const POSES: i64 = 200;

const STILL: PosePlain = PosePlain { translation_m: [0.0; 3], rotation_wxyz: [1.0, 0.0, 0.0, 0.0] };

fn calibration() -> CalibrationPlain {
    let mut covariance = [0.0; 49];
    (0..7).for_each(|k| covariance[8 * k] = 1e-8);
    CalibrationPlain {
        sensor: 0,
        carrier: 0,
        has_plane: 0,
        has_shape: 0,
        image_size_px: [0; 2],
        focal_px: [0.0; 2],
        centre_px: [0.0; 2],
        distortion: [0.0; 5],
        plane_normal: [0.0; 3],
        plane_offset_m: 0.0,
        shape_h: [0.0; 5],
        shape_origin_m: [0.0; 2],
        tool_from_camera: STILL,
        time_offset_s: 0.010,
        covariance,
        reading_sigma_m: 2e-5,
    }
}

/// A placer that owns its handle.
struct Placer(*mut PlacerHandle);

impl Placer {
    fn new(calibration: &CalibrationPlain) -> Result<Self, i32> {
        let (mut handle, mut settings) = (null_mut(), MaybeUninit::uninit());
        // SAFETY: the settings are written before they are read; a calibration, and a place for the handle.
        let status = unsafe {
            assert_eq!(trueline_settings_default(settings.as_mut_ptr()), status::OK);
            trueline_placer_new(calibration, settings.as_ptr(), from_mut(&mut handle))
        };
        if status == status::OK { Ok(Self(handle)) } else { Err(status) }
    }

    /// One that has heard of a tool that goes along x at 0.1 m/s.
    fn heard() -> Self {
        let placer = Self::new(&calibration()).unwrap();
        (0..POSES).for_each(|k| assert_eq!(placer.push(k * PERIOD_NS, &pose(k)), status::OK));
        placer
    }

    fn push(&self, stamp_ns: i64, pose: &PosePlain) -> i32 {
        // SAFETY: a live handle of this thread, and a pose.
        unsafe { trueline_placer_push_pose(self.0, stamp_ns, from_ref(pose)) }
    }

    /// The status, and of two readings the x in base (m) and the ±.
    fn place(&self, stamp_ns: i64, readings: [[f64; 2]; 2]) -> (i32, [f64; 2], [f64; 2]) {
        let (mut base, mut sigma) = ([[7.0; 3]; 2], [0.0; 2]);
        // SAFETY: a live handle of this thread, and two points in and out.
        let status = unsafe {
            let (base, sigma) = (base.as_mut_ptr().cast(), sigma.as_mut_ptr());
            trueline_placer_place(self.0, stamp_ns, readings.as_ptr().cast(), 2, base, sigma, null_mut())
        };
        (status, base.map(|point| point[0]), sigma)
    }
}

impl Drop for Placer {
    fn drop(&mut self) {
        // SAFETY: the handle is freed once.
        unsafe { trueline_placer_free(self.0) }
    }
}

fn pose(k: i64) -> PosePlain {
    PosePlain { translation_m: [0.1 * (k * PERIOD_NS) as f64 * 1e-9, 0.0, 0.0], ..STILL }
}

const READINGS: [[f64; 2]; 2] = [[0.0, 0.2], [0.001, 0.2]];

fn is_flagged((base, sigma): ([f64; 2], [f64; 2])) -> bool {
    base.iter().all(|x| x.is_nan()) && sigma.iter().all(|sigma_m| *sigma_m == f64::INFINITY)
}

#[test]
fn poses_that_end_are_refused_and_their_points_flagged() {
    let placer = Placer::heard();
    let (status, base, _) = placer.place(400_000_000, READINGS);
    assert_eq!(status, status::OK);
    // 0.1 m/s for 390 ms.
    assert!((base[0] - 0.039).abs() < 1e-9, "{base:?}");
    let (status, base, sigma) = placer.place(900_000_000, READINGS);
    assert_eq!(status, status::POSES_ENDED);
    assert!(is_flagged((base, sigma)));
}

#[test]
fn a_point_that_is_no_number_is_flagged_alone() {
    let (status, base, sigma) = Placer::heard().place(400_000_000, [[f64::NAN, 0.2], [0.001, 0.2]]);
    assert_eq!(status, status::OK);
    assert!(base[0].is_nan() && sigma[0] == f64::INFINITY);
    assert!((base[1] - 0.040).abs() < 1e-9 && sigma[1] < 1e-3);
}

#[test]
fn poses_that_are_none_are_refused_and_the_stream_goes_on() {
    let placer = Placer::heard();
    let at_ns = POSES * PERIOD_NS;
    for bad in [
        PosePlain { translation_m: [f64::NAN, 0.0, 0.0], ..STILL },
        PosePlain { translation_m: [f64::INFINITY, 0.0, 0.0], ..STILL },
        PosePlain { rotation_wxyz: [0.0; 4], ..STILL },
        PosePlain { rotation_wxyz: [f64::NAN, 0.0, 0.0, 1.0], ..STILL },
    ] {
        assert_eq!(placer.push(at_ns, &bad), status::NOT_FINITE, "{bad:?}");
    }
    assert_eq!(placer.push(at_ns - PERIOD_NS, &STILL), status::NOT_LATER);
    assert_eq!(placer.push(at_ns, &pose(POSES)), status::OK);
    assert_eq!(placer.place(at_ns, READINGS).0, status::OK);
}

#[test]
fn a_clock_that_goes_back_begins_anew() {
    let placer = Placer::heard();
    let back_ns = -3_600_000_000_000;
    assert_eq!(placer.push(back_ns, &pose(0)), status::CLOCK_WENT_BACK);
    // The poses before are of another clock.
    let (status, base, sigma) = placer.place(400_000_000, READINGS);
    assert_ne!(status, status::OK);
    assert!(is_flagged((base, sigma)));
    (1..POSES).for_each(|k| assert_eq!(placer.push(back_ns + k * PERIOD_NS, &pose(k)), status::OK));
    let (status, base, _) = placer.place(back_ns + 400_000_000, READINGS);
    assert_eq!(status, status::OK);
    assert!((base[0] - 0.039).abs() < 1e-9, "{base:?}");
}

#[test]
fn a_frame_before_all_poses_or_beyond_every_clock_is_refused() {
    let placer = Placer::heard();
    for stamp_ns in [-1_000_000_000, i64::MIN, i64::MAX] {
        let (status, base, sigma) = placer.place(stamp_ns, READINGS);
        assert!(status != status::OK && is_flagged((base, sigma)), "{stamp_ns}: {status}");
    }
}

#[test]
fn a_calibration_with_a_number_that_is_none_is_refused() {
    let spoil: [fn(&mut CalibrationPlain); 5] = [
        |calibration| calibration.time_offset_s = f64::NAN,
        |calibration| calibration.covariance[0] = f64::INFINITY,
        |calibration| calibration.reading_sigma_m = -1.0,
        |calibration| calibration.tool_from_camera.translation_m[2] = f64::NAN,
        |calibration| calibration.sensor = 9,
    ];
    for spoil in spoil {
        let mut calibration = calibration();
        spoil(&mut calibration);
        assert_eq!(Placer::new(&calibration).err(), Some(status::BAD_SETTING), "{calibration:?}");
    }
}

#[test]
fn a_seam_track_refuses_numbers_that_are_none() {
    let (mut track, mut settings, mut target) = (null_mut(), MaybeUninit::uninit(), MaybeUninit::uninit());
    // SAFETY: the settings are written before they are read; live handles, points and poses; the target is not read.
    unsafe {
        assert_eq!(trueline_track_settings_default(settings.as_mut_ptr()), status::OK);
        assert_eq!(trueline_seam_track_new(settings.as_ptr(), from_mut(&mut track)), status::OK);
        assert_eq!(trueline_seam_track_push(track, [f64::NAN, 0.0, 0.0].as_ptr(), 1e-5), status::NOT_FINITE);
        assert_eq!(trueline_seam_track_push(track, [0.0; 3].as_ptr(), -1.0), status::NOT_FINITE);
        let mut ahead = |speed| trueline_seam_track_ahead(track, &STILL, speed, 0.08, target.as_mut_ptr());
        assert_eq!(ahead(0.02), status::NO_SEAM);
        for k in 0..100 {
            let point = [0.001 * f64::from(k), 0.0, 0.0];
            assert_eq!(trueline_seam_track_push(track, point.as_ptr(), 2e-5), status::OK);
        }
        assert_eq!(ahead(f64::NAN), status::NOT_FINITE);
        // Beyond the seam.
        assert_eq!(ahead(10.0), status::NO_SEAM);
        trueline_seam_track_free(track);
    }
}
