//! External axes of a recording: joints by their names, of ROS's joint states or in the packets of the robot.

use crate::import_error::ImportError;
use std::collections::{BTreeMap, BTreeSet, HashMap};
use trueline_dataset::AxisRecord;
use trueline_dataset::axes::AxisValue;
use trueline_dataset::import::axis_columns::{AxisColumn, size_of_unit};

/// Units of joints: of packets of a robot, and of ROS.
const UNITS: [[&str; 2]; 2] = [["_deg", "_mm"], ["_rad", "_m"]];

/// Findings so far.
pub(super) struct AxisJoints<'a> {
    asked: &'a [AxisColumn],
    /// Values of each by their topic.
    found: Vec<BTreeMap<String, Vec<(i64, f64)>>>,
    /// Names of all joints.
    seen: BTreeSet<String>,
}

impl<'a> AxisJoints<'a> {
    pub(super) fn new(asked: &'a [AxisColumn]) -> Self {
        Self { asked, found: vec![BTreeMap::new(); asked.len()], seen: BTreeSet::new() }
    }

    /// Whether any is requested.
    pub(super) fn are_asked(&self) -> bool {
        !self.asked.is_empty()
    }

    /// Adds the joints of a message.
    pub(super) fn add<'n>(
        &mut self,
        topic: &str,
        stamp_ns: i64,
        joints: impl Iterator<Item = (&'n str, f64)>,
    ) {
        for (name, value) in joints {
            if !self.seen.contains(name) {
                self.seen.insert(name.to_owned());
            }
            for (asked, found) in self.asked.iter().zip(&mut self.found) {
                if asked.theirs.eq_ignore_ascii_case(name) {
                    found.entry(topic.to_owned()).or_default().push((stamp_ns, value));
                }
            }
        }
    }

    /// By the IEEE 1588 times of the packets.
    ///
    /// # Errors
    /// Values without one.
    pub(super) fn stamp(&mut self, ptp_ns: &HashMap<i64, i64>) -> Result<(), ImportError> {
        let mut count = 0;
        for (stamp_ns, _) in self.found.iter_mut().flat_map(BTreeMap::values_mut).flatten() {
            ptp_ns.get(stamp_ns).map_or_else(|| count += 1, |ptp_ns| *stamp_ns = *ptp_ns);
        }
        if count == 0 { Ok(()) } else { Err(ImportError::NoPtp { count, what: "values of axes" }) }
    }

    /// The axes, in the order of the request.
    ///
    /// # Errors
    /// A joint that is not there, or in several topics; a unit that joints do not have.
    pub(super) fn records(
        self,
        is_own: bool,
        notes: &mut Vec<String>,
    ) -> Result<Vec<AxisRecord>, ImportError> {
        let units = UNITS[usize::from(!is_own)];
        let mut records = Vec::new();
        for (asked, found) in self.asked.iter().zip(self.found) {
            let (name, joint) = (asked.name.clone(), asked.theirs.clone());
            let Some(unit) = asked.unit.filter(|unit| units.contains(unit)) else {
                return Err(ImportError::AxisUnit { name, joint, units });
            };
            let mut topics: Vec<(String, Vec<(i64, f64)>)> = found.into_iter().collect();
            let Some((_, mut values)) = topics.pop() else {
                return Err(ImportError::NoAxis { joint, seen: self.seen.into_iter().collect() });
            };
            if !topics.is_empty() {
                let candidates = topics.into_iter().map(|(topic, _)| topic).collect();
                return Err(ImportError::SeveralTopics { wanted: "the joint of an axis", candidates });
            }
            values.sort_by_key(|(stamp_ns, _)| *stamp_ns);
            let mut note = None;
            let problem = |problem: trueline_dataset::LogProblem| ImportError::Axis(problem.to_string());
            let mut record = asked.record(Some(unit), None, &mut note).map_err(problem)?;
            notes.extend(note);
            let size = size_of_unit(unit);
            record.values = values
                .into_iter()
                .map(|(stamp_ns, value)| AxisValue { stamp_ns, value: value * size })
                .collect();
            notes.push(format!("axis {name}: {} values of `{joint}`", record.values.len()));
            records.push(record);
        }
        Ok(records)
    }
}
