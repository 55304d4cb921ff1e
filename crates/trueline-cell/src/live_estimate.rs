//! What a scan that is under way yields so far.
//!
//! Every now and then everything that came is calibrated as it would be afterwards, by the same recipe: the estimate
//! deserves the same trust, and names the same unobservable directions.

use std::mem::take;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};
use trueline_dataset::{Feature, Recording, RobotSample, SensorFile};
use trueline_method::problem::parameters::{ROTATION, TIME_OFFSET, TRANSLATION};
use trueline_method::{Calibration, Config, Requirement, Status};

/// Between estimates; never less than twice as long as one takes.
const EVERY: Duration = Duration::from_secs(2);
/// Only the last ten minutes are estimated from, to bound memory and time, ns.
const LONGEST_NS: i64 = 600_000_000_000;
/// Fewer seam points give no estimate.
const FEWEST_FEATURES: usize = 30;

/// Poses and features that have come, and what follows from them.
pub struct LiveEstimate {
    sensor: SensorFile,
    want: Option<Requirement>,
    came: Mutex<(Vec<RobotSample>, Vec<Feature>)>,
    progress: Mutex<Progress>,
}

/// How far an estimate is.
#[derive(Clone, Debug)]
pub enum Progress {
    /// Too few seam points so far.
    Waiting {
        /// Those that came.
        seam_points: usize,
        /// Those that a first estimate needs.
        needed: usize,
    },
    /// The estimator refuses what came.
    Refused {
        /// Seam points that came.
        seam_points: usize,
        /// Why.
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
    /// Time offset and the random part of its sigma, which is what a longer scan makes smaller, s; `None` while it is not observable.
    pub time_offset_s: Option<[f64; 2]>,
    /// Largest sigma of the hand-eye translation, likewise, m; `None` while any part of it is not observable.
    pub translation_sigma_m: Option<f64>,
    /// Largest sigma of the hand-eye rotation, likewise, rad; `None` while any part of it is not observable.
    pub rotation_sigma_rad: Option<f64>,
    /// Whether what was required is reached, and the calibration accepted; `None` if nothing was required.
    pub is_enough: Option<bool>,
    /// What is not observable yet, and the motion that would make it so.
    pub advice: Vec<String>,
}

impl LiveEstimate {
    /// Nothing has come yet.
    #[must_use]
    pub fn new(sensor: impl Into<SensorFile>, want: Option<Requirement>) -> Self {
        let progress = Mutex::new(Progress::Waiting { seam_points: 0, needed: FEWEST_FEATURES });
        Self { sensor: sensor.into(), want, came: Mutex::default(), progress }
    }

    /// Hands over poses, unless some are just being taken: then they stay for the next time.
    pub fn offer_poses(&self, poses: &mut Vec<RobotSample>) {
        if let Ok(mut came) = self.came.try_lock() {
            came.0.append(poses);
        }
    }

    /// Hands over a feature.
    pub fn add_feature(&self, feature: Feature) {
        self.came.lock().unwrap_or_else(PoisonError::into_inner).1.push(feature);
    }

    /// How far it is.
    #[must_use]
    pub fn progress(&self) -> Progress {
        self.progress.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Estimates until all is over, and once more then.
    pub fn run(&self, over: &AtomicBool) {
        let mut recording = Recording {
            sensor: self.sensor.sensor.clone(),
            setup: self.sensor.setup.clone(),
            robot: Vec::new(),
            features: Vec::new(),
            stripes: Vec::new(),
            initial: None,
            truth: None,
            inputs: Default::default(),
        };
        let (mut due, mut last) = (Instant::now() + EVERY, false);
        while !last {
            last = over.load(Ordering::SeqCst);
            if !last && Instant::now() < due {
                thread::sleep(Duration::from_millis(50));
                continue;
            }
            self.take_into(&mut recording);
            let start = Instant::now();
            let progress = self.estimate(&recording);
            *self.progress.lock().unwrap_or_else(PoisonError::into_inner) = progress;
            due = Instant::now() + EVERY.max(2 * start.elapsed());
        }
    }

    fn take_into(&self, recording: &mut Recording) {
        let (mut robot, mut features) = {
            let mut came = self.came.lock().unwrap_or_else(PoisonError::into_inner);
            (take(&mut came.0), take(&mut came.1))
        };
        recording.robot.append(&mut robot);
        recording.features.append(&mut features);
        // Overtaken frames come late.
        recording.robot.sort_by_key(|sample| sample.stamp_ns);
        recording.features.sort_by_key(|feature| feature.stamp_ns);
        forget_old(recording);
    }

    fn estimate(&self, recording: &Recording) -> Progress {
        let seam_points = recording.features.len();
        if seam_points < FEWEST_FEATURES {
            return Progress::Waiting { seam_points, needed: FEWEST_FEATURES };
        }
        match trueline_method::calibrate(recording, None, &Config::default()) {
            Ok(calibration) => Progress::Estimated(self.estimated(&calibration, seam_points)),
            Err(why) => Progress::Refused { seam_points, why: Arc::new(why) },
        }
    }

    fn estimated(&self, calibration: &Calibration, seam_points: usize) -> Estimated {
        let offset_s = calibration.best_fit().time_offset_s;
        let is_enough =
            self.want.map(|want| calibration.status() == Status::Accepted && is_reached(calibration, &want));
        Estimated {
            seam_points,
            time_offset_s: calibration.noise_sigma(TIME_OFFSET).map(|sigma_s| [offset_s, sigma_s]),
            translation_sigma_m: worst(calibration, TRANSLATION),
            rotation_sigma_rad: worst(calibration, ROTATION),
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

/// What is older than ten minutes is left to the calibration afterwards.
fn forget_old(recording: &mut Recording) {
    let Some(last_ns) = recording.robot.last().map(|sample| sample.stamp_ns) else { return };
    let oldest_ns = last_ns - LONGEST_NS;
    let robot = recording.robot.partition_point(|sample| sample.stamp_ns < oldest_ns);
    let features = recording.features.partition_point(|feature| feature.stamp_ns < oldest_ns);
    recording.robot.drain(..robot);
    recording.features.drain(..features);
}

/// The largest sigma of three components, if all are observable.
fn worst(calibration: &Calibration, first: usize) -> Option<f64> {
    (first..first + 3)
        .map(|k| calibration.noise_sigma(k))
        .try_fold(0.0, |worst: f64, sigma| Some(worst.max(sigma?)))
}

fn is_reached(calibration: &Calibration, want: &Requirement) -> bool {
    let within = |limit: Option<f64>, sigma: Option<f64>| {
        limit.is_none_or(|limit| sigma.is_some_and(|sigma| sigma <= limit))
    };
    within(want.time_s, calibration.noise_sigma(TIME_OFFSET))
        && within(want.translation_m, worst(calibration, TRANSLATION))
        && within(want.rotation_rad, worst(calibration, ROTATION))
}
