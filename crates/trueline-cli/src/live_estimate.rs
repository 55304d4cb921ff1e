//! What a scan that is under way says so far.
//!
//! Every now and then everything that came is calibrated as it would be afterwards, by the same recipe: what is shown has
//! the same right to be believed, and says the same of what cannot be seen yet.

use std::fmt::Write;
use std::mem::take;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};
use trueline_dataset::{Feature, Recording, RobotSample, Sensor};
use trueline_method::problem::parameters::{ROTATION, TIME_OFFSET, TRANSLATION};
use trueline_method::{Calibration, Config, Requirement, Status};

/// Between estimates; never less than twice as long as one takes.
const EVERY: Duration = Duration::from_secs(2);
/// What is looked at, ns.
const LONGEST_NS: i64 = 600_000_000_000;
/// With fewer there is nothing to tell.
const FEWEST_FEATURES: usize = 30;

/// Poses and features that have come, and what they say.
pub struct LiveEstimate {
    sensor: Sensor,
    want: Option<Requirement>,
    came: Mutex<(Vec<RobotSample>, Vec<Feature>)>,
    said: Mutex<Said>,
}

/// What they say.
#[derive(Clone, Default)]
pub struct Said {
    /// In one line.
    pub line: String,
    /// What is not yet visible, and the motion that would show it.
    pub missing: Vec<String>,
}

impl LiveEstimate {
    /// Nothing has come yet.
    pub fn new(sensor: Sensor, want: Option<Requirement>) -> Self {
        Self { sensor, want, came: Mutex::default(), said: Mutex::default() }
    }

    /// Hands over poses, unless somebody is just taking some away: then they stay for the next time.
    pub fn offer_poses(&self, poses: &mut Vec<RobotSample>) {
        if let Ok(mut came) = self.came.try_lock() {
            came.0.append(poses);
        }
    }

    /// A feature came.
    pub fn add_feature(&self, feature: Feature) {
        self.came.lock().unwrap_or_else(PoisonError::into_inner).1.push(feature);
    }

    /// What all says so far.
    pub fn said(&self) -> Said {
        self.said.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Estimates until all is over, and once more then.
    pub fn run(&self, over: &AtomicBool) {
        let mut recording = Recording {
            sensor: self.sensor.clone(),
            setup: Default::default(),
            robot: Vec::new(),
            features: Vec::new(),
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
            let (mut robot, mut features) = {
                let mut came = self.came.lock().unwrap_or_else(PoisonError::into_inner);
                (take(&mut came.0), take(&mut came.1))
            };
            recording.robot.append(&mut robot);
            recording.features.append(&mut features);
            // Overtaken frames come late.
            recording.robot.sort_by_key(|sample| sample.stamp_ns);
            recording.features.sort_by_key(|feature| feature.stamp_ns);
            forget_old(&mut recording);
            let start = Instant::now();
            let said = self.say(&recording);
            *self.said.lock().unwrap_or_else(PoisonError::into_inner) = said;
            due = Instant::now() + EVERY.max(2 * start.elapsed());
        }
    }

    fn say(&self, recording: &Recording) -> Said {
        let count = recording.features.len();
        if count < FEWEST_FEATURES {
            let line = format!("{count} seam points; {FEWEST_FEATURES} are needed to begin with");
            return Said { line, ..Said::default() };
        }
        match trueline_method::calibrate(recording, None, &Config::default()) {
            Ok(calibration) => self.said_by(&calibration, count),
            Err(error) => Said { line: format!("{count} seam points; {error}"), ..Said::default() },
        }
    }

    fn said_by(&self, calibration: &Calibration, count: usize) -> Said {
        let missing: Vec<String> =
            calibration.observability.unseen.iter().map(|unseen| unseen.advice.clone()).collect();
        let mut line = match calibration.sigma(TIME_OFFSET) {
            Some(sigma_s) => format!(
                "time offset {:+.2} ± {:.2} ms",
                calibration.parameters.time_offset_s * 1e3,
                sigma_s * 1e3
            ),
            None => "time offset not visible".to_owned(),
        };
        let _ = match (worst(calibration, TRANSLATION), worst(calibration, ROTATION)) {
            (Some(m), Some(rad)) => {
                write!(line, ", hand-eye ± {:.2} mm ± {:.3}°", m * 1e3, rad.to_degrees())
            }
            _ => write!(line, ", hand-eye not wholly visible"),
        };
        let _ = write!(line, ", {count} seam points");
        if let Some(want) = &self.want {
            let enough = calibration.status == Status::Accepted && reached(calibration, want);
            line.push_str(if enough { ": ENOUGH" } else { ": not yet what is wanted" });
        }
        Said { line, missing }
    }
}

/// What is older than ten minutes is left to the calibration afterwards: the estimate must not grow with the night.
fn forget_old(recording: &mut Recording) {
    let Some(last_ns) = recording.robot.last().map(|sample| sample.stamp_ns) else { return };
    let oldest_ns = last_ns - LONGEST_NS;
    let robot = recording.robot.partition_point(|sample| sample.stamp_ns < oldest_ns);
    let features = recording.features.partition_point(|feature| feature.stamp_ns < oldest_ns);
    recording.robot.drain(..robot);
    recording.features.drain(..features);
}

/// The largest sigma of three components, if all are seen.
fn worst(calibration: &Calibration, first: usize) -> Option<f64> {
    (first..first + 3)
        .map(|k| calibration.sigma(k))
        .try_fold(0.0, |worst: f64, sigma| Some(worst.max(sigma?)))
}

fn reached(calibration: &Calibration, want: &Requirement) -> bool {
    let within = |limit: Option<f64>, sigma: Option<f64>| {
        limit.is_none_or(|limit| sigma.is_some_and(|sigma| sigma <= limit))
    };
    within(want.time_s, calibration.sigma(TIME_OFFSET))
        && within(want.translation_m, worst(calibration, TRANSLATION))
        && within(want.rotation_rad, worst(calibration, ROTATION))
}
