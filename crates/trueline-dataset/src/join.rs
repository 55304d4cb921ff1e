//! Several recordings of one sensor as one: the same time offset and hand-eye transform, each with its own lines.

use crate::picture_rows::{self, PicturesDisagree};
use crate::recording::{Recording, Sensor};
use crate::shared_samples::shared_measurements;
use crate::stamp;
use std::collections::BTreeMap;

/// Silence between two recordings that were moved apart, ns: longer than any time offset that is searched.
const SILENCE_NS: i64 = 30_000_000_000;

/// Why recordings cannot be joined.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum JoinError {
    /// None at all.
    #[error("there is no recording")]
    Nothing,
    /// Sensors that are not the same.
    #[error(
        "recording {index} has another sensor than the first: {found}, not {expected}, or another \
            calibration"
    )]
    OtherSensor {
        /// Which, from 0.
        index: usize,
        /// Its kind.
        found: &'static str,
        /// The kind of the first.
        expected: &'static str,
    },
    /// Stamps that would leave the range of stamps where recordings follow each other.
    #[error(
        "with recording {index} the recordings last longer than 95 years: one stamp is far from all others"
    )]
    TooLong {
        /// Which, from 0.
        index: usize,
    },
    /// External axes that are not the same.
    #[error(
        "recording {index} has other external axes than the first: cell.toml must name the same, in the same order"
    )]
    OtherAxes {
        /// Which, from 0.
        index: usize,
    },
    /// A scan that is there already: counted twice, it would seem to have twice the information.
    #[error(
        "recording {index} is recording {before} again: {shared} of its {of} measurements are in both, with the same poses"
    )]
    Again {
        /// Which, from 0.
        index: usize,
        /// The one before it that has the same.
        before: usize,
        /// Measurements in both.
        shared: usize,
        /// Measurements of the one with fewer.
        of: usize,
    },
    /// Stripes and seam points that count their pictures differently.
    #[error("in recording {index} {pictures}")]
    PicturesDisagree {
        /// Which, from 0.
        index: usize,
        /// The disagreement.
        pictures: PicturesDisagree,
    },
}

/// A joined recording, and the shifts of its stamps.
#[derive(Clone, Debug)]
pub struct Joined {
    /// All of them.
    pub recording: Recording,
    /// Recordings, by index, with shifted stamps (both streams alike) because they overlapped another.
    pub shifted: Vec<usize>,
}

/// Joins recordings in the order of time. The lines of each are its own: the part may have been moved in between. If two
/// overlap in time, or clocks restarted, both streams of the later one are shifted by the same amount. This changes no time
/// offset. Stripes get the stamps of the seam points of their pictures, for counts of frames are not kept.
///
/// # Errors
/// Different sensors, a scan that is there twice, stripes and seam points that count differently, or nothing to join.
pub fn join(mut recordings: Vec<Recording>) -> Result<Joined, JoinError> {
    check_each_is_new(&recordings)?;
    for (index, recording) in recordings.iter_mut().enumerate() {
        picture_rows::stamp_alike(recording)
            .map_err(|pictures| JoinError::PicturesDisagree { index, pictures })?;
    }
    let mut rest = recordings.into_iter();
    let mut recording = rest.next().ok_or(JoinError::Nothing)?;
    let mut shifted = Vec::new();
    let mut inputs: BTreeMap<String, String> = std::mem::take(&mut recording.inputs)
        .into_iter()
        .map(|(name, hash)| (format!("0/{name}"), hash))
        .collect();
    recording.truth = None;
    for (index, mut next) in (1..).zip(rest) {
        check_sensor(index, &recording.sensor, &next)?;
        if !are_one_cell(&recording, &next) {
            return Err(JoinError::OtherAxes { index });
        }
        if next.setup != recording.setup {
            let kind = next.sensor.kind();
            return Err(JoinError::OtherSensor { index, found: kind, expected: kind });
        }
        let earliest_ns = last_ns(&recording) + SILENCE_NS;
        if first_ns(&next) <= earliest_ns {
            let by_ns = earliest_ns - first_ns(&next);
            if !stamp::is_in_range(last_ns(&next) + by_ns) {
                return Err(JoinError::TooLong { index });
            }
            shift(&mut next, by_ns);
            shifted.push(index);
        }
        recording.joined_from_ns.push(first_ns(&next));
        recording.joined_from_ns.append(&mut next.joined_from_ns);
        let of_stripes = recording.stripes.iter().map(|stripe| stripe.plate / 2 + 1);
        let lines =
            recording.features.iter().map(|feature| feature.line + 1).chain(of_stripes).max().unwrap_or(0);
        // A line on an axis stays on it.
        let lines = if recording.axes.is_empty() { lines } else { 0 };
        for feature in &mut next.features {
            feature.line += lines;
        }
        for stripe in &mut next.stripes {
            stripe.plate += 2 * lines;
        }
        inputs.extend(next.inputs.into_iter().map(|(name, hash)| (format!("{index}/{name}"), hash)));
        recording.robot.extend(next.robot);
        for (axis, mut own) in recording.axes.iter_mut().zip(next.axes) {
            axis.values.append(&mut own.values);
        }
        recording.features.extend(next.features);
        recording.stripes.extend(next.stripes);
        recording.initial = recording.initial.or(next.initial);
    }
    recording.inputs = inputs;
    // Clocks of the devices and counters of frames may begin anew with each recording: as one stream they would lie.
    recording.robot.iter_mut().for_each(|sample| sample.device_ns = None);
    recording.features.iter_mut().for_each(|feature| (feature.device_ns, feature.frame) = (None, None));
    recording.stripes.iter_mut().for_each(|stripe| stripe.frame = None);
    Ok(Joined { recording, shifted })
}

/// Whether two recordings have the same external axes.
fn are_one_cell(one: &Recording, other: &Recording) -> bool {
    let pairs = || one.axes.iter().zip(&other.axes);
    one.axes.len() == other.axes.len()
        && pairs()
            .all(|(a, b)| (&a.name, a.kind, a.carries, a.guess) == (&b.name, b.kind, b.carries, b.guess))
}

fn check_each_is_new(recordings: &[Recording]) -> Result<(), JoinError> {
    for (index, recording) in recordings.iter().enumerate() {
        for (before, earlier) in recordings[..index].iter().enumerate() {
            if let Some([shared, of]) = shared_measurements(earlier, recording) {
                return Err(JoinError::Again { index, before, shared, of });
            }
        }
    }
    Ok(())
}

fn check_sensor(index: usize, first: &Sensor, next: &Recording) -> Result<(), JoinError> {
    if *first == next.sensor {
        return Ok(());
    }
    Err(JoinError::OtherSensor { index, found: next.sensor.kind(), expected: first.kind() })
}

fn first_ns(recording: &Recording) -> i64 {
    let robot = recording.robot.first().map(|sample| sample.stamp_ns);
    let features = recording.features.first().map(|feature| feature.stamp_ns);
    let stripes = recording.stripes.first().map(|stripe| stripe.stamp_ns);
    robot.into_iter().chain(features).chain(stripes).min().unwrap_or(0)
}

fn last_ns(recording: &Recording) -> i64 {
    let robot = recording.robot.last().map(|sample| sample.stamp_ns);
    let features = recording.features.last().map(|feature| feature.stamp_ns);
    let stripes = recording.stripes.last().map(|stripe| stripe.stamp_ns);
    robot.into_iter().chain(features).chain(stripes).max().unwrap_or(0)
}

/// Shifts both streams by the same amount.
fn shift(recording: &mut Recording, by_ns: i64) {
    for sample in &mut recording.robot {
        sample.stamp_ns += by_ns;
    }
    for feature in &mut recording.features {
        feature.stamp_ns += by_ns;
    }
    for stripe in &mut recording.stripes {
        stripe.stamp_ns += by_ns;
    }
    for value in recording.axes.iter_mut().flat_map(|axis| &mut axis.values) {
        value.stamp_ns += by_ns;
    }
    for from_ns in &mut recording.joined_from_ns {
        *from_ns += by_ns;
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;
    use crate::recording::{Feature, Measured, RobotSample};
    use trueline_geometry::Pose;

    fn recording(from_ns: i64) -> Recording {
        let robot = [0, 10, 20].map(|ns| RobotSample {
            stamp_ns: from_ns + ns,
            device_ns: None,
            base_from_tool: Pose::identity(),
        });
        let feature = Feature {
            stamp_ns: from_ns + 12,
            line: 1,
            frame: None,
            device_ns: None,
            measured: Measured::Profile([0.0, 0.3]),
            sigma: None,
            correlation: 0.0,
        };
        let setup = crate::SensorSetup::default();
        let inputs = [("robot.csv".to_owned(), "hash".to_owned())].into();
        Recording { inputs, ..Recording::new(Sensor::Profiler, setup, robot.to_vec(), vec![feature]) }
    }

    #[test]
    fn recordings_follow_each_other_and_keep_their_own_lines() {
        let apart = recording(100_000_000_000);
        let joined = join(vec![recording(0), recording(5), apart]).unwrap();
        assert_eq!(joined.shifted, [1]);
        let all = joined.recording;
        assert_eq!(all.features.iter().map(|f| f.line).collect::<Vec<_>>(), [1, 3, 5]);
        assert!(all.robot.windows(2).all(|two| two[0].stamp_ns < two[1].stamp_ns));
        let [second, third] = [3, 6].map(|k| all.robot[k].stamp_ns);
        assert_eq!(all.joined_from_ns, [second, third]);
        // Both streams of a shifted recording move alike.
        assert_eq!(all.features[1].stamp_ns - all.robot[3].stamp_ns, 12);
        assert_eq!(
            all.inputs.keys().map(String::as_str).collect::<Vec<_>>(),
            ["0/robot.csv", "1/robot.csv", "2/robot.csv"]
        );
    }

    #[test]
    fn recordings_that_would_leave_the_range_of_stamps_are_refused() {
        let at_the_end = || recording(crate::stamp::MOST_NS - 40);
        let joined = join(vec![at_the_end(), recording(0)]);
        assert_eq!(joined.unwrap_err(), JoinError::TooLong { index: 1 });
        assert!(join(vec![recording(0), at_the_end()]).unwrap().shifted.is_empty());
    }

    #[test]
    fn another_sensor_is_refused() {
        let other = Recording { sensor: Sensor::Points { laser_plane_in_camera: None }, ..recording(50) };
        assert!(
            join(vec![recording(0), other])
                .unwrap_err()
                .to_string()
                .contains("recording 1 has another sensor")
        );
        assert_eq!(join(Vec::new()).unwrap_err(), JoinError::Nothing);
    }

    #[test]
    fn the_same_scan_twice_is_refused_and_the_same_seam_twice_is_not() {
        let again = join(vec![recording(0), recording(50), recording(0)]).unwrap_err();
        assert_eq!(again, JoinError::Again { index: 2, before: 0, shared: 1, of: 1 });
        // One log of the robot, and another part of the sensor's data.
        let mut other_part = recording(0);
        other_part.features[0].measured = Measured::Profile([0.1, 0.3]);
        join(vec![recording(0), other_part]).unwrap();
        // The same reading at the same stamp, of clocks that begin at zero, while the robot was elsewhere.
        let mut other_run = recording(0);
        other_run.robot.iter_mut().for_each(|sample| sample.base_from_tool.translation.vector.x = 0.5);
        join(vec![recording(0), other_run]).unwrap();
    }
}
