//! Mistakes in the record of external axes: the carried part, unit, sign, column, and poses that already contain them.

use trueline_dataset::{Carries, Recording};
use trueline_geometry::AxisKind;

/// A mistake in the record of an axis, with the number of that axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum AxisMend {
    /// It carries something else.
    Carries(usize, Carries),
    /// Its values must be multiplied by a factor.
    Scaled(usize, f64),
    /// Its values are exchanged with those of another axis.
    Swapped(usize, usize),
    /// The robot's poses contain its motion already.
    WithinPoses(usize),
}

impl AxisMend {
    /// The recording without the mistake. `None` if there is no such axis.
    #[must_use]
    pub fn of(&self, recording: &Recording) -> Option<Recording> {
        let mut mended = recording.clone();
        match *self {
            Self::Carries(k, carries) => mended.axes.get_mut(k)?.carries = carries,
            Self::Scaled(k, factor) => {
                mended.axes.get_mut(k)?.values.iter_mut().for_each(|value| value.value *= factor);
            }
            Self::Swapped(one, other) => {
                let (a, b) = (recording.axes.get(one)?, recording.axes.get(other)?);
                mended.axes[one].values.clone_from(&b.values);
                mended.axes[other].values.clone_from(&a.values);
            }
            Self::WithinPoses(k) => {
                recording.axes.get(k)?;
                mended.axes.remove(k);
            }
        }
        Some(mended)
    }
}

/// Millimetres read as metres, and vice versa.
const OF_LENGTHS: [(f64, &str, &str); 2] = [(1e3, "metres", "_m"), (1e-3, "millimetres", "_mm")];

/// A possible mistake.
pub(super) struct Candidate {
    /// Its name.
    pub name: String,
    /// The mistake and its remedy.
    pub says: String,
    /// Its correction.
    pub mend: AxisMend,
    /// Whether it is the same motion as the previous one: a table under the part, and a column under the robot that turns the other way.
    pub is_twin: bool,
}

/// The possible mistakes about the axes of a recording, the likeliest first.
#[must_use]
pub(super) fn all(recording: &Recording) -> Vec<Candidate> {
    let moves = recording.axes_that_move();
    let mut list = Vec::new();
    for (k, axis) in recording.axes.iter().enumerate().filter(|(k, _)| moves[*k]) {
        let name = &axis.name;
        let mut add = |what: String, says: String, mend: AxisMend, is_twin: bool| {
            list.push(Candidate { name: format!("axis {name}: {what}"), says, mend, is_twin });
        };
        let is_stated = axis.guess.is_some();
        if is_stated {
            let says = format!("axis {name} turns opposite to its direction in cell.toml: reverse it");
            add("wrong sign".to_owned(), says, AxisMend::Scaled(k, -1.0), false);
        }
        for carries in Carries::ALL.into_iter().filter(|carries| *carries != axis.carries) {
            let word = carries.name();
            let says = format!("axis {name} carries the {word}: carries = \"{word}\" in cell.toml");
            let is_twin = is_stated && ![carries, axis.carries].contains(&Carries::Sensor);
            add(format!("carries the {word}"), says, AxisMend::Carries(k, carries), is_twin);
        }
        let turn = 1f64.to_degrees();
        let of_angles = [(turn, "radians", "_rad"), (turn.recip(), "degrees", "_deg")];
        let units = if axis.kind == AxisKind::Rotary { of_angles } else { OF_LENGTHS };
        for (factor, unit, suffix) in units {
            let says = format!("the values of axis {name} are {unit}: call the column {name}{suffix}");
            add(format!("values in {unit}"), says, AxisMend::Scaled(k, factor), false);
        }
        let others = recording.axes.iter().enumerate().skip(k + 1);
        for (other, axis_there) in others.filter(|(_, there)| there.kind == axis.kind) {
            let says = format!("the columns of axes {name} and {} are swapped", axis_there.name);
            add(format!("swapped with {}", axis_there.name), says, AxisMend::Swapped(k, other), false);
        }
        let says = format!(
            "the robot's poses contain axis {name} already: leave it out of cell.toml, or set in_pose = true with its direction and point"
        );
        add("within the poses".to_owned(), says, AxisMend::WithinPoses(k), false);
    }
    list
}
