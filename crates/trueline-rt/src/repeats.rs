//! Poses that are reported more often than they change, on line.
//!
//! If a controller updates its pose every 12 ms, a stream of 4 ms repeats each three times. Without a correction the robot
//! would stand and jump.

/// A pose that stays the same for longer than this is a robot at rest, s.
const REST_S: f64 = 0.15;
/// Part of the samples in motion that must be repetitions before any is left out: a robot that turns around stands still for a sample
/// or two as well.
const LEAST_REPEATED: f64 = 0.1;
/// Runs of one pose over which the share is averaged.
const RUNS: f64 = 32.0;

/// Repetition of poses.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Repeats {
    /// Time from one sample to the next, s, of the repetitions.
    pub poll_s: f64,
    since_s: f64,
    last_s: f64,
    repeated: u32,
    share: f64,
}

impl Repeats {
    /// Whether the stream repeats its poses.
    pub(crate) fn is_repeating(&self) -> bool {
        self.share >= LEAST_REPEATED
    }

    /// Moves the origin of times later by this, s.
    pub(crate) fn rebase(&mut self, by_s: f64) {
        self.since_s -= by_s;
        self.last_s -= by_s;
    }

    /// Adds a sample, and whether its pose repeats the one before; returns whether it adds nothing new.
    pub(crate) fn note(&mut self, time_s: f64, is_same: bool) -> bool {
        let step_s = time_s - self.last_s;
        self.last_s = time_s;
        if is_same {
            self.repeated += 1;
            self.poll_s = step_s;
            return self.is_repeating() && time_s - self.since_s <= REST_S;
        }
        // A longer run was a robot at rest.
        if time_s - self.since_s <= REST_S {
            let share = f64::from(self.repeated) / f64::from(self.repeated + 1);
            self.share += (share - self.share) / RUNS;
        }
        self.repeated = 0;
        self.since_s = time_s;
        false
    }
}
