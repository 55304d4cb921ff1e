//! The messages of ROS 2 that the node publishes, field by field as their packages define them.

use serde::Serialize;
use trueline_geometry::Pose;

/// `builtin_interfaces/msg/Time`.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub(crate) struct Time {
    sec: i32,
    nanosec: u32,
}

impl Time {
    /// From nanoseconds since 1970; ROS represents the years 1901 to 2038.
    pub(crate) fn of(ns: i64) -> Self {
        let sec = ns.div_euclid(1_000_000_000).clamp(i64::from(i32::MIN), i64::from(i32::MAX));
        Self { sec: sec as i32, nanosec: ns.rem_euclid(1_000_000_000) as u32 }
    }
}

/// `std_msgs/msg/Header`.
#[derive(Clone, Debug, Default, Serialize)]
pub(crate) struct Header {
    pub stamp: Time,
    pub frame_id: String,
}

/// `geometry_msgs/msg/Vector3`, and `Point`, which has the same fields.
#[derive(Clone, Copy, Debug, Serialize)]
pub(crate) struct Vector3 {
    pub x: f64,
    pub y: f64,
    pub z: f64,
}

/// `geometry_msgs/msg/Quaternion`.
#[derive(Clone, Copy, Debug, Serialize)]
pub(crate) struct Quaternion {
    pub x: f64,
    pub y: f64,
    pub z: f64,
    pub w: f64,
}

#[derive(Clone, Copy, Debug, Serialize)]
struct Transform {
    translation: Vector3,
    rotation: Quaternion,
}

#[derive(Clone, Debug, Serialize)]
struct TransformStamped {
    header: Header,
    child_frame_id: String,
    transform: Transform,
}

/// `tf2_msgs/msg/TFMessage`.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct TfMessage {
    transforms: Vec<TransformStamped>,
}

impl TfMessage {
    /// Of one transform, `parent_from_child`.
    pub(crate) fn of(header: Header, child: &str, parent_from_child: &Pose) -> Self {
        let (p, q) = (parent_from_child.translation.vector, parent_from_child.rotation.quaternion());
        let transform = Transform {
            translation: Vector3 { x: p.x, y: p.y, z: p.z },
            rotation: Quaternion { x: q.i, y: q.j, z: q.k, w: q.w },
        };
        Self { transforms: vec![TransformStamped { header, child_frame_id: child.to_owned(), transform }] }
    }
}

#[derive(Clone, Debug, Serialize)]
struct PointField {
    name: String,
    offset: u32,
    datatype: u8,
    count: u32,
}

/// `sensor_msgs/msg/PointCloud2`.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct PointCloud2 {
    header: Header,
    height: u32,
    width: u32,
    fields: Vec<PointField>,
    is_bigendian: bool,
    point_step: u32,
    row_step: u32,
    data: Vec<u8>,
    is_dense: bool,
}

/// FLOAT32 of `sensor_msgs/msg/PointField`.
const FLOAT32: u8 = 7;

impl PointCloud2 {
    /// Of points, a number for each field, all at the time of the header.
    pub(crate) fn of<const N: usize>(
        header: Header,
        names: [&str; N],
        points: impl Iterator<Item = [f64; N]>,
    ) -> Self {
        let fields = names.into_iter().zip(0_u32..).map(|(name, place)| PointField {
            name: name.to_owned(),
            offset: 4 * place,
            datatype: FLOAT32,
            count: 1,
        });
        let data: Vec<u8> = points.flatten().flat_map(|number| (number as f32).to_le_bytes()).collect();
        let (point_step, row_step) = (4 * N as u32, data.len() as u32);
        Self {
            header,
            height: 1,
            width: row_step / point_step,
            fields: fields.collect(),
            is_bigendian: false,
            point_step,
            row_step,
            data,
            is_dense: true,
        }
    }
}

#[derive(Clone, Debug, Serialize)]
struct KeyValue {
    key: String,
    value: String,
}

/// Severity of a diagnosis, by the numbers of `diagnostic_msgs/msg/DiagnosticStatus`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Level {
    Ok = 0,
    Warn = 1,
    Error = 2,
    Stale = 3,
}

/// `diagnostic_msgs/msg/DiagnosticStatus`.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct DiagnosticStatus {
    level: u8,
    name: String,
    message: String,
    hardware_id: String,
    values: Vec<KeyValue>,
}

impl DiagnosticStatus {
    /// A diagnosis with its numbers.
    pub(crate) fn of(name: String, level: Level, message: String, values: &[(&str, String)]) -> Self {
        let value = |(key, value): &(&str, String)| KeyValue { key: (*key).to_owned(), value: value.clone() };
        let values = values.iter().map(value).collect();
        Self { level: level as u8, name, message, hardware_id: String::new(), values }
    }
}

/// `diagnostic_msgs/msg/DiagnosticArray`.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct DiagnosticArray {
    pub header: Header,
    pub status: Vec<DiagnosticStatus>,
}
