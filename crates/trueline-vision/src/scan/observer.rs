//! Observer of the examination of a scan's pictures: a progress bar, overlays.

use crate::detection::Detection;
use crate::detector::Detector;
use crate::not_found::NotFound;
use crate::scan::error::ScanError;
use trueline_dataset::GrayImage;

/// Present work.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// A sample of the pictures is examined for every joint.
    ChoosingJoint,
    /// Every picture is examined for one joint.
    FindingSeams,
}

/// A picture that has just been examined.
#[derive(Debug)]
pub struct ExaminedPicture<'a> {
    /// Its number in the scan.
    pub number: usize,
    /// The picture.
    pub image: &'a GrayImage,
    /// Findings of the joint, or why there are none.
    pub found: &'a Result<Detection, NotFound>,
    /// The detector, which still holds the line segments of this picture.
    pub detector: &'a Detector,
}

/// Receives events, from several threads and in any order. Every method does nothing unless it is written.
pub trait ScanObserver: Sync {
    /// A stage begins; `of` pictures are examined in it.
    fn begins(&self, _stage: Stage, _pictures: usize) {}

    /// One more picture is done with.
    fn advances(&self, _stage: Stage) {}

    /// A stage is over.
    fn ends(&self, _stage: Stage) {}

    /// A picture was examined for its seam.
    ///
    /// # Errors
    /// Error that should stop the examination of the others.
    fn examined(&self, _picture: &ExaminedPicture<'_>) -> Result<(), ScanError> {
        Ok(())
    }
}

/// No observer.
impl ScanObserver for () {}
