//! Detection in a scan: its joint, the seam in every picture, and the comparison of the pictures.

use crate::detection::Detection;
use crate::detector::Detector;
use crate::not_found::NotFound;
use crate::picture_light::PictureLight;
use crate::scan::error::ScanError;
use crate::scan::joint_choice::{self, JointTrial};
use crate::scan::neighbours::{self, InOrder};
use crate::scan::observer::{ExaminedPicture, ScanObserver, Stage};
use crate::scan::picture_fault::picture_faults;
use crate::scan::scan_seams::{JointSource, ScanFrame, ScanSeams};
use crate::scan::two_places;
use crate::seam::Joint;
use rayon::prelude::*;
use std::cell::OnceCell;
use std::time::{Duration, Instant};
use trueline_dataset::{GrayImage, PictureSource, Pixels};

/// Pictures that are examined to find out which joint they show.
const SAMPLED: usize = 24;

/// Finds the seam in all pictures of a scan with the threads of the current rayon pool. Without a joint, the most frequent one is
/// detected.
///
/// # Errors
/// An unreadable picture, one of another size than the camera's, or an error of the observer.
pub fn find_seams(
    source: &dyn PictureSource,
    detector: &Detector,
    joint: Option<Joint>,
    observer: &dyn ScanObserver,
) -> Result<ScanSeams, ScanError> {
    let (joint, joint_source) = match joint {
        Some(joint) => (joint, JointSource::Given),
        None => match chosen_joint(source, detector, observer)? {
            Some(joint) => (joint, JointSource::Pictures),
            // Most scans are made over a fillet, and its reasons say most.
            None => (Joint::Fillet, JointSource::Default),
        },
    };
    let examined = examine_all(source, detector, joint, observer)?;
    let detection_time = examined.iter().map(|one| one.taken).sum();
    let lights: Vec<PictureLight> = examined.iter().filter_map(|one| one.light).collect();
    let faults = picture_faults(&lights, examined.iter().any(|one| one.wide));
    let (mut frames, mut unreadable) = (Vec::with_capacity(examined.len()), Vec::new());
    for one in examined {
        frames.push(one.frame);
        unreadable.extend(one.unreadable);
    }
    if joint == Joint::Butt {
        joint_choice::refuse_odd_gaps(frames.iter_mut().map(|frame| &mut frame.found));
    }
    let mut in_order: InOrder<'_> =
        frames.iter_mut().map(|frame| (frame.stamp.stamp_ns as f64 * 1e-9, &mut frame.found)).collect();
    let second_place_px = two_places::refuse_second_place(&mut in_order);
    let neighbour_distance_px = neighbours::refuse_jumps(&mut in_order);
    let size_px = detector.lens().camera().size;
    Ok(ScanSeams {
        joint,
        joint_source,
        frames,
        unreadable,
        faults,
        second_place_px,
        neighbour_distance_px,
        detection_time,
        size_px,
    })
}

fn examine_all(
    source: &dyn PictureSource,
    detector: &Detector,
    joint: Joint,
    observer: &dyn ScanObserver,
) -> Result<Vec<Examined>, ScanError> {
    observer.begins(Stage::FindingSeams, source.count());
    let examined: Result<Vec<_>, ScanError> = (0..source.count())
        .into_par_iter()
        .map_init(
            || (detector.clone(), Vec::new()),
            |(detector, spare), number| {
                let image = match read(source, number, detector, spare) {
                    Ok(image) => image,
                    Err(error) => {
                        observer.advances(Stage::FindingSeams);
                        return Ok(Examined { unreadable: Some(error), ..Examined::none(source, number) });
                    }
                };
                let start = Instant::now();
                let found = InColour::new(source, number, &image).detect(detector, joint);
                let taken = start.elapsed();
                observer.examined(&ExaminedPicture { number, image: &image, found: &found, detector })?;
                let wide = matches!(image.pixels, Pixels::Sixteen(_));
                recycle(image, spare);
                observer.advances(Stage::FindingSeams);
                let none = Examined::none(source, number);
                let (frame, light) = (ScanFrame { found, ..none.frame }, Some(detector.light()));
                Ok(Examined { frame, taken, unreadable: None, light, wide })
            },
        )
        .collect();
    observer.ends(Stage::FindingSeams);
    let mut examined = examined?;
    // One broken picture stops nothing; if all are broken, there is no scan.
    if !examined.is_empty() && examined.iter().all(|one| one.unreadable.is_some()) {
        return Err(examined.remove(0).unreadable.unwrap_or(ScanError::NoPictures));
    }
    Ok(examined)
}

/// One picture that was examined.
struct Examined {
    frame: ScanFrame,
    taken: Duration,
    unreadable: Option<ScanError>,
    light: Option<PictureLight>,
    /// Whether it has 16 bits.
    wide: bool,
}

impl Examined {
    fn none(source: &dyn PictureSource, number: usize) -> Self {
        let found = Err(NotFound::Unreadable);
        let frame = ScanFrame { stamp: source.stamp(number), name: source.name(number), found };
        Self { frame, taken: Duration::ZERO, unreadable: None, light: None, wide: false }
    }
}

fn chosen_joint(
    source: &dyn PictureSource,
    detector: &Detector,
    observer: &dyn ScanObserver,
) -> Result<Option<Joint>, ScanError> {
    let step = source.count().div_ceil(SAMPLED).max(1);
    let sampled: Vec<usize> = (0..source.count()).step_by(step).collect();
    observer.begins(Stage::ChoosingJoint, sampled.len());
    let trials: Result<Vec<Option<JointTrial>>, ScanError> = sampled
        .into_par_iter()
        .map_init(
            || (detector.clone(), Vec::new()),
            |(detector, spare), number| {
                // Unreadable pictures are reported when every picture is examined.
                let Ok(image) = read(source, number, detector, spare) else {
                    observer.advances(Stage::ChoosingJoint);
                    return Ok(None);
                };
                let in_colour = InColour::new(source, number, &image);
                let trial = Joint::ALL.map(|joint| in_colour.detect(detector, joint).ok());
                recycle(image, spare);
                observer.advances(Stage::ChoosingJoint);
                Ok(Some(trial))
            },
        )
        .collect();
    observer.ends(Stage::ChoosingJoint);
    let trials: Vec<JointTrial> = trials?.into_iter().flatten().collect();
    Ok(joint_choice::joint(&trials))
}

fn read(
    source: &dyn PictureSource,
    number: usize,
    detector: &Detector,
    spare: &mut Vec<u8>,
) -> Result<GrayImage, ScanError> {
    let image = source.read(number, spare)?;
    let (found, expected) = ([image.width, image.height], detector.lens().camera().size.map(|n| n as usize));
    if found != expected {
        return Err(ScanError::WrongSize { name: source.name(number), found, expected });
    }
    Ok(image)
}

/// A picture and its colours, which are read when levels alone show no joint, and once.
struct InColour<'a> {
    source: &'a dyn PictureSource,
    number: usize,
    image: &'a GrayImage,
    colour: OnceCell<Option<GrayImage>>,
}

impl<'a> InColour<'a> {
    fn new(source: &'a dyn PictureSource, number: usize, image: &'a GrayImage) -> Self {
        Self { source, number, image, colour: OnceCell::new() }
    }

    /// Findings in it of a joint.
    fn detect(&self, detector: &mut Detector, joint: Joint) -> Result<Detection, NotFound> {
        // It has been read before, so it can be read again; if not, the result from its levels stands.
        let colour = || self.colour.get_or_init(|| self.source.colour(self.number).ok().flatten()).as_ref();
        detector.detect_in_colour(self.image, colour, joint)
    }
}

/// Memory of a picture that is done with serves the next.
fn recycle(image: GrayImage, spare: &mut Vec<u8>) {
    if let Pixels::Eight(levels) = image.pixels {
        *spare = levels;
    }
}
