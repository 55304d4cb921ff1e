//! A simulated controller's messages, as `ONLYSEND` sends them.

use crate::zyx_angles;
use trueline_geometry::Pose;

/// A message: actual and set pose, no answers missed, the cycle's count.
#[must_use]
pub fn message(base_from_tool: &Pose, ipoc: u64) -> String {
    let p = base_from_tool.translation.vector * 1e3;
    let [a, b, c] = zyx_angles::to_abc_deg(&base_from_tool.rotation);
    let pose =
        format!("X=\"{:.4}\" Y=\"{:.4}\" Z=\"{:.4}\" A=\"{a:.4}\" B=\"{b:.4}\" C=\"{c:.4}\"", p.x, p.y, p.z);
    format!(
        "<Rob Type=\"KUKA\"><RIst {pose}/><RSol {pose}/>\
         <AIPos A1=\"0.0\" A2=\"-90.0\" A3=\"90.0\" A4=\"0.0\" A5=\"90.0\" A6=\"0.0\"/>\
         <ASPos A1=\"0.0\" A2=\"-90.0\" A3=\"90.0\" A4=\"0.0\" A5=\"90.0\" A6=\"0.0\"/>\
         <Delay D=\"0\"/><IPOC>{ipoc}</IPOC></Rob>"
    )
}
