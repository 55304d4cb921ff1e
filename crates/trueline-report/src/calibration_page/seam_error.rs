//! Effect of the calibration's uncertainty on a seam point, over the laser plane, at the working speed.

use super::Shown;
use crate::page::{Axis, Chart, Drawn, Heat};
use nalgebra::{Matrix3, SMatrix, Vector2, Vector3};
use trueline_dataset::unit::MM_PER_M;
use trueline_dataset::{Measured, Sensor};
use trueline_geometry::so3;
use trueline_method::problem::parameters::{LINES, ROTATION, TIME_OFFSET, TRANSLATION};
use trueline_model::LaserSheet;

/// Cells along each side.
const CELLS: usize = 15;
/// The field is drawn wider than the visited part by this share on each side …
const BEYOND: f64 = 0.25;
/// … and at least this wide and deep about its middle, m, as `diff` takes it: others weld at other stand-offs.
const LEAST_FIELD_M: [f64; 2] = [0.06, 0.04];

/// One standard deviation of a seam point in each part of the laser plane; `None` where something is not known.
pub(super) fn map(shown: &Shown<'_>) -> Option<Chart> {
    let c = shown.calibration;
    let torch = c.findings.checks.seam_point_error.as_ref()?;
    if !(0..LINES).all(|k| c.sigma(k).is_some()) {
        return None;
    }
    let (sheet, places) = visited(shown)?;
    let limits: [[f64; 2]; 2] = std::array::from_fn(|k| {
        let at = || places.iter().map(|place| place[k]);
        let (low, high) = (at().fold(f64::INFINITY, f64::min), at().fold(f64::NEG_INFINITY, f64::max));
        let half = ((0.5 + BEYOND) * (high - low)).max(0.5 * LEAST_FIELD_M[k]);
        [0.5 * (low + high) - half, 0.5 * (low + high) + half]
    });
    let cell: [f64; 2] = limits.map(|[low, high]| (high - low) / CELLS as f64);
    cell.iter().all(|side| *side > 0.0).then_some(())?;
    let covariance: SMatrix<f64, LINES, LINES> =
        c.best_fit_covariance().fixed_view::<LINES, LINES>(0, 0).into();
    let sigma_mm = |place: Vector2<f64>| {
        let lever = c.best_fit().tool_from_camera.rotation * sheet.point(&place);
        let mut effect = SMatrix::<f64, 4, LINES>::zeros();
        effect[(3, TIME_OFFSET)] = torch.speed_m_s;
        effect.fixed_view_mut::<3, 3>(0, ROTATION).copy_from(&(-so3::hat(&lever)));
        effect.fixed_view_mut::<3, 3>(0, TRANSLATION).copy_from(&Matrix3::identity());
        (effect * covariance * effect.transpose()).trace().sqrt() * MM_PER_M
    };
    let middle = |axis: usize, k: usize| limits[axis][0] + (k as f64 + 0.5) * cell[axis];
    let cells: Vec<[f64; 4]> = (0..CELLS * CELLS)
        .map(|k| {
            let place = Vector2::new(middle(0, k % CELLS), middle(1, k / CELLS));
            let seen =
                |at: &&Vector2<f64>| (0..2).all(|axis| (at[axis] - place[axis]).abs() <= 0.5 * cell[axis]);
            let features = places.iter().filter(seen).count() as f64;
            [place.x * MM_PER_M, place.y * MM_PER_M, sigma_mm(place), features]
        })
        .collect();
    let strongest = cells.iter().map(|cell| cell[2]).fold(0.0, f64::max);
    let [x, y] = limits.map(|[low, high]| [low * MM_PER_M, high * MM_PER_M]);
    Some(Chart {
        id: "seam-error",
        title: "Seam error from the calibration",
        explanation: explanation(torch.speed_m_s * MM_PER_M),
        alternative: format!(
            "Map of the laser plane: one standard deviation of a seam point, at most {strongest:.3} mm"
        ),
        wide: false,
        drawn: Drawn::Heat(Box::new(Heat {
            x: Axis::of("along the stripe (mm)").between(x[0], x[1]),
            y: Axis::of("range in the laser plane (mm)").between(y[0], y[1]),
            cell: cell.map(|side| side * MM_PER_M),
            cells,
            strongest,
            unit: "standard deviation (mm)".to_owned(),
            short: "mm".to_owned(),
            signed: false,
            equal: false,
        })),
    })
}

fn explanation(speed_mm_s: f64) -> String {
    format!(
        "One standard deviation in space at {speed_mm_s:.0} mm/s, over the laser plane: the scanned part and 25 % more on each side, at least 60 mm by \
         40 mm. Excludes the noise of a single point, the sensor's own calibration and the robot's kinematics."
    )
}

/// The laser plane, and where in it the seam was seen, m.
fn visited(shown: &Shown<'_>) -> Option<(LaserSheet, Vec<Vector2<f64>>)> {
    let recording = shown.source.recording;
    let sheet = match &recording.sensor {
        Sensor::CameraLaser { laser_plane_in_camera, .. } => LaserSheet::from_plane(*laser_plane_in_camera),
        Sensor::Profiler => LaserSheet::of_profiler(),
        Sensor::Points { laser_plane_in_camera } => LaserSheet::from_plane((*laser_plane_in_camera)?),
    };
    let place = |measured: &Measured| match (measured, &recording.sensor) {
        (Measured::Pixel(pixel), Sensor::CameraLaser { camera, .. }) => {
            let (ray, _) = camera.ray(&Vector2::from(*pixel)).ok()?;
            Some(sheet.coordinates(&sheet.intersect(&ray)?.0))
        }
        (Measured::Profile([x, z]), _) => Some(Vector2::new(*x, *z)),
        (Measured::Point(point), _) => Some(sheet.coordinates(&Vector3::from(*point))),
        (Measured::Pixel(_), _) => None,
    };
    let inliers = shown.features.iter().filter(|f| !f.is_outlier());
    let places: Vec<Vector2<f64>> =
        inliers.filter_map(|f| place(&recording.features[f.row as usize].measured)).collect();
    (places.len() > 1).then_some((sheet, places))
}
