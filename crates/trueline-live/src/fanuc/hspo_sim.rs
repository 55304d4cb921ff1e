//! A simulated controller's HSPO packets.

use crate::zyx_angles;
use trueline_geometry::Pose;

/// A packet with the tool's pose, and one with joints, as a controller sends them side by side; both end with a word of signals.
#[must_use]
pub fn packets(index: u32, clock_us: u32, base_from_tool: &Pose, io: u32) -> [Vec<u8>; 2] {
    let head = |kind: u16| {
        let mut bytes = Vec::with_capacity(60);
        for word in [1, index, clock_us] {
            bytes.extend(word.to_be_bytes());
        }
        bytes.extend(kind.to_be_bytes());
        bytes.extend(1_u16.to_be_bytes());
        bytes
    };
    let mut pose = head(1);
    let p = base_from_tool.translation.vector * 1e3;
    let [w, pitch, r] = zyx_angles::to_wpr_deg(&base_from_tool.rotation);
    for figure in [p.x, p.y, p.z, w, pitch, r] {
        pose.extend((figure as f32).to_be_bytes());
    }
    let mut joints = head(4);
    joints.extend([0; 36]);
    for bytes in [&mut pose, &mut joints] {
        bytes.extend([0; 4]);
        bytes.extend(io.to_be_bytes());
    }
    [pose, joints]
}
