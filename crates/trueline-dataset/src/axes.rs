//! External axes of a cell, and their recordings.

use crate::unit::MM_PER_M;
use nalgebra::{UnitVector3, Vector3};
use trueline_geometry::{Axis, AxisKind};

/// The body that an axis moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Carries {
    /// The part with its seams: a table, a positioner.
    Part,
    /// The whole robot: a track, a gantry.
    Robot,
    /// The sensor, on the tool.
    Sensor,
}

impl Carries {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Part, Self::Robot, Self::Sensor];

    /// Its name in files and options.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Part => "part",
            Self::Robot => "robot",
            Self::Sensor => "sensor",
        }
    }

    /// Meaning of a name.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|carries| carries.name() == name)
    }
}

/// Whether an axis may be called so: its name is a part of the name of a column.
#[must_use]
pub fn is_axis_name(name: &str) -> bool {
    let is_plain = |c: char| c.is_alphanumeric() || c == '-' || c == '_';
    !name.is_empty() && !["time", "stop", "picture"].contains(&name) && name.chars().all(is_plain)
}

/// Prior knowledge of an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisGuess {
    /// Its direction, in base; of an axis that carries the sensor, in the tool.
    pub direction: UnitVector3<f64>,
    /// A point of it, m; `None` if only the direction is known.
    pub point_m: Option<Vector3<f64>>,
    /// Standard deviations of direction (rad) and point (m), where stated.
    pub sigma: [Option<f64>; 2],
}

/// One value of an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisValue {
    /// Its stamp, ns.
    pub stamp_ns: i64,
    /// Angle (rad) or way (m).
    pub value: f64,
}

/// An axis and its recording.
#[derive(Clone, Debug, PartialEq)]
pub struct AxisRecord {
    /// Its name.
    pub name: String,
    /// Rotary or linear.
    pub kind: AxisKind,
    /// The body that it moves.
    pub carries: Carries,
    /// Whether the poses that the controller reports contain its motion already.
    pub in_pose: bool,
    /// Prior knowledge of it.
    pub guess: Option<AxisGuess>,
    /// Its values, by rising stamp.
    pub values: Vec<AxisValue>,
    /// Its place, if known: from a calibration, or the truth of a simulation.
    pub known: Option<Axis>,
    /// Whether the data show nothing of its time offset, so that the one of `known` is used.
    pub holds_time_offset: bool,
}

impl AxisRecord {
    /// An axis without records yet, at an unknown place.
    #[must_use]
    pub fn new(name: &str, kind: AxisKind, carries: Carries) -> Self {
        Self {
            name: name.to_owned(),
            kind,
            carries,
            in_pose: false,
            guess: None,
            values: Vec::new(),
            known: None,
            holds_time_offset: false,
        }
    }

    /// Whether it moves if its values are so far apart, rad or m.
    #[must_use]
    pub fn moves_by(&self, range: f64) -> bool {
        range > if self.kind == AxisKind::Rotary { STILL_RAD } else { STILL_M }
    }
}

/// An axis with values within this range stands, rad.
const STILL_RAD: f64 = 2e-3;
/// … and m.
const STILL_M: f64 = 1e-3;

/// Values that are not further apart are of one stand: rad …
const ONE_STAND_RAD: f64 = 2e-3;
/// … and m.
const ONE_STAND_M: f64 = 1e-3;

impl AxisRecord {
    /// At how many places it stood while something was read at these stamps, ns; `None` if it moved meanwhile.
    #[must_use]
    pub fn stands(&self, stamps_ns: impl Iterator<Item = i64>) -> Option<usize> {
        let at = |stamp_ns: i64| {
            let next =
                self.values.partition_point(|value| value.stamp_ns <= stamp_ns).min(self.values.len() - 1);
            self.values.get(next).map(|value| value.value)
        };
        let mut read: Vec<f64> = stamps_ns.filter_map(at).collect();
        read.sort_by(f64::total_cmp);
        let wide = if self.kind == AxisKind::Rotary { ONE_STAND_RAD } else { ONE_STAND_M };
        let (mut stands, mut first) = (0, f64::NEG_INFINITY);
        let mut last = f64::NEG_INFINITY;
        for value in read {
            if value - last > 10.0 * wide {
                (stands, first) = (stands + 1, value);
            } else if value - first > wide {
                return None;
            }
            last = value;
        }
        Some(stands)
    }
}

/// Motion of each axis between the first and the last stamp of the readings, rad or m; over all its values for a recording
/// without readings.
#[must_use]
pub fn ranges(axes: &[AxisRecord], read_ns: Option<[i64; 2]>) -> Vec<f64> {
    let [first_ns, last_ns] = read_ns.unwrap_or([i64::MIN, i64::MAX]);
    let range = |record: &AxisRecord| {
        let is_read = |value: &&AxisValue| (first_ns..=last_ns).contains(&value.stamp_ns);
        let values = || record.values.iter().filter(is_read).map(|value| value.value);
        values().fold(f64::NEG_INFINITY, f64::max) - values().fold(f64::INFINITY, f64::min)
    };
    axes.iter().map(range).collect()
}

/// A point in mm.
pub(crate) fn in_mm(point_m: &Vector3<f64>) -> [f64; 3] {
    (point_m * MM_PER_M).into()
}
