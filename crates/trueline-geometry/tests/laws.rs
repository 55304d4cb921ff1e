//! Tests laws of rotations, poses, lines and trajectories at critical points: zero, tiny angles, half a turn.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

use nalgebra::{DMatrix, Matrix3, Quaternion, UnitQuaternion, UnitVector3, Vector3, Vector4};
use proptest::prelude::*;
use trueline_geometry::{Line, Pose, Trajectory, fit, se3, smooth, so3};

fn direction() -> impl Strategy<Value = UnitVector3<f64>> {
    (-1.0..1.0_f64, -1.0..1.0_f64, -1.0..1.0_f64)
        .prop_filter_map("not zero", |(x, y, z)| UnitVector3::try_new(Vector3::new(x, y, z), 0.1))
}

/// Angles on every branch: zero, far below and about the series' limits, ordinary, near half a turn.
fn angle() -> impl Strategy<Value = f64> {
    prop_oneof![
        Just(0.0),
        Just(1e-8),
        Just(4.9e-3),
        Just(1.02e-2),
        0.0..3.0_f64,
        Just(std::f64::consts::PI - 1e-8),
    ]
}

fn point(size: f64) -> impl Strategy<Value = Vector3<f64>> {
    (-size..size, -size..size, -size..size).prop_map(|(x, y, z)| Vector3::new(x, y, z))
}

/// Exponential of a matrix by its series, 60 terms: exact to rounding for angles up to π.
fn series(matrix: &Matrix3<f64>) -> Matrix3<f64> {
    let (mut sum, mut term) = (Matrix3::identity(), Matrix3::identity());
    for k in 1..60 {
        term = term * matrix / f64::from(k);
        sum += term;
    }
    sum
}

/// Below a limit series are used. They must be as accurate as the original function, where this could be evaluated.
#[test]
fn series_of_small_angles_are_exact_to_rounding() {
    let axis = Vector3::new(0.6, -0.48, 0.64);
    for angle in [1e-9, 1e-4, 3e-3, 4.99e-3, 5.01e-3, 0.02, 1.0, 3.0] {
        let half: f64 = 0.5 * angle;
        let exact = UnitQuaternion::new_unchecked(Quaternion::from_parts(half.cos(), axis * half.sin()));
        // Relative to the angle, a few eps: from the function itself, the axis' length and the norm.
        let found = so3::exp(&(axis * angle));
        assert!((found.imag() - exact.imag()).norm() < 1e-15 * angle, "exp of {angle}");
        assert!((so3::log(&exact) - axis * angle).norm() < 2e-15 * angle, "log of {angle}");
    }
    for angle in [1e-9, 1e-4, 5e-3, 9.99e-3, 1.01e-2, 0.05, 0.0999, 0.101, 1.0, 3.0] {
        let w = so3::hat(&(axis * angle));
        // V = Σ [ω]×ᵏ / (k + 1)!
        let (mut sum, mut term) = (Matrix3::identity(), Matrix3::identity());
        for k in 2..60 {
            term = term * w / f64::from(k);
            sum += term;
        }
        let found = so3::left_jacobian(&(axis * angle));
        // x − sin x is used from 0.01 on and loses four digits of x²/6 there. A series loses none.
        let lost = if angle < 1e-2 { 1e-15 } else { 5e-14 };
        assert!((found - sum).norm() < lost, "V({angle}): {:e}", (found - sum).norm());
        let product = so3::left_jacobian_inverse(&(axis * angle)) * sum;
        assert!(
            (product - Matrix3::identity()).norm() < 4e-15,
            "V⁻¹({angle}): {:e}",
            (product - Matrix3::identity()).norm()
        );
    }
}

/// Accuracy of a line's direction: the rotation from x follows from its angle, to ε/sin of that, a few times over.
fn kept(along: &UnitVector3<f64>) -> f64 {
    1e-14_f64.max(1e-15 / along.y.hypot(along.z))
}

proptest! {
    #[test]
    fn exp_is_the_matrix_exponential(axis in direction(), angle in angle()) {
        let w = axis.into_inner() * angle;
        let rotation = so3::exp(&w).to_rotation_matrix().into_inner();
        // The series' terms reach π³/6 ≈ 5, so its rounding is some ten eps.
        prop_assert!((rotation - series(&so3::hat(&w))).norm() < 1e-13);
    }

    #[test]
    fn log_inverts_exp(axis in direction(), angle in angle()) {
        let w = axis.into_inner() * angle;
        let back = so3::log(&so3::exp(&w));
        // Near half a turn w's sign is lost when rounding crosses it. The rotation is the same.
        let error = (back - w).norm().min((so3::exp(&back).inverse() * so3::exp(&w)).angle());
        prop_assert!(error < 1e-14 * (1.0 + angle) * 4.0, "{error}");
    }

    #[test]
    fn left_jacobian_is_the_derivative_of_exp(axis in direction(), angle in 0.0..2.5_f64, push in point(1.0)) {
        let w = axis.into_inner() * angle;
        let h = 1e-5;
        let plus = so3::exp(&(w + push * h));
        let minus = so3::exp(&(w - push * h));
        let numerical = so3::log(&(plus * minus.inverse())) / (2.0 * h);
        // Central difference: truncation h² ≈ 1e-10, rounding eps/h = 2e-11.
        prop_assert!((so3::left_jacobian(&w) * push - numerical).norm() < 1e-8);
    }

    #[test]
    fn se3_exp_and_log_agree(axis in direction(), angle in 0.0..3.0_f64, rho in point(2.0)) {
        let w = axis.into_inner() * angle;
        let (w_back, rho_back) = se3::log(&se3::exp(&w, &rho));
        prop_assert!((w_back - w).norm() < 1e-13 && (rho_back - rho).norm() < 1e-12);
    }

    #[test]
    fn decoupled_retraction_and_difference_agree(
        axis in direction(), angle in 0.0..3.0_f64, t in point(2.0), d in point(0.5), dt in point(0.1),
    ) {
        let pose: Pose = se3::from_parts(so3::exp(&(axis.into_inner() * angle)), t);
        let (d_back, dt_back) = se3::difference_decoupled(&se3::retract_decoupled(&pose, &d, &dt), &pose);
        prop_assert!((d_back - d).norm() < 1e-13 && (dt_back - dt).norm() < 1e-14);
        // Left perturbation: the rotation is about axes of the outer frame, so a point rotated by the pose rotates again.
        let moved = se3::retract_decoupled(&pose, &d, &dt);
        let expected = so3::exp(&d) * (pose.rotation * Vector3::x());
        prop_assert!((moved.rotation * Vector3::x() - expected).norm() < 1e-14);
    }

    #[test]
    fn line_forms_agree(anchor in point(2.0), along in direction(), probe in point(2.0)) {
        let line = Line::new(anchor, &along);
        let pluecker = line.to_pluecker();
        // The moment is p × v, as in the paper, for every point p of the line.
        prop_assert!(((anchor + along.into_inner()).cross(&along) - pluecker.moment).norm() < 5.0 * kept(&along));
        let distance = (probe - anchor).cross(&along).norm();
        prop_assert!((line.distance(&probe) - distance).abs() < 5.0 * kept(&along));
        prop_assert!((pluecker.to_line().distance(&probe) - distance).abs() < 1e-13 + 5.0 * kept(&along));
        if let Some(orthonormal) = pluecker.to_orthonormal() {
            let back = orthonormal.to_pluecker();
            let error = (back.moment - pluecker.moment).norm() + (back.direction - pluecker.direction).norm();
            // For a line at distance m from the origin the direction n/|n| has an error of eps/m.
            prop_assert!(error < 1e-12 / pluecker.moment.norm().min(1.0), "{error}");
        }
    }

    #[test]
    fn line_step_moves_as_named(anchor in point(2.0), along in direction()) {
        let line = Line::new(anchor, &along);
        let axes = line.axes();
        let shifted = line.retract(&Vector4::new(0.0, 0.0, 0.01, -0.02));
        let expected = anchor + axes.column(1) * 0.01 - axes.column(2) * 0.02;
        prop_assert!((shifted.anchor() - expected).norm() < 1e-15 * 8.0);
        // A rotation about u₂ tilts the direction towards −u₃, one about u₃ towards u₂.
        let turned = line.retract(&Vector4::new(1e-6, 2e-6, 0.0, 0.0));
        let expected = along.into_inner() - axes.column(2) * 1e-6 + axes.column(1) * 2e-6;
        prop_assert!((turned.direction() - expected).norm() < 1e-11);
        prop_assert!((line.reversed().direction() + along.into_inner()).norm() < kept(&along));
    }
}

fn turning(times: &[f64]) -> Vec<Pose> {
    times
        .iter()
        .map(|t| se3::exp(&Vector3::new(0.3 * t, -0.2 * t, 0.1), &Vector3::new(*t, 2.0 * t, 0.5)))
        .collect()
}

#[test]
fn interpolation_passes_through_the_samples_and_is_linear_between() {
    let times = vec![0.0, 0.004, 0.009, 0.012];
    let poses = turning(&times);
    let trajectory = Trajectory::new(times.clone(), &poses).unwrap();
    for (time, pose) in times.iter().zip(&poses).take(3) {
        let at = trajectory.pose_at(*time).unwrap();
        assert!((at.to_homogeneous() - pose.to_homogeneous()).norm() < 1e-15);
    }
    let segment = trajectory.segment_at(0.006).unwrap();
    let (a, b) = (segment.pose_at(0.005), segment.pose_at(0.007));
    let middle = segment.pose_at(0.006);
    let mean = (a.translation.vector + b.translation.vector) * 0.5;
    assert!((mean - middle.translation.vector).norm() < 1e-15);
    // Body rate: R(t + h) = R(t) Exp(ω h), on the right.
    let turned = middle.rotation * so3::exp(&(segment.body_rate * 0.001));
    assert!(turned.angle_to(&b.rotation) < 1e-12);
}

#[test]
fn outside_the_recording_and_in_a_gap_there_is_no_pose() {
    let times = vec![0.0, 0.004, 0.008, 0.108, 0.112, 0.116];
    let trajectory = Trajectory::new(times.clone(), &turning(&times)).unwrap();
    for outside in [-1e-9, 0.1161, f64::NAN] {
        assert!(trajectory.pose_at(outside).is_none(), "{outside}");
    }
    assert!(trajectory.pose_at(0.05).is_none());
    assert!(trajectory.pose_at(0.116).is_some());
}

#[test]
fn the_bracket_is_the_last_sample_at_or_before() {
    let jittering: Vec<f64> = (0..100).map(|k| f64::from(k) * 0.004 + f64::from(k % 7) * 1e-4).collect();
    // A pause, then samples in bursts with one time each.
    let in_bursts: Vec<f64> =
        (0..100).map(|k| f64::from(k / 20) * 0.004 + if k < 50 { 0.0 } else { 0.35 }).collect();
    for times in [jittering, in_bursts] {
        let trajectory = Trajectory::new(times.clone(), &turning(&times)).unwrap();
        let [first, last] = [times[0], times[99]];
        // A recording that ends at equal times has no duration.
        let last_segment = times.iter().rposition(|t| *t < last).unwrap();
        let exactly = times.iter().copied().flat_map(|t| [t, t.next_down(), t.next_up()]);
        for time in (-2..402).map(|k| f64::from(k) * 1e-3).chain(exactly).chain([f64::NAN]) {
            let inside = first <= time && time <= last;
            let expected = times.iter().rposition(|t| *t <= time).filter(|_| inside);
            let expected = expected.map(|j| j.min(last_segment));
            assert_eq!(trajectory.bracket(time), expected, "time {time}");
        }
    }
}

#[test]
fn equal_stamps_and_falling_stamps() {
    let times = vec![0.0, 0.004, 0.004, 0.008];
    let trajectory = Trajectory::new(times.clone(), &turning(&times)).unwrap();
    assert!(trajectory.pose_at(0.004).is_some());
    assert!(Trajectory::new(vec![0.0, 0.004, 0.003], &turning(&[0.0, 0.004, 0.003])).is_err());
    assert!(Trajectory::new(vec![0.0], &turning(&[0.0])).is_err());
}

/// A window 0.048 s wide to either side attenuates a sine by x⁗ h⁴/280 \[Savitzky1964\]: 0.3 µm of 10 mm at 1 Hz and 0.1 mm
/// of 5 mm at 5 Hz. The bound is 15 times 0.02 of the noise, 9 µm.
#[test]
fn the_window_is_as_wide_as_the_motion_allows() {
    let times: Vec<f64> = (0..1500).map(|k| f64::from(k) * 0.012).collect();
    let mut state = 1_u64;
    let mut noise = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5) * 12.0_f64.sqrt() * 3e-5
    };
    let mut width = |amplitude_m: f64, frequency_hz: f64, most_s: f64| {
        let at = |t: &f64| amplitude_m * (std::f64::consts::TAU * frequency_hz * t).sin();
        let poses: Vec<Pose> = times
            .iter()
            .map(|t| {
                se3::from_parts(so3::exp(&Vector3::zeros()), Vector3::new(at(t) + noise(), noise(), noise()))
            })
            .collect();
        smooth::half_window_s(&times, &poses, 0.048, 3e-5, most_s)
    };
    assert!((0.045..=0.053).contains(&width(0.010, 1.0, 0.053)));
    assert_eq!(width(0.005, 5.0, 0.053), smooth::HALF_WINDOW_S);
    assert_eq!(width(0.010, 1.0, 0.023), smooth::HALF_WINDOW_S);
    // With four neighbours on each side half of the noise remains.
    assert!((smooth::noise_left(0.012, 0.048) - 0.505).abs() < 1e-3);
}

#[test]
fn the_local_fit_keeps_a_quadratic_motion_and_measures_noise() {
    let times: Vec<f64> = (0..500).map(|k| f64::from(k) * 0.004).collect();
    let smooth_motion: Vec<Pose> = (times.iter())
        .map(|t| se3::from_parts(so3::exp(&Vector3::new(0.0, 0.0, 0.1)), Vector3::new(*t, t * t, 1.0)))
        .collect();
    let kept = smooth::local_quadratic(&times, &smooth_motion, 0.016, smooth::HALF_WINDOW_S);
    for (a, b) in kept.iter().zip(&smooth_motion) {
        assert!((a.translation.vector - b.translation.vector).norm() < 1e-13);
    }
    // Uniform noise over ±√3 σ from a multiplicative generator: standard deviation σ, no correlation.
    let sigma = 3e-5;
    let mut state = 1_u64;
    let mut noise = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5) * 12.0_f64.sqrt() * sigma
    };
    let noisy: Vec<Pose> = (smooth_motion.iter())
        .map(|p| {
            let push = Vector3::from_fn(|_, _| noise());
            se3::from_parts(p.rotation, p.translation.vector + push)
        })
        .collect();
    let measured = smooth::position_noise(&times, &noisy, 0.004, 0.016);
    // A median of 1500 values with correlated neighbours: 1.25/√(1500/3)·… ≈ 6 %. Sums of nine are nearly normal.
    assert!((measured / sigma - 1.0).abs() < 0.2, "{measured}");
    // The same with nine of ten rows lost at random. A motion of 1 s² is still a parabola.
    let kept: Vec<usize> = (0..500).filter(|k| (k * 7919) % 10 == 0 || (k * 104_729) % 17 < 2).collect();
    let (few_times, few): (Vec<f64>, Vec<Pose>) = kept.iter().map(|k| (times[*k], noisy[*k])).unzip();
    let measured = smooth::position_noise(&few_times, &few, 0.004, 1.0);
    assert!((measured / sigma - 1.0).abs() < 0.5, "{measured}");
}

/// Windows with nearly equal times share weights. Times with a jitter of nanoseconds are not nearly equal.
#[test]
fn a_jitter_of_nanoseconds_is_not_taken_for_even_stamps() {
    let times: Vec<f64> =
        (0..200).map(|k| f64::from(k) * 0.004 + 1e-8 * (f64::from(k) * 2.3).sin()).collect();
    let pose = |t: &f64| se3::from_parts(so3::exp(&Vector3::zeros()), Vector3::new(2.0 * t, 0.0, 0.0));
    let poses: Vec<Pose> = times.iter().map(pose).collect();
    let kept = smooth::local_quadratic(&times, &poses, 0.016, smooth::HALF_WINDOW_S);
    for (kept, pose) in kept.iter().zip(&poses) {
        // At 2 m/s the 2·10⁻¹¹ s (10⁻⁹ of half a window) that count as equal are 4·10⁻¹¹ m. 10⁻⁸ s would be 2·10⁻⁸ m.
        assert!((kept.translation.vector - pose.translation.vector).norm() < 4e-10);
    }
}

#[test]
fn each_window_of_uneven_stamps_has_its_own_least_squares_quadratic() {
    // Regular for a while, then with jitter, then regular again with another period: windows before and after share no weights.
    let step = |k: i32| match k {
        0..40 => 0.004,
        40..80 => 0.004 + 0.001 * (f64::from(k) * 2.3).sin(),
        _ => 0.005,
    };
    let times: Vec<f64> = (0..120).map(|k| (0..k).map(step).sum()).collect();
    let shaken = |k: usize| Vector3::new((k * k % 17) as f64, (k * 7 % 11) as f64, (k % 5) as f64) * 1e-4;
    let poses: Vec<Pose> = (0..120).map(|k| se3::from_parts(so3::exp(&shaken(k)), shaken(k))).collect();
    let found = smooth::local_quadratic(&times, &poses, 0.1, 0.0201);
    for k in 10..110 {
        let mut side = 0;
        while times[k + side + 1] - times[k] < 0.0201 && times[k] - times[k - side - 1] < 0.0201 {
            side += 1;
        }
        let window = k - side..=k + side;
        // By singular values instead of normal equations.
        let powers = DMatrix::from_fn(2 * side + 1, 3, |row, power| {
            ((times[k - side + row] - times[k]) / 0.02).powi(power as i32)
        });
        let svd = powers.svd(true, true);
        let shifts = DMatrix::from_fn(2 * side + 1, 3, |row, axis| shaken(k - side + row)[axis]);
        let shift = svd.solve(&shifts, 1e-12).unwrap().row(0).transpose();
        let inverse = poses[k].rotation.inverse();
        let logs: Vec<_> = window.map(|i| so3::log(&(inverse * poses[i].rotation))).collect();
        let turns = DMatrix::from_fn(2 * side + 1, 3, |row, axis| logs[row][axis]);
        let turn = svd.solve(&turns, 1e-12).unwrap().row(0).transpose();
        let expected = poses[k].rotation * so3::exp(&Vector3::new(turn[0], turn[1], turn[2]));
        // Values of 1.6 mm, with weights accurate to 1e-9 of the window.
        assert!((found[k].translation.vector - shift).norm() < 1e-11, "{k}");
        assert!(found[k].rotation.angle_to(&expected) < 1e-11, "{k}");
    }
}

#[test]
fn the_curve_between_slow_samples_is_the_motion() {
    let (amplitude, rate) = (0.05, 2.0 * std::f64::consts::PI);
    let motion = |t: f64| {
        let wave = (rate * t).sin();
        se3::from_parts(
            so3::exp(&(Vector3::new(0.3, -0.2, 0.1) * wave)),
            Vector3::new(0.1 * t, amplitude * wave, 0.0),
        )
    };
    // 20 Hz, with one gap of half a second.
    let times: Vec<f64> =
        (0..60).map(|k| f64::from(k) * 0.05).filter(|t| !(1.02..1.48).contains(t)).collect();
    let poses: Vec<Pose> = times.iter().map(|t| motion(*t)).collect();
    let (dense_times, dense) = trueline_geometry::curve::densified(&times, &poses, 0.2, 0.004);
    // Six nodes: 5/1024 T⁶ x⁽⁶⁾ with x⁽⁶⁾ = amplitude · rate⁶. Near ends and gap there are four nodes or fewer on one
    // side, and the error is a few times 1/24 T⁴ x⁽⁴⁾.
    let bound = |amplitude: f64| 5.0 / 1024.0 * 0.05_f64.powi(6) * amplitude * rate.powi(6);
    let near_edge = |t: f64| [0.0, 1.0, 1.5, 2.95].iter().any(|edge| (t - edge).abs() < 0.11);
    let coarse = |amplitude: f64| 0.5 * 0.05_f64.powi(4) * amplitude * rate.powi(4);
    for (t, pose) in dense_times.iter().zip(&dense) {
        let (turn, shift) = se3::difference_decoupled(pose, &motion(*t));
        let limit = |amplitude: f64| 1e-13 + if near_edge(*t) { coarse(amplitude) } else { bound(amplitude) };
        assert!(shift.norm() < limit(amplitude), "{t} {}", shift.norm());
        // The rotations are about one axis and add like numbers: 0.374 rad.
        assert!(turn.norm() < limit(0.375), "{t} {}", turn.norm());
    }
    assert!(dense_times.windows(2).all(|w| w[1] - w[0] < 0.004 + 1e-9 || w[1] - w[0] > 0.4));
    assert!(times.iter().all(|t| dense_times.contains(t)));
}

#[test]
fn fits_find_line_and_plane_among_wild_points() {
    let line =
        Line::new(Vector3::new(1.0, 2.0, 3.0), &UnitVector3::new_normalize(Vector3::new(1.0, -1.0, 0.5)));
    let mut points: Vec<Vector3<f64>> =
        (0..100).map(|k| line.anchor() + line.direction() * (f64::from(k) * 0.01)).collect();
    for (k, point) in points.iter_mut().enumerate().step_by(3) {
        *point += Vector3::new(0.2, 0.1 * (k % 5) as f64, -0.3);
    }
    let found = fit::robust_line(&points).unwrap();
    // Exact points among a third of wild ones. Re-weighting shrinks the scale until only rounding remains, or ten
    // rounds are over; each at least halves the rest.
    assert!(found.distance(line.anchor()) < 1e-3, "{}", found.distance(line.anchor()));
    assert!(fit::line(&[Vector3::zeros()]).is_none());
    let flat: Vec<Vector3<f64>> =
        (0..50).map(|k| Vector3::new(f64::from(k % 7) * 0.01, f64::from(k / 7) * 0.01, 0.13)).collect();
    let plane = fit::plane(&flat).unwrap();
    assert!(plane.rms < 1e-15 && (plane.plane.offset() - 0.13).abs() < 1e-15);
}
