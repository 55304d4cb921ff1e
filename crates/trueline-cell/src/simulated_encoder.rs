//! An encoder on a simulated robot's path: a signal at fixed steps of the tool's travel, mm.

use std::collections::VecDeque;
use trueline_camera::device::Edge;
use trueline_geometry::Pose;
use trueline_live::HostClock;

/// Between looks at where the robot is, ns.
const STEP_NS: i64 = 1_000_000;
/// After this silence a robot starts anew, ns: it may be another one.
const FORGET_NS: i64 = 500_000_000;
/// How far back the way is begun, ns: where the robot is comes a moment later.
const BACK_NS: i64 = 50_000_000;
/// Changes that are remembered.
const MOST: usize = 8192;

/// The encoder.
pub(crate) struct SimulatedEncoder {
    step_m: f64,
    clock: HostClock,
    /// Time of the last check of the travel, ns, and the tool's pose then.
    last: Option<(i64, Pose)>,
    travelled_m: f64,
    /// With the count from each on.
    edges: VecDeque<(Edge, i64)>,
    /// Half steps so far.
    halves: i64,
}

impl SimulatedEncoder {
    /// A signal every `step_m` metres: on for the first half of each.
    pub(crate) fn new(step_m: f64, clock: HostClock) -> Self {
        Self { step_m, clock, last: None, travelled_m: 0.0, edges: VecDeque::new(), halves: 0 }
    }

    /// Follows the robot as far as its poses are known; `pose_at` returns its pose at a steady time, ns.
    pub(crate) fn follow(&mut self, pose_at: impl Fn(i64) -> Option<Pose>) {
        self.follow_until(self.clock.read().steady_ns, pose_at);
    }

    fn follow_until(&mut self, now_ns: i64, pose_at: impl Fn(i64) -> Option<Pose>) {
        let place = |at_ns: i64| pose_at(at_ns).map(|pose| (at_ns, pose));
        if self.last.is_none_or(|(at_ns, _)| now_ns - at_ns > FORGET_NS) {
            self.last = place(now_ns - BACK_NS);
        }
        while let Some((from_ns, from)) = self.last
            && from_ns + STEP_NS <= now_ns
            && let Some((to_ns, to)) = place(from_ns + STEP_NS)
        {
            self.travel(from_ns, (to.translation.vector - from.translation.vector).norm());
            self.last = Some((to_ns, to));
        }
    }

    /// A way in a millisecond, m.
    fn travel(&mut self, from_ns: i64, way_m: f64) {
        let half_m = 0.5 * self.step_m;
        loop {
            let next_m = (self.halves + 1) as f64 * half_m;
            if next_m > self.travelled_m + way_m {
                break;
            }
            self.halves += 1;
            let share = (next_m - self.travelled_m) / way_m;
            let at_ns = from_ns + (share * STEP_NS as f64).round() as i64;
            if self.edges.len() == MOST {
                self.edges.pop_front();
            }
            // Whole steps go on, half ones off.
            let rises = self.halves % 2 == 0;
            self.edges.push_back((Edge { at_ns, rises }, self.halves / 2));
        }
        self.travelled_m += way_m;
    }

    /// The first change after a steady time, ns.
    pub(crate) fn edge_after(&self, steady_ns: i64) -> Option<Edge> {
        let at = self.edges.partition_point(|(edge, _)| edge.at_ns <= steady_ns);
        self.edges.get(at).map(|(edge, _)| *edge)
    }

    /// Steps until a steady time, ns, and whether the signal is on then.
    pub(crate) fn state(&self, steady_ns: i64) -> (i64, bool) {
        let after = self.edges.partition_point(|(edge, _)| edge.at_ns <= steady_ns);
        let before = after.checked_sub(1).and_then(|at| self.edges.get(at));
        before.map_or((0, false), |(edge, count)| (*count, edge.rises))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn signals_come_by_the_way_and_not_by_the_time() {
        let mut encoder = SimulatedEncoder::new(0.01, HostClock::start());
        // 100 mm/s for a second, then at rest, then 50 mm/s back: known until 2.5 s.
        let way_m = |s: f64| {
            if s < 1.0 {
                0.1 * s
            } else if s < 1.5 {
                0.1
            } else {
                0.1 - 0.05 * (s - 1.5)
            }
        };
        let pose_at = |ns: i64| {
            (0..=2_500_000_000).contains(&ns).then(|| Pose::translation(way_m(ns as f64 * 1e-9), 0.0, 0.0))
        };
        for now_ns in (BACK_NS..3_000_000_000).step_by(7_000_000) {
            encoder.follow_until(now_ns, pose_at);
        }
        let mut rising = Vec::new();
        let mut at_ns = 0;
        while let Some(edge) = encoder.edge_after(at_ns) {
            at_ns = edge.at_ns;
            rising.extend(edge.rises.then_some(at_ns as f64 * 1e-9));
        }
        // Every 0.1 s, the last at the end of the first way to a hair; then every 0.2 s, from 1.5 s on.
        assert_eq!(rising.len(), 15, "{rising:?}");
        for (number, at_s) in rising.iter().enumerate() {
            let k = number as f64 + 1.0;
            let expected_s = if number < 10 { 0.1 * k } else { 1.5 + 0.2 * (k - 10.0) };
            // A millisecond of sampling, if the last step is reached by rounding.
            assert!(
                (at_s - expected_s).abs() < 1.1e-3 || (number == 9 && *at_s < 1.502),
                "{number}: {at_s} s"
            );
        }
        assert_eq!(encoder.state(330_000_000), (3, true));
        assert_eq!(encoder.state(370_000_000), (3, false));
        assert_eq!(encoder.state(-1), (0, false));
    }
}
