//! Rendered pictures of a board: corners, camera, stripe and plane, from gray levels to the result.

use crate::scenes;

use nalgebra::{SMatrix, Vector2, Vector3};
use scenes::{board, camera, plane, poses, striped_poses};
use trueline_dataset::{GrayImage, Pixels};
use trueline_geometry::{Pose, se3, so3};
use trueline_sensor::intrinsics::{DistortionModel, fit};
use trueline_sensor::laser_plane::{BoardPicture, KnownCamera, StripeOn, fit_pictures, striped_picture};
use trueline_sensor::projection::{project_from_board, to_vector};
use trueline_sensor::{Board, Gray, View, chessboard};
use trueline_sim::boards::{BoardScene, Stripe, render};

fn scene(pose: Pose, stripe: Option<Stripe>) -> BoardScene {
    BoardScene {
        camera: camera(),
        camera_from_board: pose,
        corners: [board().columns, board().rows],
        square_m: board().square_m,
        levels: [40.0, 150.0, 90.0],
        blur_px: 0.8,
        noise: 2.0,
        stripe,
    }
}

fn gray(image: &GrayImage) -> Gray {
    let Pixels::Eight(levels) = &image.pixels else { panic!("eight bits were rendered") };
    Gray::new(image.width, image.height, levels.iter().map(|l| f32::from(*l)).collect()).unwrap()
}

fn laser() -> Stripe {
    Stripe { laser_plane_in_camera: plane(), brightness: 100.0, thickness_m: 0.4e-3 }
}

/// Poses whose whole board is in the picture.
fn whole(count: usize) -> Vec<Pose> {
    let inside = |p: &Vector2<f64>| p.x > 25.0 && p.y > 25.0 && p.x < 615.0 && p.y < 455.0;
    let seen = |pose: &Pose| {
        (0..board().rows).all(|row| {
            (0..board().columns).all(|column| {
                let point = board().corner(column, row);
                project_from_board(&camera(), pose, &point).is_some_and(|seen| inside(&seen.pixel))
            })
        })
    };
    poses(80).into_iter().filter(seen).take(count).collect()
}

/// Distances between the corners that were found and the nearest true ones, px: the board may be counted from its other end.
fn distances(view: &View, pose: &Pose) -> Vec<f64> {
    let truth: Vec<Vector2<f64>> = (0..board().rows)
        .flat_map(|row| (0..board().columns).map(move |column| board().corner(column, row)))
        .map(|point| project_from_board(&camera(), pose, &point).unwrap().pixel)
        .collect();
    let nearest = |p: &Vector2<f64>| truth.iter().map(|t| (t - p).norm()).fold(f64::INFINITY, f64::min);
    view.corners.iter().map(|corner| nearest(&corner.pixel)).collect()
}

#[test]
fn every_corner_is_found_to_a_few_hundredths_of_a_pixel_and_the_camera_follows() {
    let mut views = Vec::new();
    for (k, pose) in whole(10).iter().enumerate() {
        let picture = gray(&render(&scene(*pose, None), k as u64));
        let view = chessboard::find(&picture, &board()).unwrap();
        assert!(view.complete, "picture {k}: {} corners", view.corners.len());
        let off = distances(&view, pose);
        let rms = (off.iter().map(|d| d * d).sum::<f64>() / off.len() as f64).sqrt();
        assert!(rms < 0.08, "picture {k}: {rms} px");
        views.push(view);
    }
    let fit = fit(camera().size, &board(), &views, Some(DistortionModel::K1K2P1P2)).unwrap();
    assert!(fit.rms_px < 0.08, "{} px", fit.rms_px);
    let off = to_vector(&fit.state.camera) - to_vector(&camera());
    for k in 0..8 {
        // Eight numbers, none beyond 4.5 standard deviations.
        assert!(off[k].abs() < 4.5 * fit.sigma()[k], "parameter {k}: {} ± {}", off[k], fit.sigma()[k]);
    }
}

#[test]
fn a_board_of_another_size_and_a_picture_without_one_are_told() {
    let pose = whole(1)[0];
    let picture = gray(&render(&scene(pose, None), 1));
    let smaller = Board { columns: 7, rows: 5, square_m: 0.02 };
    let error = chessboard::find(&picture, &smaller).unwrap_err();
    assert!(matches!(error, chessboard::NoBoard::OtherSize { columns: 9, rows: 6, .. }), "{error}");
    let empty = Gray::new(320, 240, vec![90.0; 320 * 240]).unwrap();
    assert_eq!(chessboard::find(&empty, &board()).unwrap_err(), chessboard::NoBoard::Nothing);
}

/// Corners that a stripe's light falls on are moved by it, all of a row to one side. The kept corners are as good as without
/// laser.
#[test]
fn corners_under_the_stripe_are_left_out() {
    let square = |off: &[f64]| off.iter().map(|d| d * d).sum::<f64>() / off.len() as f64;
    let [mut all, mut kept, mut dark] = [Vec::new(), Vec::new(), Vec::new()];
    let (mut seen, poses) = (Vec::new(), striped_poses(9));
    for (k, pose) in poses.iter().enumerate() {
        let lit = gray(&render(&scene(*pose, Some(laser())), 150 + k as u64));
        seen.push(striped_picture::look(&lit, None, &camera(), (&board(), StripeOn::Sheet)).unwrap());
        all.extend(distances(&chessboard::find(&lit, &board()).unwrap(), pose));
        let picture = gray(&render(&scene(*pose, None), 190 + k as u64));
        dark.extend(distances(&chessboard::find(&picture, &board()).unwrap(), pose));
    }
    let exact = KnownCamera { camera: camera(), covariance: SMatrix::zeros() };
    for (k, striped) in fit_pictures(&exact, &board(), &seen).unwrap().views {
        kept.extend(distances(&striped.view, &poses[k]));
    }
    // Some 200 corners of two axes: squares are good to 1/√200 = 7 %, three times that to a quarter.
    assert!(kept.len() > 150 && kept.len() < all.len(), "{} of {}", kept.len(), all.len());
    assert!(square(&kept) < 1.25 * square(&dark), "{} {}", square(&kept), square(&dark));
    assert!(square(&all) > 1.5 * square(&dark), "{} {}", square(&all), square(&dark));
}

#[test]
fn the_plane_follows_from_stripes_on_boards_alone_and_in_pairs() {
    for pairs in [false, true] {
        let looked: Vec<BoardPicture> = striped_poses(9)
            .iter()
            .enumerate()
            .map(|(k, pose)| {
                let lit = gray(&render(&scene(*pose, Some(laser())), 50 + k as u64));
                let dark = gray(&render(&scene(*pose, None), 90 + k as u64));
                let dark = pairs.then_some(&dark);
                striped_picture::look(&lit, dark, &camera(), (&board(), StripeOn::Sheet)).unwrap()
            })
            .collect();
        let exact = KnownCamera { camera: camera(), covariance: SMatrix::zeros() };
        let fitted = fit_pictures(&exact, &board(), &looked).unwrap();
        let used = fitted.pictures.iter().filter(|picture| picture.is_ok()).count();
        assert!(used >= 8, "pairs {pairs}: {:?}", fitted.pictures);
        let fit = fitted.fit;
        let found = fit.plane().unwrap();
        let tilt = found.normal().cross(plane().normal()).norm().to_degrees();
        let sigma = fit.covariance[(9, 9)].max(fit.covariance[(10, 10)]).sqrt().to_degrees();
        assert!(tilt < 4.5 * sigma && tilt < 0.1, "pairs {pairs}: {tilt} ± {sigma}°");
        let off = (found.offset() - plane().offset()).abs();
        let sigma = fit.covariance[(11, 11)].sqrt();
        assert!(off < 4.5 * sigma && off < 0.5e-3, "pairs {pairs}: {off} ± {sigma} m");
    }
}

/// A stripe of every width that a seam's may have, on a plain plate that is lit itself; without a laser there is none.
#[test]
fn stripes_of_all_widths_are_found_on_a_plate_and_none_where_there_is_none() {
    let depth_m = 0.45;
    let pose = se3::from_parts(so3::exp(&(Vector3::x() * 0.15)), Vector3::new(0.0, 0.0, depth_m));
    let plate = |stripe: Option<Stripe>| BoardScene { corners: [0, 0], square_m: 0.5, ..scene(pose, stripe) };
    for (k, width_px) in [0.7, 1.5, 4.0, 10.0, 20.0, 40.0].into_iter().enumerate() {
        // Widths at half of the height; the plate is nearly square to the view.
        let thickness_m = width_px / 2.355 * depth_m / camera().focal.y;
        let picture = gray(&render(&plate(Some(Stripe { thickness_m, ..laser() })), 300 + k as u64));
        let middles = striped_picture::on_plate(&picture, &camera()).unwrap();
        assert!(middles.len() > 20, "{width_px} px: {} middles", middles.len());
        let off_px: Vec<f64> = middles
            .iter()
            .map(|pixel| {
                let (ray, _) = camera().ray(pixel).unwrap();
                let (normal, origin) = (pose.rotation * Vector3::z(), pose.translation.vector);
                let point = ray * (normal.dot(&origin) / normal.dot(&ray));
                plane().signed_distance(&point) * camera().focal.y / point.z
            })
            .collect();
        let mean_px = off_px.iter().sum::<f64>() / off_px.len() as f64;
        // Noise of two levels in a hundred; the tilt of the laser to the plate makes a distance of the plane at most as long
        // as one in the picture.
        assert!(mean_px.abs() < 0.05 + 0.01 * width_px, "{width_px} px: {mean_px} px off");
    }
    let dark = gray(&render(&plate(None), 340));
    assert!(striped_picture::on_plate(&dark, &camera()).is_err());
}
