//! The transform as programs and programming languages read it.

use crate::export::format::{Format, Group, Unsupported};
use crate::export::mounting::Mounting;
use crate::export::number::{deg, m, mm, unit, wxyz};
use nalgebra::Matrix4;
use serde_json::json;
use trueline_dataset::unit::MM_PER_M;
use trueline_geometry::euler::ZYX_INTRINSIC;
use trueline_model::Camera;

/// Kalibr's `camchain-imucam.yaml`.
pub(crate) const KALIBR: Format = Format {
    name: "kalibr",
    aliases: &[],
    title: "Kalibr",
    group: Group::Program,
    convention: "camchain with the robot's frame in the place of the IMU: T_cam_imu maps robot to sensor, so it is the inverse of the other \
                 forms (m, row by row); timeshift_cam_imu is minus the time offset (t_robot = t_image + shift, s).",
    write: kalibr,
};

/// OpenCV's FileStorage.
pub const OPENCV: Format = Format {
    name: "opencv",
    aliases: &[],
    title: "OpenCV",
    group: Group::Program,
    convention: "FileStorage: a 4 × 4 matrix, m, row by row; multiplied from the left to points of the sensor.",
    write: |mounting| {
        let offset = mounting.time_offset_s.map_or(String::new(), |s| format!("time_offset_s: {}\n", m(s)));
        let numbers: Vec<String> =
            rows(&mounting.matrix(1.0)).iter().map(|row| row.map(unit).join(", ")).collect();
        Ok(format!(
            "%YAML:1.0\n---\n{offset}T_{}_{}: !!opencv-matrix\n   rows: 4\n   cols: 4\n   dt: d\n   data: [ {} ]",
            mounting.parent,
            mounting.child,
            numbers.join(",\n       ")
        ))
    },
};

/// A script for MATLAB, without toolboxes.
pub const MATLAB: Format = Format {
    name: "matlab",
    aliases: &[],
    title: "MATLAB",
    group: Group::Program,
    convention: "A 4 × 4 matrix, mm, row by row; p = T*[x; y; z; 1] for points of the sensor. rigidtform3d takes it as it is, rigid3d its transpose.",
    write: |mounting| {
        let numbers: Vec<String> =
            rows(&mounting.matrix(MM_PER_M)).iter().map(|row| row.map(unit).join(" ")).collect();
        let matrix = format!("T_{}_{} = [{}];  % mm", mounting.parent, mounting.child, numbers.join("; "));
        Ok(matrix + &offset_line(mounting, "% ", ";"))
    },
};

/// NumPy.
pub(crate) const PYTHON: Format = Format {
    name: "python",
    aliases: &["numpy"],
    title: "Python",
    group: Group::Program,
    convention: "A 4 × 4 NumPy array, mm, row by row; T @ [x, y, z, 1] for points of the sensor.",
    write: |mounting| {
        let numbers: Vec<String> = rows(&mounting.matrix(MM_PER_M))
            .iter()
            .map(|row| format!("[{}]", row.map(unit).join(", ")))
            .collect();
        let matrix = format!(
            "import numpy as np\nT_{}_{} = np.array([{}])  # mm",
            mounting.parent,
            mounting.child,
            numbers.join(",\n    ")
        );
        Ok(matrix + &offset_line(mounting, "# ", ""))
    },
};

/// One row of a table.
pub const CSV: Format = Format {
    name: "csv",
    aliases: &[],
    title: "CSV",
    group: Group::Program,
    convention: "A header and one row: mm; quaternion w, x, y, z by name; the time offset in ms, empty where it is not known.",
    write: |mounting| {
        let t = mounting.tool_from_sensor.translation.vector * MM_PER_M;
        let q = wxyz(&mounting.tool_from_sensor.rotation).map(unit).join(",");
        let offset = mounting.time_offset_s.map_or(String::new(), |s| mm(s * 1e3));
        Ok(format!(
            "parent,child,x_mm,y_mm,z_mm,qw,qx,qy,qz,time_offset_ms\n{},{},{},{},{},{q},{offset}",
            mounting.parent,
            mounting.child,
            mm(t.x),
            mm(t.y),
            mm(t.z)
        ))
    },
};

/// Four rows of four numbers.
pub(crate) const MATRIX: Format = Format {
    name: "matrix",
    aliases: &["4x4"],
    title: "Matrix",
    group: Group::Program,
    convention: "4 × 4, mm, row by row, blanks between numbers; multiplied from the left to points of the sensor.",
    write: |mounting| {
        let numbers: Vec<String> =
            rows(&mounting.matrix(MM_PER_M)).iter().map(|row| row.map(unit).join(" ")).collect();
        Ok(numbers.join("\n"))
    },
};

/// JSON.
pub const JSON: Format = Format {
    name: "json",
    aliases: &[],
    title: "JSON",
    group: Group::Program,
    convention: "Pose of the sensor in the robot's frame: mm; quaternion w, x, y, z; 4 × 4 row by row in mm; the time offset in s.",
    write: |mounting| {
        let t = mounting.tool_from_sensor.translation.vector * MM_PER_M;
        let value = json!({
            "parent": mounting.parent,
            "child": mounting.child,
            "convention": "p_parent = R p_child + t; Hamilton quaternion; an image stamped t was exposed at t - time_offset_s",
            "translation_mm": [t.x, t.y, t.z],
            "rotation_wxyz": wxyz(&mounting.tool_from_sensor.rotation),
            "matrix_mm": rows(&mounting.matrix(MM_PER_M)),
            "time_offset_s": mounting.time_offset_s,
        });
        Ok(format!("{value:#}"))
    },
};

/// A quaternion to copy.
pub(crate) const QUATERNION: Format = Format {
    name: "quaternion",
    aliases: &[],
    title: "Quaternion",
    group: Group::Program,
    convention: "x, y, z in mm, then w, x, y, z (Hamilton).",
    write: |mounting| {
        let t = mounting.tool_from_sensor.translation.vector * MM_PER_M;
        let q = wxyz(&mounting.tool_from_sensor.rotation).map(unit).join(" ");
        Ok(format!("{} {} {}\n{q}", mm(t.x), mm(t.y), mm(t.z)))
    },
};

/// Three angles to copy.
pub(crate) const EULER: Format = Format {
    name: "euler",
    aliases: &[],
    title: "Euler angles",
    group: Group::Program,
    convention: "x, y, z in mm, then yaw, pitch, roll in degrees: about z, then about the new y, then about the new x.",
    write: |mounting| {
        let t = mounting.tool_from_sensor.translation.vector * MM_PER_M;
        let angles = ZYX_INTRINSIC.angles(&mounting.tool_from_sensor.rotation).map(deg).join(" ");
        Ok(format!("{} {} {}\n{angles}", mm(t.x), mm(t.y), mm(t.z)))
    },
};

fn rows(matrix: &Matrix4<f64>) -> [[f64; 4]; 4] {
    std::array::from_fn(|row| std::array::from_fn(|column| matrix[(row, column)]))
}

/// Use of the time offset, as a line of a program.
fn offset_line(mounting: &Mounting, comment: &str, end: &str) -> String {
    mounting.time_offset_s.map_or(String::new(), |offset_s| {
        format!("\ntime_offset_s = {}{end}  {comment}true exposure = stamp - time_offset_s", m(offset_s))
    })
}

fn kalibr(mounting: &Mounting) -> Result<String, Unsupported> {
    let offset_s = mounting.time_offset_s.ok_or(Unsupported::NoTimeOffset)?;
    let inverse = Mounting { tool_from_sensor: mounting.tool_from_sensor.inverse(), ..mounting.clone() };
    let matrix: Vec<String> =
        rows(&inverse.matrix(1.0)).iter().map(|row| format!("  - [{}]", row.map(unit).join(", "))).collect();
    let camera = match &mounting.camera {
        Some(camera) => kalibr_camera(camera)?,
        None => {
            "  # no camera was given: Kalibr needs camera_model, intrinsics, distortion and resolution here\n"
                .to_owned()
        }
    };
    Ok(format!("cam0:\n{camera}  T_cam_imu:\n{}\n  timeshift_cam_imu: {}", matrix.join("\n"), m(-offset_s)))
}

fn kalibr_camera(camera: &Camera) -> Result<String, Unsupported> {
    let [k1, k2, p1, p2, k3] = camera.distortion.to_opencv();
    if k3 != 0.0 {
        return Err(Unsupported::ThirdRadialCoefficient);
    }
    Ok(format!(
        "  camera_model: pinhole\n  intrinsics: [{}, {}, {}, {}]\n  distortion_model: radtan\n  distortion_coeffs: [{k1}, {k2}, {p1}, {p2}]\n  \
         resolution: [{}, {}]\n",
        camera.focal.x, camera.focal.y, camera.centre.x, camera.centre.y, camera.size[0], camera.size[1]
    ))
}
