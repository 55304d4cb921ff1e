//! Places in a cell: arm, sensor, mounting, seam, and the path over it.

use super::course::{Course, Swing};
use super::joint_path::JointPath;
use super::mounting;
use crate::capture::SheetAxes;
use crate::noise::Noise;
use crate::scenario::SensorModel;
use nalgebra::{Rotation3, UnitQuaternion, UnitVector3, Vector2, Vector3};
use std::f64::consts::{PI, TAU};
use trueline_geometry::arm::inverse::{angles_for, configurations};
use trueline_geometry::arm::named::{self, NamedArm};
use trueline_geometry::arm::six_axes::Angles;
use trueline_geometry::{Line, Plane, Pose, se3};
use trueline_model::{BrownConrady, Camera};

/// Stream of random numbers of the layout; each attempt has its own.
const STREAM: u64 = 3700;
/// Arms, with their reach, m.
const ARMS: [(&str, f64); 3] = [("ur10e", 1.3), ("abb-irb2600-12-1.65", 1.65), ("kuka-kr10-r1420", 1.42)];
/// Time of known path before and after the scan, s: the log's own, and the memory of a lag.
pub(crate) const BEYOND_S: [f64; 2] = [2.6, 1.6];
/// The wrist of a comfortable arm is this far from its singularity, rad.
const COMFORTABLE_RAD: f64 = 0.4;
/// Step of the way from the middle of the path to its beginning, s.
const BACK_STEP_S: f64 = 0.04;

/// A cell without errors.
pub(crate) struct Layout {
    pub(crate) arm: &'static NamedArm,
    pub(crate) sensor: SensorModel,
    pub(crate) tool_from_camera: Pose,
    pub(crate) line: Line,
    /// Axes of the sheet in base (stripe, along the seam, range) without tilt.
    base_from_square_sheet: Rotation3<f64>,
    sheet: SheetAxes,
    pub(crate) course: Course,
}

impl Layout {
    /// A layout, and the joints along its path; `None` if the arm cannot follow it.
    pub(crate) fn drawn(seed: u64, attempt: u64) -> Option<(Self, JointPath)> {
        let mut noise = Noise::new(seed, STREAM + attempt);
        let (sensor, half_field_m) = drawn_sensor(&mut noise)?;
        let sheet = SheetAxes::of(&sensor);
        let tool_from_camera = mounting::drawn(&mut noise, &sheet);
        let (arm_name, reach_m) = ARMS[(noise.uniform(0.0, ARMS.len() as f64) as usize).min(ARMS.len() - 1)];
        let arm = named::find(arm_name)?;
        let base_from_tool = drawn_pose(&mut noise, reach_m);
        let course = Course::drawn(&mut noise, half_field_m);
        let base_from_camera = base_from_tool * tool_from_camera;
        let square = base_from_camera.rotation.to_rotation_matrix() * sheet.camera_from_sheet;
        let seam = base_from_camera * nalgebra::Point3::from(sheet.middle);
        let line = Line::new(seam.coords, &UnitVector3::new_normalize(square * Vector3::y()));
        let layout =
            Self { arm, sensor, tool_from_camera, line, base_from_square_sheet: square, sheet, course };
        let joints = layout.joints()?;
        Some((layout, joints))
    }

    /// `base_from_tool` with the sensor so far beside the seam.
    pub(crate) fn pose(&self, swing: &Swing) -> Pose {
        let [work, travel, spin] = swing.tilt_rad;
        let tilt = Rotation3::from_axis_angle(&Vector3::y_axis(), work)
            * Rotation3::from_axis_angle(&Vector3::x_axis(), travel)
            * Rotation3::from_axis_angle(&Vector3::z_axis(), spin);
        let base_from_camera = self.base_from_square_sheet * tilt * self.sheet.camera_from_sheet.inverse();
        let seam = self.line.anchor() + self.line.direction() * (self.course.length_m * swing.progress);
        let [stripe_m, range_m] = swing.in_sheet_m;
        let origin = seam - base_from_camera * self.sheet.point(stripe_m, range_m);
        let rotation = UnitQuaternion::from_rotation_matrix(&base_from_camera);
        se3::from_parts(rotation, origin) * self.tool_from_camera.inverse()
    }

    /// Unit vector in base from the seam towards the sensor, square to the seam.
    pub(crate) fn height(&self) -> Vector3<f64> {
        self.base_from_square_sheet * -Vector3::z()
    }

    fn joints(&self) -> Option<JointPath> {
        let arm = self.arm.arm();
        let path = |time_s: f64| self.pose(&self.course.at(time_s));
        let middle_s = 0.5 * self.course.duration_s;
        let worst = |angles: &Angles| arm.used_of_range(angles).into_iter().fold(0.0, f64::max);
        let is_comfortable = |angles: &Angles| arm.state(angles).wrist_rad() > COMFORTABLE_RAD;
        let found = configurations(&arm, &path(middle_s)).into_iter().filter(is_comfortable);
        let mut angles = found.min_by(|a, b| worst(a).total_cmp(&worst(b)))?;
        let start_s = -BEYOND_S[0];
        let steps = ((middle_s - start_s) / BACK_STEP_S).ceil();
        for k in 1..=steps as usize {
            let time_s = middle_s + (start_s - middle_s) * (k as f64 / steps);
            angles = angles_for(&arm, &path(time_s), &angles)?;
        }
        JointPath::along(&arm, &path, [start_s, self.course.duration_s + BEYOND_S[1]], &angles)
    }
}

/// A flange in front of the arm that looks down, leaning a little.
fn drawn_pose(noise: &mut Noise, reach_m: f64) -> Pose {
    let place = Vector3::new(
        reach_m * noise.uniform(0.5, 0.72),
        reach_m * noise.uniform(-0.2, 0.2),
        noise.uniform(0.35, 0.65),
    );
    let down = Rotation3::from_axis_angle(&Vector3::x_axis(), PI);
    let lean_about = noise.uniform(0.0, TAU);
    let lean = Vector3::new(lean_about.cos(), lean_about.sin(), 0.0) * noise.uniform(0.1, 0.5);
    let yaw = Rotation3::from_axis_angle(&Vector3::z_axis(), noise.uniform(-PI, PI));
    se3::from_parts(
        UnitQuaternion::from_rotation_matrix(&(Rotation3::from_scaled_axis(lean) * down * yaw)),
        place,
    )
}

/// A sensor, and half of the width and depth of the field of view that a scan uses, m.
fn drawn_sensor(noise: &mut Noise) -> Option<(SensorModel, [f64; 2])> {
    let kind = noise.uniform(0.0, 1.0);
    let stand_off_m = noise.uniform(0.11, 0.19);
    if kind < 0.45 {
        let (half_width_m, half_range_m) = (noise.uniform(0.022, 0.040), noise.uniform(0.030, 0.060));
        let range_m = [stand_off_m - half_range_m, stand_off_m + half_range_m];
        return Some((SensorModel::Profiler { half_width_m, range_m }, [half_width_m, 0.6 * half_range_m]));
    }
    let half_field_m = noise.uniform(0.022, 0.034);
    let size = if noise.happens(0.5) { [1600, 1200] } else { [2448, 2048] };
    let focal = (0.5 * f64::from(size[0]) * stand_off_m / half_field_m).round();
    let centre = Vector2::from(size).map(|size: u32| 0.5 * f64::from(size) + noise.normal(8.0).round());
    let distortion =
        BrownConrady { k1: noise.normal(0.08), k2: noise.normal(0.06), p1: 0.0, p2: 0.0, k3: 0.0 };
    let camera = Camera { size, focal: Vector2::new(focal, focal), centre, distortion };
    let triangulation = noise.uniform(48.0, 60.0).to_radians();
    let normal = Vector3::new(noise.normal(0.006), -triangulation.sin(), triangulation.cos());
    let plane = Plane::new(normal, stand_off_m * normal.normalize().z)?;
    let sensor = match kind < 0.85 {
        true => SensorModel::CameraLaser { camera, laser_plane_in_camera: plane },
        false => SensorModel::Points { camera, laser_plane_in_camera: plane },
    };
    // Seen under the angle of triangulation, the height of the image is a longer range.
    let half_height_m = half_field_m * f64::from(size[1]) / f64::from(size[0]);
    Some((sensor, [half_field_m, 0.9 * half_height_m]))
}
