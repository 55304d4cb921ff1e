//! The transform as ROS and its tools write it: metres, x, y, z, w.

use crate::export::format::{Format, Group};
use crate::export::mounting::Mounting;
use crate::export::number::{m, unit, wxyz};
use crate::markup::escape;
use trueline_geometry::euler::XYZ_FIXED;

/// A fixed joint.
pub const URDF: Format = Format {
    name: "urdf",
    aliases: &[],
    title: "URDF",
    group: Group::Ros,
    convention: "Origin of a fixed joint from the robot's frame to the sensor: m; roll, pitch, yaw in rad about the fixed x, then y, then z. \
                 The parent must be the frame that the robot reports: ROS-Industrial's `flange` may have other axes than the maker's.",
    write: |mounting| Ok(joint(mounting, &mounting.parent, &mounting.child)),
};

/// A macro with a fixed joint.
pub(crate) const XACRO: Format = Format {
    name: "xacro",
    aliases: &[],
    title: "xacro",
    group: Group::Ros,
    convention: "A macro with the fixed joint of `urdf`: m; roll, pitch, yaw in rad about the fixed x, then y, then z.",
    write: |mounting| {
        Ok(format!(
            "<robot xmlns:xacro=\"http://www.ros.org/wiki/xacro\">\n\
             <xacro:macro name=\"{child}_mount\" params=\"parent:={parent}\">\n<link name=\"{child}\"/>\n{}\n</xacro:macro>\n</robot>",
            joint(mounting, "${parent}", &mounting.child),
            child = escape(&mounting.child),
            parent = escape(&mounting.parent),
        ))
    },
};

/// `static_transform_publisher`.
pub(crate) const ROS2: Format = Format {
    name: "ros2",
    aliases: &["tf", "static-transform"],
    title: "ROS 2",
    group: Group::Ros,
    convention: "static_transform_publisher of Humble and later: m; quaternion x, y, z, w by name. The parent must be the frame that the \
                 robot reports.",
    write: |mounting| {
        let t = mounting.tool_from_sensor.translation.vector;
        let [w, x, y, z] = wxyz(&mounting.tool_from_sensor.rotation).map(unit);
        Ok(format!(
            "ros2 run tf2_ros static_transform_publisher --x {} --y {} --z {} --qx {x} --qy {y} --qz {z} --qw {w} --frame-id {} \
             --child-frame-id {}",
            m(t.x),
            m(t.y),
            m(t.z),
            mounting.parent,
            mounting.child
        ))
    },
};

/// `NAME.calib` of easy_handeye2.
pub(crate) const EASY_HANDEYE2: Format = Format {
    name: "easy-handeye2",
    aliases: &["easy_handeye2"],
    title: "easy_handeye2",
    group: Group::Ros,
    convention: "A .calib file, eye in hand: the pose of the sensor (tracking_base_frame) in the robot's frame (robot_effector_frame): m; \
                 quaternion by name.",
    write: |mounting| {
        let t = mounting.tool_from_sensor.translation.vector;
        let [w, x, y, z] = wxyz(&mounting.tool_from_sensor.rotation).map(unit);
        Ok(format!(
            "parameters:\n  name: trueline\n  calibration_type: eye_in_hand\n  robot_base_frame: base_link\n  \
             robot_effector_frame: {}\n  tracking_base_frame: {}\n  tracking_marker_frame: seam\n  freehand_robot_movement: true\n  \
             move_group_namespace: /\n  move_group: manipulator\ntransform:\n  translation: {{x: {}, y: {}, z: {}}}\n  \
             rotation: {{x: {x}, y: {y}, z: {z}, w: {w}}}",
            mounting.parent,
            mounting.child,
            m(t.x),
            m(t.y),
            m(t.z)
        ))
    },
};

fn joint(mounting: &Mounting, parent: &str, child: &str) -> String {
    let [parent, child, name] = [parent, child, mounting.child.as_str()].map(escape);
    let t = mounting.tool_from_sensor.translation.vector;
    let [roll, pitch, yaw] = XYZ_FIXED.angles(&mounting.tool_from_sensor.rotation).map(unit);
    format!(
        "<joint name=\"{name}_joint\" type=\"fixed\">\n  <parent link=\"{parent}\"/>\n  <child link=\"{child}\"/>\n  \
         <origin xyz=\"{} {} {}\" rpy=\"{roll} {pitch} {yaw}\"/>\n</joint>",
        m(t.x),
        m(t.y),
        m(t.z)
    )
}
