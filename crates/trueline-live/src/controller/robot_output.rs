//! A digital output of a simulated robot that starts pictures: by the way that the tool travels, or by the time.

use super::trigger_feed::TriggerSender;
use trueline_geometry::Pose;

/// How long the output is on, ns.
const PULSE_NS: i64 = 5_000_000;

/// Time at which the output switches on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum OutputEvery {
    /// After this travel of the tool, m.
    Way(f64),
    /// After this time, s.
    Time(f64),
}

/// The output. It is set in the cycle in which way or time is reached, as a controller sets its outputs, and not between cycles.
#[derive(Debug)]
pub(super) struct RobotOutput {
    wire: TriggerSender,
    rhythm: Rhythm,
}

impl RobotOutput {
    /// Wired to a camera.
    pub(super) fn new(wire: TriggerSender, every: OutputEvery) -> Self {
        Self { wire, rhythm: Rhythm::new(every) }
    }

    /// A cycle: its time, ns, and where the tool is.
    pub(super) fn cycle(&mut self, steady_ns: i64, base_from_tool: &Pose) {
        if self.rhythm.is_due(steady_ns, base_from_tool) {
            self.wire.send([steady_ns, steady_ns + PULSE_NS]);
        }
    }
}

/// Counts way or time.
#[derive(Debug)]
struct Rhythm {
    every: OutputEvery,
    last: Option<(i64, Pose)>,
    /// Way, m, or time, s, so far.
    passed: f64,
    count: u64,
}

impl Rhythm {
    fn new(every: OutputEvery) -> Self {
        Self { every, last: None, passed: 0.0, count: 0 }
    }

    /// Whether a multiple was reached since the cycle before; several are one.
    fn is_due(&mut self, steady_ns: i64, base_from_tool: &Pose) -> bool {
        let Some((last_ns, last)) = self.last.replace((steady_ns, *base_from_tool)) else { return false };
        let step = match self.every {
            OutputEvery::Way(step_m) => {
                self.passed += (base_from_tool.translation.vector - last.translation.vector).norm();
                step_m
            }
            OutputEvery::Time(step_s) => {
                self.passed += (steady_ns - last_ns) as f64 * 1e-9;
                step_s
            }
        };
        let count = (self.passed / step) as u64;
        std::mem::replace(&mut self.count, count) != count
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CYCLE_NS: i64 = 4_000_000;

    /// The cycles at which the output switches on, of a robot that travels 100 mm/s for a second, rests for one and goes
    /// back.
    fn cycles(every: OutputEvery) -> Vec<i64> {
        let mut rhythm = Rhythm::new(every);
        let at_m = |s: f64| if s < 2.0 { 0.1 * s.min(1.0) } else { 0.1 - 0.1 * (s - 2.0) };
        (0..750)
            .filter(|k| {
                let pose = Pose::translation(at_m((k * CYCLE_NS) as f64 * 1e-9), 0.0, 0.0);
                rhythm.is_due(k * CYCLE_NS, &pose)
            })
            .collect()
    }

    #[test]
    fn the_output_goes_on_by_the_way_or_by_the_time_and_at_a_cycle() {
        // 3 mm are 7.5 cycles on the way, and none while it rests; 33 steps there, 33 back with the rest of the first way.
        let by_way = cycles(OutputEvery::Way(0.003));
        assert_eq!(by_way[..4], [8, 15, 23, 30]);
        assert!(by_way.iter().all(|k| !(251..500).contains(k)) && by_way.len() == 66, "{by_way:?}");
        assert_eq!(cycles(OutputEvery::Time(0.1))[..4], [25, 50, 75, 100]);
        // Shorter than a cycle: on at each.
        assert_eq!(cycles(OutputEvery::Time(0.001)).len(), 749);
    }
}
