//! The kept part of a stream, and the choice between a new calibration and an update.

use super::innovation::Change;
use super::past::{Estimate, Past};
use crate::calibrate::estimate;
use crate::calibration::Calibration;
use crate::config::Config;
use crate::error::Error;
use trueline_dataset::{Feature, Recording, RobotSample};

/// The kept part of a stream.
#[derive(Clone, Copy, Debug)]
pub struct Extent {
    /// Time for which samples are kept, ns. A stream of this length is recalibrated now and then. Older samples remain in sums only.
    pub kept_ns: i64,
    /// New samples are placed with the path and the clocks of this time before them, ns.
    pub context_ns: i64,
}

impl Default for Extent {
    fn default() -> Self {
        Self { kept_ns: 600_000_000_000, context_ns: 30_000_000_000 }
    }
}

/// State so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Work {
    /// Number of calibrations of all kept samples.
    pub calibrations: usize,
    /// Total seam points in them.
    pub calibrated: usize,
    /// Seam points that were linearised and added.
    pub added: usize,
}

/// A calibration of a continuing stream.
pub struct Incremental {
    config: Config,
    extent: Extent,
    kept: Recording,
    calibration: Option<Calibration>,
    past: Option<Past>,
    /// Seam points of the last calibration.
    calibrated: usize,
    /// Stamp of the last seam point in the estimate, ns.
    until_ns: i64,
    /// Whether samples in the estimate were dropped.
    has_dropped: bool,
    /// Whether the estimate contains samples after the last calibration.
    is_ahead: bool,
    seam_points: usize,
    work: Work,
}

/// Growth of the number of samples that triggers a calibration. The total cost is three times that of one calibration.
const GROWTH: f64 = 1.5;
/// The same while part of the unknowns is unobservable, or the scan disagrees with itself.
const GROWTH_UNSETTLED: f64 = 1.1;
/// Waiting time for delayed frames and poses, ns.
const WAIT_NS: i64 = 500_000_000;

impl Incremental {
    /// An empty stream. `empty` describes the sensor. Its sums include noise alone. Only the calibration of the whole scan includes form and edge of
    /// the seam.
    #[must_use]
    pub fn new(empty: Recording, config: Config, extent: Extent) -> Self {
        let config = Config { edge_radius_m: Some(0.0), waviness_m: Some(0.0), ..config };
        Self {
            config,
            extent,
            kept: empty,
            calibration: None,
            past: None,
            calibrated: 0,
            until_ns: i64::MIN,
            has_dropped: false,
            is_ahead: false,
            seam_points: 0,
            work: Work::default(),
        }
    }

    /// Adds samples, which may be out of order.
    pub fn add(&mut self, mut robot: Vec<RobotSample>, mut features: Vec<Feature>) {
        let until_ns = self.until_ns;
        // Later samples cannot be added any more.
        features.retain(|feature| feature.stamp_ns > until_ns);
        self.seam_points += features.len();
        self.kept.robot.append(&mut robot);
        self.kept.features.append(&mut features);
        self.kept.robot.sort_by_key(|sample| sample.stamp_ns);
        self.kept.features.sort_by_key(|feature| feature.stamp_ns);
    }

    /// Number of seam points received.
    #[must_use]
    pub fn seam_points(&self) -> usize {
        self.seam_points
    }

    /// State so far.
    #[must_use]
    pub fn work(&self) -> Work {
        self.work
    }

    /// Samples that are kept: poses and features.
    #[must_use]
    pub fn kept(&self) -> [usize; 2] {
        [self.kept.robot.len(), self.kept.features.len()]
    }

    /// The last calibration of all kept samples.
    #[must_use]
    pub fn calibration(&self) -> Option<&Calibration> {
        self.calibration.as_ref()
    }

    /// New samples that disagree with earlier ones.
    #[must_use]
    pub fn change(&self) -> Option<Change> {
        self.past.as_ref().and_then(Past::change)
    }

    /// Whether the estimate has more information than the last calibration.
    #[must_use]
    pub fn is_ahead(&self) -> bool {
        self.is_ahead
    }

    /// Estimate from all samples. `None` if it is incomplete. The last calibration then reports the missing parts.
    #[must_use]
    pub fn estimate(&mut self) -> Option<Estimate> {
        self.past.as_mut()?.estimate()
    }

    /// Updates the estimate with the received samples.
    ///
    /// # Errors
    /// Those of [`calibrate`](crate::calibrate()), and new samples that cannot be placed. They are tried again the next time.
    pub fn update(&mut self) -> Result<(), Error> {
        let Some(settled_ns) = self.settled_ns() else { return Ok(()) };
        let ready = self.kept.features.partition_point(|feature| feature.stamp_ns <= settled_ns);
        let is_due = ready as f64 >= self.growth() * self.calibrated as f64;
        let outcome = if !self.has_dropped && is_due {
            self.calibrate(ready)
        } else if self.past.is_some() {
            self.add_ready(ready)
        } else {
            Ok(())
        };
        self.forget();
        outcome
    }

    /// Calibrates all samples at the end of a stream, if they are all kept. Otherwise adds the last ones to the sums.
    ///
    /// # Errors
    /// Those of [`Incremental::update`].
    pub fn finish(&mut self) -> Result<(), Error> {
        let all = self.kept.features.len();
        if self.has_dropped && self.past.is_some() { self.add_ready(all) } else { self.calibrate(all) }
    }

    fn growth(&self) -> f64 {
        let is_settled = self.past.as_ref().is_some_and(|past| past.change().is_none());
        if is_settled { GROWTH } else { GROWTH_UNSETTLED }
    }

    /// The stamp up to which all samples have arrived, ns.
    fn settled_ns(&self) -> Option<i64> {
        let last_ns = self.kept.features.last()?.stamp_ns;
        let robot_ns = self.kept.robot.last()?.stamp_ns;
        let offset_s = self.past.as_ref().map_or(0.0, Past::time_offset_s);
        Some(last_ns.min(robot_ns + (offset_s * 1e9) as i64) - WAIT_NS)
    }

    fn calibrate(&mut self, ready: usize) -> Result<(), Error> {
        let _stage = tracing::debug_span!("live_estimate", features = ready).entered();
        let later = self.kept.features.split_off(ready);
        let outcome = estimate(&self.kept, None, &self.config).and_then(|calibration| {
            let past = Past::of(&calibration, &self.kept, &self.config)?;
            Ok((calibration, past))
        });
        self.work.calibrations += 1;
        self.work.calibrated += ready;
        self.calibrated = ready;
        let last = self.kept.features.last().map(|feature| feature.stamp_ns);
        self.kept.features.extend(later);
        self.is_ahead = false;
        // A refusal of all samples invalidates the result from fewer.
        (self.calibration, self.past) = (None, None);
        let (calibration, past) = outcome?;
        (self.calibration, self.past) = (Some(calibration), past);
        self.until_ns = last.filter(|_| self.past.is_some()).unwrap_or(i64::MIN);
        Ok(())
    }

    fn add_ready(&mut self, ready: usize) -> Result<(), Error> {
        let features = &self.kept.features[..ready];
        let Some(last_ns) = features.last().map(|f| f.stamp_ns).filter(|last| *last > self.until_ns) else {
            return Ok(());
        };
        let from_ns = self.until_ns - self.extent.context_ns;
        let first = features.partition_point(|feature| feature.stamp_ns < from_ns);
        let offset_ns = self.past.as_ref().map_or(0.0, Past::time_offset_s) * 1e9;
        let robot_from_ns = from_ns - offset_ns as i64 - WAIT_NS;
        let robot = self.kept.robot.partition_point(|sample| sample.stamp_ns < robot_from_ns);
        let Recording { sensor, setup, inputs, .. } = &self.kept;
        let (robot, features) = (self.kept.robot[robot..].to_vec(), features[first..].to_vec());
        let recording = Recording::new(sensor.clone(), setup.clone(), robot, features);
        let recording = Recording { inputs: inputs.clone(), ..recording };
        if let Some(past) = &mut self.past {
            self.work.added += past.add(&recording, [self.until_ns, last_ns], &self.config)?;
            self.until_ns = last_ns;
            self.is_ahead = true;
        }
        Ok(())
    }

    /// Drops samples in the sums when the stream is longer than the kept part. Without sums, drops the older half.
    fn forget(&mut self) {
        let Some(last_ns) = self.kept.robot.last().map(|sample| sample.stamp_ns) else { return };
        let Some(first_ns) = self.kept.robot.first().map(|sample| sample.stamp_ns) else { return };
        if last_ns - first_ns <= self.extent.kept_ns {
            return;
        }
        let oldest_ns = if self.past.is_some() {
            self.has_dropped = true;
            // Samples that could not be placed for this long are discarded.
            (self.until_ns - 2 * self.extent.context_ns).max(last_ns - self.extent.kept_ns)
        } else {
            self.calibrated = 0;
            last_ns - self.extent.kept_ns / 2
        };
        let robot = self.kept.robot.partition_point(|sample| sample.stamp_ns < oldest_ns);
        let features = self.kept.features.partition_point(|feature| feature.stamp_ns < oldest_ns);
        self.kept.robot.drain(..robot);
        self.kept.features.drain(..features);
    }
}
