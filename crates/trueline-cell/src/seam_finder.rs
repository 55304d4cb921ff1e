//! Seam points in the pictures of a live camera.

use trueline_camera::SourceAbout;
use trueline_dataset::{Feature, GrayImage, Measured, Pixels, Sensor};
use trueline_vision::{Detector, Joint, Lens, Picture};

use crate::error::CellError;

/// Finds the seam in picture after picture.
pub struct SeamFinder {
    detector: Detector,
    joint: Joint,
}

impl SeamFinder {
    /// For the pictures of a source; `None` if the sensor is no camera with a laser plane.
    ///
    /// # Errors
    /// [`CellError::PictureSize`] if the source's pictures are not of the size of the calibrated camera.
    pub fn new(sensor: &Sensor, joint: Joint, about: &SourceAbout) -> Result<Option<Self>, CellError> {
        let Sensor::CameraLaser { camera, laser_plane_in_camera } = sensor else { return Ok(None) };
        let (found, expected) = ([about.width, about.height], camera.size.map(|n| n as usize));
        if found != expected {
            return Err(CellError::PictureSize { name: about.name.clone(), found, expected });
        }
        Ok(Some(Self { detector: Detector::new(Lens::new(*camera, *laser_plane_in_camera)), joint }))
    }

    /// The seam's pixel and its sigma as a feature of a frame; `None` if the picture shows no seam.
    pub fn find(
        &mut self,
        image: &GrayImage,
        stamp_ns: i64,
        frame: u64,
        device_ns: Option<i64>,
    ) -> Option<Feature> {
        let Self { detector, joint } = self;
        let (width, height) = (image.width, image.height);
        let seam = match &image.pixels {
            Pixels::Eight(levels) => detector.seam(&Picture::new(width, height, levels)?, *joint),
            Pixels::Sixteen(levels) => detector.seam(&Picture::new(width, height, levels)?, *joint),
        }
        .ok()?;
        let (measured, sigma) = (Measured::Pixel(seam.pixel.into()), Some(seam.sigma_px()));
        Some(Feature { stamp_ns, line: 0, frame: Some(frame), device_ns, measured, sigma })
    }
}
