//! ABB's RAPID: linear moves with the time of each, without EGM.

use super::warning::{about_axes, warning};
use super::waypoints::Waypoints;
use std::fmt::Write;
use trueline_geometry::Pose;

/// The module, for `tool0` in `wobj0`.
#[must_use]
pub(crate) fn program(path: &Waypoints) -> String {
    let mut text = String::from("MODULE TruelineScan\n");
    for line in warning(path.reach_is_checked) {
        let _ = writeln!(text, "  ! {line}");
    }
    if let Some(line) = about_axes(path, Some(&AXES)) {
        let _ = writeln!(text, "  ! {line}");
    }
    let _ = write!(
        text,
        "  ! For tool0 in wobj0 and the task T_ROB1; `trueline robot-program abb --pc` takes your own names, and streams poses.\n\n\
         \x20 PROC TruelineScan_Run()\n\
         \x20   ConfJ\\Off;\n\
         \x20   ConfL\\Off;\n\
         \x20   ! Approach to the start of the path: check where that is before you run it.\n\
         \x20   MoveJ {}, [20, 20, 200, 15], fine, tool0\\WObj:=wobj0;\n\
         \x20   WaitTime\\InPos, 1;\n\
         \x20   TruelineScan_Path;\n\
         \x20   ConfL\\On;\n\
         \x20   ConfJ\\On;\n\
         \x20 ERROR\n\
         \x20   ConfL\\On;\n\
         \x20   ConfJ\\On;\n\
         \x20   RAISE;\n\
         \x20 ENDPROC\n\n",
        waypoint(path, 0)
    );
    text.push_str(&path_procedure("TruelineScan", path, "tool0", "wobj0"));
    text.push_str("ENDMODULE\n");
    text
}

/// The procedure with the moves.
pub(crate) fn path_procedure(module: &str, path: &Waypoints, tool: &str, work_object: &str) -> String {
    let mut text = format!(
        "  ! {} moves in {:.1} s; {}.\n\
         \x20 ! \\T is the duration of each move; the speed follows from it.\n\
         \x20 LOCAL PROC {module}_Path()\n",
        path.list.len() - 1,
        path.duration_s(),
        path.chords_in_words(),
    );
    let last = path.list.len() - 2;
    for (k, (_, takes_s)) in path.moves().enumerate() {
        let zone = if k == last { "fine" } else { "z1" };
        let _ = writeln!(
            text,
            "    MoveL {}, v100\\T:={takes_s:.3}, {zone}, {tool}\\WObj:={work_object};",
            waypoint(path, k + 1)
        );
    }
    text.push_str("  ENDPROC\n");
    text
}

/// Names of the external axes.
const AXES: [&str; 6] = ["eax_a", "eax_b", "eax_c", "eax_d", "eax_e", "eax_f"];
/// An external axis that does not exist.
const NO_AXIS: &str = "9E9";

/// A waypoint as `robtarget`, with the external axes.
fn waypoint(path: &Waypoints, waypoint: usize) -> String {
    let axes = path.axis_values(waypoint).map(|value| format!("{value:.4}"));
    let axes: Vec<String> = axes.chain(AXES.iter().map(|_| NO_AXIS.to_owned())).take(AXES.len()).collect();
    robtarget(&path.list[waypoint].pose, &axes.join(", "))
}

/// `robtarget` without configuration (`ConfJ\Off`, `ConfL\Off`) and external axes.
pub(crate) fn target(pose: &Pose) -> String {
    robtarget(pose, &[NO_AXIS; AXES.len()].join(", "))
}

fn robtarget(pose: &Pose, axes: &str) -> String {
    let p = pose.translation.vector * 1e3;
    let q = pose.rotation.quaternion();
    // RAPID wants |q| = 1 to five digits or so; seven are given.
    format!(
        "[[{:.3}, {:.3}, {:.3}], [{:.7}, {:.7}, {:.7}, {:.7}], [0, 0, 0, 0], [{axes}]]",
        p.x, p.y, p.z, q.w, q.i, q.j, q.k
    )
}
