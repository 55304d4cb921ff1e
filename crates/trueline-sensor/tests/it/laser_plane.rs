//! The laser plane: from points by boards, and from pictures jointly with the camera.
#![allow(clippy::print_stderr, reason = "a skipped test says so")]

use crate::scenes;

use nalgebra::{SMatrix, Vector3};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha12Rng;
use rand_distr::{Distribution, StandardNormal};
use scenes::{board, camera, plane, stripe, striped_poses, view};
use std::path::PathBuf;
use trueline_geometry::Plane;
use trueline_sensor::Error;
use trueline_sensor::laser_plane::{KnownCamera, StripedView, fit_joint, fit_points, jackknife, next_board};
use trueline_sensor::sheet_tilt;
use trueline_sensor::verdict::{self, Remark};

/// Stripes on `count` boards: lines in the plane, each moved off it and tilted as a whole, with hardly any noise of its own.
fn stripes(count: usize, offset_m: f64, slope: f64, random: &mut ChaCha12Rng) -> Vec<Vec<Vector3<f64>>> {
    let plane = plane();
    let (normal, axes) = (plane.normal().into_inner(), sheet_tilt::axes(&plane));
    (0..count)
        .map(|_| {
            let middle = normal * plane.offset()
                + axes
                    * nalgebra::Vector2::new(
                        random.random_range(-0.02..0.02),
                        random.random_range(0.05..0.09),
                    );
            let bulge: f64 = StandardNormal.sample(random);
            let twist: f64 = StandardNormal.sample(random);
            (0..100)
                .map(|k| {
                    let s = (f64::from(k) - 49.5) * 4e-4;
                    middle + axes.column(0) * s + normal * (bulge * offset_m + twist * slope * s)
                })
                .collect()
        })
        .collect()
}

/// (θ₁, θ₂, offset) from the truth to an estimate, in the axes of the estimate.
fn off(estimate: &Plane) -> Vector3<f64> {
    let tilt = sheet_tilt::axes(estimate).transpose() * plane().normal().into_inner();
    -Vector3::new(tilt.x, tilt.y, plane().offset() - estimate.offset())
}

#[test]
fn points_of_no_plane_are_refused_and_doubtful_ones_are_told() {
    let code = |remarks: Vec<Remark>| remarks.iter().map(Remark::code).collect::<Vec<_>>();
    // Offsets of the boards are what the points are off by: beyond 2 mm RMS refused, beyond 0.5 mm told. 40 boards: ± 11 %.
    for (offset_m, refused, told) in [(1e-4, false, false), (1e-3, false, true), (4e-3, true, false)] {
        let mut random = ChaCha12Rng::seed_from_u64(7);
        let fit = fit_points(&stripes(40, offset_m, 0.0, &mut random)).unwrap();
        let (reasons, warnings) = verdict::of_points(&fit);
        assert_eq!(code(reasons).contains(&"points-off-plane"), refused, "{offset_m}");
        assert_eq!(code(warnings).contains(&"points-off-plane"), told, "{offset_m}");
    }
}

#[test]
fn the_covariance_is_by_boards_and_honest() {
    let mut random = ChaCha12Rng::seed_from_u64(4);
    let (sets, mut sum) = (400, 0.0);
    for _ in 0..sets {
        let fit = fit_points(&stripes(18, 40e-6, 1e-3, &mut random)).unwrap();
        let error = off(&fit.plane);
        sum += error.dot(&(fit.covariance.try_inverse().unwrap() * error)) / 3.0;
    }
    // Variances from 18 boards less three unknowns are themselves uncertain: the mean of a squared t of 15 degrees of
    // freedom is 15/13 = 1.15 with one variance, somewhat less with two. The spread of the mean is sqrt(2/(3 × 400)) × 1.3 =
    // 0.05.
    let nees = sum / f64::from(sets);
    assert!((0.95..1.32).contains(&nees), "NEES {nees}");
}

#[test]
fn points_do_not_count_as_boards() {
    let mut random = ChaCha12Rng::seed_from_u64(5);
    let boards = stripes(18, 40e-6, 1e-3, &mut random);
    let fit = fit_points(&boards).unwrap();
    let twice: Vec<Vec<Vector3<f64>>> = boards.iter().map(|b| b.iter().chain(b).copied().collect()).collect();
    let doubled = fit_points(&twice).unwrap();
    // The same points again say nothing new.
    let change = doubled.covariance.diagonal().component_div(&fit.covariance.diagonal());
    assert!(change.iter().all(|c| (c - 1.0).abs() < 1e-6), "{change}");
    let by_jackknife = jackknife(&boards, &fit.plane).unwrap();
    let sigma = fit.covariance.diagonal().map(f64::sqrt);
    for k in 0..3 {
        // Two estimates of one spread from 18 boards: each is uncertain by 1/sqrt(2 × 15) = 18 %, and they share the data.
        assert!((sigma[k] / by_jackknife[k] - 1.0).abs() < 0.4, "{} against {}", sigma[k], by_jackknife[k]);
    }
}

#[test]
fn a_tilted_board_is_named() {
    let mut random = ChaCha12Rng::seed_from_u64(6);
    let mut boards = stripes(15, 20e-6, 2e-4, &mut random);
    let normal = plane().normal().into_inner();
    let middle = boards[9].iter().sum::<Vector3<f64>>() / 100.0;
    let along = sheet_tilt::axes(&plane()).column(0).into_owned();
    for point in &mut boards[9] {
        *point += normal * (along.dot(&(*point - middle)) * 5e-3);
    }
    let fit = fit_points(&boards).unwrap();
    let worst =
        (0..15).max_by(|a, b| fit.boards[*a].z[1].abs().total_cmp(&fit.boards[*b].z[1].abs())).unwrap();
    assert_eq!(worst, 9);
    assert!(fit.boards[9].z[1].abs() > 3.0, "{:?}", fit.boards[9]);
}

#[test]
fn what_fixes_no_plane_is_refused() {
    let mut random = ChaCha12Rng::seed_from_u64(7);
    let boards = stripes(3, 1e-5, 1e-4, &mut random);
    assert_eq!(fit_points(&boards).unwrap_err(), Error::TooFewBoards { found: 3, needed: 4 });
    let one = stripes(1, 0.0, 0.0, &mut random).remove(0);
    let same: Vec<Vec<Vector3<f64>>> = (0..6).map(|_| one.clone()).collect();
    assert_eq!(fit_points(&same).unwrap_err(), Error::OneLine);
}

/// The public laser-plane data of the paper's authors, which has no licence and is no part of this repository.
fn public_boards() -> Option<Vec<Vec<Vector3<f64>>>> {
    let beside = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/data/lvs_st_calib");
    let folder =
        std::env::var_os("TRUELINE_LVS_ST_CALIB").map_or_else(|| PathBuf::from(beside), PathBuf::from);
    let file = folder.join("pattern_3dpoint.txt");
    let Ok(text) = std::fs::read_to_string(&file) else {
        eprintln!("SKIPPED: public_data: there is no {}", file.display());
        return None;
    };
    let numbers = text.split_whitespace().map(|x| x.parse::<f64>().unwrap() / 1000.0).collect::<Vec<_>>();
    let points: Vec<Vector3<f64>> = numbers.chunks_exact(3).map(Vector3::from_column_slice).collect();
    Some(points.chunks_exact(400).map(<[Vector3<f64>]>::to_vec).collect())
}

#[test]
fn public_data_of_the_laser_plane_is_fitted_with_the_uncertainty_of_its_boards() {
    let Some(boards) = public_boards() else { return };
    assert_eq!(boards.len(), 18);
    let fit = fit_points(&boards).unwrap();
    // An independent orthogonal fit in numpy gives n (−0.0153205, −0.9045506, 0.4260910), d 55.7067 mm, rms 0.0286955 mm.
    let expected = Vector3::new(-0.015_320_5, -0.904_550_6, 0.426_091_0);
    let normal = fit.plane.normal().into_inner();
    let angle_deg = normal.cross(&expected).norm().atan2(normal.dot(&expected)).to_degrees();
    assert!(angle_deg < 0.02, "{angle_deg}°");
    assert!((fit.plane.offset() - 0.055_706_7).abs() < 1e-5, "{}", fit.plane.offset());
    assert!((fit.rms_m - 2.869_55e-5).abs() < 1e-8, "{}", fit.rms_m);
    let by_jackknife = jackknife(&boards, &fit.plane).unwrap();
    let sigma = fit.covariance.diagonal().map(f64::sqrt);
    for k in 0..3 {
        assert!((sigma[k] / by_jackknife[k] - 1.0).abs() < 0.3, "{} against {}", sigma[k], by_jackknife[k]);
    }
    // By the jackknife, elsewhere: ±0.135° about the stripe, ±0.0076 mm in the middle of the points.
    assert!((sigma.y.to_degrees() / 0.135 - 1.0).abs() < 0.3, "{}", sigma.y.to_degrees());
    assert!((fit.middle_sigma_m / 0.0076e-3 - 1.0).abs() < 0.3, "{}", fit.middle_sigma_m);
}

#[test]
fn pictures_give_the_plane_with_an_honest_covariance() {
    let camera = camera();
    let mut covariance = SMatrix::<f64, 9, 9>::zeros();
    for (k, sigma) in [0.5, 0.5, 0.5, 0.5, 2e-3, 8e-3, 1e-4, 1e-4].into_iter().enumerate() {
        covariance[(k, k)] = sigma * sigma;
    }
    let (sets, mut sum) = (40, 0.0);
    for seed in 0..sets {
        let mut random = ChaCha12Rng::seed_from_u64(1000 + seed);
        // The camera's knowledge is off by its stated amount.
        let mut known = trueline_sensor::projection::to_vector(&camera);
        for k in 0..8 {
            let z: f64 = StandardNormal.sample(&mut random);
            known[k] += z * covariance[(k, k)].sqrt();
        }
        let known = trueline_sensor::projection::from_vector(camera.size, &known);
        let views: Vec<StripedView> = striped_poses(10)
            .iter()
            .map(|pose| StripedView {
                view: view(&camera, pose, 0.15, &mut random),
                stripe: stripe(&camera, pose, 0.2, &mut random),
            })
            .collect();
        let fit = fit_joint(&KnownCamera { camera: known, covariance }, &board(), &views).unwrap();
        let error = off(&fit.plane().unwrap());
        let of_plane: nalgebra::Matrix3<f64> = fit.covariance.fixed_view::<3, 3>(9, 9).into();
        sum += error.dot(&(of_plane.try_inverse().unwrap() * error)) / 3.0;
    }
    // Forty sets of three numbers: a spread of sqrt(2/120) = 0.13 about one.
    let nees = sum / sets as f64;
    assert!((0.6..1.4).contains(&nees), "NEES {nees}");
}

/// Boards with corners where they seem to be, and a stripe where their surface is, elsewhere by a small move.
fn boards_of(
    count: usize,
    surface: impl Fn(usize) -> trueline_geometry::Pose,
    seed: u64,
) -> Vec<StripedView> {
    let (camera, mut random) = (camera(), ChaCha12Rng::seed_from_u64(seed));
    let poses = striped_poses(count);
    let mut striped = |(k, pose): (usize, &trueline_geometry::Pose)| StripedView {
        view: view(&camera, pose, 0.05, &mut random),
        stripe: stripe(&camera, &(pose * surface(k)), 0.2, &mut random),
    };
    poses.iter().enumerate().map(&mut striped).collect()
}

#[test]
fn boards_are_found_as_flat_as_they_are() {
    let exact = KnownCamera { camera: camera(), covariance: SMatrix::zeros() };
    let fitted = |bulge_m: f64| {
        // Offsets of one size and both signs, half of the boards each; nothing is twisted.
        let surface = |k: usize| {
            trueline_geometry::Pose::translation(
                0.0,
                0.0,
                if k.is_multiple_of(2) { bulge_m } else { -bulge_m },
            )
        };
        fit_joint(&exact, &board(), &boards_of(14, surface, 51)).unwrap()
    };
    let [flat, bulged] = [0.0, 0.5e-3].map(fitted);
    // Half of the numbers that count are twists, which are zero: √½ of 0.5 mm, known to 1/√(2 · 25) = 14 %.
    assert!((0.2e-3..0.5e-3).contains(&bulged.flatness_m), "{} m", bulged.flatness_m);
    // Poses are good to about 0.05 mm: smaller effects are invisible.
    assert!(flat.flatness_m < 0.06e-3, "{} m", flat.flatness_m);
    assert_eq!(bulged.left_out + flat.left_out, 0);
    let sigma = |fit: &trueline_sensor::laser_plane::JointFit| fit.covariance[(11, 11)].sqrt();
    assert!(sigma(&bulged) > 3.0 * sigma(&flat), "{} {}", sigma(&bulged), sigma(&flat));
}

#[test]
fn a_stripe_that_is_none_is_left_out_and_moves_nothing() {
    let exact = KnownCamera { camera: camera(), covariance: SMatrix::zeros() };
    let fitted = |tilt: f64| {
        let turn = trueline_geometry::so3::exp(&Vector3::new(tilt, 0.0, 0.0));
        let surface = |k: usize| {
            let turn = if k == 3 { turn } else { trueline_geometry::so3::exp(&Vector3::zeros()) };
            trueline_geometry::se3::from_parts(turn, Vector3::zeros())
        };
        fit_joint(&exact, &board(), &boards_of(10, surface, 52)).unwrap()
    };
    let (clean, wrong) = (fitted(0.0), fitted(0.15));
    assert_eq!((clean.left_out, wrong.left_out), (0, 1));
    assert!(wrong.flatness_m < 0.1e-3, "{} m", wrong.flatness_m);
    let error = off(&wrong.plane().unwrap());
    for k in 0..3 {
        let sigma = wrong.covariance[(9 + k, 9 + k)].sqrt();
        assert!(error[k].abs() < 4.5 * sigma, "{k}: {} ± {sigma}", error[k]);
    }
}

#[test]
fn the_board_to_add_is_where_none_has_been_and_helps_as_much_as_promised() {
    let camera = camera();
    let mut random = ChaCha12Rng::seed_from_u64(31);
    let mut striped = |pose: &trueline_geometry::Pose| StripedView {
        view: view(&camera, pose, 0.1, &mut random),
        stripe: stripe(&camera, pose, 0.2, &mut random),
    };
    // Nine boards between 40 and 41 cm: hardly anything tells how the plane tilts about their stripes.
    let n = plane().normal().into_inner();
    let at = |depth: f64, x: f64, tilt: f64| {
        let rotation = trueline_geometry::so3::exp(&Vector3::new(tilt, 0.3 * tilt, 0.0));
        let middle = Vector3::new(x, (plane().offset() - n.x * x - n.z * depth) / n.y, depth);
        trueline_geometry::se3::from_parts(rotation, middle - rotation * board().middle())
    };
    let mut views: Vec<StripedView> = (0..9)
        .map(|k| {
            striped(&at(
                0.40 + 0.005 * f64::from(k % 3),
                0.01 * f64::from(k - 4),
                0.3 * f64::from(k % 2) - 0.1,
            ))
        })
        .collect();
    let exact = KnownCamera { camera, covariance: SMatrix::zeros() };
    let fit = fit_joint(&exact, &board(), &views).unwrap();
    let next = next_board::best(&fit).unwrap();
    let elsewhere = next.depth_m < next.seen_m[0] || next.depth_m > next.seen_m[1];
    assert!(elsewhere || next.turn_rad != 0.0, "{next:?}");
    assert!(next.then_m < 0.9 * next.now_m, "{next:?}");
    // This board: across the laser plane, with its stripe turned as stated.
    let along = (Vector3::x() - n * n.x).normalize();
    let away = n.cross(&along);
    let direction = along * next.turn_rad.cos() + away * (next.turn_rad.sin() * away.z.signum());
    let z = direction.cross(&n);
    let z = z * z.z.signum();
    let axes = nalgebra::Matrix3::from_columns(&[direction, z.cross(&direction), z]);
    let rotation =
        nalgebra::UnitQuaternion::from_rotation_matrix(&nalgebra::Rotation3::from_matrix_unchecked(axes));
    let place = at(next.depth_m, 0.04 * f64::from(next.side), 0.0) * nalgebra::Point3::from(board().middle());
    views.push(striped(&trueline_geometry::se3::from_parts(
        rotation,
        place.coords - rotation * board().middle(),
    )));
    let after = next_board::best(&fit_joint(&exact, &board(), &views).unwrap()).unwrap();
    // Flatness and noise are estimated anew from ten boards, each good to a fifth; the board is not all where it was taken to be.
    assert!((0.6..1.4).contains(&(after.now_m / next.then_m)), "{} {}", after.now_m, next.then_m);
}
