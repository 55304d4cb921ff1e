//! Paths against their limits, with exact figures: the largest values of a path, the room that it needs, the fastest start,
//! the limits derived from it, and the part of all this shown to the person who allows it.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

mod common;

use common::limits;
use nalgebra::{UnitQuaternion, Vector3};
use trueline_dataset::RobotSample;
use trueline_geometry::{Pose, so3};
use trueline_live::motion::{CheckedPath, MotionLimits, PathError, PathState, PathSummary, derive_limits};

fn down() -> UnitQuaternion<f64> {
    so3::exp(&Vector3::new(std::f64::consts::PI, 0.0, 0.0))
}

/// Poses a second apart, from places and turns in the tool.
fn path(count: i32, at: impl Fn(f64) -> (Vector3<f64>, Vector3<f64>)) -> Vec<RobotSample> {
    (0..count)
        .map(|k| {
            let (place, turn) = at(f64::from(k));
            RobotSample {
                stamp_ns: 5_000_000_000 + i64::from(k) * 1_000_000_000,
                device_ns: None,
                base_from_tool: Pose::from_parts(place.into(), down() * so3::exp(&turn)),
            }
        })
        .collect()
}

/// 0.05 rad/s + 0.05 rad/s² about the tool's z axis, for 3 s.
fn turn(t: f64) -> Vector3<f64> {
    Vector3::z() * (0.05 * t + 0.025 * t * t)
}

/// Parabolas, which the splines reproduce: 20 mm/s + 20 mm/s² along x, and the turn.
fn parabola() -> Vec<RobotSample> {
    path(4, |t| (Vector3::new(0.8 + 0.02 * t + 0.01 * t * t, 0.0, 0.6), turn(t)))
}

fn resting() -> Vec<RobotSample> {
    path(4, |_| (Vector3::new(0.8, 0.0, 0.6), Vector3::zeros()))
}

fn checked(change: impl FnOnce(&mut MotionLimits)) -> Result<CheckedPath, PathError> {
    let mut limits = limits();
    change(&mut limits);
    CheckedPath::new(&parabola(), 1.0, &limits)
}

fn near(found: f64, wanted: f64) {
    assert!((found - wanted).abs() <= 1e-9 * wanted.abs().max(1e-2), "{found} is not {wanted}");
}

#[test]
fn a_path_reaches_what_it_reaches() {
    let most = checked(|_| {}).unwrap().extremes();
    near(most.speed_m_s, 0.08);
    near(most.acceleration_m_s2, 0.02);
    near(most.jerk_m_s3, 0.0);
    near(most.turn_rad_s, 0.2);
    // w'' + w'².
    near(most.turn_acceleration_rad_s2, 0.05 + 0.04);
    // |v| + |ω|·300 mm at the end; and h²/8 of the bound of (v, ω·300 mm)'': (1.5·0.2·0.05 + 0.5·0.2³)·300 mm.
    near(most.tip_m_s, 0.08 + 0.06 + 0.3 * (0.015 + 0.004) / 8.0);
    // At half the pace speeds are halved, accelerations a quarter.
    let slow = CheckedPath::new(&parabola(), 0.5, &limits()).unwrap();
    near(slow.duration_s(), 6.0);
    near(slow.extremes().speed_m_s, 0.04);
    near(slow.extremes().acceleration_m_s2, 0.005);
    near(slow.extremes().turn_acceleration_rad_s2, 0.0125 + 0.01);
}

#[test]
fn on_the_way_the_reference_is_the_path_at_the_rate_of_the_motion() {
    let path = checked(|_| {}).unwrap();
    let at = path.at(1.5);
    near(at.base_from_tool.translation.vector.x, 0.8 + 0.03 + 0.0225);
    near(at.velocity_m_s.x, 0.05);
    // The tool looks down: about its z axis is about −z of the base.
    near(at.angular_velocity_rad_s.z, -0.125);
    assert!(at.base_from_tool.rotation.angle_to(&(down() * so3::exp(&turn(1.5)))) < 1e-7);
    let along = path.along(&PathState { path_s: 1.5, asked: 1.0, rate: 0.25 });
    assert_eq!(along.base_from_tool, at.base_from_tool);
    near(along.velocity_m_s.x, 0.0125);
    near(along.angular_velocity_rad_s.z, -0.03125);
}

#[test]
fn the_room_about_a_path_is_where_the_scan_may_begin_and_what_bends_between_poses() {
    // 10 mm and h²/8 of 20 mm/s²: 12.5 mm beyond the end at 950 mm.
    assert!(checked(|l| l.box_m[1].x = 0.9626).is_ok());
    let Err(PathError::OutsideBox { at_s, at_m, margin_m }) = checked(|l| l.box_m[1].x = 0.9624) else {
        panic!("it is outside")
    };
    near(at_s, 3.0);
    near(at_m[0], 0.95);
    near(margin_m, 0.0125);
    assert!(checked(|l| l.box_m[0].z = 0.5874).is_ok() && checked(|l| l.box_m[0].z = 0.5876).is_err());
    // 0.05 rad and half a second of 0.2 rad/s.
    assert!(checked(|l| l.cone_rad = 0.1501).is_ok());
    let Err(PathError::OutsideCone { lean_rad, margin_rad, cone_rad, .. }) = checked(|l| l.cone_rad = 0.1499)
    else {
        panic!("it is outside")
    };
    assert!(lean_rad.abs() < 1e-7 && cone_rad == 0.1499);
    near(margin_rad, 0.15);
}

#[test]
fn the_limit_that_is_passed_by_most_is_named_in_its_units() {
    let refused = |change: fn(&mut MotionLimits), wanted: (f64, &str, f64, f64, &str)| match checked(change) {
        Err(PathError::TooMuch { at_s, what, found, limit, unit }) => {
            near(at_s, wanted.0);
            near(found, wanted.2);
            near(limit, wanted.3);
            assert_eq!((what, unit), (wanted.1, wanted.4));
        }
        other => panic!("{other:?}"),
    };
    let degrees = f64::to_degrees;
    refused(|l| l.speed_m_s = 0.05, (2.0, "the speed", 80.0, 50.0, "mm/s"));
    refused(|l| l.turn_rad_s = 0.1, (2.0, "the angular speed", degrees(0.2), degrees(0.1), "°/s"));
    refused(
        |l| l.turn_acceleration_rad_s2 = 0.08,
        (2.0, "the angular acceleration", degrees(0.09), degrees(0.08), "°/s²"),
    );
    // The greatest multiple of its limit, not the first or the last.
    refused(
        |l| (l.speed_m_s, l.turn_rad_s, l.turn_acceleration_rad_s2) = (0.05, 0.05, 0.08),
        (2.0, "the angular speed", degrees(0.2), degrees(0.05), "°/s"),
    );
    // A hair above what it reaches it is within its limits.
    assert!(checked(|l| (l.speed_m_s, l.turn_rad_s) = (0.08 + 1e-9, 0.2 + 1e-9)).is_ok());
}

#[test]
fn a_motion_begins_as_briskly_as_its_limits_leave_free() {
    let slope = |change: &dyn Fn(&mut MotionLimits)| checked(change).map(|path| path.ramp().slope_per_s);
    near(slope(&|_| {}).unwrap(), 2.0);
    // Of a rate r with |r'| ≤ ρ, places and turns: p''r² + p'r'.
    near(slope(&|l| l.acceleration_m_s2 = 0.02 + 1.2 * 0.08).unwrap(), 1.2);
    near(slope(&|l| l.turn_acceleration_rad_s2 = 0.09 + 1.3 * 0.2).unwrap(), 1.3);
    // Third derivative of p: p'''r³ + 3 p''r r' + p'r'', |r''| ≤ 2ρ/0.1 s.
    near(slope(&|l| l.jerk_m_s3 = 0.7 * (3.0 * 0.02 + 0.08 * 20.0)).unwrap(), 0.7);
    // Two limits at once: the tighter one.
    let both = |l: &mut MotionLimits| (l.acceleration_m_s2, l.jerk_m_s3) = (0.02 + 1.2 * 0.08, 0.7 * 1.66);
    near(slope(&both).unwrap(), 0.7);
    near(slope(&|l| l.acceleration_m_s2 = 0.02 + 0.501 * 0.08).unwrap(), 0.501);
    let refused = slope(&|l| l.acceleration_m_s2 = 0.02 + 0.4 * 0.08);
    let Err(PathError::NoRoomToStop { stop_s }) = refused else { panic!("{refused:?}") };
    near(stop_s, 2.5);
    // Rest uses nothing of any limit.
    near(CheckedPath::new(&resting(), 1.0, &limits()).unwrap().ramp().slope_per_s, 2.0);
}

#[test]
fn poses_need_rising_times_and_attitudes_that_follow_each_other() {
    let short = CheckedPath::new(&parabola()[..1], 1.0, &limits());
    assert!(matches!(short, Err(PathError::TooShort { poses: 1 })), "{short:?}");
    assert!(CheckedPath::new(&parabola()[..2], 1.0, &limits()).is_ok());
    let mut stands = parabola();
    stands[2].stamp_ns = stands[1].stamp_ns;
    let refused = CheckedPath::new(&stands, 0.5, &limits());
    let Err(PathError::TimeStands { at_s }) = refused else { panic!("{refused:?}") };
    near(at_s, 2.0);
    let wide = MotionLimits {
        cone_rad: 4.0,
        reach_m: 0.01,
        turn_rad_s: 9.0,
        turn_acceleration_rad_s2: 90.0,
        ..limits()
    };
    let stepping = |steps: &[f64]| {
        let turned = |t: f64| steps[..t as usize].iter().sum::<f64>();
        let at = |t: f64| (Vector3::new(1.0, 0.0, 0.6), Vector3::z() * turned(t));
        CheckedPath::new(&path(steps.len() as i32 + 1, at), 1.0, &wide)
    };
    let jumps = |steps: &[f64]| match stepping(steps) {
        Err(PathError::Attitude { at_s }) => at_s,
        other => panic!("{other:?}"),
    };
    assert!(stepping(&[0.1, 0.499, -0.499]).is_ok(), "0.5 rad from pose to pose");
    near(jumps(&[0.1, 0.501, 0.1]), 2.0);
    assert!(stepping(&[0.4, 0.4, 0.4, 0.4, 0.399]).is_ok(), "2 rad from the first");
    near(jumps(&[0.4, 0.4, 0.4, 0.4, 0.401]), 5.0);
}

#[test]
fn derived_limits_are_a_tenth_above_the_path_with_room_for_the_start() {
    let l = derive_limits::limits_for(&parabola(), 1.0, 0.3).unwrap();
    let room = Vector3::repeat(0.025);
    assert!((l.box_m[0] - (Vector3::new(0.8, 0.0, 0.6) - room)).norm() < 1e-12);
    assert!((l.box_m[1] - (Vector3::new(0.95, 0.0, 0.6) + room)).norm() < 1e-12);
    assert!((l.tool_axis.into_inner() + Vector3::z()).norm() < 1e-12);
    // An angle of zero is known to the root of the rounding.
    assert!((l.cone_rad - (2.0_f64.to_radians() + 0.05)).abs() < 1e-7);
    near(l.reach_m, 0.3);
    near(l.speed_m_s, 1.1 * 0.08);
    near(l.acceleration_m_s2, 1.1 * (0.02 + 2.0 * 0.08));
    near(l.jerk_m_s3, 1.1 * 2.0 * (3.0 * 0.02 + 2.0 * 0.08 / 0.1));
    near(l.turn_rad_s, 1.1 * 0.2);
    near(l.turn_acceleration_rad_s2, 1.1 * (0.09 + 2.0 * 0.2));
    near(l.start_m, 0.005);
    near(l.start_rad, 2.0_f64.to_radians());
    near(l.deviation_m, 0.015);
    near(l.deviation_rad, 5.0_f64.to_radians());
    // The cap at the tip holds for turning alone: 0.24 m/s at 1.2 m, and a tenth above is too much.
    let turning = path(4, |t| (Vector3::new(0.8, 0.0, 0.6), turn(t)));
    near(derive_limits::limits_for(&turning, 1.0, 1.2).unwrap().turn_rad_s, 0.25 / 1.2);
    // Leaning by 0.1 rad to both sides of the middle.
    let leaning = path(3, |t| (Vector3::new(1.0, 0.0, 0.6), Vector3::x() * (0.1 * t)));
    let l = derive_limits::limits_for(&leaning, 1.0, 0.3).unwrap();
    near(l.cone_rad, 0.1 + 2.0_f64.to_radians() + 0.05);
    assert!((l.tool_axis.into_inner() - leaning[1].base_from_tool.rotation * Vector3::z()).norm() < 1e-12);
    let l = derive_limits::limits_for(&resting(), 1.0, 0.3).unwrap();
    near(l.speed_m_s, 1e-3);
    near(l.acceleration_m_s2, 0.01);
    near(l.jerk_m_s3, 0.1);
    near(l.turn_rad_s, 0.01);
    near(l.turn_acceleration_rad_s2, 0.011);
}

#[test]
fn whoever_allows_a_path_sees_it_beside_its_limits() {
    let (poses, limits) = (parabola(), limits());
    let path = CheckedPath::new(&poses, 1.0, &limits).unwrap();
    let shown = PathSummary { path: &path, poses: &poses, limits: &limits, pace: 1.0 }.to_string();
    let wanted = "Path of 4 poses, 3.0 s; 0.8 s to start, as many to stop
  begins at    x 800.0  y 0.0  z 600.0 mm
  x            800.0 to 950.0 mm, allowed 700.0 to 1300.0
  y            0.0 to 0.0 mm, allowed -200.0 to 200.0
  z            600.0 to 600.0 mm, allowed 400.0 to 800.0
  speed        up to 80.0 mm/s, allowed 120.0
  acceleration up to 20.0 mm/s², allowed 600.0
  jerk         up to 0.0 mm/s³, allowed 8000.0
  turning      up to 11.5 °/s, allowed 34.4
  turn change  up to 5.2 °/s², allowed 171.9
  at the tip   up to 140.7 mm/s, allowed 250.0: 300 mm from the tool's origin
";
    assert_eq!(shown, wanted);
    let slow = CheckedPath::new(&poses, 0.4, &limits).unwrap();
    let shown = PathSummary { path: &slow, poses: &poses, limits: &limits, pace: 0.4 }.to_string();
    assert!(shown.starts_with("Path of 4 poses, 7.5 s at 40 % of its pace; 0.8 s to start"), "{shown}");
}

#[test]
fn a_rest_on_the_way_that_may_be_taken_for_the_end_is_said() {
    // 20 mm/s or 1°/s, then 12 s of rest, then on.
    for (place, turn) in [(0.02, 0.0), (0.0, 1.0_f64.to_radians())] {
        let way = |t: f64| t.min(3.0) + (t - 15.0).max(0.0);
        let at = |t: f64| (Vector3::new(0.8 + place * way(t), 0.0, 0.6), Vector3::z() * (turn * way(t)));
        let (poses, limits) = (path(19, at), limits());
        let path = CheckedPath::new(&poses, 1.0, &limits).unwrap();
        let shown = PathSummary { path: &path, poses: &poses, limits: &limits, pace: 1.0 }.to_string();
        let rests_s = shown.split_once("it rests for ").unwrap().1.split_once(" s").unwrap().0;
        // A spline rings on for some poses on either side, by 0.27 from one to the next: 20 mm/s to 1 in three.
        let rests_s: f64 = rests_s.parse().unwrap();
        assert!((6.0..=10.0).contains(&rests_s), "{rests_s} s");
    }
}
