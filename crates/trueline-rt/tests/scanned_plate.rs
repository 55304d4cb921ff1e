//! A plate scanned forth and back at 10, 50 and 200 mm/s.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod cell;

use cell::{Event, FRAME_PERIOD_S, Path, RANGE_NOISE_M, TIME_OFFSET_S};
use nalgebra::Vector3;
use trueline_rt::{Placer, Points, Settings};

/// One placed point: the error, its ±, the distance from the plate.
struct Point {
    error: Vector3<f64>,
    sigma_m: f64,
    off_plate_m: f64,
    turns: bool,
}

fn scan(speed_m_s: f64, time_offset_s: f64) -> Vec<Point> {
    let path = Path { speed_m_s };
    // Two laps at the least.
    let duration_s = (2.0 * path.period_s()).clamp(4.0, 14.0);
    let mut placer = Placer::new(&cell::calibration(time_offset_s), &Settings::default()).unwrap();
    let (normal, offset) = cell::plate();
    let mut list = Vec::new();
    let (mut base, mut sigmas) = (vec![[0.0; 3]; 16], vec![0.0; 16]);
    for event in cell::events(path, duration_s, 16, 7) {
        match event {
            Event::Pose { stamp_ns, pose } => placer.push_pose(stamp_ns, &pose).unwrap(),
            Event::Frame { stamp_ns, readings, truth, exposed_s } => {
                let placed = placer.place(stamp_ns, Points::Profile(&readings), &mut base, &mut sigmas);
                // The last frames may come after the last pose.
                let Ok(placed) = placed else {
                    assert!(exposed_s > duration_s - 2.0 * FRAME_PERIOD_S, "{placed:?} at {exposed_s}");
                    continue;
                };
                assert_eq!((placed.placed, placed.flagged), (16, 0));
                let moves = [-0.05, 0.0, 0.05].map(|s| path.pose(exposed_s + s).translation.vector.x);
                let turns = ((moves[2] - moves[1]) - (moves[1] - moves[0])).abs() > 1e-9;
                for ((point, sigma_m), truth) in base.iter().zip(&sigmas).zip(&truth) {
                    let point = Vector3::from(*point);
                    let off_plate_m = normal.dot(&point) - offset;
                    list.push(Point { error: point - truth, sigma_m: *sigma_m, off_plate_m, turns });
                }
            }
        }
    }
    list
}

fn root_mean_square(values: impl Iterator<Item = f64>) -> f64 {
    let (count, sum) = values.fold((0.0, 0.0), |(count, sum), value| (count + 1.0, sum + value * value));
    f64::sqrt(sum / count)
}

/// Without motion the error is the noise of a range, 15 µm, and the rest of the poses' noise after a local fit: 20 µm √3
/// times 0.45 to 1 of the samples, averaged over the curve, and 20 µrad √2 over 0.3 m. This is 15 ⊕ 16…35 ⊕ 4…8: from 22 to
/// 39 µm, at every speed.
#[test]
fn with_the_offset_the_error_is_flat_and_without_it_goes_with_the_speed() {
    for speed_m_s in [0.010, 0.050, 0.200] {
        let error_m = root_mean_square(scan(speed_m_s, TIME_OFFSET_S).iter().map(|point| point.error.norm()));
        assert!((20e-6..40e-6).contains(&error_m), "{speed_m_s}: {error_m}");
        let plain: Vec<f64> = scan(speed_m_s, 0.0)
            .iter()
            .filter(|point| !point.turns)
            .map(|point| point.error.norm())
            .collect();
        let wrong_m = root_mean_square(plain.into_iter());
        // Along the slope the tool goes √(1 + 0.5²) as far, and swings with up to 0.28 rad/s, 0.3 m away: at 10 mm/s most of it.
        let (by_speed_m, by_swing_m) = (1.118 * speed_m_s * TIME_OFFSET_S, 0.28 * 0.3 * TIME_OFFSET_S);
        let least_m = (by_speed_m - by_swing_m).max(0.2 * by_swing_m);
        assert!((least_m..by_speed_m + by_swing_m).contains(&wrong_m), "{speed_m_s}: {wrong_m}");
    }
}

/// The ± are the root mean squares of the errors: 4 of them are exceeded by none of some thousand Gaussian vectors but by chance.
#[test]
fn the_uncertainty_is_that_of_the_errors() {
    for speed_m_s in [0.010, 0.200] {
        let points = scan(speed_m_s, TIME_OFFSET_S);
        let z = root_mean_square(points.iter().map(|point| point.error.norm() / point.sigma_m));
        assert!((0.6..1.15).contains(&z), "{speed_m_s}: {z}");
        assert!(points.iter().all(|point| point.error.norm() < 5.0 * point.sigma_m));
    }
}

/// The cloud of both directions is as thick as the noise: 15 µm of a range along its slanted ray, and 20 µm and less of a pose.
#[test]
fn the_cloud_of_a_plate_is_as_thick_as_its_noise_at_every_speed() {
    let thick_m = |speed_m_s: f64, offset_s: f64| {
        root_mean_square(scan(speed_m_s, offset_s).iter().map(|point| point.off_plate_m))
    };
    let slow_m = thick_m(0.010, TIME_OFFSET_S);
    assert!((RANGE_NOISE_M * 0.8..28e-6).contains(&slow_m), "{slow_m}");
    for speed_m_s in [0.050, 0.200] {
        let with_m = thick_m(speed_m_s, TIME_OFFSET_S);
        assert!((0.8..1.25).contains(&(with_m / slow_m)), "{speed_m_s}: {with_m} of {slow_m}");
    }
    assert!(thick_m(0.200, 0.0) > 5.0 * slow_m);
}
