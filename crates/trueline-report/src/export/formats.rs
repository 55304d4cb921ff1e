//! All formats by name.

use crate::export::axes::{AXES, AxisForm};
use crate::export::curves::{CURVES, CurveForm};
use crate::export::format::Format;
use crate::export::{files, robots, ros, time_offset};

/// The format of a name or an alias.
#[must_use]
pub fn named(name: &str) -> Option<&'static Format> {
    FORMATS.iter().find(|format| format.name == name || format.aliases.contains(&name))
}

/// Name, title and convention of every format, those of curves and axes last, as lines for a person.
#[must_use]
pub fn list() -> String {
    let row = |format: &Format| {
        let aliases = match format.aliases {
            [] => String::new(),
            aliases => format!(" (also {})", aliases.join(", ")),
        };
        format!("{:<14} {}{aliases}\n               {}", format.name, format.title, format.convention)
    };
    let curve =
        |form: &CurveForm| format!("{:<14} {}\n               {}", form.name, form.title, form.convention);
    let axis =
        |form: &AxisForm| format!("{:<14} {}\n               {}", form.name, form.title, form.convention);
    FORMATS
        .iter()
        .map(row)
        .chain(CURVES.iter().map(curve))
        .chain(AXES.iter().map(axis))
        .collect::<Vec<_>>()
        .join("\n")
}

/// All of them.
pub const FORMATS: [Format; 23] = [
    robots::ABB_TOOLDATA,
    robots::ABB_WOBJDATA,
    robots::ABB_POSE,
    robots::KUKA_TOOL,
    robots::KUKA_FRAME,
    robots::FANUC,
    robots::UR,
    robots::YASKAWA,
    robots::STAUBLI,
    ros::URDF,
    ros::XACRO,
    ros::ROS2,
    ros::EASY_HANDEYE2,
    files::KALIBR,
    files::OPENCV,
    files::MATLAB,
    files::PYTHON,
    files::CSV,
    files::MATRIX,
    files::JSON,
    files::QUATERNION,
    files::EULER,
    time_offset::FORMAT,
];
