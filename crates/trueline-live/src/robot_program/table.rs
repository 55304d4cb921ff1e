//! The waypoints as a table, for robots that have none of the other languages: the same columns as `robot.csv`.

use super::waypoints::Waypoints;
use std::fmt::Write;

/// The table.
#[must_use]
pub fn program(path: &Waypoints) -> String {
    let mut text = String::from("time_s,x_mm,y_mm,z_mm,qw,qx,qy,qz\n");
    for waypoint in &path.list {
        let (p, q) = (waypoint.pose.translation.vector * 1e3, waypoint.pose.rotation.quaternion());
        let _ = writeln!(
            text,
            "{:.4},{:.5},{:.5},{:.5},{:.9},{:.9},{:.9},{:.9}",
            waypoint.time_s, p.x, p.y, p.z, q.w, q.i, q.j, q.k
        );
    }
    text
}
