//! A part on a table, a robot on a track, a sensor on an axis of its own: points are in the frame of the part.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod cell;

use cell::{Noise, ns};
use nalgebra::{Point3, SVector, UnitVector3, Vector3};
use trueline_geometry::axis::AXIS;
use trueline_geometry::{Axis, AxisKind, Pose, se3, so3};
use trueline_rt::{
    AxisCarries, AxisError, AxisProblem, Carrier, ExternalAxis, PlaceError, Placer, PlacerCalibration,
    Points, Settings, StampRule,
};

/// Time between poses, s.
const POSE_S: f64 = 0.004;
/// Time between values of an axis, s.
const VALUE_S: f64 = 0.008;
/// How late the axes are stamped, s.
const AXIS_LATE_S: f64 = 0.031;
/// How late frames are stamped, s.
const FRAME_LATE_S: f64 = 0.017;
/// A swing of an axis, rad or m, and its frequency, Hz.
const SWING: [f64; 2] = [0.4, 0.25];

fn axis(kind: AxisKind, k: f64) -> Axis {
    let direction = UnitVector3::new_normalize(Vector3::new(k.sin(), (2.0 * k).cos(), 1.4));
    Axis {
        scale: 1.01,
        time_offset_s: AXIS_LATE_S,
        ..Axis::new(kind, direction, Vector3::new(0.3 + 0.1 * k, -0.2, 0.1))
    }
}

fn external(kind: AxisKind, carries: AxisCarries, k: f64) -> ExternalAxis {
    let covariance = ExternalAxis::covariance_of(0.0, 0.0, 0.0, 0.0);
    ExternalAxis { axis: axis(kind, k), carries, in_pose: None, covariance }
}

fn value(time_s: f64, k: usize) -> f64 {
    SWING[0] * (std::f64::consts::TAU * SWING[1] * time_s + k as f64).sin()
}

fn robot(time_s: f64) -> Pose {
    let turn = Vector3::new(0.2 * (1.1 * time_s).sin(), 2.5, 0.3 * (0.7 * time_s).cos());
    let place = Vector3::new(0.8 + 0.1 * time_s, 0.05 * (0.9 * time_s).sin(), 0.4);
    se3::from_parts(so3::exp(&turn), place)
}

fn calibration(axes: Vec<ExternalAxis>, carrier: Carrier) -> PlacerCalibration {
    PlacerCalibration {
        covariance: PlacerCalibration::covariance_of(0.0, 0.0, 0.0),
        reading_sigma_m: 0.0,
        carrier,
        axes,
        ..cell::calibration(FRAME_LATE_S)
    }
}

/// A placer that has heard poses and values up to a time, s.
fn heard(calibration: &PlacerCalibration, settings: &Settings, until_s: f64) -> Placer {
    let mut placer = Placer::new(calibration, settings).unwrap();
    for k in 0..(until_s / POSE_S) as usize {
        placer.push_pose(ns(POSE_S * k as f64), &robot(POSE_S * k as f64)).unwrap();
    }
    for axis in 0..calibration.axes.len() {
        for k in 0..(until_s / VALUE_S) as usize {
            let time_s = VALUE_S * k as f64;
            placer.push_axis(axis, ns(time_s + AXIS_LATE_S), value(time_s, axis)).unwrap();
        }
    }
    placer
}

fn place(placer: &mut Placer, exposed_s: f64, reading: [f64; 2]) -> Result<([f64; 3], f64), PlaceError> {
    let (mut base, mut sigma) = ([[0.0; 3]], [0.0]);
    placer.place(ns(exposed_s + FRAME_LATE_S), Points::Profile(&[reading]), &mut base, &mut sigma)?;
    Ok((base[0], sigma[0]))
}

const READING: [f64; 2] = [0.012, 0.24];

/// By the definition of the chain, each factor written out.
fn wanted(axes: &[ExternalAxis], carrier: Carrier, exposed_s: f64) -> Vector3<f64> {
    let motion = |k: usize, axis: &ExternalAxis| axis.axis.motion(value(exposed_s, k));
    let of = |carries: AxisCarries| {
        let own = axes.iter().enumerate().filter(move |(_, axis)| axis.carries == carries);
        own.fold(Pose::identity(), |product, (k, axis)| product * motion(k, axis))
    };
    let [part, track, sensor] = [AxisCarries::Part, AxisCarries::Robot, AxisCarries::Sensor].map(of);
    let carrier = match carrier {
        Carrier::Tool => part.inverse() * track * robot(exposed_s) * sensor,
        Carrier::Fixed => part.inverse() * robot(exposed_s).inverse() * track.inverse() * sensor,
    };
    (carrier * cell::tool_from_camera() * Point3::new(READING[0], 0.0, READING[1])).coords
}

fn all() -> Vec<ExternalAxis> {
    use AxisCarries::{Part, Robot, Sensor};
    use AxisKind::{Linear, Rotary};
    [(Rotary, Part), (Linear, Robot), (Rotary, Sensor), (Linear, Part), (Rotary, Robot), (Linear, Sensor)]
        .into_iter()
        .zip(1..)
        .map(|((kind, carries), k)| external(kind, carries, f64::from(k)))
        .collect()
}

/// Six axes of every kind, two on each carrier, in the order of the chain, with the sensor on the tool and next to the
/// robot.
#[test]
fn points_are_where_the_chain_of_axes_puts_them() {
    for carrier in [Carrier::Tool, Carrier::Fixed] {
        let axes = all();
        let mut placer = heard(&calibration(axes.clone(), carrier), &Settings::default(), 4.0);
        for exposed_s in [0.6, 1.2345, 2.8] {
            let (point, _) = place(&mut placer, exposed_s, READING).unwrap();
            let off_m = (Vector3::from(point) - wanted(&axes, carrier, exposed_s)).norm();
            // Cubic pieces of 8 ms: T³/12 of a third derivative of 1.55, 0.07 µ a value, six of them over levers of up to 1
            // m. Poses are joined straight: 4 ms of 0.4 rad/s² bend by 0.8 µrad.
            assert!(off_m < 3e-6, "{carrier:?} {exposed_s}: {off_m}");
        }
    }
}

/// A controller whose poses contain the track: with the axis as the controller has it nothing changes.
#[test]
fn an_axis_that_the_poses_contain_counts_once() {
    for carrier in [Carrier::Tool, Carrier::Fixed] {
        let mut axes = all();
        axes.iter_mut().for_each(|axis| axis.in_pose = Some(axis.axis));
        let mut placer = heard(&calibration(axes, carrier), &Settings::default(), 3.0);
        let mut alone = heard(&calibration(Vec::new(), carrier), &Settings::default(), 3.0);
        let [(with, _), (without, _)] = [&mut placer, &mut alone].map(|it| place(it, 1.5, READING).unwrap());
        assert!((Vector3::from(with) - Vector3::from(without)).norm() < 1e-12);
    }
}

/// One number of one axis is off by one standard deviation: the point moves by its ±.
#[test]
fn the_uncertainty_of_each_number_of_an_axis_is_that_of_the_point() {
    const STEP: f64 = 1e-5;
    for carrier in [Carrier::Tool, Carrier::Fixed] {
        for (number, k) in (0..6).flat_map(|axis| (0..AXIS).map(move |k| (axis, k))) {
            let axes = all();
            let mut stated = axes.clone();
            stated[number].covariance[(k, k)] = STEP * STEP;
            let mut delta = SVector::<f64, AXIS>::zeros();
            delta[k] = STEP;
            let mut moved = axes.clone();
            moved[number].axis = moved[number].axis.retract(&delta);
            let at = |axes: Vec<ExternalAxis>| {
                place(&mut heard(&calibration(axes, carrier), &Settings::default(), 2.4), 1.3, READING)
                    .unwrap()
            };
            let ((there, bare_m), (_, sigma_m), (other, _)) = (at(axes), at(stated), at(moved));
            let moved_m = (Vector3::from(other) - Vector3::from(there)).norm();
            let by_axis_m = (sigma_m * sigma_m - bare_m * bare_m).max(0.0).sqrt();
            // Second order: 1e-10 m; and a rate of cubic pieces, by 1 %.
            assert!(
                (by_axis_m - moved_m).abs() < 0.01 * moved_m + 2e-9,
                "{number} {k}: {by_axis_m} {moved_m}"
            );
        }
    }
}

/// A table that turns with up to 0.63 rad/s, whose values have noise; errors over ± of points on the part.
fn z_of(
    events: &mut dyn FnMut(f64, f64) -> Option<(f64, f64)>,
    settings: &Settings,
) -> (Vec<f64>, Vec<PlaceError>) {
    let table = external(AxisKind::Rotary, AxisCarries::Part, 1.0);
    let mut placer = Placer::new(&calibration(vec![table], Carrier::Tool), settings).unwrap();
    let (mut z, mut refused) = (Vec::new(), Vec::new());
    for k in 0..1000 {
        let time_s = POSE_S * f64::from(k);
        placer.push_pose(ns(time_s), &robot(time_s)).unwrap();
        if k % 2 == 0
            && let Some((stamp_s, value)) = events(time_s, value(time_s, 0))
        {
            let _ = placer.push_axis(0, ns(stamp_s + AXIS_LATE_S), value);
        }
        // A frame arrives 17 ms after its exposure.
        if k % 5 == 0 && k > 100 {
            let exposed_s = time_s - FRAME_LATE_S;
            match place(&mut placer, exposed_s, READING) {
                Ok((point, sigma_m)) => {
                    let error_m = (Vector3::from(point) - wanted(&[table], Carrier::Tool, exposed_s)).norm();
                    // Half a micrometre is what straight pieces between poses leave.
                    z.push((error_m - 1e-6).max(0.0) / sigma_m);
                }
                Err(error) => refused.push(error),
            }
        }
    }
    (z, refused)
}

fn is_honest(z: &[f64], what: &str) {
    let worst = z.iter().copied().fold(0.0, f64::max);
    assert!(worst < 5.0, "{what}: {worst} of {}", z.len());
}

#[test]
fn a_noisy_axis_is_as_uncertain_as_it_is() {
    for noise in [0.0, 1e-5, 1e-3] {
        let mut random = Noise::new(9);
        let mut noisy = |time_s: f64, value: f64| Some((time_s, value + noise * random.normal()));
        let (z, refused) = z_of(&mut noisy, &Settings::default());
        is_honest(&z, &format!("{noise}"));
        assert!(refused.is_empty() && z.len() == 179, "{refused:?}");
    }
}

#[test]
fn an_axis_that_stalls_ends_or_lies_gives_no_wrong_point() {
    let settings = Settings::default();
    let mut ends = |time_s: f64, value: f64| (time_s < 2.0).then_some((time_s, value));
    let (z, refused) = z_of(&mut ends, &settings);
    is_honest(&z, "ends");
    let ended = |error: &&PlaceError| {
        matches!(error, PlaceError::Axis { axis: 0, problem: AxisProblem::ValuesEnded { .. } })
    };
    assert!(refused.iter().filter(ended).count() >= 98, "{}", refused.len());

    let mut stalls = |time_s: f64, value: f64| (!(1.5..1.8).contains(&time_s)).then_some((time_s, value));
    let (z, refused) = z_of(&mut stalls, &settings);
    is_honest(&z, "stalls");
    assert!((12..=17).contains(&refused.len()), "{refused:?}");

    let mut random = Noise::new(4);
    let mut lost = |time_s: f64, value: f64| (random.uniform() > 0.2).then_some((time_s, value));
    let (z, refused) = z_of(&mut lost, &settings);
    is_honest(&z, "lost");
    assert!(refused.len() < 12, "{refused:?}");

    for off in [1e-4, 1e-3, 0.01, 0.1, 1.0, 10.0] {
        let mut spike = |time_s: f64, value: f64| {
            let is_wrong = (time_s - 2.0).abs() < 1e-9;
            Some((time_s, if is_wrong { value + off } else { value }))
        };
        is_honest(&z_of(&mut spike, &settings).0, &format!("spike of {off}"));
    }

    // From here on the axis stands somewhere else: a drive that slipped, or another zero.
    for off in [0.001, 0.1] {
        let mut step = |time_s: f64, value: f64| Some((time_s, value + if time_s > 2.0 { off } else { 0.0 }));
        let (z, _) = z_of(&mut step, &settings);
        // Later data do not show that the first values were the right ones: only the earlier ones, and the step itself, are
        // judged.
        is_honest(&z[..80], "step");
    }
}

#[test]
fn stamps_of_arrival_of_an_axis_are_dated_by_its_clock() {
    let mut random = Noise::new(12);
    let mut last_s = 0.0_f64;
    let mut delayed = |time_s: f64, value: f64| {
        let delay_s = (-0.0008 * (1.0 - random.uniform()).ln()).min(0.005);
        last_s = (time_s + delay_s).max(last_s + 1e-6);
        Some((last_s, value))
    };
    let settings = Settings { axis_stamps: StampRule::LowerEnvelope, ..Settings::default() };
    let (z, refused) = z_of(&mut delayed, &settings);
    is_honest(&z, "delayed");
    // 64 values are learnt: 0.5 s.
    assert!(z.len() > 150, "{} {}", z.len(), refused.len());
}

#[test]
fn values_that_are_none_are_refused_and_the_stream_goes_on() {
    let table = external(AxisKind::Rotary, AxisCarries::Part, 1.0);
    let calibration = calibration(vec![table], Carrier::Tool);
    let mut placer = heard(&calibration, &Settings::default(), 2.0);
    for bad in [f64::NAN, f64::INFINITY, 1e9] {
        assert_eq!(placer.push_axis(0, ns(3.0), bad), Err(AxisError::NotFinite));
    }
    assert_eq!(placer.push_axis(0, i64::MIN, 0.0), Err(AxisError::NotFinite));
    assert_eq!(placer.push_axis(1, ns(3.0), 0.0), Err(AxisError::NoSuchAxis { axis: 1, axes: 1 }));
    assert!(matches!(placer.push_axis(0, ns(2.0), 0.0), Err(AxisError::NotLater { .. })));
    assert!(place(&mut placer, 1.5, READING).is_ok());
    let health = placer.axis_health(0, ns(2.02)).unwrap();
    assert!(health.is_settled && !health.is_stalled && (health.period_s - VALUE_S).abs() < 1e-9);
    assert!(placer.axis_health(0, ns(2.2)).unwrap().is_stalled && placer.axis_health(1, 0).is_none());
    assert!(matches!(placer.push_axis(0, ns(0.5), 0.0), Err(AxisError::ClockWentBack { .. })));
    let unsettled = place(&mut placer, 1.5, READING);
    assert!(
        matches!(unsettled, Err(PlaceError::Axis { problem: AxisProblem::Unsettled { .. }, .. })),
        "{unsettled:?}"
    );
    assert!(!placer.health(ns(2.0)).is_settled);
    for (k, bad) in [f64::NAN, 0.0].into_iter().enumerate() {
        let mut wrong = calibration.clone();
        wrong.axes[0].axis.scale = bad;
        assert_eq!(Placer::new(&wrong, &Settings::default()).unwrap_err().name, "axes", "{k}");
    }
}
