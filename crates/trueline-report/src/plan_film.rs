//! A planned scan as a film in space: the tool, the sensor's view and the point of the seam that it sees, over the whole path.

use crate::page::{Block, Chart, Colour, Column, Columns, Drawn, Part};
use nalgebra::{Point3, Vector3};
use trueline_dataset::unit::MM_PER_M;
use trueline_geometry::Pose;
use trueline_plan::{Cell, JointPath, MountedArm, Plan, View};

/// Places of the paths that are drawn.
const PLACES: usize = 1500;
/// Pictures a second, and how many there are at least and at most.
const PICTURES_HZ: f64 = 20.0;
/// See [`PICTURES_HZ`].
const PICTURES: [f64; 2] = [100.0, 800.0];
/// Length of the tool's axes, m.
const AXIS_M: f64 = 0.06;

/// The film.
pub(crate) fn block(cell: &Cell, plan: &Plan, columns: &mut Columns) -> Block {
    let duration_s = plan.motion.design().duration_s;
    let pictures = (duration_s * PICTURES_HZ).clamp(PICTURES[0], PICTURES[1]) as usize;
    let times = || (0..=pictures).map(move |k| duration_s * k as f64 / pictures as f64);
    let poses: Vec<(f64, Pose)> = times().map(|t| (t, plan.motion.base_from_tool(t))).collect();
    let mut filmed = |name: &str, colour, line, points: &dyn Fn(f64, &Pose) -> Vec<Vector3<f64>>| {
        let all = poses.iter().flat_map(|(t, pose)| points(*t, pose)).collect();
        Part { name: name.to_owned(), xyz: column(columns, all), colour, line }
    };
    let moving = vec![
        filmed("tool and camera", Colour::A, true, &|_, pose| tool(cell, pose)),
        filmed("view", Colour::B, true, &|_, pose| fan(cell, &(pose * cell.tool_from_camera))),
        filmed("seam point", Colour::Bad, false, &|t, _| vec![plan.motion.seam_point(t)]),
    ];
    let arm = cell.arm.as_ref().zip(plan.joints.as_ref()).map(|(mounted, joints)| {
        filmed(&mounted.name, Colour::Soft, true, &|t, _| bones(mounted, joints, t))
    });
    let times = columns.add(times());
    let parts = paths(cell, plan, columns);
    Block::Chart(Chart {
        id: "scene",
        title: "The scan as a film: tool, view and seam",
        explanation: "Press Play or move the slider. The tool's x axis is drawn long, its z axis short. Drag to rotate; Ctrl and wheel, or + and −, to zoom. All axes have the same scale: millimetres in base.".to_owned(),
        alternative: "The tool's planned path, the tool, the field of view on the laser plane and the seam over time, in the robot's base frame in mm".to_owned(),
        wide: true,
        drawn: Drawn::Film { parts, moving, arm, times },
    })
}

/// From the arm's foot over its joints to the tool, at a time, s.
fn bones(mounted: &MountedArm, joints: &JointPath, time_s: f64) -> Vec<Vector3<f64>> {
    let k = ((time_s / joints.period_s).round() as usize).min(joints.angles.len().saturating_sub(1));
    let Some(angles) = joints.angles.get(k) else { return Vec::new() };
    let state = mounted.arm.state(angles);
    let tool = state.base_from_flange * mounted.flange_from_tool;
    let bones = state.base_from_joint.into_iter().chain([state.base_from_flange, tool]);
    let foot = mounted.base_from_arm.translation.vector;
    std::iter::once(foot).chain(bones.map(|bone| (mounted.base_from_arm * bone).translation.vector)).collect()
}

fn column(columns: &mut Columns, points: Vec<Vector3<f64>>) -> Column {
    columns.add(points.iter().flat_map(|p| [p.x, p.y, p.z]).map(|m| m * MM_PER_M).collect::<Vec<f64>>())
}

/// The fixed parts: the paths of tool and camera, the seam, the workspace.
fn paths(cell: &Cell, plan: &Plan, columns: &mut Columns) -> Vec<Part> {
    let duration_s = plan.motion.design().duration_s;
    let poses = || (0..=PLACES).map(|k| plan.motion.base_from_tool(duration_s * k as f64 / PLACES as f64));
    let mut part = |name: &str, points: Vec<Vector3<f64>>, colour| Part {
        name: name.to_owned(),
        xyz: column(columns, points),
        colour,
        line: true,
    };
    let mut parts = vec![
        part("tool path", poses().map(|pose| pose.translation.vector).collect(), Colour::A),
        part(
            "camera path",
            poses().map(|pose| (pose * cell.tool_from_camera).translation.vector).collect(),
            Colour::D,
        ),
        part("seam", seam(cell), Colour::C),
    ];
    if let Some(corners) = &cell.limits.workspace_m {
        parts.push(part("workspace of the tool", edges(corners), Colour::Soft));
    }
    parts
}

/// The seam.
fn seam(cell: &Cell) -> Vec<Vector3<f64>> {
    cell.course.as_ref().map_or_else(|| vec![cell.seam.from_m, cell.seam.to_m], |course| course.points())
}

/// The tool's axes, and a line to the camera; gaps between them.
fn tool(cell: &Cell, base_from_tool: &Pose) -> Vec<Vector3<f64>> {
    let origin = base_from_tool.translation.vector;
    let gap = Vector3::repeat(f64::NAN);
    let axis = |(direction, part): (Vector3<f64>, f64)| {
        [origin, origin + base_from_tool.rotation * direction * (AXIS_M * part), gap]
    };
    let camera = (base_from_tool * cell.tool_from_camera).translation.vector;
    let axes = [(Vector3::x(), 1.0), (Vector3::y(), 0.7), (Vector3::z(), 0.4)];
    axes.into_iter().flat_map(axis).chain([origin, camera]).collect()
}

/// Outline of the field of view on the laser plane, and lines from the camera to its near corners.
fn fan(cell: &Cell, base_from_camera: &Pose) -> Vec<Vector3<f64>> {
    let [near, far] = cell.limits.stand_off_m;
    let Some(half) = half_width(cell, near).zip(half_width(cell, far)) else { return Vec::new() };
    let at = |stand_off_m: f64, stripe_m: f64| {
        let station = trueline_plan::sensor_pose::Station {
            seam_point: Vector3::zeros(),
            stripe_m,
            stand_off_m,
            tilt_rad: [0.0; 3],
        };
        (base_from_camera * Point3::from(cell.sensor_pose.point_in_camera(&station))).coords
    };
    let corners = [at(near, -half.0), at(near, half.0), at(far, half.1), at(far, -half.1)];
    let camera = base_from_camera.translation.vector;
    corners.into_iter().chain([corners[0], camera, corners[1]]).collect()
}

/// Half the width of the view at a stand-off, m.
fn half_width(cell: &Cell, stand_off_m: f64) -> Option<f64> {
    match &cell.view {
        View::Camera { camera, .. } => Some(0.5 * f64::from(camera.size[0]) / camera.focal.x * stand_off_m),
        View::Window { half_width_m, .. } => Some(*half_width_m),
    }
}

/// Edges of a box; gaps between them.
fn edges(corners: &[Vector3<f64>; 2]) -> Vec<Vector3<f64>> {
    let [low, high] = corners;
    let pick = |bits: usize| Vector3::from_fn(|k, _| if bits >> k & 1 == 1 { high[k] } else { low[k] });
    let pairs = (0..8_usize).flat_map(|from| (0..3).map(move |axis| (from, from | 1 << axis)));
    let edges = pairs.filter(|(from, to)| from != to);
    edges.flat_map(|(from, to)| [pick(from), pick(to), Vector3::repeat(f64::NAN)]).collect()
}
