//! Path, field of view, seam points and lines in base.

use super::Shown;
use super::plates::relief_m;
use crate::number::digits_for;
use crate::page::{Block, Chart, Colour, Columns, Drawn, Part};
use nalgebra::{Point3, Vector2, Vector3};
use trueline_dataset::unit::MM_PER_M;
use trueline_dataset::{RobotSample, Sensor};
use trueline_geometry::{Line, Pose};
use trueline_model::LaserSheet;

/// Poses of the path that are drawn.
const PATH: usize = 3000;
/// Places at which the field of view is drawn.
const VIEWS: usize = 7;
/// Seam points that are drawn.
const POINTS: usize = 5000;

/// Title and explanation, without plates and with them.
const WORDS: [[&str; 2]; 2] = [
    [
        "Path of the tool, field of view and seam in base",
        "Drag to rotate; Ctrl and wheel, or + and −, to zoom. All axes have the same scale: millimetres.",
    ],
    [
        "Path of the tool, field of view, seam and plates in base",
        "Drag to rotate; Ctrl and wheel, or + and −, to zoom. All axes have the same scale: millimetres. \
        Colours show the height of a plate above its best-fit plane, towards the sensor.",
    ],
];

pub(super) fn blocks(shown: &Shown<'_>, columns: &mut Columns) -> Vec<Block> {
    let c = shown.calibration;
    let robot = &shown.source.recording.robot;
    let recording = shown.source.recording;
    let carrier = |sample: &RobotSample| recording.lines_from_carrier(sample);
    let path = thinned(robot, PATH).map(|sample| carrier(sample).translation.vector);
    let mut parts = vec![Part {
        name: "tool path".to_owned(),
        xyz: column(columns, path),
        colour: Colour::A,
        line: true,
    }];
    if c.rotation().is_ok() {
        let corners = view_corners(shown);
        let views = thinned(robot, VIEWS)
            .flat_map(|sample| outline(&(carrier(sample) * c.file_tool_from_camera()), &corners));
        let xyz = column(columns, views);
        parts.push(Part {
            name: "field of view on the laser plane".to_owned(),
            xyz,
            colour: Colour::B,
            line: true,
        });
    }
    let stride = shown.features.len().div_ceil(POINTS).max(1);
    let seam = shown.features.iter().filter(|f| !f.is_outlier()).step_by(stride).map(|f| f.point_in_base);
    let seam: Vec<Vector3<f64>> = seam.collect();
    parts.push(Part {
        name: "seam points".to_owned(),
        xyz: column(columns, seam.iter().copied()),
        colour: Colour::C,
        line: false,
    });
    parts.extend(fitted(shown, &seam, columns));
    let plates = plates(shown, columns);
    let [title, explanation] = WORDS[usize::from(!plates.is_empty())];
    parts.extend(plates);
    if let (Some(first), Some(last)) = (robot.first(), robot.last()) {
        let length_m = 0.1
            * (robot.iter())
                .map(|s| {
                    (s.base_from_tool.translation.vector - first.base_from_tool.translation.vector).norm()
                })
                .fold(0.0, f64::max);
        for (name, sample) in [("tool at the start (x long, z short)", first), ("tool at the end", last)] {
            let xyz = column(columns, axes(&carrier(sample), length_m));
            parts.push(Part { name: name.to_owned(), xyz, colour: Colour::Bad, line: true });
        }
    }
    vec![Block::Chart(Chart {
        id: "scene",
        title,
        explanation: explanation.to_owned(),
        alternative:
            "The tool's path, the field of view on the laser plane at some places, the seam points, \
            the line and, of whole stripes, their support points on the plates in the robot's base frame, in \
            mm. Arrow keys turn the view."
                .to_owned(),
        wide: true,
        drawn: Drawn::Scene(parts),
    })]
}

/// The lines, or the curve, along their visible part.
fn fitted(shown: &Shown<'_>, seam: &[Vector3<f64>], columns: &mut Columns) -> Vec<Part> {
    let c = shown.calibration;
    let lines = &c.best_fit().lines;
    let mut part = |name: String, xyz: Vec<Vector3<f64>>| Part {
        name,
        xyz: column(columns, xyz),
        colour: Colour::D,
        line: true,
    };
    let mut parts: Vec<Part> = Vec::new();
    for (k, line) in lines.iter().enumerate() {
        let name = if lines.len() > 1 { format!("line {k}") } else { "line".to_owned() };
        parts.push(part(name, ends(line, seam)));
    }
    if let Some(curve) = &c.findings.curve {
        for seam in &curve.seams {
            let name =
                if curve.seams.len() > 1 { format!("curve {}", seam.label) } else { "curve".to_owned() };
            parts.push(part(name, curve.points_m[seam.points.clone()].to_vec()));
        }
    }
    parts
}

/// A part of a plate counts as high or low from this part of its greatest height on.
const OFF_PLANE: f64 = 1.0 / 3.0;

/// The support points of each plate's stripes, in three groups: high, low, and the rest.
fn plates(shown: &Shown<'_>, columns: &mut Columns) -> Vec<Part> {
    let estimate = shown.calibration.findings.stripes.as_ref().and_then(|stripes| stripes.estimate.as_ref());
    let planes = estimate.map_or(&[][..], |estimate| &estimate.planes);
    let mut parts = Vec::new();
    for plane in planes {
        let heights_m = relief_m(plane).unwrap_or_else(|| vec![0.0; plane.points.len()]);
        let limit_m = OFF_PLANE * heights_m.iter().fold(0.0, |most: f64, height| most.max(height.abs()));
        let limit_mm = format!("{:.1$} mm", limit_m * MM_PER_M, digits_for(limit_m * MM_PER_M));
        let number = plane.number;
        let kinds = [
            (format!("plate {number}"), Colour::Soft),
            (format!("plate {number}, {limit_mm} high and more"), Colour::E),
            (format!("plate {number}, {limit_mm} low and more"), Colour::F),
        ];
        let kind_of = |height_m: f64| match height_m {
            height_m if height_m > limit_m => 1,
            height_m if height_m < -limit_m => 2,
            _ => 0,
        };
        let stride = plane.points.len().div_ceil(POINTS).max(1);
        for (kind, (name, colour)) in kinds.into_iter().enumerate() {
            let points = plane.points.iter().zip(&heights_m).step_by(stride);
            let of_kind = points.filter(|(_, height_m)| kind_of(**height_m) == kind);
            let of_kind: Vec<Vector3<f64>> = of_kind.map(|(point, _)| point.in_base).collect();
            if !of_kind.is_empty() {
                parts.push(Part { name, xyz: column(columns, of_kind), colour, line: false });
            }
        }
    }
    parts
}

fn column(columns: &mut Columns, points: impl IntoIterator<Item = Vector3<f64>>) -> crate::page::Column {
    columns.add(points.into_iter().flat_map(|p| [p.x, p.y, p.z]).map(|m| m * MM_PER_M))
}

fn thinned(robot: &[RobotSample], most: usize) -> impl Iterator<Item = &RobotSample> {
    robot.iter().step_by(robot.len().div_ceil(most).max(1))
}

/// Corners of the field of view on the sheet in the camera frame, m: the picture's own, or those of the visited part.
fn view_corners(shown: &Shown<'_>) -> Vec<Vector3<f64>> {
    if let Sensor::CameraLaser { camera, laser_plane_in_camera } = &shown.source.recording.sensor {
        let sheet = LaserSheet::from_plane(*laser_plane_in_camera);
        let [right, low] = camera.size.map(|n| f64::from(n) - 1.0);
        let corners = [[0.0, 0.0], [right, 0.0], [right, low], [0.0, low]].map(|[u, v]| {
            let (ray, _) = camera.ray(&Vector2::new(u, v)).ok()?;
            Some(sheet.intersect(&ray)?.0)
        });
        if let Some(corners) = corners.into_iter().collect::<Option<Vec<_>>>() {
            return corners;
        }
    }
    seen_corners(shown)
}

/// Corners of the box about all measured points in the camera's x and z.
fn seen_corners(shown: &Shown<'_>) -> Vec<Vector3<f64>> {
    let points: Vec<Vector3<f64>> = (shown.source.recording.features.iter())
        .filter_map(|f| match f.measured {
            trueline_dataset::Measured::Profile([x, z]) => Some(Vector3::new(x, 0.0, z)),
            trueline_dataset::Measured::Point(point) => Some(point.into()),
            trueline_dataset::Measured::Pixel(_) => None,
        })
        .collect();
    let Some(first) = points.first() else { return Vec::new() };
    let (low, high) = points.iter().fold((*first, *first), |(low, high), p| (low.inf(p), high.sup(p)));
    let y = 0.5 * (low.y + high.y);
    [(low.x, low.z), (high.x, low.z), (high.x, high.z), (low.x, high.z)]
        .map(|(x, z)| Vector3::new(x, y, z))
        .to_vec()
}

/// The outline of the field of view; a gap ends it.
fn outline(base_from_camera: &Pose, corners: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
    let in_base = |p: &Vector3<f64>| (base_from_camera * Point3::from(*p)).coords;
    let Some(first) = corners.first() else { return Vec::new() };
    let mut points: Vec<Vector3<f64>> = corners.iter().chain([first]).map(in_base).collect();
    points.push(Vector3::repeat(f64::NAN));
    points
}

/// The axes of the tool at a pose, x longest and z shortest; a gap ends each.
fn axes(base_from_tool: &Pose, length_m: f64) -> Vec<Vector3<f64>> {
    let origin = base_from_tool.translation.vector;
    let axis = |(direction, part): (Vector3<f64>, f64)| {
        [origin, origin + base_from_tool.rotation * direction * (length_m * part), Vector3::repeat(f64::NAN)]
    };
    [(Vector3::x(), 1.0), (Vector3::y(), 0.7), (Vector3::z(), 0.4)].into_iter().flat_map(axis).collect()
}

/// The stretch of a line that the points lie on.
fn ends(line: &Line, points: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
    let along = points.iter().map(|p| line.direction().dot(&(p - line.anchor())));
    let (low, high) =
        along.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), a| (low.min(a), high.max(a)));
    if low > high {
        return Vec::new();
    }
    [low, high].map(|a| line.anchor() + line.direction() * a).to_vec()
}
