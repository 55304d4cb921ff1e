//! How the makers of robots write a pose: names and units of the columns, and what the rotation means.

use crate::error::Problem;
use trueline_geometry::EulerSequence;

/// The columns of a robot's pose, in the words of its maker.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RobotLayout {
    /// What is assumed, in words; said whenever the layout is used.
    pub words: String,
    columns: Vec<LayoutColumn>,
}

#[derive(Clone, Debug, PartialEq, Eq)]
struct LayoutColumn {
    /// Names in lower case, without unit.
    theirs: &'static [&'static str],
    /// Our name, without unit.
    ours: String,
    /// Our suffix where the header tells no unit; `None` if it must.
    unit: Option<&'static str>,
}

/// Theirs, ours, our unit.
type Column = (&'static [&'static str], &'static str, &'static str);

struct Maker {
    name: &'static str,
    words: &'static str,
    columns: &'static [Column],
}

const MAKERS: [Maker; 8] = [
    Maker {
        name: "abb",
        words: "ABB: x, y, z in mm; quaternion q1, q2, q3, q4 = w, x, y, z",
        columns: &[
            (&["x", "pos_x", "trans.x"], "x", "_mm"),
            (&["y", "pos_y", "trans.y"], "y", "_mm"),
            (&["z", "pos_z", "trans.z"], "z", "_mm"),
            (&["q1", "u0", "qw", "rot.q1"], "qw", ""),
            (&["q2", "u1", "qx", "rot.q2"], "qx", ""),
            (&["q3", "u2", "qy", "rot.q3"], "qy", ""),
            (&["q4", "u3", "qz", "rot.q4"], "qz", ""),
        ],
    },
    Maker {
        name: "kuka",
        words: "KUKA: X, Y, Z in mm; A, B, C in degrees, about z, then the new y, then the new x",
        columns: &[
            (&["x", "pos_act_mes.x", "pos_act.x"], "x", "_mm"),
            (&["y", "pos_act_mes.y", "pos_act.y"], "y", "_mm"),
            (&["z", "pos_act_mes.z", "pos_act.z"], "z", "_mm"),
            (&["a", "pos_act_mes.a", "pos_act.a"], "a", "_deg"),
            (&["b", "pos_act_mes.b", "pos_act.b"], "b", "_deg"),
            (&["c", "pos_act_mes.c", "pos_act.c"], "c", "_deg"),
        ],
    },
    Maker {
        name: "ur",
        words: "UR: x, y, z in m; rx, ry, rz the rotation vector in rad",
        columns: &[
            (&["timestamp"], "time", "_s"),
            (&["x", "actual_tcp_pose_0"], "x", "_m"),
            (&["y", "actual_tcp_pose_1"], "y", "_m"),
            (&["z", "actual_tcp_pose_2"], "z", "_m"),
            (&["rx", "actual_tcp_pose_3"], "rx", "_rad"),
            (&["ry", "actual_tcp_pose_4"], "ry", "_rad"),
            (&["rz", "actual_tcp_pose_5"], "rz", "_rad"),
        ],
    },
    Maker {
        name: "fanuc",
        words: "FANUC: X, Y, Z in mm; W, P, R in degrees, about the fixed x, then y, then z",
        columns: &[
            (&["x"], "x", "_mm"),
            (&["y"], "y", "_mm"),
            (&["z"], "z", "_mm"),
            (&["w"], "w", "_deg"),
            (&["p"], "p", "_deg"),
            (&["r"], "r", "_deg"),
        ],
    },
    Maker {
        name: "yaskawa",
        words: "Yaskawa: X, Y, Z in mm; Rx, Ry, Rz in degrees, about the fixed x, then y, then z",
        columns: &[
            (&["x"], "x", "_mm"),
            (&["y"], "y", "_mm"),
            (&["z"], "z", "_mm"),
            (&["rx"], "roll", "_deg"),
            (&["ry"], "pitch", "_deg"),
            (&["rz"], "yaw", "_deg"),
        ],
    },
    Maker {
        name: "staubli",
        words: "Staubli: x, y, z in mm; rx, ry, rz in degrees, about x, then the new y, then the new z",
        columns: &[
            (&["x"], "x", "_mm"),
            (&["y"], "y", "_mm"),
            (&["z"], "z", "_mm"),
            (&["rx"], "euler_xyz_intrinsic_1", "_deg"),
            (&["ry"], "euler_xyz_intrinsic_2", "_deg"),
            (&["rz"], "euler_xyz_intrinsic_3", "_deg"),
        ],
    },
    Maker {
        name: "matrix",
        words: "matrix: x, y, z in mm; r11 to r33 row by row, columns are the axes of the tool",
        columns: &[(&["x"], "x", "_mm"), (&["y"], "y", "_mm"), (&["z"], "z", "_mm")],
    },
    Maker {
        name: "ros",
        words: "ROS: x, y, z in m; quaternion qx, qy, qz, qw by name",
        columns: &[
            (&["x", "position.x", "translation.x"], "x", "_m"),
            (&["y", "position.y", "translation.y"], "y", "_m"),
            (&["z", "position.z", "translation.z"], "z", "_m"),
            (&["qw", "orientation.w", "rotation.w"], "qw", ""),
            (&["qx", "orientation.x", "rotation.x"], "qx", ""),
            (&["qy", "orientation.y", "rotation.y"], "qy", ""),
            (&["qz", "orientation.z", "rotation.z"], "qz", ""),
        ],
    },
];

/// Names of the three angles where the sequence is named by the user.
const ANGLES: [&[&str]; 3] =
    [&["a", "rx", "e1", "angle1"], &["b", "ry", "e2", "angle2"], &["c", "rz", "e3", "angle3"]];

impl RobotLayout {
    /// All names that [`RobotLayout::named`] knows.
    pub fn names() -> impl Iterator<Item = &'static str> {
        MAKERS.iter().map(|maker| maker.name)
    }

    /// The layout of a maker.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        let maker = MAKERS.iter().find(|maker| maker.name == name)?;
        let column =
            |&(theirs, ours, unit): &Column| LayoutColumn { theirs, ours: ours.to_owned(), unit: Some(unit) };
        let columns = maker.columns.iter().map(column).collect();
        Some(Self { words: maker.words.to_owned(), columns })
    }

    /// Angles A B C, Rx Ry Rz, e1 e2 e3 or angle1 angle2 angle3 in a sequence that the user names. Units stand in the header, or are mm
    /// and degrees if a maker's layout says so.
    #[must_use]
    pub fn with_sequence(maker: Option<&Self>, sequence: EulerSequence) -> Self {
        let unit = |unit| maker.map(|_| unit);
        let stem = sequence.to_string().replace('-', "_");
        let positions = match maker {
            Some(maker) => maker
                .columns
                .iter()
                .filter(|c| matches!(c.ours.as_str(), "x" | "y" | "z" | "time"))
                .cloned()
                .collect(),
            None => Vec::new(),
        };
        let angles = ANGLES.iter().zip(1..).map(|(theirs, number)| LayoutColumn {
            theirs,
            ours: format!("euler_{stem}_{number}"),
            unit: unit("_deg"),
        });
        Self {
            words: format!("three angles, {sequence}, in the order of their names"),
            columns: positions.into_iter().chain(angles).collect(),
        }
    }

    /// Our name, with unit, for a column of the foreign header; `None` if it is none of the layout's.
    ///
    /// # Errors
    /// A column of the layout with a unit that is not known: the maker's is then not what it is in.
    pub fn ours(&self, header: &str) -> Result<Option<String>, Problem> {
        let (stem, unit) = stem_and_unit(header);
        let Some(column) = self.columns.iter().find(|column| column.theirs.contains(&stem.as_str())) else {
            return Ok(None);
        };
        Ok(Some(format!("{}{}", column.ours, unit.suffix()?.or(column.unit).unwrap_or(""))))
    }

    /// The makers whose columns a header has, all of them.
    #[must_use]
    pub fn recognised(header: &[String]) -> Vec<&'static str> {
        let fits = |maker: &&Maker| {
            let ours: Vec<&str> = maker
                .columns
                .iter()
                .filter(|(theirs, ..)| {
                    header.iter().any(|name| theirs.contains(&stem_and_unit(name).0.as_str()))
                })
                .map(|(_, ours, _)| *ours)
                .collect();
            ["x", "y", "z"].iter().all(|axis| ours.contains(axis)) && ours.len() >= 6
        };
        MAKERS.iter().filter(fits).map(|maker| maker.name).collect()
    }
}

/// What a header says of the unit of its column.
#[derive(Clone, Debug, PartialEq, Eq)]
enum HeaderUnit {
    /// Nothing.
    Absent,
    /// Our suffix.
    Known(&'static str),
    /// Words in brackets that are no unit known here.
    Unknown(String),
}

impl HeaderUnit {
    /// Our suffix, or none where the header has no unit.
    fn suffix(&self) -> Result<Option<&'static str>, Problem> {
        match self {
            Self::Absent => Ok(None),
            Self::Known(suffix) => Ok(Some(suffix)),
            Self::Unknown(unit) => Err(Problem::UnknownUnit { unit: unit.clone() }),
        }
    }
}

/// `A [°]` → `a`, `_deg`; `X_mm` → `x`, `_mm`; `Y` → `y` and no unit.
fn stem_and_unit(header: &str) -> (String, HeaderUnit) {
    let lower = header.trim().trim_start_matches('$').to_lowercase();
    if let Some((stem, unit)) = lower.split_once(['[', '(']) {
        let unit = unit.trim_end_matches([']', ')']).trim();
        let known = suffix_of(unit).map(HeaderUnit::Known);
        return (stem.trim().to_owned(), known.unwrap_or_else(|| HeaderUnit::Unknown(unit.to_owned())));
    }
    match lower.rsplit_once('_').and_then(|(stem, unit)| Some((stem.to_owned(), suffix_of(unit)?))) {
        Some((stem, suffix)) if !suffix.is_empty() => (stem, HeaderUnit::Known(suffix)),
        _ => (lower, HeaderUnit::Absent),
    }
}

/// Our suffix of a unit; empty for what says that there is none. Two letters of Unicode are micro.
fn suffix_of(unit: &str) -> Option<&'static str> {
    Some(match unit {
        "" | "-" | "1" => "",
        "mm" => "_mm",
        "m" => "_m",
        "cm" => "_cm",
        "um" | "µm" | "μm" => "_um",
        "in" | "inch" => "_in",
        "deg" | "°" | "degree" | "degrees" => "_deg",
        "rad" => "_rad",
        "mrad" => "_mrad",
        "gon" | "grad" => "_gon",
        "s" | "sec" => "_s",
        "ms" => "_ms",
        "us" | "µs" | "μs" => "_us",
        "ns" => "_ns",
        _ => return None,
    })
}

/// Our name for a column of time: `t` is in seconds, other names tell their unit. One in another unit, a date say, is none.
#[must_use]
pub(crate) fn time_column(header: &str) -> Option<String> {
    let (stem, unit) = stem_and_unit(header);
    match (stem.as_str(), unit) {
        ("t", HeaderUnit::Absent) if header.trim() == "t" => Some("time_s".to_owned()),
        ("t" | "time" | "timestamp" | "stamp" | "zeit", HeaderUnit::Known(unit)) if unit.ends_with('s') => {
            Some(format!("time{unit}"))
        }
        _ => None,
    }
}
