//! Rendered pictures with their truth, and what a detector makes of them.
#![allow(dead_code, reason = "each test uses a part")]

use nalgebra::Vector2;
use trueline_dataset::{GrayImage, Pixels};
use trueline_sim::{Joint as Scene, Look, PictureScan, Preset, Scenario, SensorModel};
use trueline_vision::{Detector, Joint, Lens, NotFound, Picture, Seam};

/// A well excited scan with so many pictures.
pub(crate) fn scenario(pictures: usize) -> Scenario {
    let mut scenario = Preset::Quick.scenario();
    scenario.timing.frame_period_s = scenario.timing.duration_s / (pictures as f64 + 1.0);
    scenario
}

/// A detector for a scenario's camera.
pub(crate) fn detector(scenario: &Scenario) -> Detector {
    let SensorModel::CameraLaser { camera, laser_plane_in_camera } = scenario.cell.sensor else {
        panic!("the scan has a camera");
    };
    Detector::new(Lens::new(camera, laser_plane_in_camera))
}

/// Pictures of a scan with the true seam, where it is visible.
pub(crate) fn pictures(
    scenario: &Scenario,
    scene: Scene,
    look: Look,
    seed: u64,
) -> Vec<(GrayImage, Option<Vector2<f64>>)> {
    let scan = PictureScan::new(scenario, scene, look, seed).unwrap();
    let mut renderer = scan.renderer();
    let draw = |exposed| {
        let picture = scan.draw(&mut renderer, exposed);
        (picture.image, picture.seam_px)
    };
    scan.exposures().iter().map(draw).collect()
}

/// Pictures of a scan with where the lines of the joint are, if they are visible.
pub(crate) fn pictures_with_lines(
    scenario: &Scenario,
    scene: Scene,
    look: Look,
    seed: u64,
) -> Vec<(GrayImage, Vec<Vector2<f64>>)> {
    let scan = PictureScan::new(scenario, scene, look, seed).unwrap();
    let mut renderer = scan.renderer();
    let draw = |exposed| {
        let picture = scan.draw(&mut renderer, exposed);
        (picture.image, picture.seam_px.into_iter().chain(picture.second_px).collect())
    };
    scan.exposures().iter().map(draw).collect()
}

/// The seam in a picture.
pub(crate) fn seam(detector: &mut Detector, image: &GrayImage, joint: Joint) -> Result<Seam, NotFound> {
    match &image.pixels {
        Pixels::Eight(levels) => {
            detector.seam(&Picture::new(image.width, image.height, levels).unwrap(), joint)
        }
        Pixels::Sixteen(levels) => {
            detector.seam(&Picture::new(image.width, image.height, levels).unwrap(), joint)
        }
    }
}

/// How well a detector does on a set of pictures.
#[derive(Debug, Default)]
pub(crate) struct Score {
    pub visible: usize,
    pub found: usize,
    pub invented: usize,
    pub errors: Vec<Vector2<f64>>,
    /// Squared error, normalised by the covariance: 2 on average.
    pub normalised: Vec<f64>,
}

impl Score {
    pub(crate) fn of(
        detector: &mut Detector,
        pictures: &[(GrayImage, Option<Vector2<f64>>)],
        joint: Joint,
    ) -> Self {
        let mut score = Self::default();
        for (image, truth) in pictures {
            let found = seam(detector, image, joint);
            match (truth, found) {
                (Some(truth), Ok(seam)) => {
                    score.visible += 1;
                    score.found += 1;
                    let error = seam.pixel - truth;
                    score.errors.push(error);
                    let inverse = seam.covariance_px2.try_inverse().unwrap();
                    score.normalised.push((error.transpose() * inverse * error)[0]);
                }
                (Some(_), Err(_)) => score.visible += 1,
                (None, Ok(_)) => score.invented += 1,
                (None, Err(_)) => {}
            }
        }
        score
    }

    pub(crate) fn rms_px(&self) -> f64 {
        (self.errors.iter().map(Vector2::norm_squared).sum::<f64>() / self.errors.len() as f64).sqrt()
    }

    pub(crate) fn worst_px(&self) -> f64 {
        self.errors.iter().map(Vector2::norm).fold(0.0, f64::max)
    }

    pub(crate) fn mean_normalised(&self) -> f64 {
        self.normalised.iter().sum::<f64>() / self.normalised.len() as f64
    }
}
