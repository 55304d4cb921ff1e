//! Commands that would be sent to a robot, for the person who is to allow them.

use super::checked_path::CheckedPath;
use super::limits::{FASTEST_M_S, MotionLimits};
use std::fmt;
use trueline_dataset::RobotSample;

/// A rest that is longer comes near to \\CondTime, after which a guidance ends, s.
const DWELL_S: f64 = 1.5;

/// A path beside its limits; its `Display` is a table.
#[derive(Clone, Copy, Debug)]
pub struct PathSummary<'a> {
    /// The path.
    pub path: &'a CheckedPath,
    /// The poses that it was made from.
    pub poses: &'a [RobotSample],
    /// The limits it was checked against.
    pub limits: &'a MotionLimits,
    /// Share of the path's own pace.
    pub pace: f64,
}

impl fmt::Display for PathSummary<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.head(f)?;
        let [low, high] = self.path.extent_m().map(|corner| corner * 1e3);
        for (axis, k) in [("x", 0), ("y", 1), ("z", 2)] {
            let [from, to] = self.limits.box_m.map(|corner| corner[k] * 1e3);
            writeln!(
                f,
                "  {axis}            {:.1} to {:.1} mm, allowed {from:.1} to {to:.1}",
                low[k], high[k]
            )?;
        }
        self.motion(f)?;
        let rest_s = self.path.longest_rest_s();
        if rest_s > DWELL_S {
            writeln!(f, "  warning      it rests for {rest_s:.1} s on the way: EGMRunPose may end there")?;
        }
        Ok(())
    }
}

impl PathSummary<'_> {
    fn head(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (path, ramp) = (self.path, self.path.ramp());
        let pace = if self.pace < 1.0 {
            format!(" at {:.0} % of its pace", 100.0 * self.pace)
        } else {
            String::new()
        };
        let start_s = 1.0 / ramp.slope_per_s + 3.0 * ramp.lag_s;
        let (count, takes_s) = (self.poses.len(), path.duration_s());
        writeln!(f, "Path of {count} poses, {takes_s:.1} s{pace}; {start_s:.1} s to start, as many to stop")?;
        let Some(first) = self.poses.first() else { return Ok(()) };
        let start = first.base_from_tool.translation.vector * 1e3;
        writeln!(f, "  begins at    x {:.1}  y {:.1}  z {:.1} mm", start.x, start.y, start.z)
    }

    fn motion(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (most, limits, d) = (self.path.extremes(), self.limits, f64::to_degrees);
        let rows = [
            ("speed", most.speed_m_s * 1e3, limits.speed_m_s * 1e3, "mm/s"),
            ("acceleration", most.acceleration_m_s2 * 1e3, limits.acceleration_m_s2 * 1e3, "mm/s²"),
            ("jerk", most.jerk_m_s3 * 1e3, limits.jerk_m_s3 * 1e3, "mm/s³"),
            ("turning", d(most.turn_rad_s), d(limits.turn_rad_s), "°/s"),
            ("turn change", d(most.turn_acceleration_rad_s2), d(limits.turn_acceleration_rad_s2), "°/s²"),
        ];
        for (what, found, limit, unit) in rows {
            writeln!(f, "  {what:<12} up to {found:.1} {unit}, allowed {limit:.1}")?;
        }
        let [tip_mm_s, cap_mm_s, reach_mm] = [most.tip_m_s, FASTEST_M_S, limits.reach_m].map(|m| m * 1e3);
        writeln!(
            f,
            "  at the tip   up to {tip_mm_s:.1} mm/s, allowed {cap_mm_s:.1}: {reach_mm:.0} mm from the tool's origin"
        )
    }
}
