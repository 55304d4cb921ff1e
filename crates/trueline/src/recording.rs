//! A recording, wherever it comes from.

use crate::calibration::Calibration;
use crate::error::Error;
use std::collections::BTreeMap;
use std::ops::Deref;
use std::path::Path;
use trueline_dataset::{Feature, Guess, RobotSample, Sensor, SensorSetup, folder};
#[cfg(feature = "images")]
use trueline_dataset::{FoundSeams, PictureFolder, PictureSource, images};
#[cfg(feature = "mcap")]
use trueline_dataset::{Problem, SensorFile, sensor_toml};
use trueline_method::evaluate::seam_points::{self, SeamPoints};
#[cfg(feature = "images")]
use trueline_method::stripe::corners::with_corners;
use trueline_method::{Config, calibrate};
#[cfg(feature = "images")]
use trueline_vision::scan::ScanError;
#[cfg(feature = "images")]
use trueline_vision::{Detector, find_seams};

/// A recorded scan: everything of [`trueline_dataset::Recording`], and what can be done with it.
#[derive(Clone, Debug)]
pub struct Recording {
    data: trueline_dataset::Recording,
    notes: Vec<String>,
}

impl Recording {
    /// Opens a dataset folder; with the feature `mcap` also a recording in MCAP or rosbag2, and with the feature `images`
    /// either of them with pictures instead of seam features, in which the seam is found.
    ///
    /// # Errors
    /// The first file, line and column that cannot be used; a recording without seam features.
    pub fn open(path: impl AsRef<Path>) -> Result<Self, Error> {
        let path = path.as_ref();
        #[cfg(feature = "mcap")]
        if path.is_file() || path.join("metadata.yaml").exists() && !path.join("robot.csv").exists() {
            return imported(path);
        }
        #[cfg(feature = "images")]
        if images::index_of(path).exists() && !path.join("features.csv").exists() {
            return with_pictures(path);
        }
        #[cfg(feature = "images")]
        {
            let content = folder::read_content(path)?;
            let mut data = content.recording;
            if !content.profiles.is_empty() {
                let found = trueline_vision::profile::seams(&content.profiles).found;
                if found.features.is_empty() {
                    return Err(Error::NoFeatures(path.to_owned()));
                }
                (data.features, data.stripes) = (found.features, found.stripes);
            }
            let data = with_corners(&data).unwrap_or(data);
            Ok(Recording { data, notes: content.notes })
        }
        #[cfg(not(feature = "images"))]
        Ok(folder::read(path)?.into())
    }

    /// A recording from arrays: poses and features by rising stamp.
    #[must_use]
    pub fn new(sensor: Sensor, poses: Vec<RobotSample>, features: Vec<Feature>) -> Self {
        Self::from(trueline_dataset::Recording {
            sensor,
            setup: SensorSetup::default(),
            robot: poses,
            features,
            stripes: Vec::new(),
            initial: None,
            truth: None,
            inputs: BTreeMap::new(),
        })
    }

    /// The same with a first guess of time offset and hand-eye.
    #[must_use]
    pub fn with_guess(mut self, guess: Guess) -> Self {
        self.data.initial = Some(guess);
        self
    }

    /// What is worth knowing of the file it was opened from: what was sorted or left out, what its stamps mean, and what of it
    /// could not be read.
    #[must_use]
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// Calibrates from the recording's first guess, or without one if it has none.
    ///
    /// # Errors
    /// A recording from which nothing can be estimated. A doubtful result is none: see
    /// [`status`](trueline_method::Calibration::status) and [`reasons`](trueline_method::Calibration::reasons).
    pub fn calibrate(&self) -> Result<Calibration, Error> {
        self.calibrate_with(&Config::default())
    }

    /// The same with settings.
    ///
    /// # Errors
    /// As [`Recording::calibrate`].
    pub fn calibrate_with(&self, config: &Config) -> Result<Calibration, Error> {
        Ok(Calibration::new(calibrate(&self.data, self.data.initial.as_ref(), config)?))
    }

    /// Where the seam is in base by a calibration, with the stamps as recorded.
    ///
    /// # Errors
    /// A time offset or hand-eye that the calibration could not observe; features that do not lie on a laser plane.
    pub fn seam_points(&self, by: &Calibration) -> Result<SeamPoints, Error> {
        let tool_from_camera = by.tool_from_camera()?.tool_from_camera;
        let guess = Guess { time_offset_s: by.time_offset()?.value_s, tool_from_camera };
        Ok(seam_points::place(&self.data, &guess, &by.findings.config)?)
    }
}

#[cfg(feature = "mcap")]
fn imported(path: &Path) -> Result<Recording, Error> {
    let choice = trueline_mcap::Choice { sensor: sensor_beside(path)?, ..trueline_mcap::Choice::default() };
    let imported = trueline_mcap::import(path, &choice)?;
    #[cfg_attr(not(feature = "images"), expect(unused_mut, reason = "features come from pictures"))]
    let mut data = imported.in_written_form()?;
    folder::refuse_what_is_not_applied(path, &data.setup)?;
    #[cfg(feature = "images")]
    if let (true, Some(pictures)) = (data.features.is_empty(), &imported.pictures) {
        let found = seams_in(pictures, &data.sensor)?;
        (data.features, data.stripes) = (found.features, found.stripes);
    }
    #[cfg(feature = "images")]
    if data.features.is_empty() {
        let found = trueline_vision::profile::seams(&imported.profiles).found;
        (data.features, data.stripes) = (found.features, found.stripes);
    }
    if data.features.is_empty() {
        return Err(Error::NoFeatures(path.to_owned()));
    }
    let damages = imported.damages.iter().map(ToString::to_string);
    let notes = imported.stamp_meaning.into_iter().chain(imported.notes).chain(damages).collect();
    Ok(Recording { data, notes })
}

/// A dataset folder without features: they are found in its pictures, and nothing is written.
#[cfg(feature = "images")]
fn with_pictures(path: &Path) -> Result<Recording, Error> {
    let found = seams_in(&PictureFolder::open(path)?, &folder::read_sensor(path)?)?;
    if found.features.is_empty() {
        return Err(Error::NoFeatures(path.to_owned()));
    }
    Ok(folder::read_with_features(path, found)?.into())
}

#[cfg(feature = "images")]
fn seams_in(pictures: &dyn PictureSource, sensor: &Sensor) -> Result<FoundSeams, Error> {
    let detector = Detector::for_sensor(sensor).ok_or(ScanError::NoCamera { kind: sensor.kind() })?;
    Ok(find_seams(pictures, &detector, None, &())?.found())
}

/// The sensor that was laid into a bag's folder.
#[cfg(feature = "mcap")]
fn sensor_beside(bag: &Path) -> Result<Option<SensorFile>, Error> {
    let file = bag.join("sensor.toml");
    if !file.exists() {
        return Ok(None);
    }
    let text = std::fs::read_to_string(&file)
        .map_err(|error| trueline_dataset::Error::in_file(&file, Problem::Io(error)))?;
    Ok(Some(sensor_toml::parse_file(&file, &text)?))
}

impl From<trueline_dataset::Recording> for Recording {
    fn from(recording: trueline_dataset::Recording) -> Self {
        Self { data: recording, notes: Vec::new() }
    }
}

impl Deref for Recording {
    type Target = trueline_dataset::Recording;

    fn deref(&self) -> &Self::Target {
        &self.data
    }
}
