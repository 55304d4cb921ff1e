//! How often the robot speaks, and how much of the path's time a frame may use up.
//!
//! The controller's clock says best how much time lies between two frames, but it is not to be trusted with more than it can
//! have: over any stretch, no more time is used up than has passed here, plus a period and what came late.

use super::step_budget::MADE_UP_S;
use crate::robot_frame::RobotFrame;

/// Frames that show the period.
const FRAMES: u32 = 25;
/// Delays on the way may be made up for later, up to so many periods, and [`MADE_UP_S`].
const MADE_UP_PERIODS: f64 = 3.0;

/// A frame and when it came.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReceivedFrame {
    /// What it says.
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
    /// Time used up beyond what passed here, s.
    ahead_s: f64,
}

impl CycleClock {
    /// Time between the robot's messages, s, once it is known: by this PC's clock and the robot's numbers.
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
