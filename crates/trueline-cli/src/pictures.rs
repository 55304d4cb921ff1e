//! Examines the pictures of a dataset with all cores, draws the findings, and reports them.

use crate::failure::Failure;
use crate::output;
use crate::picture_progress::PictureProgress;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use trueline::open::Told;
use trueline::open::detector;
use trueline::open::error::hint_of_pictures;
use trueline_dataset::{PictureFolder, folder};
use trueline_vision::overlay_folder::OverlayFolder;
use trueline_vision::scan::{ExaminedPicture, ScanError, ScanObserver, ScanSeams, Stage};
use trueline_vision::{Joint, PictureRegion, StripeChoice, find_seams};

/// How to examine them.
pub(crate) struct PictureOptions {
    /// The joint, or the one that most pictures show.
    pub joint: Option<Joint>,
    /// Region of the pictures, if not that of sensor.toml.
    pub region: Option<PictureRegion>,
    /// Index among several corners.
    pub stripe: StripeChoice,
    /// Overlay of the findings: its folder, and how often.
    pub overlay: Option<OverlayChoice>,
    /// Threads; one for each core if not given.
    pub threads: Option<NonZeroUsize>,
    /// No progress bar.
    pub quiet: bool,
}

/// Overlay of the findings.
pub(crate) struct OverlayChoice {
    /// The folder.
    pub folder: PathBuf,
    /// Step between pictures.
    pub every: usize,
    /// Whether a folder that is there may be replaced.
    pub replace: bool,
}

/// Examines all pictures of a dataset.
pub(crate) fn examine(dataset: &Path, options: &PictureOptions) -> Result<ScanSeams, Failure> {
    let sensor = folder::read_sensor_file(dataset)?;
    // Without a camera pictures are optional, and the message says so.
    let detector = detector::of(&sensor, options.region.as_ref(), options.stripe)
        .map_err(|error| Failure::new(error.to_string(), error.hint()))?;
    let pictures = PictureFolder::open(dataset)?;
    let begin = |OverlayChoice { folder, every, replace }: &OverlayChoice| {
        OverlayFolder::create(folder, *every, *replace)
    };
    let overlay = options.overlay.as_ref().map(begin).transpose()?;
    let onlooker = Onlooker { overlay, progress: PictureProgress::new(options.quiet) };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(options.threads.map_or(0, NonZeroUsize::get));
    let pool = pool
        .build()
        .map_err(|error| Failure::new(format!("threads cannot be started: {error}"), "try --threads 1"))?;
    let scan = pool
        .install(|| find_seams(&pictures, &detector, options.joint, &onlooker))
        .map_err(|error| Failure::new(error.to_string(), hint_of_pictures(&error)))?;
    if let (Some(overlay), Some(OverlayChoice { folder, .. })) = (onlooker.overlay, &options.overlay) {
        output::former_folder(folder, overlay.finish()?);
    }
    if !options.quiet {
        if scan.second_place_px.is_some() {
            output::words("hint: --overlay FOLDER draws both places; --stripe or --region chooses one");
        }
        pictures.channel().iter().for_each(|channel| output::words(&Told::Channel(*channel).to_string()));
    }
    Ok(scan)
}

/// A progress bar and overlays.
struct Onlooker {
    overlay: Option<OverlayFolder>,
    progress: PictureProgress,
}

impl ScanObserver for Onlooker {
    fn begins(&self, stage: Stage, pictures: usize) {
        self.progress.begins(stage, pictures);
    }

    fn advances(&self, stage: Stage) {
        self.progress.advances(stage);
    }

    fn ends(&self, stage: Stage) {
        self.progress.ends(stage);
    }

    fn examined(&self, picture: &ExaminedPicture<'_>) -> Result<(), ScanError> {
        self.overlay.as_ref().map_or(Ok(()), |overlay| overlay.draw(picture))
    }
}
