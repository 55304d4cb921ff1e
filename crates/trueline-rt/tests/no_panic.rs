//! For any input, nothing panics, and a placed point is finite with a ± above zero, or NaN with an infinite one.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod cell;

use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use proptest::prelude::*;
use trueline_geometry::{Axis, AxisKind, Pose, se3};
use trueline_rt::{
    AxisCarries, ExternalAxis, Placer, PlacerCalibration, Points, Readout, SeamTrack, Settings, StampRule,
    TrackSettings,
};

#[derive(Clone, Debug)]
enum Step {
    Pose(i64, [f64; 7]),
    Next(i64),
    Axis(i64, f64),
    Frame(i64, Vec<[f64; 2]>),
    FrameNow(i64),
}

/// Any number at all, and those of a robot more often.
fn number() -> impl Strategy<Value = f64> {
    prop_oneof![4 => -1.0..1.0_f64, 1 => any::<f64>()]
}

fn step() -> impl Strategy<Value = Step> {
    prop_oneof![
        1 => (any::<i64>(), prop::array::uniform7(number())).prop_map(|(stamp, pose)| Step::Pose(stamp, pose)),
        20 => prop_oneof![10 => Just(4_000_000), 1 => -10_000_000..100_000_000_i64].prop_map(Step::Next),
        1 => (any::<i64>(), prop::collection::vec(prop::array::uniform2(number()), 0..5))
            .prop_map(|(stamp, points)| Step::Frame(stamp, points)),
        4 => (-50_000_000..50_000_000_i64).prop_map(Step::FrameNow),
        20 => (prop_oneof![10 => 0..4_000_000_i64, 1 => any::<i64>()], number())
            .prop_map(|(after_ns, value)| Step::Axis(after_ns, value)),
    ]
}

fn settings() -> impl Strategy<Value = Settings> {
    let rule = || prop_oneof![Just(StampRule::AsStamped), Just(StampRule::LowerEnvelope)];
    let readout = prop_oneof![Just(Readout::AtOnce), (-1e-3..1e-3_f64).prop_map(Readout::ByIndex)];
    (rule(), rule(), rule(), readout).prop_map(|(pose_stamps, frame_stamps, axis_stamps, readout)| Settings {
        pose_stamps,
        frame_stamps,
        axis_stamps,
        readout,
        poses_kept: 64,
        ..Settings::default()
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn a_placer_survives_anything(
        settings in settings(),
        with_axis in any::<bool>(),
        steps in prop::collection::vec(step(), 0..400),
    ) {
        let axis = Axis::new(AxisKind::Rotary, Vector3::z_axis(), Vector3::new(0.8, 0.1, 0.0));
        let covariance = ExternalAxis::covariance_of(1e-4, 1e-4, 0.0, 1e-4);
        let axis = ExternalAxis { axis, carries: AxisCarries::Part, in_pose: None, covariance };
        let axes = if with_axis { vec![axis] } else { Vec::new() };
        let calibration = PlacerCalibration { axes, ..cell::calibration(0.01) };
        let mut placer = Placer::new(&calibration, &settings).unwrap();
        let (mut base, mut sigmas) = ([[0.0; 3]; 8], [0.0; 8]);
        let mut now_ns = 0_i64;
        for step in steps {
            let (stamp_ns, points) = match step {
                Step::Pose(stamp_ns, [x, y, z, qw, qx, qy, qz]) => {
                    let rotation = UnitQuaternion::new_unchecked(Quaternion::new(qw, qx, qy, qz));
                    let _ = placer.push_pose(stamp_ns, &se3::from_parts(rotation, Vector3::new(x, y, z)));
                    continue;
                }
                Step::Axis(after_ns, value) => {
                    let _ = placer.push_axis(0, now_ns.saturating_add(after_ns), value);
                    continue;
                }
                Step::Next(after_ns) => {
                    now_ns += after_ns;
                    let _ = placer.push_pose(now_ns, &Pose::translation(now_ns as f64 * 1e-10, 0.0, 0.0));
                    continue;
                }
                Step::Frame(stamp_ns, points) => (stamp_ns, points),
                Step::FrameNow(after_ns) => (now_ns + after_ns, vec![[0.0, 0.2]; 3]),
            };
            let told = placer.place(stamp_ns, Points::Profile(&points), &mut base, &mut sigmas);
            for (point, sigma_m) in base.iter().zip(&sigmas).take(points.len()) {
                let is_placed = point.iter().all(|number| number.is_finite()) && *sigma_m > 0.0 && sigma_m.is_finite();
                let is_flagged = point.iter().all(|number| number.is_nan()) && *sigma_m == f64::INFINITY;
                prop_assert!(is_placed != is_flagged);
                prop_assert!(told.is_ok() || is_flagged);
            }
            std::hint::black_box((placer.health(stamp_ns), placer.axis_health(0, stamp_ns)));
        }
    }

    #[test]
    fn a_track_survives_anything(
        points in prop::collection::vec((prop::array::uniform3(number()), number()), 0..200),
        asked in prop::collection::vec((prop::array::uniform3(number()), number(), number()), 1..5),
    ) {
        let mut track = SeamTrack::new(&TrackSettings { points_kept: 64, ..TrackSettings::default() }).unwrap();
        for (k, (point, sigma_m)) in points.into_iter().enumerate() {
            let along = Vector3::x() * (1e-3 * k as f64);
            let _ = track.push(&(along + Vector3::from(point) * 1e-4), sigma_m);
            let _ = track.push(&Vector3::from(point), sigma_m);
        }
        for ([x, y, z], speed_m_s, delay_s) in asked {
            if let Ok(target) = track.ahead(&Pose::translation(x, y, z), speed_m_s, delay_s) {
                prop_assert!(target.sigma_m >= 0.0);
                prop_assert!(target.base_from_torch.translation.vector.iter().all(|number| number.is_finite()));
            }
        }
    }
}
