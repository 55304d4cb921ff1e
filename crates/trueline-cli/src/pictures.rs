//! Examines the pictures of a dataset with all cores, and tells what was found.

use crate::failure::Failure;
use crate::output;
use crate::overlay::OverlayFolder;
use crate::progress;
use indicatif::ProgressBar;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use trueline_dataset::sensor_setup::RegionOfInterest;
use trueline_dataset::{PictureFolder, PictureSource, SensorFile, folder};
use trueline_report::picture_page::{Looked, MissingSeam, SeamPixel};
use trueline_vision::scan::{
    ExaminedPicture, JointSource, ScanError, ScanObserver, ScanSeams, SkippedPictures, Stage,
};
use trueline_vision::{Detector, Joint, PictureRegion, StripeChoice, find_seams};

/// Gaps that are typically further than this from where their neighbours have them deserve a look, px: soot makes
/// gaps as well. Corners and edges may just move fast.
const DOUBTFUL_PX: f64 = 20.0;

/// Pictures that could not be used and are named at most.
const MOST_NAMED: usize = 10;

/// How to examine them.
#[derive(Default)]
pub struct PictureOptions {
    /// The joint, or whatever most pictures show.
    pub joint: Option<Joint>,
    /// Where in the pictures, if not where sensor.toml says.
    pub region: Option<PictureRegion>,
    /// Which of several corners.
    pub stripe: StripeChoice,
    /// Where to draw what was found, and how often.
    pub overlay: Option<(PathBuf, usize)>,
    /// Threads; one for each core if not given.
    pub threads: Option<NonZeroUsize>,
    /// No progress bar.
    pub quiet: bool,
}

/// Examines all pictures of a dataset.
///
/// # Errors
/// A dataset without a camera or pictures, or a picture that cannot be read.
pub fn examine(dataset: &Path, options: &PictureOptions) -> Result<ScanSeams, Failure> {
    let sensor = folder::read_sensor_file(dataset)?;
    // Without a camera there need not be pictures, and that is what is to be told.
    detector(&sensor, dataset, options)?;
    let pictures = PictureFolder::open(dataset)?;
    let scan = examine_source(&pictures, &sensor, dataset, options)?;
    tell_channel(&pictures, options.quiet);
    Ok(scan)
}

/// Says which channel of colour pictures was looked at.
pub fn tell_channel(pictures: &PictureFolder, quiet: bool) {
    if let (Some(channel), false) = (pictures.channel(), quiet) {
        output::words(&format!(
            "colour pictures: {} is looked at, where the stripe stands out most",
            channel.name()
        ));
    }
}

/// Examines all pictures of a recording; `dataset` is what an error calls it.
///
/// # Errors
/// As [`examine`].
pub fn examine_source(
    pictures: &dyn PictureSource,
    sensor: &SensorFile,
    dataset: &Path,
    options: &PictureOptions,
) -> Result<ScanSeams, Failure> {
    let detector = detector(sensor, dataset, options)?;
    let overlay = options.overlay.as_ref();
    let overlay = overlay.map(|(folder, every)| OverlayFolder::create(folder, *every)).transpose()?;
    let onlooker = Onlooker { overlay, quiet: options.quiet, bar: Mutex::default() };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(options.threads.map_or(0, NonZeroUsize::get));
    let pool = pool
        .build()
        .map_err(|error| Failure::new(format!("threads cannot be started: {error}"), "try --threads 1"))?;
    pool.install(|| find_seams(pictures, &detector, options.joint, &onlooker))
        .map_err(|error| failure(&error, None))
}

/// The detector for a dataset's sensor, with what its file and the user say of where to look.
fn detector(file: &SensorFile, dataset: &Path, options: &PictureOptions) -> Result<Detector, Failure> {
    let SensorFile { sensor, setup } = file;
    let detector = Detector::for_sensor(sensor).ok_or_else(|| ScanError::NoCamera { kind: sensor.kind() });
    let detector = detector.map_err(|error| failure(&error, Some(dataset)))?;
    let stated = match setup.region_of_interest {
        Some(RegionOfInterest::Pixels { u_px, v_px }) => PictureRegion::rectangle(u_px, v_px),
        _ => None,
    };
    let region = options.region.clone().or(stated);
    let [width, height] = detector.lens().camera().size;
    if !region.as_ref().is_none_or(|region| region.overlaps([width, height])) {
        return Err(Failure::new(
            format!("the region of interest lies outside of the pictures, which are {width} x {height} px"),
            "--region U0,V0,U1,V1 in px, (0, 0) is the top-left pixel",
        ));
    }
    Ok(detector.within(region).choosing(options.stripe))
}

/// What a person can do about it.
fn failure(error: &ScanError, dataset: Option<&Path>) -> Failure {
    let hint = match error {
        ScanError::Read(error) => error.hint(),
        ScanError::NoCamera { .. } => {
            "profilers and point sensors bring their features along in features.csv".to_owned()
        }
        ScanError::WrongSize { .. } => {
            "a region of interest moves cx and cy; scaled pictures need scaled intrinsics".to_owned()
        }
        _ => "is the disk full, or the folder read-only?".to_owned(),
    };
    let file =
        dataset.map_or_else(String::new, |folder| format!("{}: ", folder.join("sensor.toml").display()));
    Failure::new(format!("{file}{error}"), hint)
}

/// A progress bar and overlays.
struct Onlooker {
    overlay: Option<OverlayFolder>,
    quiet: bool,
    bar: Mutex<Option<ProgressBar>>,
}

impl Onlooker {
    fn with_bar(&self, then: impl FnOnce(&mut Option<ProgressBar>)) {
        if let Ok(mut bar) = self.bar.lock() {
            then(&mut bar);
        }
    }
}

impl ScanObserver for Onlooker {
    fn begins(&self, stage: Stage, pictures: usize) {
        let what = match stage {
            Stage::ChoosingJoint => "pictures, to see which joint",
            Stage::FindingSeams => "pictures",
        };
        self.with_bar(|bar| *bar = Some(progress::bar(pictures as u64, what, self.quiet)));
    }

    fn advances(&self, _: Stage) {
        self.with_bar(|bar| bar.iter().for_each(|bar| bar.inc(1)));
    }

    fn ends(&self, _: Stage) {
        self.with_bar(|bar| bar.take().iter().for_each(ProgressBar::finish_and_clear));
    }

    fn examined(&self, picture: &ExaminedPicture<'_>) -> Result<(), ScanError> {
        self.overlay.as_ref().map_or(Ok(()), |overlay| overlay.draw(picture))
    }
}

/// Every picture, for the report.
pub fn looked(scan: &ScanSeams) -> Vec<Looked> {
    let first_ns = scan.frames.first().map_or(0, |frame| frame.stamp.stamp_ns);
    let looked = scan.frames.iter().map(|frame| Looked {
        stamp_s: (frame.stamp.stamp_ns - first_ns) as f64 * 1e-9,
        file: Path::new(&frame.name).file_name().unwrap_or_default().to_string_lossy().into_owned(),
        seam: match &frame.found {
            Ok(found) => Ok(SeamPixel { at_px: found.seam.pixel.into(), sigma_px: found.seam.sigma_px() }),
            Err(reason) => Err(MissingSeam { code: reason.code(), text: reason.to_string() }),
        },
    });
    looked.collect()
}

/// For a person.
pub fn summary(scan: &ScanSeams) -> String {
    let how = match scan.joint_source {
        JointSource::Given => "",
        JointSource::Pictures => " (the pictures show it; --joint decides otherwise)",
        JointSource::Default => " (looked for, since the pictures show no joint)",
    };
    let mut text = format!("Joint            {}{how}\n", scan.joint.name());
    text += &format!("Found            {} of {} pictures\n", scan.detections().count(), scan.frames.len());
    for error in scan.unreadable.iter().take(MOST_NAMED) {
        text += &format!("                 skipped: {error}\n");
    }
    for skipped in scan.reasons() {
        text += &format!("                 {}: {}\n", skipped.count, skipped.typical);
    }
    let spread = |axis: usize| scan.median_and_p95(|seam| seam.sigma_px()[axis]);
    if let (Some(u), Some(v)) = (spread(0), spread(1)) {
        text += &format!(
            "Uncertainty      ± {:.3} px in u, ± {:.3} px in v (median; 95 % below {:.3}, {:.3})\n",
            u[0], v[0], u[1], v[1]
        );
    }
    if let Some(distance_px) = scan.neighbour_distance_px {
        let doubtful = scan.joint == Joint::Butt && distance_px > DOUBTFUL_PX;
        let doubt = if doubtful { ": are these gaps the joint? look at --overlay" } else { "" };
        text += &format!("From neighbours  {distance_px:.2} px (median){doubt}\n");
    }
    for fault in &scan.faults {
        text += &format!("Pictures         {fault}\n");
    }
    if let Some(distance_px) = scan.second_place_px {
        text += &format!(
            "Two places       the seam is found at two places in turn, {distance_px:.0} px apart: look at --overlay, then \
             choose with --stripe or --region\n"
        );
    }
    if let (Joint::Butt, Some(gap)) = (scan.joint, scan.median_and_p95(|seam| seam.gap_m)) {
        text += &format!("Gap              {:.2} mm (median)\n", gap[0] * 1e3);
    }
    text + &format!(
        "Time             {:.2} ms of one core a picture, without reading it",
        scan.ms_per_picture()
    )
}

/// For a program.
pub fn json(scan: &ScanSeams) -> serde_json::Value {
    let reasons: Vec<serde_json::Value> = (scan.reasons().into_iter())
        .map(|SkippedPictures { count, typical }| {
            serde_json::json!({ "code": typical.code(), "count": count, "text": typical.to_string() })
        })
        .collect();
    let spread = |axis: usize| scan.median_and_p95(|seam| seam.sigma_px()[axis]);
    let gap_mm = scan.median_and_p95(|seam| seam.gap_m * 1e3).filter(|_| scan.joint == Joint::Butt);
    serde_json::json!({
        "joint": scan.joint.name(),
        "joint_chosen_by_pictures": scan.joint_source == JointSource::Pictures,
        "pictures": scan.frames.len(),
        "found": scan.detections().count(),
        "not_found": reasons,
        "unreadable": scan.unreadable.iter().map(ToString::to_string).collect::<Vec<_>>(),
        "median_sigma_px": spread(0).zip(spread(1)).map(|(u, v)| [u[0], v[0]]),
        "median_px_from_neighbours": scan.neighbour_distance_px,
        "picture_faults": scan.faults.iter().map(|fault| {
            serde_json::json!({ "code": fault.code(), "text": fault.to_string() })
        }).collect::<Vec<_>>(),
        "second_place_px": scan.second_place_px,
        "median_gap_mm": gap_mm.map(|gap| gap[0]),
        "ms_per_picture": scan.ms_per_picture(),
    })
}
