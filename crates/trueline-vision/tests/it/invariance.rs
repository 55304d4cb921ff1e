//! Invariances: bits, direction of the stripe, earlier pictures.

use crate::scenes;

use nalgebra::Vector3;
use scenes::{detector, pictures, scenario, seam};
use trueline_dataset::{GrayImage, Pixels};
use trueline_geometry::Plane;
use trueline_model::{BrownConrady, Camera};
use trueline_sim::{Joint as Scene, Look, SensorModel};
use trueline_vision::{Detector, Joint, Lens};

fn eight(image: &GrayImage) -> &[u8] {
    match &image.pixels {
        Pixels::Eight(levels) => levels,
        Pixels::Sixteen(_) => panic!("eight bits were asked for"),
    }
}

#[test]
fn sixteen_bits_of_the_same_picture_give_the_same_seam() {
    let scenario = scenario(4);
    let mut detector = detector(&scenario);
    for (image, _) in pictures(&scenario, Scene::fillet(), Look::speckled(), 2) {
        let wide = eight(&image).iter().map(|level| u16::from(*level) * 16).collect();
        let wide = GrayImage { pixels: Pixels::Sixteen(wide), ..image.clone() };
        let (a, b) = (seam(&mut detector, &image, Joint::Fillet), seam(&mut detector, &wide, Joint::Fillet));
        // Sums of single precision round differently by 1e-7 of a reach of 10 px.
        assert!((a.unwrap().pixel - b.unwrap().pixel).norm() < 1e-4);
    }
}

/// A picture mirrored in its diagonal, seen by the camera mirrored likewise, has the mirrored seam: columns
/// and rows are treated alike.
#[test]
fn a_stripe_across_is_as_good_as_one_along() {
    let scenario = scenario(6);
    let mut upright = detector(&scenario);
    let SensorModel::CameraLaser { camera, laser_plane_in_camera } = scenario.cell.sensor else { panic!() };
    let d = camera.distortion;
    let lying = Camera {
        size: [camera.size[1], camera.size[0]],
        focal: camera.focal.yx(),
        centre: camera.centre.yx(),
        distortion: BrownConrady { p1: d.p2, p2: d.p1, ..d },
    };
    let n = laser_plane_in_camera.normal();
    let plane = Plane::new(Vector3::new(n.y, n.x, n.z), laser_plane_in_camera.offset()).unwrap();
    let mut lying = Detector::new(Lens::new(lying, plane));
    for (scene, joint, look) in [
        (Scene::fillet(), Joint::Fillet, Look::clean()),
        (Scene::fillet(), Joint::Fillet, Look::speckled()),
        (Scene::Lap { step_m: 3e-3 }, Joint::Lap, Look::speckled()),
    ] {
        for (image, truth) in pictures(&scenario, scene, look, 2) {
            if truth.is_none() {
                continue;
            }
            let levels = eight(&image);
            let across: Vec<u8> = (0..image.width)
                .flat_map(|u| (0..image.height).map(move |v| (u, v)))
                .map(|(u, v)| levels[v * image.width + u])
                .collect();
            let mirrored =
                GrayImage { width: image.height, height: image.width, pixels: Pixels::Eight(across) };
            let a = seam(&mut upright, &image, joint).unwrap();
            let b = seam(&mut lying, &mirrored, joint).unwrap();
            let sigma = a.covariance_px2.trace().sqrt();
            // Tiles are looked at in another order and every second row is another one: the start differs, and
            // the answer by a part of its uncertainty.
            let apart = (a.pixel - b.pixel.yx()).norm();
            assert!(apart < 0.02 + 0.7 * sigma, "{joint:?}: {apart:.4} px apart, sigma {sigma:.4}");
        }
    }
}

#[test]
fn a_picture_gives_the_same_seam_whatever_was_seen_before() {
    let scenario = scenario(5);
    let fillets = pictures(&scenario, Scene::fillet(), Look::shiny(), 2);
    let laps = pictures(&scenario, Scene::Lap { step_m: 3e-3 }, Look::welding(), 3);
    let mut fresh: Vec<_> =
        fillets.iter().map(|(image, _)| seam(&mut detector(&scenario), image, Joint::Fillet)).collect();
    let mut used = detector(&scenario);
    for (fillet, lap) in fillets.iter().zip(&laps) {
        let _ = seam(&mut used, &lap.0, Joint::Lap);
        assert_eq!(seam(&mut used, &fillet.0, Joint::Fillet), fresh.remove(0));
    }
}
