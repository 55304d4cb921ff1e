//! KUKA's KRL: a SPLINE block through the waypoints, with the time of each.
//!
//! Syntax after KUKA System Software 8.3, Operating and Programming Instructions for System Integrators, "Programming time
//! blocks". Each part's time is a share of the whole; the shares here are per cent and add up to 100 but for rounding.

use super::warning::{about_axes, warning};
use super::waypoints::Waypoints;
use std::fmt::Write;
use trueline_geometry::{Pose, euler};

/// Text around the path.
pub(crate) struct Around<'a> {
    /// Name of the program.
    pub name: &'a str,
    /// Declarations, each a line; KRL wants them first.
    pub declarations: &'a str,
    /// Between the approach and the path.
    pub begin: &'a str,
    /// After the path.
    pub end: &'a str,
}

/// The program.
#[must_use]
pub fn program(path: &Waypoints) -> String {
    program_with(path, &Around { name: "trueline_scan", declarations: "", begin: "WAIT SEC 1.0\n", end: "" })
}

pub(crate) fn program_with(path: &Waypoints, around: &Around<'_>) -> String {
    let mut text = format!("&ACCESS RVP\n&REL 1\nDEF {} ( )\n", around.name);
    for line in warning(path.reach_is_checked) {
        let _ = writeln!(text, "; {line}");
    }
    if let Some(line) = about_axes(path, Some(&AXES)) {
        let _ = writeln!(text, "; {line}");
    }
    let total_s = path.duration_s();
    let _ = write!(
        text,
        "; {} waypoints in {total_s:.3} s; {}; the spline through them stays closer.\n\
         ; TOOL 0 is the flange and BASE 0 the world: replace them by your own numbers.\n\
         {}\
         BAS (#INITMOV, 0)\n\
         BAS (#TOOL, 0)\n\
         BAS (#BASE, 0)\n\
         BAS (#VEL_PTP, 5)\n\
         ; Approach to the start of the path: check where that is before you run it. Status and turn are the current ones.\n\
         PTP {{{}}}\n\
         {}\
         SPLINE\n\
         \x20 TIME_BLOCK START\n",
        path.list.len(),
        path.chords_in_words(),
        around.declarations,
        position(path, 0),
        around.begin,
    );
    for (k, (_, takes_s)) in path.moves().enumerate() {
        let to = position(path, k + 1);
        let _ = write!(text, "  SPL {{{to}}}\n  TIME_BLOCK PART = {:.5}\n", 100.0 * takes_s / total_s);
    }
    let _ = write!(text, "  TIME_BLOCK END = {total_s:.4}\nENDSPLINE\n{}END\n", around.end);
    text
}

/// Names of the external axes.
const AXES: [&str; 6] = ["E1", "E2", "E3", "E4", "E5", "E6"];

/// A waypoint, with the external axes.
fn position(path: &Waypoints, waypoint: usize) -> String {
    let axes =
        AXES.iter().zip(path.axis_values(waypoint)).map(|(name, value)| format!(", {name} {value:.5}"));
    frame(&path.list[waypoint].pose) + &axes.collect::<String>()
}

/// X, Y, Z in mm; A, B, C in degrees about z, then the new y, then the new x.
fn frame(pose: &Pose) -> String {
    let p = pose.translation.vector * 1e3;
    let [a, b, c] = euler::ZYX_INTRINSIC.angles(&pose.rotation).map(f64::to_degrees);
    format!("X {:.4}, Y {:.4}, Z {:.4}, A {a:.6}, B {b:.6}, C {c:.6}", p.x, p.y, p.z)
}
