//! One scan, from wherever it is.

use crate::open::detector;
use crate::open::error::OpenError;
use crate::open::observer::{OpenObserver, Told, told_of_import};
use crate::open::place::{self, Place};
use crate::open::profiles::seams_of_profiles;
use crate::open::trigger::{self, MeasuredByInput, Trigger};
use std::collections::BTreeSet;
use std::fmt;
use std::path::Path;
use tracing::field;
use trueline_dataset::feature_cache::FeatureCache;
use trueline_dataset::folder::FolderContent;
use trueline_dataset::{
    FoundSeams, PictureFolder, PictureSource, Recording, SensorFile, folder, images, sensor_toml,
};
use trueline_mcap::{Choice, Imported, import};
use trueline_method::Calibration;
use trueline_method::stripe::corners::with_corners;
use trueline_vision::scan::ScanSeams;
use trueline_vision::{Joint, StripeChoice, find_seams};

/// How a scan is opened.
#[derive(Clone, Debug, Default)]
pub struct How {
    /// The joint in pictures or profiles; without one, the most frequent joint is used.
    pub joint: Option<Joint>,
    /// Cache of seams found in pictures.
    pub cache: Option<FeatureCache>,
    /// The cached seams depend, besides dataset and joint, on the build that found them.
    pub found_by: String,
}

/// A scan with its seam, and its pictures if it has some.
pub struct Opened {
    /// Input of the calibration.
    pub recording: Recording,
    /// Its pictures.
    pub pictures: Option<Box<dyn PictureSource>>,
    /// Meaning of its stamps, if the recording states it.
    pub stamp_meaning: Option<String>,
    /// An input of the robot that follows the exposures, if one was recorded.
    pub trigger: Option<Trigger>,
}

impl Opened {
    /// The time offset measured by an input of the robot; `None` if none follows the exposures.
    #[must_use]
    pub fn measured_offset(&self, calibration: &Calibration) -> Option<MeasuredByInput> {
        self.trigger.as_ref()?.measured(&self.recording, calibration)
    }
}

impl fmt::Debug for Opened {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Opened")
            .field("recording", &self.recording)
            .field("pictures", &self.pictures.as_ref().map(|pictures| pictures.count()))
            .field("stamp_meaning", &self.stamp_meaning)
            .finish()
    }
}

/// Reads a scan. Without seam points, the seam is detected in pictures or whole profiles. Nothing is written
/// into the dataset.
///
/// # Errors
/// Unreadable data, and pictures or profiles without a seam.
pub fn open(path: &Path, how: &How, observer: &dyn OpenObserver) -> Result<Opened, OpenError> {
    let span = tracing::info_span!(
        "read",
        path = %path.display(),
        robot_poses = field::Empty,
        features = field::Empty
    );
    let opened = span.in_scope(|| read(path, how, observer))?;
    span.record("robot_poses", opened.recording.robot.len());
    span.record("features", opened.recording.features.len());
    Ok(opened)
}

fn read(path: &Path, how: &How, observer: &dyn OpenObserver) -> Result<Opened, OpenError> {
    let mut opened = match place::of(path)? {
        Place::Recording(file) => open_recording(&file, how, observer),
        Place::Folder => open_folder(path, how, observer),
    }?;
    if let Some(cornered) = with_corners(&opened.recording) {
        observer.told(&Told::CrossingsOfStripes { in_place_of: opened.recording.features.len() });
        opened.recording = cornered;
    }
    if let Some(shift_m) = small_path_m(&opened.recording) {
        observer.told(&Told::SmallPath(shift_m * 1e3));
    }
    Ok(opened)
}

/// A scan is centimetres long at the least; metres read as millimetres are less than this, m.
const SMALL_PATH_M: f64 = 0.003;

/// Largest distance of the robot from its start, m, if it is too small to be intended. One that stands still
/// is another matter.
fn small_path_m(recording: &Recording) -> Option<f64> {
    let positions = || recording.robot.iter().map(|sample| sample.base_from_tool.translation.vector);
    let first = positions().next()?;
    let shift_m = positions().map(|position| (position - first).norm()).fold(0.0, f64::max);
    (shift_m > 0.0 && shift_m < SMALL_PATH_M).then_some(shift_m)
}

fn open_folder(path: &Path, how: &How, observer: &dyn OpenObserver) -> Result<Opened, OpenError> {
    let pictures = if images::are_named_in(path)? { Some(PictureFolder::open(path)?) } else { None };
    let features = path.join("features.csv");
    if let (Some(pictures), false) = (&pictures, features.exists()) {
        return open_pictures(path, pictures.clone(), how, observer);
    }
    if how.joint.is_some() && features.exists() {
        return Err(OpenError::SeamKnown(features));
    }
    let FolderContent { mut recording, profiles, notes } = folder::read_content(path)?;
    notes.iter().for_each(|note| observer.told(&Told::Note(note)));
    if !profiles.is_empty() {
        let found = seams_of_profiles(&profiles, how.joint, observer)?;
        (recording.features, recording.stripes) = (found.features, found.stripes);
    }
    let pictures = pictures.map(|pictures| Box::new(pictures) as Box<dyn PictureSource>);
    Ok(Opened { recording, pictures, stamp_meaning: None, trigger: None })
}

/// A folder of pictures without a search for their seam.
fn open_pictures(
    path: &Path,
    pictures: PictureFolder,
    how: &How,
    observer: &dyn OpenObserver,
) -> Result<Opened, OpenError> {
    let sensor = folder::read_sensor_file(path)?;
    let found_how = format!("{} {}", how.joint.map_or("auto", Joint::name), how.found_by);
    let key = FeatureCache::key(path, &pictures, &found_how)?;
    let found = match how.cache.as_ref().and_then(|cache| cache.get(&key, &sensor.sensor)) {
        Some(found) => {
            observer.told(&Told::FoundBefore(found.features.len()));
            found
        }
        None => {
            let sensor_file = path.join("sensor.toml");
            let found = seams_of_pictures(&pictures, &sensor, &sensor_file, how, observer)?;
            if let Some(Err(error)) = how.cache.as_ref().map(|cache| cache.put(&key, &found)) {
                observer.told(&Told::NotKept(&error));
            }
            found
        }
    };
    if let Some(channel) = pictures.channel() {
        observer.told(&Told::Channel(channel));
    }
    let FolderContent { mut recording, notes, .. } = folder::read_with_features(path, found)?;
    notes.iter().for_each(|note| observer.told(&Told::Note(note)));
    recording.inputs.insert("images".to_owned(), key);
    Ok(Opened { recording, pictures: Some(Box::new(pictures)), stamp_meaning: None, trigger: None })
}

/// Number of images with only their seam points recorded.
fn with_a_seam(recording: &Recording) -> usize {
    recording.features.iter().map(|feature| feature.stamp_ns).collect::<BTreeSet<_>>().len()
}

fn open_recording(file: &Path, how: &How, observer: &dyn OpenObserver) -> Result<Opened, OpenError> {
    let choice = Choice { sensor: sensor_beside(file)?, ..Choice::default() };
    let imported = import(file, &choice)?;
    told_of_import(&imported, observer);
    let mut recording = imported.in_written_form()?;
    folder::refuse_what_is_not_applied(file, &recording.setup)?;
    let frames = match &imported.pictures {
        Some(pictures) => pictures.count(),
        None if imported.profiles.is_empty() => with_a_seam(&recording),
        None => imported.profiles.len(),
    };
    let trigger = trigger::of(&imported, frames);
    let Imported { pictures, profiles, stamp_meaning, .. } = imported;
    if recording.features.is_empty() {
        let found = match &pictures {
            _ if !profiles.is_empty() => seams_of_profiles(&profiles, how.joint, observer)?,
            Some(pictures) => {
                let sensor = SensorFile { sensor: recording.sensor.clone(), setup: recording.setup.clone() };
                seams_of_pictures(pictures, &sensor, file, how, observer)?
            }
            None => return Err(OpenError::NothingSeen(file.to_owned())),
        };
        (recording.features, recording.stripes) = (found.features, found.stripes);
    }
    let pictures = pictures.map(|pictures| Box::new(pictures) as Box<dyn PictureSource>);
    Ok(Opened { recording, pictures, stamp_meaning, trigger })
}

/// The seams of pictures; errors name `sensor_file` as the sensor's place.
fn seams_of_pictures(
    pictures: &dyn PictureSource,
    sensor: &SensorFile,
    sensor_file: &Path,
    how: &How,
    observer: &dyn OpenObserver,
) -> Result<FoundSeams, OpenError> {
    let _stage = tracing::debug_span!("find_seams", pictures = pictures.count()).entered();
    let detector = detector::of(sensor, None, StripeChoice::default())
        .map_err(|error| OpenError::Detector { file: sensor_file.to_owned(), error })?;
    let scan: ScanSeams = find_seams(pictures, &detector, how.joint, observer.of_pictures())?;
    observer.told(&Told::SeamsInPictures(&scan));
    if scan.detections().next().is_none() {
        return Err(OpenError::NoSeamInPictures(scan.frames.len()));
    }
    Ok(scan.found())
}

/// The sensor that was laid into a bag's folder.
pub(crate) fn sensor_beside(recording: &Path) -> Result<Option<SensorFile>, OpenError> {
    let file = recording.join("sensor.toml");
    if !(recording.is_dir() && file.exists()) {
        return Ok(None);
    }
    Ok(Some(sensor_toml::read(&file)?))
}
