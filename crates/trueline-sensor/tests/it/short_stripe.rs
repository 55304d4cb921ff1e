//! A stripe that is seen in two or three white squares of each board, in pictures that another program drew.
#![allow(clippy::print_stderr, reason = "a skipped test says so")]

use nalgebra::{SMatrix, Vector2, Vector3};
use std::path::{Path, PathBuf};
use trueline_dataset::gray_picture;
use trueline_model::{BrownConrady, Camera};
use trueline_sensor::laser_plane::{BoardPicture, KnownCamera, StripeOn, fit_pictures, striped_picture};
use trueline_sensor::{Board, Gray};

/// The camera that drew them.
fn camera() -> Camera {
    Camera {
        size: [850, 600],
        focal: Vector2::repeat(716.0),
        centre: Vector2::new(424.5, 299.5),
        distortion: BrownConrady::default(),
    }
}

#[test]
fn a_stripe_on_white_squares_only_gives_the_plane() {
    let folder =
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/cases/short-stripe-board/lit");
    let Ok(entries) = std::fs::read_dir(&folder) else {
        eprintln!("SKIPPED: cases_short_stripe: there is no {}", folder.display());
        return;
    };
    let mut files: Vec<PathBuf> = entries.map(|entry| entry.unwrap().path()).collect();
    files.sort();
    let known = KnownCamera { camera: camera(), covariance: SMatrix::zeros() };
    for board in [[6, 7], [7, 6]].map(|[columns, rows]| Board { columns, rows, square_m: 0.030 }) {
        let looked: Vec<BoardPicture> = files
            .iter()
            .map(|file| {
                let image = gray_picture::decode(file, &gray_picture::bytes(file).unwrap()).unwrap();
                let picture = Gray::new(image.width, image.height, image.levels_f32()).unwrap();
                striped_picture::look(&picture, None, &known.camera, (&board, StripeOn::Sheet)).unwrap()
            })
            .collect();
        let found = fit_pictures(&known, &board, &looked).unwrap();
        // In the third picture three pieces of 15 px lie at the corners of squares, where their middles are drawn aside.
        let used = found.pictures.iter().filter(|picture| picture.is_ok()).count();
        assert!(used >= 4, "{:?}", found.pictures);
        let plane = found.fit.plane().unwrap();
        let (normal, sigma) = (Vector3::new(-0.9995, 0.018, 0.0248).normalize(), &found.fit.covariance);
        let turned_rad = plane.normal().cross(&normal).norm();
        let turned_sigma_rad = (sigma[(9, 9)] + sigma[(10, 10)]).sqrt();
        assert!(turned_rad < 3.0 * turned_sigma_rad, "{turned_rad} ± {turned_sigma_rad}");
        let offset_m = (normal.x * -20.0 + normal.z * 450.0) * 1e-3;
        let off_m = (plane.offset() - offset_m).abs();
        assert!(off_m < 3.0 * sigma[(11, 11)].sqrt() && off_m < 0.5e-3, "{off_m}");
    }
}
