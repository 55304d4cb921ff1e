//! The clocks of both streams, followed as long as the streams last.

use super::even_clock::{EvenClock, Moved, Stamp};
use crate::config::Config;
use crate::error::Error;
use crate::input::observations::{Observations, origin_ns};
use crate::input::robot_motion::RobotMotion;
use crate::input::timestamps::{Dejittered, Sampling, Stream};
use trueline_dataset::Recording;

/// The streams that use clock times, and the lines of those clocks.
#[derive(Clone, Debug)]
pub(super) struct Clocks {
    dejittered: Dejittered,
    robot: Option<EvenClock>,
    images: Option<EvenClock>,
    /// The origin of their times, ns.
    about_ns: i64,
    /// Whether both have had one phase since the calibration began.
    pub(super) are_whole: bool,
}

impl Clocks {
    /// From a calibration of these samples.
    pub(super) fn of(recording: &Recording, dejittered: Dejittered, about_ns: i64) -> Self {
        let sampling = Sampling::of(recording, origin_ns(recording));
        let since_s = (origin_ns(recording) - about_ns) as f64 * 1e-9;
        let line = |stream: &Stream, stamps: &[Stamp], is_even: bool| {
            let clock = stream.clock.as_ref().filter(|_| is_even)?;
            let regular_s: Vec<f64> = clock.regular_s.iter().map(|s| s + since_s).collect();
            EvenClock::of(clock, stamps, &regular_s)
        };
        let (poses, pictures) = (poses(recording, about_ns), pictures(recording, about_ns));
        let robot = line(&sampling.robot, &poses, dejittered.robot);
        let images = line(&sampling.images, &pictures, dejittered.images);
        let holds = |clock: &Option<EvenClock>, stamps: &[Stamp]| {
            clock.as_ref().is_none_or(|clock| clock.holds_since(&stamps[0]))
        };
        let are_whole = holds(&robot, &poses) && holds(&images, &pictures);
        Self { dejittered, robot, images, about_ns, are_whole }
    }

    /// Updates the lines with new stamps. Returns the resulting shift of exposures on the robot's path, as one line relative to the other.
    pub(super) fn follow(&mut self, recording: &Recording) -> Moved {
        let follow = |clock: &mut Option<EvenClock>, stamps: &[Stamp]| {
            if clock.as_ref().is_some_and(|clock| !clock.can_place(stamps)) {
                *clock = None;
            }
            clock.as_mut().map(|clock| clock.follow(stamps)).unwrap_or_default()
        };
        let robot = follow(&mut self.robot, &poses(recording, self.about_ns));
        let images = follow(&mut self.images, &pictures(recording, self.about_ns));
        Moved {
            shift_s: images.shift_s - robot.shift_s,
            rate: images.rate - robot.rate,
            is_new: robot.is_new || images.is_new,
        }
    }

    /// Variance of the rate between both clocks from the noise of their stamps.
    pub(super) fn rate_variance(&self) -> f64 {
        [&self.robot, &self.images].into_iter().flatten().map(EvenClock::rate_variance).sum()
    }

    /// Observations with the times of these clocks instead of the recorded ones. Exposures without a time are left out.
    pub(super) fn placed(
        &self,
        recording: &Recording,
        sampling: &Sampling,
        config: &Config,
        recorded: &Observations,
    ) -> Result<Observations, Error> {
        let of_these_samples = Dejittered {
            robot: self.dejittered.robot && self.robot.is_none(),
            images: self.dejittered.images && self.images.is_none(),
        };
        let treatments = [Dejittered::default(), of_these_samples];
        let mut placed = recorded.clone().restamped(recording, sampling, config, treatments)?;
        let since_s = (self.about_ns - origin_ns(recording)) as f64 * 1e-9;
        if let Some(clock) = &self.images {
            let times_s = clock.times_s(&pictures(recording, self.about_ns));
            placed.list.retain_mut(|o| {
                let time_s = times_s.get(o.frame as usize).copied().flatten();
                o.stamp_s = time_s.map_or(o.stamp_s, |time_s| time_s + since_s);
                time_s.is_some()
            });
        }
        if let Some(clock) = &self.robot {
            let times_s: Vec<f64> = (clock.times_s(&poses(recording, self.about_ns)).into_iter())
                .zip(&sampling.robot.recorded_s)
                .map(|(time_s, recorded_s)| time_s.map_or(*recorded_s, |time_s| time_s + since_s))
                .collect();
            // Two successive phases without a pause between them may overlap.
            if times_s.windows(2).all(|pair| pair[0] < pair[1]) {
                placed.robot = RobotMotion::of(recording, &times_s, config)?;
            }
        }
        Ok(placed)
    }
}

fn poses(recording: &Recording, about_ns: i64) -> Vec<Stamp> {
    stamps(recording.robot.iter().map(|sample| (sample.stamp_ns, sample.device_ns)), about_ns)
}

fn pictures(recording: &Recording, about_ns: i64) -> Vec<Stamp> {
    stamps(recording.features.iter().map(|feature| (feature.stamp_ns, feature.device_ns)), about_ns)
}

/// Distinct rising stamps.
fn stamps(of: impl Iterator<Item = (i64, Option<i64>)>, about_ns: i64) -> Vec<Stamp> {
    let mut last_ns = None;
    let first_of_each = of.filter(|(stamp_ns, _)| last_ns.replace(*stamp_ns) != Some(*stamp_ns));
    let stamp = |(stamp_ns, device_ns): (i64, Option<i64>)| Stamp {
        received_s: (stamp_ns - about_ns) as f64 * 1e-9,
        device_s: device_ns.map(|ns| ns as f64 * 1e-9),
    };
    first_of_each.map(stamp).collect()
}
