//! Seam points in the pictures of a live camera.

use trueline_camera::SourceAbout;
use trueline_dataset::{Feature, FrameStamp, GrayImage, Sensor};
use trueline_vision::{Detector, Joint};

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
        let Some(detector) = Detector::for_sensor(sensor) else { return Ok(None) };
        let camera = detector.lens().camera();
        let (found, expected) = ([about.width, about.height], camera.size.map(|n| n as usize));
        if found != expected {
            return Err(CellError::PictureSize { name: about.name.clone(), found, expected });
        }
        Ok(Some(Self { detector, joint }))
    }

    /// The seam's pixel and its sigma as a feature of a frame; `None` if the picture shows no seam.
    pub fn find(&mut self, image: &GrayImage, stamp: &FrameStamp) -> Option<Feature> {
        Some(self.detector.seam_in(image, self.joint).ok()?.feature(stamp))
    }
}
