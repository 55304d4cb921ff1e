//! `visualization_msgs/msg/Marker` of ROS 2, of Humble and newer: a point with its ±.

use crate::ros2_messages::{Header, Quaternion, Time, Vector3};
use serde::Serialize;

/// `SPHERE` and `ADD` of `visualization_msgs/msg/Marker`.
const SPHERE: i32 = 2;
const ADD: i32 = 0;
/// Smallest diameter that is visible, m.
const VISIBLE_M: f64 = 0.001;
/// Red, green, blue, and opacity.
const COLOUR: [f32; 4] = [1.0, 0.4, 0.0, 0.9];

#[derive(Clone, Copy, Debug, Serialize)]
struct Pose {
    position: Vector3,
    orientation: Quaternion,
}

/// `sensor_msgs/msg/CompressedImage`.
#[derive(Clone, Debug, Serialize)]
struct CompressedImage {
    header: Header,
    format: String,
    data: Vec<u8>,
}

/// `visualization_msgs/msg/MeshFile`.
#[derive(Clone, Debug, Default, Serialize)]
struct MeshFile {
    filename: String,
    data: Vec<u8>,
}

/// A marker; its names are those of ROS.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Marker {
    header: Header,
    ns: String,
    id: i32,
    r#type: i32,
    action: i32,
    pose: Pose,
    scale: Vector3,
    color: [f32; 4],
    lifetime: Time,
    frame_locked: bool,
    points: Vec<Vector3>,
    colors: Vec<[f32; 4]>,
    texture_resource: String,
    texture: CompressedImage,
    uv_coordinates: Vec<[f32; 2]>,
    text: String,
    mesh_resource: String,
    mesh_file: MeshFile,
    mesh_use_embedded_materials: bool,
}

impl Marker {
    /// A sphere at a point (m) as wide as twice its ± (m), and as wide as it must be to be visible; its text is the ±. It replaces
    /// the marker with the same number.
    pub(crate) fn point(header: Header, ns: &str, id: i32, [x, y, z]: [f64; 3], sigma_m: f64) -> Self {
        let wide_m = (2.0 * sigma_m).max(VISIBLE_M);
        let no_texture =
            CompressedImage { header: Header::default(), format: String::new(), data: Vec::new() };
        Self {
            header,
            ns: ns.to_owned(),
            id,
            r#type: SPHERE,
            action: ADD,
            pose: Pose {
                position: Vector3 { x, y, z },
                orientation: Quaternion { x: 0.0, y: 0.0, z: 0.0, w: 1.0 },
            },
            scale: Vector3 { x: wide_m, y: wide_m, z: wide_m },
            color: COLOUR,
            lifetime: Time::default(),
            frame_locked: false,
            points: Vec::new(),
            colors: Vec::new(),
            texture_resource: String::new(),
            texture: no_texture,
            uv_coordinates: Vec::new(),
            text: format!("± {:.3} mm", sigma_m * 1e3),
            mesh_resource: String::new(),
            mesh_file: MeshFile::default(),
            mesh_use_embedded_materials: false,
        }
    }
}
