//! The sensor's view: the line is intersected with the sheet, and the point projected forward.

use crate::scenario::SensorModel;
use nalgebra::{Matrix3, Point3, Rotation3, Vector3};
use trueline_dataset::Measured;
use trueline_geometry::{Line, Polyline, Pose};

/// The sheet's own axes in the camera frame and the point that the scan aims at.
pub struct SheetAxes {
    /// Columns: along the stripe, normal, range.
    pub camera_from_sheet: Rotation3<f64>,
    /// Middle of the field of view, on the sheet, m in the camera frame.
    pub middle: Vector3<f64>,
    /// Unit normal n in the camera frame.
    pub normal: Vector3<f64>,
    /// Offset d of the sheet, m.
    pub offset: f64,
}

impl SheetAxes {
    /// The axes of a sensor.
    #[must_use]
    pub fn of(sensor: &SensorModel) -> Self {
        let (normal, offset, middle) = match sensor {
            SensorModel::CameraLaser { laser_plane_in_camera: plane, .. }
            | SensorModel::Points { laser_plane_in_camera: plane, .. } => {
                let n = plane.normal().into_inner();
                (n, plane.offset(), Vector3::new(0.0, 0.0, plane.offset() / n.z))
            }
            SensorModel::Profiler { range_m, .. } => {
                (Vector3::y(), 0.0, Vector3::new(0.0, 0.0, 0.5 * (range_m[0] + range_m[1])))
            }
        };
        // Away from the camera along the sheet, whichever side the normal is on; the stripe runs across.
        let range = (Vector3::z() - normal * normal.z).normalize();
        let across = normal * normal.y.signum();
        let axes = Matrix3::from_columns(&[across.cross(&range), across, range]);
        Self { camera_from_sheet: Rotation3::from_matrix_unchecked(axes), middle, normal, offset }
    }

    /// The point of the sheet at (along the stripe, range) from the middle, m.
    #[must_use]
    pub fn point(&self, stripe_m: f64, range_m: f64) -> Vector3<f64> {
        self.middle + self.camera_from_sheet * Vector3::new(stripe_m, 0.0, range_m)
    }
}

/// The true point of a line on the sheet in the camera frame (m), or `None` if they do not meet.
#[must_use]
pub(crate) fn point_on_sheet(
    sheet: &SheetAxes,
    base_from_camera: &Pose,
    line: &Line,
) -> Option<Vector3<f64>> {
    let camera_from_base = base_from_camera.inverse();
    let start = (camera_from_base * Point3::from(*line.anchor())).coords;
    let direction = camera_from_base * line.direction();
    let toward = sheet.normal.dot(&direction);
    (toward.abs() > 1e-6).then(|| start + direction * ((sheet.offset - sheet.normal.dot(&start)) / toward))
}

/// The same for a seam that is displaced from the line by `beside` (in base, m) at each place along it, m.
#[must_use]
pub(crate) fn point_on_sheet_beside(
    sheet: &SheetAxes,
    base_from_camera: &Pose,
    line: &Line,
    beside: &dyn Fn(f64) -> Vector3<f64>,
) -> Option<Vector3<f64>> {
    let camera_from_base = base_from_camera.inverse();
    let start = (camera_from_base * Point3::from(*line.anchor())).coords;
    let direction = camera_from_base * line.direction();
    let toward = sheet.normal.dot(&direction);
    if toward.abs() < 1e-6 {
        return None;
    }
    let mut along = (sheet.offset - sheet.normal.dot(&start)) / toward;
    // The seam's slope is far below that of the sheet: each round gains their ratio.
    for _ in 0..BESIDE_ROUNDS {
        let shift = camera_from_base.rotation * beside(along);
        along = (sheet.offset - sheet.normal.dot(&(start + shift))) / toward;
    }
    let shift = camera_from_base.rotation * beside(along);
    let point = start + shift + direction * along;
    // The residual of the last round is removed along the seam.
    Some(point + direction * ((sheet.offset - sheet.normal.dot(&point)) / toward))
}

/// Rounds of the search for a displaced seam.
const BESIDE_ROUNDS: usize = 6;

/// The sensor's report of a curve in base without noise: of its visible crossings with the sheet, the one nearest to the middle of the
/// view. `None` without a visible crossing.
#[must_use]
pub(crate) fn measured_of_curve(
    sensor: &SensorModel,
    sheet: &SheetAxes,
    base_from_camera: &Pose,
    curve: &Polyline,
) -> Option<Measured> {
    let camera_from_base = base_from_camera.inverse();
    let in_camera = |point: &Vector3<f64>| (camera_from_base * Point3::from(*point)).coords;
    let points: Vec<Vector3<f64>> = curve.points().iter().map(in_camera).collect();
    let off = |point: &Vector3<f64>| sheet.normal.dot(point) - sheet.offset;
    let crossings = points.windows(2).filter_map(|pair| {
        let (from, to) = (off(&pair[0]), off(&pair[1]));
        (from * to <= 0.0 && from != to).then(|| pair[0].lerp(&pair[1], from / (from - to)))
    });
    let visible =
        crossings.filter_map(|point| Some(((point - sheet.middle).norm(), measure(sensor, &point)?)));
    visible.min_by(|one, other| one.0.total_cmp(&other.0)).map(|(_, measured)| measured)
}

/// The sensor's report of a point without noise, or `None` if it is out of view.
#[must_use]
pub fn measure(sensor: &SensorModel, point_in_camera: &Vector3<f64>) -> Option<Measured> {
    match sensor {
        SensorModel::CameraLaser { camera, .. } => {
            camera.project(point_in_camera).map(|pixel| Measured::Pixel(pixel.into()))
        }
        SensorModel::Points { camera, .. } => {
            camera.project(point_in_camera).map(|_| Measured::Point((*point_in_camera).into()))
        }
        SensorModel::Profiler { half_width_m, range_m } => {
            let (x, z) = (point_in_camera.x, point_in_camera.z);
            let seen = x.abs() <= *half_width_m && z >= range_m[0] && z <= range_m[1];
            seen.then_some(Measured::Profile([x, z]))
        }
    }
}
