//! Predicted stripes on the plates of a joint in a planned scan, for `calibrate --use stripe`.
//!
//! Hiding of a lower plate by an upper one is not considered: it is unknown whether a sensor stands by its laser or by its
//! camera. A stripe is given by two points with independent errors: for N columns with errors σ, correlated over 1.75
//! columns, σ √(2 · 1.75 / N) at ± ℓ/√3 of its middle.

use crate::cell::Cell;
use crate::joint::Joint;
use crate::predicted_frames::PredictedFrame;
use nalgebra::{Vector2, Vector3};
use trueline_dataset::{Measured, PlateStripe, Sensor};

/// Range of a plate's stripe that is used, from the seam, m: at the corner light is reflected, and plates have a limited
/// width.
const FROM_SEAM_M: [f64; 2] = [2e-3, 25e-3];
/// Columns over which speckle is alike.
const ALIKE: f64 = 1.75;
/// Distance of a profiler's points, m.
const PROFILE_STEP_M: f64 = 1e-4;

/// Used range of the stripes on the plates of a joint, in the camera, m; `along` is the seam's direction, and `in_camera` maps
/// directions from base. `None` for a plate along the sheet, and for a missing plate.
pub(crate) fn ends(
    cell: &Cell,
    (joint, along): (&Joint, &Vector3<f64>),
    in_camera: impl Fn(&Vector3<f64>) -> Vector3<f64>,
    seam: &Vector3<f64>,
) -> [Option<[Vector3<f64>; 2]>; 2] {
    let sheet = cell.sheet.plane().normal();
    let along = in_camera(along);
    [0, 1].map(|number| {
        let plate = joint.seen[number].then_some(&joint.plates[number])?;
        let (normal, outward) = (in_camera(&plate.normal), in_camera(&plate.outward));
        let stripe = sheet.cross(&normal).try_normalize(1e-3)?;
        let stripe = stripe * stripe.dot(&outward).signum();
        // Straight above or below the seam the sheet cuts the plate a little along it.
        let begin = seam + (normal - along * (sheet.dot(&normal) / sheet.dot(&along))) * plate.above_m;
        Some(FROM_SEAM_M.map(|m| begin + stripe * m))
    })
}

/// Whether a stripe is completely in view: a stripe that is cut off is not used.
pub(crate) fn is_in_view(cell: &Cell, ends: &[Vector3<f64>; 2]) -> bool {
    ends.iter().all(|end| cell.view.contains(end))
}

/// A stripe's support points.
pub(crate) struct Stripe {
    /// Their places in the camera, m.
    pub places: [Vector3<f64>; 2],
    /// Their noise, square to the stripe, as a part of a seam point's.
    pub noise: f64,
}

/// The support points of a stripe between two ends; `None` if the camera does not see them.
pub(crate) fn stripe(cell: &Cell, [from, to]: &[Vector3<f64>; 2]) -> Option<Stripe> {
    let (middle, half) = (0.5 * (from + to), 0.5 * (to - from) / 3.0_f64.sqrt());
    let columns = match &cell.sensor {
        Sensor::CameraLaser { camera, .. } => (camera.project(to)? - camera.project(from)?).norm(),
        Sensor::Profiler | Sensor::Points { .. } => (to - from).norm() / PROFILE_STEP_M,
    };
    Some(Stripe { places: [middle - half, middle + half], noise: (2.0 * ALIKE / columns).sqrt() })
}

/// The visible stripes of a frame; `normal` draws standard normal numbers.
pub(crate) fn stripes_of(
    cell: &Cell,
    (joint, along): (&Joint, &Vector3<f64>),
    sight: &PredictedFrame,
    stamp_ns: i64,
    normal: &mut impl FnMut() -> f64,
) -> Vec<PlateStripe> {
    let camera_from_base = sight.placement.base_from_camera().rotation.inverse();
    let mut one = |ends: [Vector3<f64>; 2]| {
        if is_in_view(cell, &ends) { supports(cell, &ends, normal) } else { None }
    };
    let in_camera = |direction: &Vector3<f64>| camera_from_base * direction;
    let found = ends(cell, (joint, along), in_camera, &sight.point_in_camera).map(|ends| one(ends?));
    let known = (0_u32..).zip(found).filter_map(|(plate, found)| Some((plate, found?)));
    known
        .map(|(plate, (points, sigma))| PlateStripe { stamp_ns, frame: None, plate, points, sigma })
        .collect()
}

/// The sensor's report of the support points of a stripe between two ends, and their uncertainty, px or m.
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

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]
    use super::*;
    use crate::cell_toml;
    use crate::design::{DIMENSION, from_unit_box};
    use crate::motion::Motion;
    use crate::predicted_frames::PredictedFrames;
    use crate::shape::Shape;
    use crate::truth::Truth;
    use std::path::Path;
    use trueline_dataset::{Recording, sensor_toml};
    use trueline_sim::{Disturbance, PlatePair, Plates, Preset, SensorModel, scan_plates_along};

    /// A joint's text in the cell's file, and its name in the simulator, which casts points of the plates forward.
    fn joints() -> Vec<(String, PlatePair, usize)> {
        let plate = |toward: f64, more: &str| {
            format!("\n[[plates]]\nnormal = [0, 0, 1]\ntoward = [0, {toward}, 0]\n{more}\n")
        };
        let lap = PlatePair::Lap { step_m: 4e-3 };
        let below = "below_mm = 4";
        // The seam runs roughly along x and is seen from above: the simulator's plate 0 lies at negative y.
        vec![
            (format!("{}{}", plate(1.0, ""), plate(-1.0, below)), lap, 1),
            (format!("{}{}", plate(1.0, below), plate(-1.0, "")), lap, 0),
            (format!("{}{}", plate(-1.0, ""), plate(1.0, below)), lap, 0),
            (plate(1.0, ""), PlatePair::Edge, 1),
            (plate(-1.0, ""), PlatePair::Edge, 0),
        ]
    }

    const DURATION_S: f64 = 8.0;

    /// The example's cell with level plates about a level seam.
    fn cell(plates: &str) -> Cell {
        let file = Path::new("cell.toml");
        let sensor = sensor_toml::parse(file, cell_toml::EXAMPLE_SENSOR).unwrap();
        let mut cell = cell_toml::parse(file, &format!("{}{plates}", cell_toml::EXAMPLE), sensor).unwrap();
        cell.seam.to_m.z = cell.seam.from_m.z;
        cell
    }

    /// The simulator's view of the same plates, without noise.
    fn simulated(cell: &Cell, motion: &Motion, pair: PlatePair, edge_on: usize) -> Recording {
        let mut scenario = Preset::Quick.scenario();
        let Sensor::CameraLaser { camera, laser_plane_in_camera } = cell.sensor.clone() else { panic!() };
        scenario.cell.sensor = SensorModel::CameraLaser { camera, laser_plane_in_camera };
        scenario.cell.tool_from_camera = cell.tool_from_camera;
        scenario.cell.lines = vec![cell.seam.line().unwrap()];
        scenario.cell.approach = -Vector3::z_axis();
        (scenario.timing.duration_s, scenario.timing.frame_period_s) = (DURATION_S, cell.frame_period_s);
        (scenario.timing.time_offset_s, scenario.timing.start_ns) = (0.0, 0);
        scenario.disturbance = Disturbance::default();
        let none = 1e-9;
        let exact = Plates { pair, edge_on, column_sigma_px: none, edge_sigma_px: none, ..Plates::default() };
        scan_plates_along(&scenario, &exact, &|time_s| motion.base_from_tool(time_s), 1).unwrap()
    }

    fn pixels(stripe: &PlateStripe) -> [Vector2<f64>; 2] {
        stripe.points.map(|point| if let Measured::Pixel(pixel) = point { pixel.into() } else { panic!() })
    }

    /// Frames seen by both.
    fn compare(cell: &Cell, (pair, edge_on): (PlatePair, usize)) -> usize {
        let (joint, along) = (Joint::of(cell).unwrap(), cell.seam.direction().unwrap());
        let box_point = [0.6; DIMENSION];
        let design = from_unit_box(cell, Shape::TwoPasses, DURATION_S, &box_point);
        let motion = Motion::new(cell, design);
        let sights = PredictedFrames::of(cell, &motion, &Truth::guessed(cell).unwrap(), 1).unwrap();
        let seen = simulated(cell, &motion, pair, edge_on);
        let mut compared = 0;
        for sight in &sights.list {
            let stamp_ns = (sight.time_s * 1e9).round() as i64;
            let is_now = |other_ns: i64| (other_ns - stamp_ns).abs() < 1_000_000;
            for stripe in stripes_of(cell, (&joint, &along), sight, stamp_ns, &mut || 0.0) {
                let left = joint.plates[stripe.plate as usize].outward.y < 0.0;
                // The simulator makes no stripe in a picture in which the other one is out of view.
                let theirs =
                    seen.stripes.iter().find(|other| is_now(other.stamp_ns) && (other.plate == 0) == left);
                let Some(theirs) = theirs else { continue };
                let ([a, b], [c, d]) = (pixels(&stripe), pixels(theirs));
                let chord = (b - a).normalize();
                let across = |p: Vector2<f64>| (chord.x * (p - a).y - chord.y * (p - a).x).abs();
                // One line, except for the bend of the lens between other places on it.
                assert!(across(c) < 1.0 && across(d) < 1.0, "{pair:?}: {} {}", across(c), across(d));
                // On the same side of the seam, and as far from it, but for lengths that the simulator counts square to the seam.
                let most = 0.15 * (b - a).norm();
                let [begin, end] = [(c - a).dot(&chord).abs(), (d - b).dot(&chord).abs()];
                assert!(begin < most && end < most, "{pair:?}, {edge_on}: {begin} {end}");
                compared += 1;
            }
        }
        compared
    }

    #[test]
    fn stripes_are_where_the_simulator_sees_them() {
        for (text, pair, edge_on) in joints() {
            let compared = compare(&cell(&text), (pair, edge_on));
            assert!(compared > 50, "{pair:?}, {edge_on}: {compared}");
        }
    }
}
