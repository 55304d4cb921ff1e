//! FANUC's LS (TP program as text): linear moves whose time is given in milliseconds.
//!
//! Form after FANUC's handling tool manuals and programs of theirs: `/PROG`, `/ATTR`, `/MN`, `/POS`, `/END`; `L P[n] 250msec CNT100`;
//! positions `GP1: UF, UT, CONFIG, X … R` in mm and degrees about fixed x, y, z. A line ends in a semicolon, 32 letters of a
//! remark fit.

use super::waypoints::Waypoints;
use crate::zyx_angles::to_wpr_deg;
use std::fmt::Write;
use trueline_geometry::Pose;

/// What the program says of itself in lines of at most 32 letters.
const REMARKS: [&str; 4] = [
    "Written by trueline",
    "NOT TRIED ON A REAL CONTROLLER",
    "Check it in ROBOGUIDE, then run",
    "it in T1 with the deadman",
];
/// See [`REMARKS`].
const NOTHING_CHECKED: [&str; 2] = ["Reach, singularities, collisions", "are not checked"];
/// See [`REMARKS`].
const REACH_CHECKED: [&str; 2] = ["Reach was checked for the arm of", "the plan; collisions were not"];
/// See [`REMARKS`].
const LOOK_AT: [&str; 3] = [
    "Look at UFRAME, UTOOL and CONFIG",
    "of P[1]: they must be yours, and",
    "the tool that of the calibration",
];

/// The program. Moves last whole milliseconds; the rounding is carried over.
#[must_use]
pub fn program(path: &Waypoints) -> String {
    let checked = if path.reach_is_checked { REACH_CHECKED } else { NOTHING_CHECKED };
    let remarks = REMARKS.into_iter().chain(checked).chain(LOOK_AT);
    let mut lines: Vec<String> = (remarks.map(str::to_owned))
        .chain([
            format!("Leaves the path by {:.2} mm", path.chord_m * 1e3),
            format!("and {:.3} deg at most", path.chord_rad.to_degrees()),
        ])
        .map(|remark| format!("  !{remark} ;"))
        .collect();
    lines.extend(
        ["  UFRAME_NUM=0 ;", "  UTOOL_NUM=1 ;", "J P[1] 5% FINE    ;", "  WAIT   1.00(sec) ;"]
            .map(str::to_owned),
    );
    let ms = |time_s: f64| (time_s * 1e3).round() as u64;
    for (k, pair) in path.list.windows(2).enumerate() {
        let takes_ms = ms(pair[1].time_s) - ms(pair[0].time_s);
        let end = if k + 2 == path.list.len() { "FINE" } else { "CNT100" };
        lines.push(format!("L P[{}] {takes_ms}msec {end}    ;", k + 2));
    }
    let mut text = format!(
        "/PROG  TL_SCAN\n/ATTR\nOWNER\t\t= MNEDITOR;\nCOMMENT\t\t= \"trueline\";\nLINE_COUNT\t= {};\nPROTECT\t\t= READ_WRITE;\n\
         TCD:  STACK_SIZE\t= 0,\n      TASK_PRIORITY\t= 50,\n      TIME_SLICE\t= 0,\n      BUSY_LAMP_OFF\t= 0,\n      ABORT_REQUEST\t= 0,\n\
         \x20     PAUSE_REQUEST\t= 0;\nDEFAULT_GROUP\t= 1,*,*,*,*;\nCONTROL_CODE\t= 00000000 00000000;\n/MN\n",
        lines.len()
    );
    for (k, line) in lines.iter().enumerate() {
        let _ = writeln!(text, "{:4}:{line}", k + 1);
    }
    text.push_str("/POS\n");
    for (k, waypoint) in path.list.iter().enumerate() {
        let _ = write!(text, "P[{}]{{\n{}\n}};\n", k + 1, position(&waypoint.pose));
    }
    text.push_str("/END\n");
    text
}

fn position(pose: &Pose) -> String {
    let p = pose.translation.vector * 1e3;
    let [w, pitch, r] = to_wpr_deg(&pose.rotation);
    format!(
        "   GP1:\n\tUF : 0, UT : 1,\t\tCONFIG : 'N U T, 0, 0, 0',\n\
         \tX = {:9.3}  mm,\tY = {:9.3}  mm,\tZ = {:9.3}  mm,\n\
         \tW = {w:9.4} deg,\tP = {pitch:9.4} deg,\tR = {r:9.4} deg",
        p.x, p.y, p.z
    )
}
