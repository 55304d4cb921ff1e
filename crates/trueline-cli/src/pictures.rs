//! Examines the pictures of a dataset with all cores, and tells what was found.

use crate::failure::Failure;
use crate::overlay::OverlayFolder;
use crate::{output, progress};
use indicatif::ProgressBar;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use trueline_dataset::sensor_setup::RegionOfInterest;
use trueline_dataset::{PictureFolder, PictureSource, SensorFile, folder, gray_png};
use trueline_report::picture_page::{Looked, MissingSeam, SeamPixel};
use trueline_vision::contact_sheet::{self, Sample};
use trueline_vision::scan::{ExaminedPicture, ScanError, ScanObserver, ScanSeams, Stage};
use trueline_vision::{Detector, Joint, PictureRegion, StripeChoice, find_seams};

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
    pub overlay: Option<OverlayChoice>,
    /// Threads; one for each core if not given.
    pub threads: Option<NonZeroUsize>,
    /// No progress bar.
    pub quiet: bool,
}

/// Where to draw what was found.
pub struct OverlayChoice {
    /// The folder.
    pub folder: PathBuf,
    /// Every so many pictures.
    pub every: usize,
    /// Whether a folder that is there may be replaced.
    pub replace: bool,
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
    let begin = |OverlayChoice { folder, every, replace }: &OverlayChoice| {
        OverlayFolder::create(folder, *every, *replace)
    };
    let overlay = overlay.map(begin).transpose()?;
    let onlooker = Onlooker { overlay, quiet: options.quiet, bar: Mutex::default() };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(options.threads.map_or(0, NonZeroUsize::get));
    let pool = pool
        .build()
        .map_err(|error| Failure::new(format!("threads cannot be started: {error}"), "try --threads 1"))?;
    let scan = pool
        .install(|| find_seams(pictures, &detector, options.joint, &onlooker))
        .map_err(|error| failure(&error, None))?;
    onlooker.overlay.map_or(Ok(()), OverlayFolder::finish)?;
    if scan.second_place_px.is_some() && !options.quiet {
        output::words("hint: --overlay FOLDER draws both places; --stripe or --region chooses one");
    }
    Ok(scan)
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

/// Some pictures for the report, PNG, with their numbers.
pub fn samples(dataset: &Path, scan: &ScanSeams) -> Result<Vec<(usize, Vec<u8>)>, Failure> {
    let samples = contact_sheet::samples(&PictureFolder::open(dataset)?, scan);
    let png =
        |Sample { number, canvas }: Sample| Ok((number, gray_png::encode_rgb(canvas.size(), canvas.rgb())?));
    samples.into_iter().map(png).collect()
}
