//! Watches weld after weld with one calibration, deletes old ones, and sends alarms.

use crate::repair::{self, Repair, RepairError};
use crate::store::{ReceiverRow, Store, StoreError};
use crate::tell;
use crate::tell::courier::{Courier, CourierError};
use crate::tell::receiver::ReceiverError;
use crate::watch::{WatchError, Watched, watch};
use crate::weld_line::WeldLine;
use sha2::{Digest, Sha256};
use std::path::Path;
use std::time::{Duration, SystemTime, UNIX_EPOCH};
use trueline_dataset::calibration_file::{self, KnownCalibration};
use trueline_dataset::result_file::ResultFile;
use trueline_dataset::{Recording, source_file};

/// Settings: calibration, state, and receivers of alarms.
pub struct WatcherSettings<'a> {
    /// The state file.
    pub state: &'a Path,
    /// The file of the calibration.
    pub calibration: &'a Path,
    /// Addresses of the receivers of alarms.
    pub tell: &'a [String],
    /// Welds older than this are forgotten.
    pub keep: Option<Duration>,
    /// Tolerated displacement of seam points, m.
    pub tolerance_m: Option<f64>,
}

/// Why nothing can be watched.
#[derive(Debug, thiserror::Error)]
pub enum WatcherError {
    /// The calibration cannot be read.
    #[error(transparent)]
    Calibration(#[from] trueline_dataset::Error),
    /// The state cannot be used.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// An address cannot be used.
    #[error("{0}")]
    Receiver(#[from] ReceiverError),
    /// Messages cannot be sent.
    #[error(transparent)]
    Courier(#[from] CourierError),
    /// A repair cannot be at the reported place.
    #[error(transparent)]
    Repair(#[from] RepairError),
    /// A weld cannot be watched.
    #[error("{name}: {error}")]
    Weld {
        /// The weld.
        name: String,
        /// Reason.
        error: WatchError,
    },
}

impl WatcherError {
    /// Hint for the user.
    #[must_use]
    pub fn hint(&self) -> String {
        match self {
            Self::Calibration(error) => error.hint(),
            Self::Store(error) | Self::Courier(CourierError::Store(error)) => error.hint().to_owned(),
            Self::Receiver(error) => error.hint().to_owned(),
            Self::Courier(CourierError::Thread(_)) => "are there too many processes?".to_owned(),
            Self::Repair(error) => error.hint().to_owned(),
            Self::Weld { error, .. } => error.hint().to_owned(),
        }
    }
}

/// Watches weld after weld.
pub struct Watcher {
    store: Store,
    known: KnownCalibration,
    calibration: Watched,
    keep: Option<Duration>,
    couriers: Vec<Courier>,
    met_another_sensor: bool,
    /// Whether an alarm stands after the last weld.
    pub is_alarm: bool,
}

impl Watcher {
    /// Opens state and calibration, and starts to send messages.
    ///
    /// # Errors
    /// A file that cannot be used, or an address of no known kind.
    pub fn of(settings: &WatcherSettings<'_>) -> Result<Self, WatcherError> {
        let known = calibration_file::read(settings.calibration)?;
        let mut calibration = watched(settings.calibration, &known)?;
        calibration.tolerance_m = settings.tolerance_m;
        let store = Store::open(settings.state)?;
        let (mut couriers, pace) = (Vec::new(), tell::Pace::default());
        for address in settings.tell {
            couriers.push(Courier::start(settings.state, tell::at(address, pace.patience)?, pace)?);
        }
        let keep = settings.keep;
        Ok(Self { store, known, calibration, keep, couriers, met_another_sensor: false, is_alarm: false })
    }

    /// Whether the calibration was accepted, if its file states it.
    #[must_use]
    pub fn was_accepted(&self) -> Option<bool> {
        self.known.accepted
    }

    /// Whether the sensor's file of a weld is another than that of the calibration, and this has not been asked of such a weld
    /// before.
    pub fn meets_another_sensor(&mut self, weld: &Recording) -> bool {
        let is_another = self.calibration.sensor_file_differs(weld) == Some(true);
        is_another && !std::mem::replace(&mut self.met_another_sensor, is_another)
    }

    /// Watches a weld.
    ///
    /// # Errors
    /// A weld or a state that cannot be used.
    pub fn one(&mut self, name: &str, recording: Recording) -> Result<WeldLine, WatcherError> {
        self.known.check_recording(Path::new(&self.calibration.name), &recording)?;
        let recording = self.known.corrected(recording);
        let line = watch(&self.store, &self.calibration, name, &recording)
            .map_err(|error| WatcherError::Weld { name: name.to_owned(), error })?;
        self.is_alarm = line.is_alarm();
        tracing::info!(
            weld = name,
            number = line.number,
            used = line.used,
            is_alarm = self.is_alarm,
            "weld watched"
        );
        if let Some(keep) = self.keep {
            let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
            self.store.forget_before(now.saturating_sub(keep).as_secs().cast_signed())?;
        }
        Ok(line)
    }

    /// Takes the fault that stands to be mended before a weld, by number or name; `None` is the next one.
    ///
    /// # Errors
    /// A weld that is not known, or lies before the fault; a state that cannot be written.
    pub fn repaired(&mut self, before: Option<&str>) -> Result<Repair, WatcherError> {
        let now_s = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |d| d.as_secs().cast_signed());
        let names = (self.calibration.sha256.as_str(), self.calibration.name.as_str());
        let repair = repair::claim(&self.store, names, before, now_s)?;
        self.is_alarm = false;
        Ok(repair)
    }

    /// Whether a word names a weld that has been watched, by number or name.
    ///
    /// # Errors
    /// A state that cannot be read.
    pub fn knows(&self, weld: &str) -> Result<bool, WatcherError> {
        Ok(repair::is_known(&self.store, &self.calibration.sha256, weld)?)
    }

    /// Sends pending messages once more, and returns the receivers that failed. Their messages are kept.
    ///
    /// # Errors
    /// A state that cannot be read.
    pub fn finish(&mut self) -> Result<Vec<ReceiverRow>, StoreError> {
        if self.couriers.is_empty() {
            return Ok(Vec::new());
        }
        self.couriers.clear();
        Ok(self.store.receivers()?.into_iter().filter(|receiver| receiver.waiting > 0).collect())
    }
}

/// The calibration with all data of its file.
fn watched(file: &Path, known: &KnownCalibration) -> Result<Watched, WatcherError> {
    let bytes = source_file::bytes(file)?;
    let is_json = calibration_file::is_json(&String::from_utf8_lossy(&bytes));
    let result = is_json.then(|| ResultFile::read(file)).transpose()?;
    let sha256 = Sha256::digest(&bytes).iter().map(|byte| format!("{byte:02x}")).collect();
    Ok(Watched {
        name: file.display().to_string(),
        sha256,
        guess: known.with_correction(),
        result,
        tolerance_m: None,
    })
}
