//! Attitudes composed from three angles in a wrong sequence, or with a wrong order of columns.
//!
//! Every sequence about fixed axes equals one about moving axes with its columns reversed. Twelve sequences in six orders of columns are therefore
//! complete.

use crate::diagnose::mistake::with_rotations;
use nalgebra::UnitQuaternion;
use std::f64::consts::PI;
use trueline_dataset::Recording;
use trueline_geometry::euler::EulerSequence;

/// Angles written in one sequence and composed in another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EulerMistake {
    /// The sequence in which they were written.
    written: EulerSequence,
    /// The sequence in which they were composed.
    composed: EulerSequence,
    /// For each angle of the written sequence its column in the composed one.
    columns: [usize; 3],
    /// Whether the middle angle was beyond the range of a decomposition.
    is_beyond: bool,
}

/// The twelve sequences, those most usual for robots first.
const WRITTEN: [&str; 12] =
    ["zyx", "xyz", "zyz", "zxz", "zxy", "yxz", "yzx", "xzy", "xyx", "xzx", "yxy", "yzy"];
/// The default sequences of programs.
const COMPOSED: [&str; 3] = ["zyx", "xyz", "zyz"];
/// Orders of three columns, the usual ones first.
const COLUMNS: [[usize; 3]; 6] = [[0, 1, 2], [2, 1, 0], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1]];

/// All of them, the likeliest first. The likelihood decreases with the rank in each list.
pub(super) fn all() -> Vec<EulerMistake> {
    let sequence = |letters: &str| format!("{letters}-intrinsic").parse::<EulerSequence>().ok();
    let mut ranked = Vec::new();
    for (a, written) in WRITTEN.iter().enumerate() {
        for (b, composed) in COMPOSED.iter().enumerate() {
            for (c, columns) in COLUMNS.iter().enumerate() {
                for is_beyond in [false, true] {
                    let (Some(of), Some(as_if)) = (sequence(written), sequence(composed)) else { continue };
                    if written == composed && *columns == [0, 1, 2] {
                        continue;
                    }
                    let mistake = EulerMistake { written: of, composed: as_if, columns: *columns, is_beyond };
                    ranked.push((a + b + c + 4 * usize::from(is_beyond), mistake));
                }
            }
        }
    }
    ranked.sort_by_key(|(rank, _)| *rank);
    ranked.into_iter().map(|(_, mistake)| mistake).collect()
}

impl EulerMistake {
    /// Short name.
    #[must_use]
    pub fn name(&self) -> String {
        let beyond = if self.is_beyond { ", beyond its range" } else { "" };
        let order = match self.columns {
            [0, 1, 2] => String::new(),
            order => format!(" in columns {}", order.map(|k| (k + 1).to_string()).join(" ")),
        };
        format!("Euler angles {}{order} read as {}{beyond}", self.written, self.composed)
    }

    /// The probable mistake and its remedy.
    #[must_use]
    pub fn says(&self) -> String {
        let order = match self.columns {
            [0, 1, 2] => "in the order of their columns".to_owned(),
            order => {
                format!("with the columns in the order {}", order.map(|k| (k + 1).to_string()).join(", "))
            }
        };
        format!(
            "the attitude was made from Euler angles in the wrong order: they are {}{} {order}, and were composed as {}; {}",
            self.written,
            makers(self.written, self.columns),
            self.composed,
            self.remedy()
        )
    }

    /// The command that reads the angles as written.
    fn remedy(&self) -> String {
        let command = format!("trueline import csv --euler {}", self.written);
        if self.columns == [0, 1, 2] {
            return format!("`{command}` reads them");
        }
        let of = |angle: usize| self.columns.iter().position(|column| *column == angle).map_or(0, |k| k + 1);
        format!(
            "`{command} --robot-map e1_deg=ANGLE{},e2_deg=ANGLE{},e3_deg=ANGLE{}` reads them, with the names of the first, second and third \
             column of angles for ANGLE1, ANGLE2 and ANGLE3",
            of(0),
            of(1),
            of(2)
        )
    }

    /// The recording with its angles composed as written.
    pub(super) fn mend(&self, recording: &Recording) -> Recording {
        with_rotations(recording, |sample| self.right(&sample.base_from_tool.rotation))
    }

    fn right(&self, rotation: &UnitQuaternion<f64>) -> UnitQuaternion<f64> {
        let mut angles = self.composed.angles(rotation);
        if self.is_beyond {
            angles = other_angles(angles, self.composed);
        }
        let mut written = [0.0; 3];
        for (angle, column) in angles.into_iter().zip(self.columns) {
            written[column] = angle;
        }
        self.written.rotation(written)
    }
}

/// Makers of robots that write angles this way, as words after a sequence's name.
fn makers(written: EulerSequence, columns: [usize; 3]) -> &'static str {
    match (written.to_string().as_str(), columns) {
        ("zyx-intrinsic", [0, 1, 2]) => " (as KUKA's A, B, C)",
        ("zyx-intrinsic", [2, 1, 0]) => " (as FANUC's W, P, R and Yaskawa's Rx, Ry, Rz)",
        ("xyz-intrinsic", [0, 1, 2]) => " (as Stäubli's Rx, Ry, Rz)",
        ("zyz-intrinsic", [0, 1, 2]) => " (as Kawasaki's O, A, T and the A, B, C of Comau and Doosan)",
        _ => "",
    }
}

/// The other three angles of the same rotation.
fn other_angles([first, middle, last]: [f64; 3], sequence: EulerSequence) -> [f64; 3] {
    let turned = |angle: f64| if angle > 0.0 { angle - PI } else { angle + PI };
    let is_proper = sequence.to_string().as_bytes().first() == sequence.to_string().as_bytes().get(2);
    let middle = match (is_proper, middle > 0.0) {
        (true, _) => -middle,
        (false, true) => PI - middle,
        (false, false) => -PI - middle,
    };
    [turned(first), middle, turned(last)]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every mistake is undone by composing its own angles correctly. The mistakes are made by hand here.
    #[test]
    fn the_other_angles_are_of_the_same_rotation() {
        for letters in WRITTEN {
            let sequence: EulerSequence = format!("{letters}-intrinsic").parse().unwrap_or_else(|_| panic!());
            let angles = [0.4, 0.7, -1.9];
            let same = sequence.rotation(other_angles(angles, sequence));
            assert!(sequence.rotation(angles).angle_to(&same) < 1e-12, "{letters}");
        }
    }

    /// zyz in the columns 3, 1, 2: the third angle of the sequence stands first, so the first one of the sequence is in the second column.
    #[test]
    fn the_remedy_maps_columns_to_angles() {
        let sequence = |letters: &str| letters.parse::<EulerSequence>().unwrap_or_else(|_| panic!());
        let mistake = EulerMistake {
            written: sequence("zyz-intrinsic"),
            composed: sequence("zyx-intrinsic"),
            columns: [2, 0, 1],
            is_beyond: false,
        };
        assert!(mistake.says().contains("e1_deg=ANGLE2,e2_deg=ANGLE3,e3_deg=ANGLE1"), "{}", mistake.says());
    }

    #[test]
    fn there_are_all_sequences_in_all_orders_of_columns() {
        let all = all();
        // Twelve sequences, three composed ones, six orders, two ranges, without the three that change nothing.
        assert_eq!(all.len(), 2 * (12 * 3 * 6 - 3));
    }
}
