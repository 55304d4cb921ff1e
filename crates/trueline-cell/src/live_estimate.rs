//! The estimate of a scan that is under way.
//!
//! All data so far are calibrated by the same recipe as afterwards, again whenever they have grown by half. In
//! between, and after ten minutes, new data are added to the sums of the old ones. At the end of a stream that is
//! still kept as a whole, all of it is calibrated again.

use std::mem::take;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};
use trueline_dataset::{Feature, Recording, RobotSample, SensorFile};
use trueline_method::incremental::{Change, Estimate, Extent, Incremental};
use trueline_method::problem::parameters::{ROTATION, TIME_OFFSET, TRANSLATION};
use trueline_method::{Calibration, Config, Requirement, Status};

/// Between estimates; at least twice the duration of one.
const EVERY: Duration = Duration::from_secs(2);
/// Fewer seam points give no estimate.
const FEWEST_FEATURES: usize = 30;

/// Poses and features received, and the estimate from them.
pub struct LiveEstimate {
    sensor: SensorFile,
    want: Option<Requirement>,
    came: Mutex<(Vec<RobotSample>, Vec<Feature>)>,
    progress: Mutex<Progress>,
    /// Whether the receiver is gone.
    has_failed: AtomicBool,
}

/// If the estimate panics, later data are not kept.
struct Guard<'a>(&'a LiveEstimate);

impl Drop for Guard<'_> {
    fn drop(&mut self) {
        if thread::panicking() {
            self.0.has_failed.store(true, Ordering::SeqCst);
            *self.0.came.lock().unwrap_or_else(PoisonError::into_inner) = Default::default();
        }
    }
}

/// How far an estimate is.
#[derive(Clone, Debug)]
pub enum Progress {
    /// Too few seam points so far.
    Waiting {
        /// Number received.
        seam_points: usize,
        /// Number needed for a first estimate.
        needed: usize,
    },
    /// The estimator refuses the data.
    Refused {
        /// Seam points that came.
        seam_points: usize,
        /// Reason.
        why: Arc<trueline_method::Error>,
    },
    /// An estimate.
    Estimated(Estimated),
}

/// An estimate from a scan that is under way.
#[derive(Clone, Debug)]
pub struct Estimated {
    /// Seam points that it is made from.
    pub seam_points: usize,
    /// Time offset and the random part of its sigma, which a longer scan reduces, s; `None` while it is not observable.
    pub time_offset_s: Option<[f64; 2]>,
    /// Largest sigma of the hand-eye translation, likewise, m; `None` while any part of it is not observable.
    pub translation_sigma_m: Option<f64>,
    /// Largest sigma of the hand-eye rotation, likewise, rad; `None` while any part of it is not observable.
    pub rotation_sigma_rad: Option<f64>,
    /// Whether the requirements are met and the calibration is accepted; `None` without requirements.
    pub is_enough: Option<bool>,
    /// Quantities that are not observable yet, and the motion that would make them so.
    pub advice: Vec<String>,
}

impl LiveEstimate {
    /// Nothing has come yet.
    #[must_use]
    pub fn new(sensor: impl Into<SensorFile>, want: Option<Requirement>) -> Self {
        let progress = Mutex::new(Progress::Waiting { seam_points: 0, needed: FEWEST_FEATURES });
        Self {
            sensor: sensor.into(),
            want,
            came: Mutex::default(),
            progress,
            has_failed: AtomicBool::new(false),
        }
    }

    /// Hands over poses, unless some are just being taken: then they stay for the next time.
    pub fn offer_poses(&self, poses: &mut Vec<RobotSample>) {
        if self.has_failed.load(Ordering::SeqCst) {
            poses.clear();
        } else if let Ok(mut came) = self.came.try_lock() {
            came.0.append(poses);
        }
    }

    /// Hands over a feature.
    pub fn add_feature(&self, feature: Feature) {
        if self.has_failed.load(Ordering::SeqCst) {
            return;
        }
        self.came.lock().unwrap_or_else(PoisonError::into_inner).1.push(feature);
    }

    /// How far it is.
    #[must_use]
    pub fn progress(&self) -> Progress {
        self.progress.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Estimates until the end, and once more then.
    pub fn run(&self, over: &AtomicBool) {
        let _guard = Guard(self);
        let mut stream = Incremental::new(self.nothing(), Config::default(), Extent::default());
        let (mut due, mut last) = (Instant::now() + EVERY, false);
        while !last {
            last = over.load(Ordering::SeqCst);
            if !last && Instant::now() < due {
                thread::sleep(Duration::from_millis(50));
                continue;
            }
            let (robot, features) = {
                let mut came = self.came.lock().unwrap_or_else(PoisonError::into_inner);
                (take(&mut came.0), take(&mut came.1))
            };
            stream.add(robot, features);
            let start = Instant::now();
            let progress = self.estimate(&mut stream, last);
            *self.progress.lock().unwrap_or_else(PoisonError::into_inner) = progress;
            due = Instant::now() + EVERY.max(2 * start.elapsed());
        }
    }

    fn nothing(&self) -> Recording {
        let SensorFile { sensor, setup } = self.sensor.clone();
        Recording::new(sensor, setup, Vec::new(), Vec::new())
    }

    fn estimate(&self, stream: &mut Incremental, last: bool) -> Progress {
        let seam_points = stream.seam_points();
        if seam_points < FEWEST_FEATURES {
            return Progress::Waiting { seam_points, needed: FEWEST_FEATURES };
        }
        let outcome = if last { stream.finish() } else { stream.update() };
        let answer = stream.estimate();
        match (stream.calibration(), answer, outcome) {
            // Samples that cannot be placed yet change nothing.
            (Some(calibration), Some(answer), _) if stream.is_ahead() => {
                Progress::Estimated(self.ahead(calibration, &answer, seam_points))
            }
            (_, _, Err(why)) => Progress::Refused { seam_points, why: Arc::new(why) },
            (Some(calibration), ..) => Progress::Estimated(self.estimated(calibration, seam_points)),
            (None, ..) => Progress::Waiting { seam_points, needed: FEWEST_FEATURES },
        }
    }

    /// The last calibration, updated with later data.
    fn ahead(&self, calibration: &Calibration, answer: &Estimate, seam_points: usize) -> Estimated {
        let sigma = |k: usize| answer.noise_sigma[k];
        let is_accepted = calibration.status() == Status::Accepted && answer.change.is_none();
        Estimated {
            time_offset_s: sigma(TIME_OFFSET).map(|sigma_s| [answer.parameters.time_offset_s, sigma_s]),
            translation_sigma_m: worst(sigma, TRANSLATION),
            rotation_sigma_rad: worst(sigma, ROTATION),
            is_enough: self.want.map(|want| is_accepted && is_reached(sigma, &want)),
            advice: answer.change.iter().map(in_words).collect(),
            ..self.estimated(calibration, seam_points)
        }
    }

    fn estimated(&self, calibration: &Calibration, seam_points: usize) -> Estimated {
        let offset_s = calibration.best_fit().time_offset_s;
        let sigma = |k: usize| calibration.noise_sigma(k);
        let is_enough =
            self.want.map(|want| calibration.status() == Status::Accepted && is_reached(sigma, &want));
        Estimated {
            seam_points,
            time_offset_s: sigma(TIME_OFFSET).map(|sigma_s| [offset_s, sigma_s]),
            translation_sigma_m: worst(sigma, TRANSLATION),
            rotation_sigma_rad: worst(sigma, ROTATION),
            is_enough,
            advice: calibration
                .findings
                .unknowns
                .observability
                .unobservable
                .iter()
                .map(ToString::to_string)
                .collect(),
        }
    }
}

/// Assumptions that do not hold for the whole stream any more.
fn in_words(change: &Change) -> String {
    if change.time_offset_s == 0.0 {
        let percent = 100.0 * change.fitting;
        return format!(
            "one seam for the whole stream: of newer seam points {percent:.0} % fit those before"
        );
    }
    format!(
        "one time offset for the whole stream, but it has changed by {:+.2} ms",
        1e3 * change.time_offset_s
    )
}

/// The largest sigma of three components, if all are observable.
fn worst(sigma: impl Fn(usize) -> Option<f64>, first: usize) -> Option<f64> {
    (first..first + 3).map(sigma).try_fold(0.0, |worst: f64, sigma| Some(worst.max(sigma?)))
}

fn is_reached(sigma: impl Fn(usize) -> Option<f64>, want: &Requirement) -> bool {
    let within = |limit: Option<f64>, sigma: Option<f64>| {
        limit.is_none_or(|limit| sigma.is_some_and(|sigma| sigma <= limit))
    };
    within(want.time_s, sigma(TIME_OFFSET))
        && within(want.translation_m, worst(&sigma, TRANSLATION))
        && within(want.rotation_rad, worst(&sigma, ROTATION))
}

#[cfg(test)]
#[allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]
mod tests {
    use super::*;
    use trueline_dataset::Sensor;
    use trueline_geometry::Pose;

    #[test]
    fn nothing_is_kept_for_an_estimate_that_failed() {
        let estimate = LiveEstimate::new(Sensor::Profiler, None);
        let pose = RobotSample { stamp_ns: 0, device_ns: None, base_from_tool: Pose::identity() };
        estimate.offer_poses(&mut vec![pose]);
        assert_eq!(estimate.came.lock().unwrap().0.len(), 1);
        let failed = thread::scope(|scope| {
            let fails = || {
                let _guard = Guard(&estimate);
                panic!("as asked");
            };
            scope.spawn(fails).join().is_err()
        });
        let mut poses = vec![pose];
        estimate.offer_poses(&mut poses);
        assert!(failed && poses.is_empty() && estimate.came.lock().unwrap().0.is_empty());
    }
}
