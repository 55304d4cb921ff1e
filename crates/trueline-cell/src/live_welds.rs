//! Welds as they end, from a running recording: from the first seam point to a pause.

use std::sync::{Mutex, PoisonError};
use std::time::Duration;
use trueline_dataset::{Feature, Recording, RobotSample, SensorFile};

/// Poses that are kept before the first seam point of a weld and after its last, ns: stamps are off by less.
const MARGIN_NS: i64 = 1_000_000_000;
/// Fewer seam points are a glance at something, no weld.
const FEWEST_FEATURES: usize = 20;

/// Poses and seam points that have come and belong to no weld that has ended.
pub struct LiveWelds {
    sensor: SensorFile,
    pause_ns: i64,
    came: Mutex<Came>,
}

#[derive(Default)]
struct Came {
    robot: Vec<RobotSample>,
    features: Vec<Feature>,
}

impl LiveWelds {
    /// A weld has ended when no seam point has come for a pause: longer than between the seams of a part, shorter than between
    /// parts.
    #[must_use]
    pub fn new(sensor: impl Into<SensorFile>, pause: Duration) -> Self {
        let pause_ns = i64::try_from(pause.as_nanos()).unwrap_or(i64::MAX);
        Self { sensor: sensor.into(), pause_ns, came: Mutex::default() }
    }

    /// Hands over poses, unless some are just being taken: then they stay for the next time.
    pub fn offer_poses(&self, poses: &mut Vec<RobotSample>) {
        if let Ok(mut came) = self.came.try_lock() {
            came.robot.append(poses);
        }
    }

    /// Hands over a feature.
    pub fn add_feature(&self, feature: Feature) {
        self.came.lock().unwrap_or_else(PoisonError::into_inner).features.push(feature);
    }

    /// The welds that have ended since the last call, in order of time; `is_over`: nothing more will come.
    #[must_use]
    pub fn take_ended(&self, is_over: bool) -> Vec<Recording> {
        let mut came = self.came.lock().unwrap_or_else(PoisonError::into_inner);
        // Overtaken frames come late.
        came.robot.sort_by_key(|sample| sample.stamp_ns);
        came.features.sort_by_key(|feature| feature.stamp_ns);
        let mut ended = Vec::new();
        while let Some(count) = came.ended(self.pause_ns, is_over) {
            let features: Vec<Feature> = came.features.drain(..count).collect();
            let (Some(first), Some(last)) = (features.first(), features.last()) else { break };
            let (from_ns, to_ns) = (first.stamp_ns - MARGIN_NS, last.stamp_ns + MARGIN_NS);
            let begin = came.robot.partition_point(|sample| sample.stamp_ns < from_ns);
            let end = came.robot.partition_point(|sample| sample.stamp_ns <= to_ns);
            let robot = came.robot[begin..end].to_vec();
            if count >= FEWEST_FEATURES {
                ended.push(self.recording(robot, features));
            }
        }
        came.forget();
        ended
    }

    fn recording(&self, robot: Vec<RobotSample>, features: Vec<Feature>) -> Recording {
        let SensorFile { sensor, setup } = self.sensor.clone();
        Recording::new(sensor, setup, robot, features)
    }
}

impl Came {
    /// How many of the first features are a weld that has ended.
    fn ended(&self, pause_ns: i64, is_over: bool) -> Option<usize> {
        let last = self.features.last()?;
        let gap = self.features.windows(2).position(|pair| pair[1].stamp_ns - pair[0].stamp_ns > pause_ns);
        let now_ns = self.robot.last().map_or(last.stamp_ns, |sample| sample.stamp_ns);
        let all = (is_over || now_ns - last.stamp_ns > pause_ns).then_some(self.features.len());
        gap.map(|k| k + 1).or(all)
    }

    /// Poses before all that a weld to come can need.
    fn forget(&mut self) {
        let now_ns = self.robot.last().map_or(i64::MIN, |sample| sample.stamp_ns);
        let first_ns = self.features.first().map_or(now_ns, |feature| feature.stamp_ns);
        let old = self.robot.partition_point(|sample| sample.stamp_ns < first_ns.saturating_sub(MARGIN_NS));
        self.robot.drain(..old);
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;
    use trueline_dataset::{Measured, Sensor};
    use trueline_geometry::Pose;

    const SECOND_NS: i64 = 1_000_000_000;

    fn pose(at_ns: i64) -> RobotSample {
        RobotSample { stamp_ns: at_ns, device_ns: None, base_from_tool: Pose::identity() }
    }

    fn feature(at_ns: i64) -> Feature {
        let measured = Measured::Profile([0.0, 0.1]);
        Feature {
            stamp_ns: at_ns,
            line: 0,
            frame: None,
            device_ns: None,
            measured,
            sigma: None,
            correlation: 0.0,
        }
    }

    #[test]
    fn a_weld_ends_with_a_pause_and_not_before() {
        let welds = LiveWelds::new(Sensor::Profiler, Duration::from_secs(5));
        let mut taken = Vec::new();
        // Two seams with 3 s between them, then 8 s of nothing, then a glance, then a third seam that is under way.
        let is_seen = |s: i64| (10..20).contains(&s) || (23..30).contains(&s) || (60..80).contains(&s);
        for tenth in 0..800_i64 {
            let (at_ns, s) = (tenth * SECOND_NS / 10, tenth / 10);
            welds.offer_poses(&mut vec![pose(at_ns)]);
            if is_seen(s) || tenth == 450 {
                welds.add_feature(feature(at_ns));
            }
            for weld in welds.take_ended(false) {
                taken.push((s, weld));
            }
        }
        let [(told_s, first)] = &taken[..] else { unreachable!("one has ended, not {}", taken.len()) };
        // Its last seam point came at 29.9 s.
        assert_eq!((*told_s, first.features.len()), (35, 170));
        let ends = [first.robot.first().unwrap(), first.robot.last().unwrap()]
            .map(|p| p.stamp_ns / (SECOND_NS / 10));
        assert_eq!(ends, [90, 309]);
        let rest = welds.take_ended(true);
        assert_eq!(rest.iter().map(|weld| weld.features.len()).collect::<Vec<_>>(), [200]);
        assert!(welds.take_ended(true).is_empty());
    }

    #[test]
    fn what_no_weld_will_need_is_forgotten() {
        let welds = LiveWelds::new(Sensor::Profiler, Duration::from_secs(5));
        for second in 0..1000 {
            welds.offer_poses(&mut vec![pose(second * SECOND_NS)]);
            assert!(welds.take_ended(false).is_empty());
        }
        assert!(welds.came.lock().unwrap().robot.len() <= 2);
    }
}
