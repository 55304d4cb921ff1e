//! A recording, wherever it comes from.

use crate::calibration::Calibration;
use crate::error::Error;
#[cfg(feature = "open")]
use crate::open::{How, OpenObserver, Opened, Told};
use std::ops::Deref;
use std::path::Path;
#[cfg(feature = "open")]
use std::sync::Mutex;
use trueline_dataset::{Feature, Guess, RobotSample, Sensor, SensorSetup};
use trueline_method::evaluate::seam_points::{self, SeamPoints};
use trueline_method::{Config, calibrate};

/// A recorded scan: everything of [`trueline_dataset::Recording`], and its methods.
#[derive(Clone, Debug)]
pub struct Recording {
    data: trueline_dataset::Recording,
    notes: Vec<String>,
    stamp_meaning: Option<String>,
}

impl Recording {
    /// Opens a dataset folder, a recording in MCAP or a rosbag2. Without seam points, the seam is detected in
    /// pictures or whole profiles. Without the feature `open`: a dataset folder with `features.csv` alone.
    ///
    /// # Errors
    /// The first file, line and column that cannot be used; a recording without a seam.
    pub fn open(path: impl AsRef<Path>) -> Result<Self, Error> {
        #[cfg(feature = "open")]
        return Self::open_how(path, &How::default());
        #[cfg(not(feature = "open"))]
        Ok(trueline_dataset::folder::read(path.as_ref())?.into())
    }

    /// The same for pictures with a known joint.
    ///
    /// # Errors
    /// As [`Recording::open`]; a joint for a scan with a known seam.
    #[cfg(feature = "open")]
    pub fn open_how(path: impl AsRef<Path>, how: &How) -> Result<Self, Error> {
        let notes = Notes::default();
        let Opened { recording: data, stamp_meaning, .. } = crate::open::open(path.as_ref(), how, &notes)?;
        Ok(Self { data, notes: notes.0.into_inner().unwrap_or_default(), stamp_meaning })
    }

    /// A recording from arrays: poses and features by rising stamp.
    #[must_use]
    pub fn new(sensor: Sensor, poses: Vec<RobotSample>, features: Vec<Feature>) -> Self {
        Self::from(trueline_dataset::Recording::new(sensor, SensorSetup::default(), poses, features))
    }

    /// The same with a first guess of time offset and hand-eye.
    #[must_use]
    pub fn with_guess(mut self, guess: Guess) -> Self {
        self.data.initial = Some(guess);
        self
    }

    /// Remarks about the file it was opened from: sorted or ignored rows, the kind of stamps, and unreadable
    /// data.
    #[must_use]
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// Calibrates from the recording's first guess, or without one if it has none.
    ///
    /// # Errors
    /// A recording from which nothing can be estimated. A doubtful result is not an error: see
    /// [`status`](trueline_method::Calibration::status) and [`reasons`](trueline_method::Calibration::reasons).
    pub fn calibrate(&self) -> Result<Calibration, Error> {
        self.calibrate_with(&Config::default())
    }

    /// The same with settings.
    ///
    /// # Errors
    /// As [`Recording::calibrate`].
    pub fn calibrate_with(&self, config: &Config) -> Result<Calibration, Error> {
        let calibration = calibrate(&self.data, self.data.initial.as_ref(), config)?;
        Ok(Calibration::new(calibration, self.data.setup.mounted, self.stamp_meaning.clone()))
    }

    /// Place of the seam in base by a calibration, with the stamps as recorded.
    ///
    /// # Errors
    /// A time offset or hand-eye that the calibration could not observe; features that do not lie on a laser plane.
    pub fn seam_points(&self, by: &Calibration) -> Result<SeamPoints, Error> {
        let tool_from_camera = by.tool_from_camera()?.tool_from_camera;
        let guess = Guess { time_offset_s: by.time_offset()?.value_s, tool_from_camera };
        Ok(seam_points::place(&self.data, &guess, &by.findings.config)?)
    }
}

/// Notes on the recording; the progress of the search for the seam is not kept.
#[cfg(feature = "open")]
#[derive(Default)]
struct Notes(Mutex<Vec<String>>);

#[cfg(feature = "open")]
impl OpenObserver for Notes {
    fn told(&self, told: &Told<'_>) {
        let searched = matches!(told, Told::SeamsInPictures(_) | Told::SeamsInProfiles { .. });
        if let (false, Ok(mut notes)) = (searched, self.0.lock()) {
            notes.push(told.to_string());
        }
    }
}

impl From<trueline_dataset::Recording> for Recording {
    fn from(recording: trueline_dataset::Recording) -> Self {
        Self { data: recording, notes: Vec::new(), stamp_meaning: None }
    }
}

impl Deref for Recording {
    type Target = trueline_dataset::Recording;

    fn deref(&self) -> &Self::Target {
        &self.data
    }
}
