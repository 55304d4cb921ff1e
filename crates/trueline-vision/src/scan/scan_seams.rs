//! Seams found in the pictures of a scan.

use crate::detection::Detection;
use crate::not_found::NotFound;
use crate::scan::error::ScanError;
use crate::scan::picture_fault::PictureFault;
use crate::seam::{Joint, Seam};
use std::collections::BTreeMap;
use std::time::Duration;
use trueline_dataset::{Feature, FoundSeams, FrameStamp, PlateStripe};

/// Reason for the joint of the search.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum JointSource {
    /// The caller named it.
    Given,
    /// Most pictures show it.
    Pictures,
    /// The pictures show none; one is taken so that there are reasons.
    Default,
}

/// One picture of a scan.
#[derive(Clone, Debug)]
pub struct ScanFrame {
    /// When it was taken.
    pub stamp: FrameStamp,
    /// Its name for people.
    pub name: String,
    /// Findings of the joint, or why there are none.
    pub found: Result<Detection, NotFound>,
}

/// Pictures that have no seam for one kind of reason.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SkippedPictures {
    /// Number.
    pub count: usize,
    /// The reason of the picture in the middle of them, by the number that decided.
    pub typical: NotFound,
}

/// The seams of a scan.
#[derive(Debug)]
pub struct ScanSeams {
    /// The joint of the search.
    pub joint: Joint,
    /// Why that one.
    pub joint_source: JointSource,
    /// All pictures in the order of the scan.
    pub frames: Vec<ScanFrame>,
    /// Why pictures could not be used, one by one; they are among the frames.
    pub unreadable: Vec<ScanError>,
    /// Fault of most pictures, and the setting to change.
    pub faults: Vec<PictureFault>,
    /// How far a second place of the seam is from the first, px, where the scan shows two in turn.
    pub second_place_px: Option<f64>,
    /// How far a point typically is from where its neighbours have it, px; `None` with too few points.
    pub neighbour_distance_px: Option<f64>,
    /// Time in detection alone, summed over threads.
    pub detection_time: Duration,
    /// Width and height of the pictures, px.
    pub size_px: [u32; 2],
}

impl ScanSeams {
    /// Findings, picture by picture, with their stamps.
    pub fn detections(&self) -> impl Iterator<Item = (&FrameStamp, &Detection)> {
        self.frames.iter().filter_map(|frame| Some((&frame.stamp, frame.found.as_ref().ok()?)))
    }

    /// All seam points that were found; a picture of a joint with two lines has two.
    pub fn seams(&self) -> impl Iterator<Item = &Seam> {
        self.detections().flat_map(|(_, found)| found.seams())
    }

    /// The features of the pictures that show the seam.
    #[must_use]
    pub fn features(&self) -> Vec<Feature> {
        self.detections().flat_map(|(stamp, found)| found.features(stamp)).collect()
    }

    /// The stripes on the plates that meet in the seam; none for a joint that has no such plates.
    #[must_use]
    pub fn stripes(&self) -> Vec<PlateStripe> {
        self.detections().flat_map(|(stamp, found)| found.stripes(stamp)).collect()
    }

    /// Both together.
    #[must_use]
    pub fn found(&self) -> FoundSeams {
        FoundSeams { features: self.features(), stripes: self.stripes() }
    }

    /// Why pictures have no seam: for each kind of reason how many, and the one of them in the middle.
    #[must_use]
    pub fn reasons(&self) -> Vec<SkippedPictures> {
        let mut kinds: BTreeMap<&'static str, Vec<NotFound>> = BTreeMap::new();
        for reason in self.frames.iter().filter_map(|frame| frame.found.as_ref().err()) {
            kinds.entry(reason.code()).or_default().push(*reason);
        }
        let mut skipped: Vec<SkippedPictures> = kinds
            .into_values()
            .map(|mut reasons| {
                let count = reasons.len();
                let middle = |a: &NotFound, b: &NotFound| a.value().total_cmp(&b.value());
                let typical = *reasons.select_nth_unstable_by(count / 2, middle).1;
                SkippedPictures { count, typical }
            })
            .collect();
        skipped.sort_by_key(|skipped| std::cmp::Reverse(skipped.count));
        skipped
    }

    /// Median, and 95th percentile, of a number over the seams; `None` without a seam.
    pub(crate) fn median_and_p95(&self, of: impl Fn(&Seam) -> f64) -> Option<[f64; 2]> {
        let mut values: Vec<f64> = self.seams().map(of).collect();
        values.sort_by(f64::total_cmp);
        let at = |part: f64| values[((values.len() - 1) as f64 * part) as usize];
        (!values.is_empty()).then(|| [at(0.5), at(0.95)])
    }

    /// Milliseconds of one core for a picture, without reading it.
    #[must_use]
    pub fn ms_per_picture(&self) -> f64 {
        self.detection_time.as_secs_f64() * 1e3 / self.frames.len().max(1) as f64
    }
}
