//! The stripes on both plates of a joint as a planned scan will show them, to `calibrate --use stripe`.
//!
//! The plates are two of the cell's that hold the seam; each reaches from it to the free side of the other. A stripe is known by two points
//! whose errors are independent: of N columns with errors σ that are alike over 1.75 columns, σ √(2 · 1.75 / N) at ± ℓ/√3 of its middle.

use crate::cell::Cell;
use crate::sights::Sight;
use crate::surroundings::Plate;
use nalgebra::{Vector2, Vector3};
use trueline_dataset::{Measured, PlateStripe, Sensor};

/// A plate's stripe is used from here to there from the seam, m: at the corner light is reflected, and plates are no wider than they are.
const FROM_SEAM_M: [f64; 2] = [2e-3, 25e-3];
/// A plate that is further off the ends of the seam does not hold it, m: the seam may have been found elsewhere since it was written down.
const OFF_SEAM_M: f64 = 20e-3;
/// Plates whose normals are nearer to each other meet in no line, as a cosine.
const PARALLEL: f64 = 0.996;
/// Columns over which speckle is alike.
const ALIKE: f64 = 1.75;
/// Distance of a profiler's points, m.
const PROFILE_STEP_M: f64 = 1e-4;

/// The two plates that meet in the seam; `None` if the cell's file does not name them.
#[must_use]
pub fn plates(cell: &Cell) -> Option<[Plate; 2]> {
    let holds = |plate: &&Plate| {
        let off = |end: &Vector3<f64>| plate.normal.dot(&(end - plate.point_m)).abs();
        off(&cell.seam.from_m) < OFF_SEAM_M && off(&cell.seam.to_m) < OFF_SEAM_M
    };
    let held: Vec<Plate> = cell.surroundings.plates.iter().filter(holds).copied().collect();
    let [one, other] = held.try_into().ok()?;
    (one.normal.dot(&other.normal).abs() < PARALLEL).then_some([one, other])
}

/// From where to where the stripes on both plates are used, in the camera, m; the plates' normals are in the camera as well. `None` for a
/// plate along the sheet.
pub(crate) fn ends(
    cell: &Cell,
    normals: &[Vector3<f64>; 2],
    corner: &Vector3<f64>,
) -> [Option<[Vector3<f64>; 2]>; 2] {
    let sheet = cell.sheet.plane().normal().into_inner();
    [0, 1].map(|plate| {
        let along = outward(&sheet, &normals[plate], &normals[1 - plate])?;
        Some(FROM_SEAM_M.map(|m| corner + along * m))
    })
}

/// The direction in which a plate's stripe leaves the corner: to the free side of the other plate.
pub(crate) fn outward(
    sheet: &Vector3<f64>,
    normal: &Vector3<f64>,
    other: &Vector3<f64>,
) -> Option<Vector3<f64>> {
    let along = sheet.cross(normal).try_normalize(1e-3)?;
    Some(along * along.dot(other).signum())
}

/// Whether all of a stripe is in view: of one that is cut off no use is made.
pub(crate) fn is_in_view(cell: &Cell, ends: &[Vector3<f64>; 2]) -> bool {
    ends.iter().all(|end| cell.view.contains(end))
}

/// A stripe's support points.
pub(crate) struct Stripe {
    /// Where they are in the camera, m.
    pub places: [Vector3<f64>; 2],
    /// Their noise, square to the stripe, as a part of a seam point's.
    pub noise: f64,
}

/// The support points of a stripe between two ends; `None` where the camera does not see them.
pub(crate) fn stripe(cell: &Cell, [from, to]: &[Vector3<f64>; 2]) -> Option<Stripe> {
    let (middle, half) = (0.5 * (from + to), 0.5 * (to - from) / 3.0_f64.sqrt());
    let columns = match &cell.sensor {
        Sensor::CameraLaser { camera, .. } => (camera.project(to)? - camera.project(from)?).norm(),
        Sensor::Profiler | Sensor::Points { .. } => (to - from).norm() / PROFILE_STEP_M,
    };
    Some(Stripe { places: [middle - half, middle + half], noise: (2.0 * ALIKE / columns).sqrt() })
}

/// The stripes of a frame, those that are in view; `normal` draws standard normal numbers.
pub(crate) fn stripes_of(
    cell: &Cell,
    plates: &[Plate; 2],
    sight: &Sight,
    stamp_ns: i64,
    normal: &mut impl FnMut() -> f64,
) -> Vec<PlateStripe> {
    let camera_from_base = sight.placement.base_from_camera().rotation.inverse();
    let normals = [0, 1].map(|k| camera_from_base * plates[k].normal.into_inner());
    let mut one = |ends: [Vector3<f64>; 2]| {
        if is_in_view(cell, &ends) { supports(cell, &ends, normal) } else { None }
    };
    let found = ends(cell, &normals, &sight.point_in_camera).map(|ends| one(ends?));
    let known = (0_u32..).zip(found).filter_map(|(plate, found)| Some((plate, found?)));
    known
        .map(|(plate, (points, sigma))| PlateStripe { stamp_ns, frame: None, plate, points, sigma })
        .collect()
}

/// What the sensor reports of the support points of a stripe between two ends, and how well, px or m.
fn supports(
    cell: &Cell,
    ends: &[Vector3<f64>; 2],
    normal: &mut impl FnMut() -> f64,
) -> Option<([Measured; 2], f64)> {
    let Stripe { places, noise } = stripe(cell, ends)?;
    let [from, to] = ends;
    match &cell.sensor {
        Sensor::CameraLaser { camera, .. } => {
            let along = camera.project(to)? - camera.project(from)?;
            let across = Vector2::new(-along.y, along.x).normalize();
            let sigma = cell.noise.feature_px * noise;
            let mut seen = |at: &Vector3<f64>| Some(camera.project(at)? + across * (sigma * normal()));
            let [a, b] = [seen(&places[0])?, seen(&places[1])?];
            Some(([Measured::Pixel(a.into()), Measured::Pixel(b.into())], sigma))
        }
        Sensor::Profiler | Sensor::Points { .. } => {
            let sigma = cell.noise.feature_m * noise;
            let across = cell.sheet.plane().normal().cross(&(to - from)).normalize();
            let mut seen = |at: &Vector3<f64>| {
                let at = at + across * (sigma * normal());
                match &cell.sensor {
                    Sensor::Profiler => Measured::Profile([at.x, at.z]),
                    _ => Measured::Point(at.into()),
                }
            };
            Some(([seen(&places[0]), seen(&places[1])], sigma))
        }
    }
}
