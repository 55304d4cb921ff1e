//! A camera, a laser plane and boards before them, for tests.
#![allow(dead_code, reason = "every test uses a part of it")]

pub(crate) mod plate;

use nalgebra::{UnitQuaternion, Vector2, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha12Rng;
use rand_distr::{Distribution, Normal, StandardNormal};
use trueline_geometry::{Plane, Pose, se3, so3};
use trueline_model::{BrownConrady, Camera};
use trueline_sensor::bundle::{BoardState, Bundle, BundleState, CameraPrior, Picture};
use trueline_sensor::projection::{CAMERA_SIZE, project_from_board};
use trueline_sensor::sheet::SheetShape;
use trueline_sensor::stripe_residual::StripePixel;
use trueline_sensor::{Board, FoundCorner, View};

pub(crate) fn camera() -> Camera {
    Camera {
        size: [640, 480],
        focal: Vector2::new(533.0, 531.0),
        centre: Vector2::new(325.0, 236.0),
        distortion: BrownConrady { k1: -0.2, k2: 0.06, p1: 8e-4, p2: -5e-4, k3: 0.0 },
    }
}

pub(crate) fn board() -> Board {
    Board { columns: 9, rows: 6, square_m: 0.020 }
}

/// A laser plane that crosses the view about half a metre away, 60° to the camera's axis.
pub(crate) fn plane() -> Plane {
    Plane::new(Vector3::new(0.03, 0.866, 0.5), 0.2).unwrap()
}

/// Poses of the board: tilted to every side, near and far, over the whole picture.
pub(crate) fn poses(count: usize) -> Vec<Pose> {
    let golden = 2.399_963;
    (0..count)
        .map(|k| {
            let angle = golden * k as f64;
            let tilt = 0.25 + 0.3 * (k % 3) as f64 / 2.0;
            let rotation = so3::exp(&(Vector3::new(angle.cos(), angle.sin(), 0.0) * tilt))
                * UnitQuaternion::from_scaled_axis(Vector3::z() * 0.3 * (1.7 * angle).sin());
            let depth = 0.33 + 0.09 * (k % 4) as f64;
            let aside = Vector3::new((2.0 * angle).cos() * 0.18, (2.0 * angle).sin() * 0.12, 1.0) * depth;
            se3::from_parts(rotation, aside - rotation * board().middle())
        })
        .collect()
}

/// Corners as the camera sees them, with noise, of what is in the picture.
pub(crate) fn view(camera: &Camera, pose: &Pose, noise_px: f64, random: &mut ChaCha12Rng) -> View {
    let noise = Normal::new(0.0, noise_px).unwrap();
    let mut corners = Vec::new();
    for row in 0..board().rows {
        for column in 0..board().columns {
            let seen = project_from_board(camera, pose, &board().corner(column, row)).unwrap().pixel;
            let pixel = seen + Vector2::new(noise.sample(random), noise.sample(random));
            let inside = pixel.x > 5.0 && pixel.y > 5.0 && pixel.x < 634.0 && pixel.y < 474.0;
            if inside {
                corners.push(FoundCorner { column, row, pixel });
            }
        }
    }
    View { complete: corners.len() == board().corners(), corners }
}

/// Pixels of the stripe on a board: points of the line where plane and board meet, projected, with noise across.
pub(crate) fn stripe(
    camera: &Camera,
    pose: &Pose,
    noise_px: f64,
    random: &mut ChaCha12Rng,
) -> Vec<Vector2<f64>> {
    let plane = plane();
    let mut pixels = Vec::new();
    for k in 0..60 {
        let x = -0.02 + 0.2 * f64::from(k) / 59.0;
        // Along y of the board, where n·(R (x, y, 0) + t) = d.
        let n = pose.rotation.inverse() * plane.normal().into_inner();
        let y = (plane.offset() - plane.normal().dot(&pose.translation.vector) - n.x * x) / n.y;
        if !(-0.02..0.12).contains(&y) {
            continue;
        }
        let Some(seen) = project_from_board(camera, pose, &Vector3::new(x, y, 0.0)) else { continue };
        let noise = Vector2::new(StandardNormal.sample(random), StandardNormal.sample(random)) * noise_px;
        let pixel: Vector2<f64> = seen.pixel + noise;
        if pixel.x > 0.0 && pixel.y > 0.0 && pixel.x < 639.0 && pixel.y < 479.0 {
            pixels.push(pixel);
        }
    }
    pixels
}

/// A problem with corners, stripes, flatness and a prior, and a state near its optimum.
pub(crate) fn striped_bundle(seed: u64) -> (Bundle, BundleState) {
    let mut random = ChaCha12Rng::seed_from_u64(seed);
    let camera = camera();
    let mut pictures = Vec::new();
    let mut boards = Vec::new();
    for pose in poses(6) {
        let stripe = stripe(&camera, &pose, 0.2, &mut random);
        let middle = stripe.iter().sum::<Vector2<f64>>() / stripe.len().max(1) as f64;
        pictures.push(Picture {
            corners: view(&camera, &pose, 0.2, &mut random).corners,
            stripe: (stripe.iter())
                .map(|p| StripePixel { pixel: *p, px_per_m: 900.0, along_m: (p - middle).x * 1e-3 })
                .collect(),
        });
        boards.push(BoardState::flat(pose));
    }
    let covariance = nalgebra::SMatrix::<f64, CAMERA_SIZE, CAMERA_SIZE>::from_diagonal(
        &nalgebra::SVector::from_column_slice(&[2.0, 2.0, 2.0, 2.0, 1e-3, 1e-2, 1e-6, 1e-6, 1e-2]),
    );
    let mut near = camera;
    near.focal.x += 1.0;
    near.distortion.k1 += 0.003;
    let bundle = Bundle {
        board: board(),
        pictures,
        corner_sigma_px: 0.2,
        stripe_sigma_px: 0.3,
        flatness_m: 5e-5,
        camera_prior: CameraPrior::new(&near, &covariance),
    };
    (
        bundle,
        BundleState {
            camera: near,
            laser_plane_in_camera: Some(plane()),
            sheet: SheetShape::new([0.02, -0.01, 0.03, 1e-3, -5e-4]),
            boards,
        },
    )
}

/// Poses whose middle is on the laser plane: tilted to every side, near and far, from the left to the right.
pub(crate) fn striped_poses(count: usize) -> Vec<Pose> {
    let plane = plane();
    let n = plane.normal().into_inner();
    (0..count)
        .map(|k| {
            let angle = 2.399_963 * k as f64;
            let tilt = 0.1 + 0.35 * (k % 3) as f64 / 2.0;
            let rotation = so3::exp(&(Vector3::new(angle.cos(), angle.sin(), 0.0) * tilt));
            let depth = 0.33 + 0.14 * (k % 5) as f64 / 4.0;
            let x = 0.04 * (2.0 * angle).cos();
            let middle = Vector3::new(x, (plane.offset() - n.x * x - n.z * depth) / n.y, depth);
            se3::from_parts(rotation, middle - rotation * board().middle())
        })
        .collect()
}
