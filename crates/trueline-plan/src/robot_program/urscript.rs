//! URScript: `servoj` along straight pieces between the waypoints, a step each 8 ms.
//!
//! After the URScript manual for PolyScope 5.20 (e-Series): `servoj(q, a, v, t, lookahead_time, gain)` with
//! `get_inverse_kin(x, qnear)`, `interpolate_pose(p_from, p_to, alpha)`, `movej(pose, a, v)`. Poses are p\[x, y, z, rx, ry, rz\] in
//! metres and a rotation vector in radians. `movel` with a blend radius would leave the path, and its times.

use super::warning::{about_axes, warning};
use super::waypoints::Waypoints;
use std::fmt::Write;
use trueline_geometry::{Pose, so3};

/// Time of a step, s: a whole number of cycles of every controller (8 ms of CB3, 2 ms of e-Series).
const STEP_S: f64 = 0.008;

/// The program. Moves last whole steps. The rounding is carried over, so the times of the path are kept to one step.
#[must_use]
pub fn program(path: &Waypoints) -> String {
    let mut text = String::new();
    for line in warning(path.reach_is_checked) {
        let _ = writeln!(text, "# {line}");
    }
    if let Some(line) = about_axes(path, None) {
        let _ = writeln!(text, "# {line}");
    }
    let _ = write!(
        text,
        "# {} waypoints in {:.3} s; {}.\n\
         # Poses are in the robot's base frame, and the active TCP must be that tool.\n\
         def trueline_scan():\n\
         \x20 global tl_from = {}\n\
         \x20 def tl_go(tl_to, tl_steps):\n\
         \x20   local tl_k = 1\n\
         \x20   while tl_k <= tl_steps:\n\
         \x20     local tl_at = interpolate_pose(tl_from, tl_to, tl_k / tl_steps)\n\
         \x20     servoj(get_inverse_kin(tl_at, get_target_joint_positions()), 0, 0, {STEP_S}, 0.1, 300)\n\
         \x20     tl_k = tl_k + 1\n\
         \x20   end\n\
         \x20   global tl_from = tl_to\n\
         \x20 end\n\
         \x20 # Approach to the start of the path: check where that is before you run it.\n\
         \x20 movej(tl_from, a=0.5, v=0.1)\n\
         \x20 sleep(1.0)\n",
        path.list.len(),
        path.duration_s(),
        path.chords_in_words(),
        pose(&path.list[0].pose),
    );
    let steps = |time_s: f64| (time_s / STEP_S).round() as u64;
    for pair in path.list.windows(2) {
        let count = steps(pair[1].time_s) - steps(pair[0].time_s);
        let _ = writeln!(text, "  tl_go({}, {count})", pose(&pair[1].pose));
    }
    text.push_str("  stopj(1.0)\nend\n");
    text
}

fn pose(pose: &Pose) -> String {
    let (p, r) = (pose.translation.vector, so3::log(&pose.rotation));
    format!("p[{:.7}, {:.7}, {:.7}, {:.8}, {:.8}, {:.8}]", p.x, p.y, p.z, r.x, r.y, r.z)
}
