//! Looks at the pictures of a dataset with all cores.

use crate::failure::Failure;
use crate::overlay;
use crate::progress;
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};
use trueline_dataset::{Feature, FrameFile, GrayImage, Measured, Pixels, Sensor, folder, gray_png, images};
use trueline_report::picture_page::Looked;
use trueline_vision::choose::{self, Trial};
use trueline_vision::neighbours;
use trueline_vision::{Detector, Joint, Lens, NotFound, Picture, Seam};

/// Pictures that are looked at to find out which joint they show.
const SAMPLED: usize = 24;

/// Gaps that are typically further than this from where their neighbours have them deserve a look, px: soot makes
/// gaps as well. Corners and edges may just move fast.
const DOUBTFUL_PX: f64 = 20.0;

/// How to look.
pub struct Look {
    /// The joint, or whatever most pictures show.
    pub joint: Option<Joint>,
    /// Where to draw what was found, and how often.
    pub overlay: Option<(PathBuf, usize)>,
    /// Threads; one for each core if not given.
    pub threads: Option<NonZeroUsize>,
    /// No progress bar.
    pub quiet: bool,
}

/// Why a joint was looked for.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Choice {
    /// The user named it.
    Asked,
    /// The pictures show it.
    Seen,
    /// The pictures show none.
    Nothing,
}

/// What was found in each picture.
pub struct Found {
    /// The joint that was looked for.
    pub joint: Joint,
    choice: Choice,
    frames: Vec<(FrameFile, Result<Seam, NotFound>)>,
    /// How far a point typically is from where its neighbours have it, px.
    apart_px: Option<f64>,
    /// Time in detection alone, summed over threads.
    detection: Duration,
    size_px: [u32; 2],
}

/// Looks at all pictures of a dataset.
///
/// # Errors
/// A dataset without a camera or pictures, or a picture that cannot be read.
pub fn look_at(dataset: &Path, look: &Look) -> Result<Found, Failure> {
    let detector = detector(dataset)?;
    let frames = images::read_index(dataset)?;
    if let Some((folder, _)) = &look.overlay {
        overlay::prepare(folder)?;
    }
    let pool = rayon::ThreadPoolBuilder::new().num_threads(look.threads.map_or(0, NonZeroUsize::get));
    let pool = pool
        .build()
        .map_err(|error| Failure::new(format!("threads cannot be started: {error}"), "try --threads 1"))?;
    pool.install(|| look_at_frames(&detector, frames, look))
}

fn detector(dataset: &Path) -> Result<Detector, Failure> {
    match folder::read_sensor(dataset)? {
        Sensor::CameraLaser { camera, laser_plane_in_camera } => {
            Ok(Detector::new(Lens::new(camera, laser_plane_in_camera)))
        }
        other => Err(Failure::new(
            format!(
                "{}: features are found in the pictures of a camera_laser, and the sensor is of kind {}",
                dataset.join("sensor.toml").display(),
                other.kind()
            ),
            "profilers and point sensors bring their features along in features.csv",
        )),
    }
}

fn look_at_frames(detector: &Detector, frames: Vec<FrameFile>, look: &Look) -> Result<Found, Failure> {
    let (joint, choice) = match look.joint {
        Some(joint) => (joint, Choice::Asked),
        None => match choose_joint(detector, &frames, look.quiet)? {
            Some(joint) => (joint, Choice::Seen),
            // Most scans are made over a fillet, and its reasons say most.
            None => (Joint::Fillet, Choice::Nothing),
        },
    };
    let bar = progress::bar(frames.len() as u64, "pictures", look.quiet);
    let looked: Result<Vec<_>, Failure> = frames
        .into_par_iter()
        .enumerate()
        .map_init(
            || (detector.clone(), Vec::new()),
            |(detector, spare), (number, frame)| {
                let image = read(&frame, detector, spare)?;
                let start = Instant::now();
                let seam = seam(detector, &image, joint);
                let taken = start.elapsed();
                if let Some((folder, every)) = &look.overlay
                    && number % every == 0
                {
                    overlay::draw(&folder.join(format!("{number:06}")), &image, detector, &seam)?;
                }
                give_back(image, spare);
                bar.inc(1);
                Ok((frame, seam, taken))
            },
        )
        .collect();
    bar.finish_and_clear();
    let mut looked = looked?;
    if joint == Joint::Butt {
        choose::refuse_odd_gaps(looked.iter_mut().map(|(_, seam, _)| seam));
    }
    let in_order = looked.iter_mut().map(|(frame, seam, _)| (frame.stamp_ns as f64 * 1e-9, seam));
    let apart_px = neighbours::refuse_jumps(in_order);
    let detection = looked.iter().map(|(_, _, taken)| *taken).sum();
    let frames = looked.into_iter().map(|(frame, seam, _)| (frame, seam)).collect();
    Ok(Found { joint, choice, frames, apart_px, detection, size_px: detector.lens().camera().size })
}

fn choose_joint(detector: &Detector, frames: &[FrameFile], quiet: bool) -> Result<Option<Joint>, Failure> {
    let step = frames.len().div_ceil(SAMPLED).max(1);
    let sampled: Vec<&FrameFile> = frames.iter().step_by(step).collect();
    let bar = progress::bar(sampled.len() as u64, "pictures, to see which joint", quiet);
    let trials: Result<Vec<Trial>, Failure> = sampled
        .into_par_iter()
        .map_init(
            || (detector.clone(), Vec::new()),
            |(detector, spare), frame| {
                let image = read(frame, detector, spare)?;
                let trial = Joint::ALL.map(|joint| seam(detector, &image, joint).ok());
                give_back(image, spare);
                bar.inc(1);
                Ok(trial)
            },
        )
        .collect();
    bar.finish_and_clear();
    Ok(choose::joint(&trials?))
}

fn read(frame: &FrameFile, detector: &Detector, spare: &mut Vec<u8>) -> Result<GrayImage, Failure> {
    let image = gray_png::read(&frame.path, spare)?;
    let [width, height] = detector.lens().camera().size.map(|n| n as usize);
    if [image.width, image.height] != [width, height] {
        return Err(Failure::new(
            format!(
                "{}: the picture is {} x {} px, and sensor.toml says {width} x {height}",
                frame.path.display(),
                image.width,
                image.height
            ),
            "a region of interest moves cx and cy; scaled pictures need scaled intrinsics",
        ));
    }
    Ok(image)
}

/// Memory of a picture that is done with serves the next.
fn give_back(image: GrayImage, spare: &mut Vec<u8>) {
    if let Pixels::Eight(levels) = image.pixels {
        *spare = levels;
    }
}

/// The seam in a picture.
pub fn seam(detector: &mut Detector, image: &GrayImage, joint: Joint) -> Result<Seam, NotFound> {
    let (width, height) = (image.width, image.height);
    match &image.pixels {
        Pixels::Eight(levels) => {
            Picture::new(width, height, levels).map_or(Err(NotFound::NoStripe), |p| detector.seam(&p, joint))
        }
        Pixels::Sixteen(levels) => {
            Picture::new(width, height, levels).map_or(Err(NotFound::NoStripe), |p| detector.seam(&p, joint))
        }
    }
}

/// A seam as a feature of its picture.
pub fn feature(stamp_ns: i64, frame: u64, device_ns: Option<i64>, seam: &Seam) -> Feature {
    Feature {
        stamp_ns,
        line: 0,
        frame: Some(frame),
        device_ns,
        measured: Measured::Pixel(seam.pixel.into()),
        sigma: Some(seam.sigma_px()),
    }
}

impl Found {
    /// How many pictures there are.
    pub fn looked_at(&self) -> usize {
        self.frames.len()
    }

    /// The features of the pictures that show the seam.
    pub fn features(&self) -> Vec<Feature> {
        let found = self.frames.iter().filter_map(|(frame, seam)| {
            let seam = seam.as_ref().ok()?;
            Some(feature(frame.stamp_ns, frame.frame, frame.device_ns, seam))
        });
        found.collect()
    }

    /// Every picture, for the report.
    pub fn looked(&self) -> Vec<Looked> {
        let first_ns = self.frames.first().map_or(0, |(frame, _)| frame.stamp_ns);
        let one = |(frame, seam): &(FrameFile, Result<Seam, NotFound>)| Looked {
            stamp_s: (frame.stamp_ns - first_ns) as f64 * 1e-9,
            file: frame.path.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned()),
            seam: match seam {
                Ok(seam) => Ok((seam.pixel.into(), seam.sigma_px())),
                Err(reason) => Err(reason.to_string()),
            },
        };
        self.frames.iter().map(one).collect()
    }

    /// Width and height of the pictures.
    pub fn size_px(&self) -> [u32; 2] {
        self.size_px
    }

    fn reasons(&self) -> BTreeMap<NotFound, usize> {
        let mut reasons = BTreeMap::new();
        for reason in self.frames.iter().filter_map(|(_, seam)| seam.as_ref().err()) {
            *reasons.entry(*reason).or_insert(0) += 1;
        }
        reasons
    }

    /// Median, and 95th percentile, of a number over the seams; `None` without a seam.
    fn spread(&self, of: impl Fn(&Seam) -> f64) -> Option<[f64; 2]> {
        let mut values: Vec<f64> =
            self.frames.iter().filter_map(|(_, seam)| seam.as_ref().ok().map(&of)).collect();
        values.sort_by(f64::total_cmp);
        let at = |part: f64| values[((values.len() - 1) as f64 * part) as usize];
        (!values.is_empty()).then(|| [at(0.5), at(0.95)])
    }

    /// Milliseconds of one core for a picture, without reading it.
    fn ms_per_picture(&self) -> f64 {
        self.detection.as_secs_f64() * 1e3 / self.frames.len().max(1) as f64
    }

    /// For a person.
    pub fn summary(&self) -> String {
        let found = self.features().len();
        let how = match self.choice {
            Choice::Asked => "",
            Choice::Seen => " (the pictures show it; --joint decides otherwise)",
            Choice::Nothing => " (looked for, since the pictures show no joint)",
        };
        let mut text = format!("Joint            {}{how}\n", self.joint.name());
        text += &format!("Found            {found} of {} pictures\n", self.frames.len());
        for (reason, count) in self.reasons() {
            text += &format!("                 {count}: {reason}\n");
        }
        if let (Some(u), Some(v)) = (self.spread(|s| s.sigma_px()[0]), self.spread(|s| s.sigma_px()[1])) {
            text += &format!(
                "Uncertainty      ± {:.3} px in u, ± {:.3} px in v (median; 95 % below {:.3}, {:.3})\n",
                u[0], v[0], u[1], v[1]
            );
        }
        if let Some(apart_px) = self.apart_px {
            let doubtful = self.joint == Joint::Butt && apart_px > DOUBTFUL_PX;
            let doubt = if doubtful { ": are these gaps the joint? look at --overlay" } else { "" };
            text += &format!("From neighbours  {apart_px:.2} px (median){doubt}\n");
        }
        if let (Joint::Butt, Some(gap)) = (self.joint, self.spread(|s| s.gap_m)) {
            text += &format!("Gap              {:.2} mm (median)\n", gap[0] * 1e3);
        }
        text += &format!(
            "Time             {:.2} ms of one core a picture, without reading it",
            self.ms_per_picture()
        );
        text
    }

    /// For a program.
    pub fn json(&self) -> serde_json::Value {
        let reasons: serde_json::Map<String, serde_json::Value> =
            self.reasons().into_iter().map(|(reason, count)| (reason.to_string(), count.into())).collect();
        let (u, v) = (self.spread(|s| s.sigma_px()[0]), self.spread(|s| s.sigma_px()[1]));
        serde_json::json!({
            "joint": self.joint.name(),
            "joint_chosen_by_pictures": self.choice == Choice::Seen,
            "pictures": self.frames.len(),
            "found": self.features().len(),
            "not_found": reasons,
            "median_sigma_px": u.zip(v).map(|(u, v)| [u[0], v[0]]),
            "median_px_from_neighbours": self.apart_px,
            "median_gap_mm": self.spread(|s| s.gap_m * 1e3).filter(|_| self.joint == Joint::Butt).map(|g| g[0]),
            "ms_per_picture": self.ms_per_picture(),
        })
    }
}
