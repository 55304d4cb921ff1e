//! The waypoints as a table, for robots that have none of the other languages: the same columns as `robot.csv`, and one for each external axis.

use super::waypoints::Waypoints;
use std::fmt::Write;

/// The table.
#[must_use]
pub fn program(path: &Waypoints) -> String {
    let names = path.axes.iter().map(|axis| format!(",{}_{}", axis.name, axis.unit));
    let mut text = format!("time_s,x_mm,y_mm,z_mm,qw,qx,qy,qz{}\n", names.collect::<String>());
    for (k, waypoint) in path.list.iter().enumerate() {
        let (p, q) = (waypoint.pose.translation.vector * 1e3, waypoint.pose.rotation.quaternion());
        let axes: String = path.axis_values(k).map(|value| format!(",{value:.5}")).collect();
        let _ = writeln!(
            text,
            "{:.4},{:.5},{:.5},{:.5},{:.9},{:.9},{:.9},{:.9}{axes}",
            waypoint.time_s, p.x, p.y, p.z, q.w, q.i, q.j, q.k
        );
    }
    text
}
