//! How often the robot speaks, and how much of the path's time a frame may use up.
//!
//! The controller's clock gives the best time between two frames, but it is trusted with limits. Over any stretch the time
//! used is at most the time passed here, plus a period and the delay.

use super::step_budget::MADE_UP_S;
use crate::robot_frame::RobotFrame;

/// Frames that show the period.
const FRAMES: u32 = 25;
/// Delays on the way may be made up later, up to this many periods, and [`MADE_UP_S`].
const MADE_UP_PERIODS: f64 = 3.0;

/// A frame and when it came.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReceivedFrame {
    /// Its content.
    pub frame: RobotFrame,
    /// When it came, on the steady clock, ns.
    pub arrival_ns: i64,
    /// It is the first of a session: the controller began, or began anew.
    pub is_first: bool,
}

/// The robot's cycle clock.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct CycleClock {
    first: Option<(u32, i64)>,
    frames: u32,
    period_s: Option<f64>,
    /// Time used up beyond the time passed here, s.
    ahead_s: f64,
}

impl CycleClock {
    /// Time between the robot's messages, s, once known: by this PC's clock and the robot's numbers.
    #[must_use]
    pub(super) fn period_s(&self) -> Option<f64> {
        self.period_s
    }

    /// Learns from a frame until the period is known.
    pub(super) fn learn(&mut self, received: &ReceivedFrame) {
        if self.period_s.is_some() {
            return;
        }
        let (first_sequence, first_ns) =
            *self.first.get_or_insert((received.frame.sequence, received.arrival_ns));
        self.frames += 1;
        let numbers = received.frame.sequence.wrapping_sub(first_sequence);
        if self.frames > FRAMES && numbers > 0 {
            let passed_s = (received.arrival_ns - first_ns) as f64 * 1e-9;
            self.period_s = Some(passed_s / f64::from(numbers)).filter(|period_s| *period_s > 0.0);
        }
    }

    /// Time that the motion may go on by from one frame to the next, s.
    pub(crate) fn elapsed_s(&mut self, before: &ReceivedFrame, now: &ReceivedFrame, period_s: f64) -> f64 {
        let arrivals_s = ((now.arrival_ns - before.arrival_ns) as f64 * 1e-9).max(0.0);
        let controller_s = now.frame.device_ns.saturating_sub(before.frame.device_ns) as f64 * 1e-9;
        let made_up_s = (MADE_UP_PERIODS * period_s).min(MADE_UP_S);
        let plausible = controller_s > 0.0 && (controller_s - arrivals_s).abs() < made_up_s;
        let told_s = if plausible { controller_s } else { arrivals_s };
        let ahead_s = self.ahead_s - arrivals_s;
        let elapsed_s = told_s.min(period_s - ahead_s).max(0.0);
        self.ahead_s = (ahead_s + elapsed_s).max(-made_up_s);
        elapsed_s
    }

    /// Nothing is owed any more.
    pub(super) fn settle(&mut self) {
        self.ahead_s = 0.0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::egm::{Generation, MciState, MotorState, RapidState};
    use trueline_geometry::Pose;

    const MS: i64 = 1_000_000;

    fn received(sequence: u32, arrival_ns: i64, device_ns: i64) -> ReceivedFrame {
        let frame = RobotFrame {
            sequence,
            base_from_tool: Pose::identity(),
            device_ns,
            ptp_ns: None,
            motors: MotorState::On,
            mci: MciState::Running,
            rapid: RapidState::Running,
            utilization_percent: None,
            converged: false,
            collided: false,
            generation: Generation::From7,
            attitudes_differ: false,
            digital: None,
        };
        ReceivedFrame { frame, arrival_ns, is_first: false }
    }

    /// Time used by a received frame with its stated age after the one before, ms.
    fn elapsed_ms(clock: &mut CycleClock, arrival_ms: f64, device_ms: f64) -> f64 {
        elapsed_of(clock, arrival_ms, device_ms, 0.004)
    }

    fn elapsed_of(clock: &mut CycleClock, arrival_ms: f64, device_ms: f64, period_s: f64) -> f64 {
        let ns = |ms: f64| (ms * 1e6) as i64;
        let before = received(0, 7 * MS, 9 * MS);
        clock.elapsed_s(&before, &received(1, 7 * MS + ns(arrival_ms), 9 * MS + ns(device_ms)), period_s)
            * 1e3
    }

    #[test]
    fn the_period_is_the_time_by_this_clock_over_the_robots_numbers() {
        let mut clock = CycleClock::default();
        // Every other frame is lost: numbers rise by two in 8 ms.
        for k in 0..25 {
            clock.learn(&received(100 + 2 * k, i64::from(k) * 8 * MS, 0));
        }
        assert_eq!(clock.period_s(), None, "25 frames are 24 periods");
        clock.learn(&received(150, 25 * 8 * MS, 0));
        assert!((clock.period_s().unwrap_or(0.0) - 0.004).abs() < 1e-12, "{:?}", clock.period_s());
        clock.learn(&received(151, 900 * MS, 0));
        assert!((clock.period_s().unwrap_or(0.0) - 0.004).abs() < 1e-12, "learnt once");
        // Constant numbers and constant times give none.
        for (step, apart_ns) in [(0, MS), (1, 0)] {
            let mut clock = CycleClock::default();
            for k in 0..60 {
                clock.learn(&received(k * step, i64::from(k) * apart_ns, 0));
            }
            assert_eq!(clock.period_s(), None);
        }
    }

    #[test]
    fn the_controllers_clock_says_how_much_time_lies_between_frames_where_it_can_be_so() {
        let near =
            |found: f64, wanted: f64| assert!((found - wanted).abs() < 1e-9, "{found}, not {wanted} ms");
        // Jitter of the network.
        near(elapsed_ms(&mut CycleClock::default(), 5.0, 4.0), 4.0);
        near(elapsed_ms(&mut CycleClock::default(), 3.0, 4.0), 4.0);
        // A clock that stands, goes back, or leaps by 12 ms or more is not asked.
        for device_ms in [0.0, -4.0, 17.1, 500.0] {
            near(elapsed_ms(&mut CycleClock::default(), 5.0, device_ms), 5.0);
        }
        // A clock 11.9 ms ahead is accepted, but it gets no more than the time passed and a period.
        near(elapsed_ms(&mut CycleClock::default(), 5.0, 16.9), 9.0);
        // Three periods of 2 ms are 6; of 20 ms they are 60, and 12 the most.
        near(elapsed_of(&mut CycleClock::default(), 5.0, 11.1, 0.002), 5.0);
        near(elapsed_of(&mut CycleClock::default(), 5.0, 10.9, 0.002), 7.0);
        near(elapsed_of(&mut CycleClock::default(), 25.0, 37.1, 0.02), 25.0);
        near(elapsed_of(&mut CycleClock::default(), 25.0, 36.9, 0.02), 36.9);
        // Frames that come in the wrong order take no time.
        near(elapsed_ms(&mut CycleClock::default(), -3.0, -4.0), 0.0);
    }

    #[test]
    fn over_any_stretch_no_more_is_used_up_than_passed_and_a_period() {
        let mut clock = CycleClock::default();
        // It reports 6 ms every 4.
        let used: f64 = (0..50).map(|_| elapsed_ms(&mut clock, 4.0, 6.0)).sum();
        assert!((used - 204.0).abs() < 1e-9, "{used} ms of 200");
        // A delay is made up, up to 12 ms and no more: 100 ms at half the rate, then twice the rate.
        let mut clock = CycleClock::default();
        let slow: f64 = (0..25).map(|_| elapsed_ms(&mut clock, 4.0, 2.0)).sum();
        assert!((slow - 50.0).abs() < 1e-9);
        let fast: f64 = (0..50).map(|_| elapsed_ms(&mut clock, 4.0, 8.0)).sum();
        assert!((fast - (200.0 + 12.0 + 4.0)).abs() < 1e-9, "{fast} ms of 200");
        let mut settled = CycleClock::default();
        for _ in 0..25 {
            elapsed_ms(&mut settled, 4.0, 2.0);
        }
        settled.settle();
        let fast: f64 = (0..50).map(|_| elapsed_ms(&mut settled, 4.0, 8.0)).sum();
        assert!((fast - 204.0).abs() < 1e-9, "{fast} ms: nothing is owed any more");
    }
}
