//! Seam points in the pictures or profiles of a live sensor.

use trueline_camera::SourceAbout;
use trueline_dataset::{Feature, FrameStamp, GrayImage, Profile, ProfilePoint, Sensor};
use trueline_mcap::ProfileEntry;
use trueline_vision::{Detector, Joint, profile};

use crate::error::CellError;

/// Finds the seam in picture after picture, or profile after profile.
pub enum SeamFinder {
    /// In pictures of a camera with a laser plane.
    Pictures {
        /// Finds the stripe and the seam in it.
        detector: Box<Detector>,
        /// What the stripe looks like there.
        joint: Joint,
    },
    /// In profiles: where two faces meet, or the edge of a lap.
    Profiles,
}

impl SeamFinder {
    /// For the frames of a source; `None` if the sensor is neither a profiler nor a camera with a laser plane.
    ///
    /// # Errors
    /// [`CellError::PictureSize`] if the source's pictures are not of the size of the calibrated camera.
    pub fn new(sensor: &Sensor, joint: Joint, about: &SourceAbout) -> Result<Option<Self>, CellError> {
        if *sensor == Sensor::Profiler {
            return Ok(Some(Self::Profiles));
        }
        let Some(detector) = Detector::for_sensor(sensor) else { return Ok(None) };
        let camera = detector.lens().camera();
        let (found, expected) = ([about.width, about.height], camera.size.map(|n| n as usize));
        if found != expected {
            return Err(CellError::PictureSize { name: about.name.clone(), found, expected });
        }
        Ok(Some(Self::Pictures { detector: Box::new(detector), joint }))
    }

    /// The seam's pixel and its sigma as a feature of a frame; `None` if the picture shows no seam.
    pub fn find(&mut self, image: &GrayImage, stamp: &FrameStamp) -> Option<Feature> {
        let Self::Pictures { detector, joint } = self else { return None };
        Some(detector.seam_in(image, *joint).ok()?.feature(stamp))
    }

    /// The corner of a profile as a feature; `None` if there is none.
    pub fn in_profile(&mut self, seen: &ProfileEntry) -> Option<Feature> {
        let Self::Profiles = self else { return None };
        let point = |[x_m, z_m]: [f64; 2]| ProfilePoint { x_m, z_m, intensity: None };
        let points = seen.columns.iter().flatten().copied().map(point).collect();
        let profile = Profile { stamp_ns: seen.stamp_ns, frame: Some(seen.profile), points };
        profile::seams(std::slice::from_ref(&profile), None).found.features.pop()
    }
}
