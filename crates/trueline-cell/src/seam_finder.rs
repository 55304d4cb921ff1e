//! Seam points in the pictures or profiles of a live sensor.

use trueline_camera::SourceAbout;
use trueline_dataset::{Feature, FrameStamp, GrayImage, Profile, ProfilePoint, Sensor};
use trueline_mcap::ProfileEntry;
use trueline_vision::profile::{ProfileJoint, ProfileStream};
use trueline_vision::{Detector, Joint};

use crate::error::CellError;

/// Finds the seam in picture after picture, or profile after profile.
pub enum SeamFinder {
    /// In pictures of a camera with a laser plane.
    Pictures {
        /// Finds the stripe and the seam in it.
        detector: Box<Detector>,
        /// Appearance of the stripe there.
        joint: Joint,
    },
    /// In profiles, by the second.
    Profiles(ProfileStream),
}

impl SeamFinder {
    /// For the frames of a source; `None` if the sensor is neither a profiler nor a camera with a laser plane. Without a
    /// joint profiles determine it, and pictures are those of a fillet.
    ///
    /// # Errors
    /// [`CellError::PictureSize`] if the source's pictures are not of the size of the calibrated camera, [`CellError::NotInProfiles`] for a
    /// joint that profiles are not searched for.
    pub fn new(
        sensor: &Sensor,
        joint: Option<Joint>,
        about: &SourceAbout,
    ) -> Result<Option<Self>, CellError> {
        if *sensor == Sensor::Profiler {
            let of = |joint| ProfileJoint::of(joint).ok_or(CellError::NotInProfiles { joint });
            return Ok(Some(Self::Profiles(ProfileStream::new(joint.map(of).transpose()?))));
        }
        let joint = joint.unwrap_or(Joint::Fillet);
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

    /// Takes a profile in, and returns the seam points of the waiting ones.
    pub(crate) fn in_profile(&mut self, seen: &ProfileEntry) -> Vec<Feature> {
        let Self::Profiles(stream) = self else { return Vec::new() };
        let point = |[x_m, z_m]: [f64; 2]| ProfilePoint { x_m, z_m, intensity: None };
        let points = seen.columns.iter().flatten().copied().map(point).collect();
        stream.push(Profile { stamp_ns: seen.stamp_ns, frame: Some(seen.profile), points })
    }

    /// The seam points of the profiles that still wait: nothing more comes.
    pub fn finish(&mut self) -> Vec<Feature> {
        let Self::Profiles(stream) = self else { return Vec::new() };
        stream.finish()
    }
}
