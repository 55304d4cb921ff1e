//! Rows against the forward model, moved by differences.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]
use super::*;
use crate::cell_toml;
use crate::design::{DIMENSION, from_unit_box};
use crate::motion::Motion;
use crate::shape::Shape;
use nalgebra::{DVector, Point3, SVector};
use std::path::Path;
use trueline_dataset::{Sensor, sensor_toml};
use trueline_geometry::so3;
use trueline_method::problem::parameters::{ROTATION, TRANSLATION};

const FILLET: &str = "\n[[plates]]\nnormal = [-0.127023, 0.695640, 0.707072]\n[[plates]]\nnormal = [0.113104, -0.698038, 0.707072]\n";
const LAP: &str = "\n[[plates]]\nnormal = [0.02, -0.03, 1]\ntoward = [0, -1, 0]\n[[plates]]\nnormal = [0.02, -0.03, 1]\ntoward = [0, 1, 0]\nbelow_mm = 3\n";
const ONE_PLATE: &str = "\n[[plates]]\nnormal = [0.02, -0.03, 1]\ntoward = [0, 1, 0]\n";

/// Places of everything, moved by the tangent of all unknowns: φ of every surface at a point of the sheet, written
/// out.
struct Forward<'a> {
    cell: &'a Cell,
    motion: &'a Motion,
    ahead: &'a JointAhead,
    truth: &'a Truth,
}

impl Forward<'_> {
    fn phi(&self, step: &DVector<f64>, (surface, time_s): (usize, f64), reported: &Vector2<f64>) -> f64 {
        let three = |first: usize| Vector3::new(step[first], step[first + 1], step[first + 2]);
        let unknowns = &self.ahead.unknowns;
        let h = SVector::<f64, 5>::from_fn(|k, _| step[unknowns.shape().start + k]);
        let in_camera = self.cell.sheet.point(&self.ahead.shape.retract(&h).corrected(reported).0);
        let mounted = &self.truth.tool_from_camera;
        let in_tool = so3::exp(&three(ROTATION)) * mounted.rotation * in_camera
            + mounted.translation.vector
            + three(TRANSLATION);
        let in_base = (self.motion.base_from_tool(time_s - step[TIME_OFFSET]) * Point3::from(in_tool)).coords;
        let plate = &self.ahead.surfaces[surface];
        let (along, outward) = (plate.chart.along, plate.chart.outward);
        let [turn_along, turn_outward, raised] = three(unknowns.plane(0, surface).start).into();
        let normal = so3::exp(&(along * turn_along + outward * turn_outward)) * plate.normal.as_ref();
        let from = in_base - plate.chart.centre;
        let (r, s) = (outward.dot(&from) / 0.025, along.dot(&from) / 0.100);
        let terms = [r * r, r * s, s * s, r * r * r, r * r * s, r * s * s, s * s * s];
        let first = unknowns.surface(0, surface).start;
        let height: f64 = (0..7).map(|k| terms[k] * step[first + k]).sum();
        normal.dot(&from) - plate.offset_m - raised - height
    }

    /// Derivative, by each unknown, of a distance along an axis of the sheet: between a place and the crossing of the cuts
    /// of a plate and of the edge. Both conditions of the crossing hold, by differences.
    fn slopes_of_end(
        &self,
        (on, time_s): (usize, f64),
        at: &Vector2<f64>,
        axis: &Vector2<f64>,
    ) -> DVector<f64> {
        const STEP: f64 = 1e-6;
        let surfaces = [(on, time_s), (EDGE, time_s)];
        let none = DVector::zeros(self.ahead.unknowns.dimension());
        let normals = Matrix2::from_fn(|row, axis| {
            let by = Vector2::from_fn(|k, _| if k == axis { STEP } else { 0.0 });
            (self.phi(&none, surfaces[row], &(at + by)) - self.phi(&none, surfaces[row], &(at - by)))
                / (2.0 * STEP)
        });
        let inverse = normals.try_inverse().unwrap();
        DVector::from_fn(none.len(), |k, _| {
            let by = DVector::from_fn(none.len(), |i, _| if i == k { 10.0 * STEP } else { 0.0 });
            let moved =
                surfaces.map(|seen| (self.phi(&by, seen, at) - self.phi(&-&by, seen, at)) / (20.0 * STEP));
            axis.dot(&(inverse * Vector2::from(moved)))
        })
    }

    /// How the distance of a place of the sheet from the surface's cut moves with each unknown, by differences.
    ///
    /// `from_middle` is where a support point lies on its stripe: then bows move it as the straight line through all of the stripe.
    fn slopes(
        &self,
        seen: (usize, f64),
        (at, from_middle): (&Vector2<f64>, Option<Vector2<f64>>),
    ) -> DVector<f64> {
        const STEP: f64 = 1e-5;
        let count = self.ahead.unknowns.dimension();
        let none = DVector::zeros(count);
        // The place is where the surface cuts the sheet, to the rounding of lengths of a metre.
        let off_m = self.phi(&none, seen, at);
        assert!(off_m.abs() < 1e-12, "{seen:?}: {off_m}");
        let slope = |axis: usize| {
            let by = Vector2::from_fn(|k, _| if k == axis { STEP } else { 0.0 });
            (self.phi(&none, seen, &(at + by)) - self.phi(&none, seen, &(at - by))) / (2.0 * STEP)
        };
        let steepness = slope(0).hypot(slope(1));
        let bows = self.ahead.unknowns.surface(0, seen.0);
        DVector::from_fn(count, |k, _| {
            let by = DVector::from_fn(count, |i, _| if i == k { STEP } else { 0.0 });
            let moved = |at: &Vector2<f64>| {
                (self.phi(&by, seen, at) - self.phi(&-&by, seen, at)) / (2.0 * STEP) / steepness
            };
            match from_middle {
                Some(from_middle) if bows.contains(&k) => {
                    let middle = at - from_middle;
                    line_at_support(|x| moved(&(middle + from_middle * x)))
                }
                _ => moved(at),
            }
        })
    }
}

/// The unit vector in the sheet whose product with a shift is zero for shifts perpendicular to the stripe in the picture, by
/// projection.
fn axis_of_end(cell: &Cell, [begin, end]: &[Vector3<f64>; 2], point: &Vector3<f64>) -> Vector2<f64> {
    let Sensor::CameraLaser { camera, .. } = &cell.sensor else { panic!("a camera") };
    let at = cell.sheet.coordinates(point);
    let pixel = |shift: Vector2<f64>| {
        let place = cell.sheet.point(&(at + shift));
        camera.distortion.distort(&(place.xy() / place.z)).0.component_mul(&camera.focal)
    };
    let chord = (cell.sheet.coordinates(end) - cell.sheet.coordinates(begin)).normalize() * 1e-6;
    let along = pixel(chord) - pixel(-chord);
    // A shift across the stripe, of the direction in the sheet that is square to it in the picture: by bisection of its angle.
    let shift = |angle: f64| Vector2::new(angle.cos(), angle.sin()) * 1e-6;
    let product = |angle: f64| along.dot(&(pixel(shift(angle)) - pixel(-shift(angle))));
    let begin = chord.y.atan2(chord.x);
    let (mut low, mut high) = (begin, begin + std::f64::consts::PI);
    for _ in 0..50 {
        let middle = 0.5 * (low + high);
        if product(middle) > 0.0 { low = middle } else { high = middle }
    }
    Vector2::new(low.sin(), -low.cos())
}

/// The line of least squares through a polynomial of third degree on a stripe of length 2√3 about zero, at 1: its mean and
/// its slope ∫ x f dx / ∫ x² dx. The quadrature at three points is exact up to the fifth degree.
fn line_at_support(f: impl Fn(f64) -> f64) -> f64 {
    let nodes = [(-0.6_f64.sqrt(), 5.0 / 9.0), (0.0, 8.0 / 9.0), (0.6_f64.sqrt(), 5.0 / 9.0)];
    // ∫ x² dx is 2 √3, and 0.5 of the weights the mean.
    nodes
        .map(|(node, weight)| (3.0_f64.sqrt() * node, 0.5 * weight))
        .iter()
        .map(|(x, weight)| weight * f(*x) * (1.0 + x))
        .sum()
}

fn cell(plates: &str) -> Cell {
    let file = Path::new("cell.toml");
    let sensor = sensor_toml::parse(file, cell_toml::EXAMPLE_SENSOR).unwrap();
    cell_toml::parse(file, &format!("{}{plates}", cell_toml::EXAMPLE), sensor).unwrap()
}

/// The places that the rows of a frame are of: row, surface, place in the sheet, and of support points how far it is from the middle
/// of the stripe.
type Place = (usize, usize, Vector2<f64>, Option<Vector2<f64>>);

fn places(cell: &Cell, ahead: &JointAhead, sight: &PredictedFrame) -> Vec<Place> {
    let camera_from_base = sight.placement.base_from_camera().rotation.inverse();
    let turned = |direction: &Vector3<f64>| camera_from_base * direction;
    let stripes = ends(cell, (&ahead.joint, &ahead.along), turned, &sight.point_in_camera);
    let supports = stripes.iter().enumerate().filter_map(|(number, ends)| {
        let places = stripe(cell, ends.as_ref()?)?.places.map(|place| cell.sheet.coordinates(&place));
        let middle = 0.5 * (places[0] + places[1]);
        Some([0, 1].map(|k| (2 * number + k, number, places[k], Some(places[k] - middle))))
    });
    let edge = cell.sheet.coordinates(&sight.point_in_camera);
    let edge = ahead.joint.edge_on.map(|_| (EDGE_ROW, EDGE, edge, None));
    supports.flatten().chain(edge).collect()
}

fn rows_move_as_the_forward_model_does<const R: usize, const N: usize>(plates: &str) {
    let cell = cell(plates);
    let (joint, truth) = (Joint::of(&cell).unwrap(), Truth::guessed(&cell).unwrap());
    let box_point = [0.6; DIMENSION];
    let design = from_unit_box(&cell, Shape::TwoPasses, 10.0, &box_point);
    let motion = Motion::new(&cell, design);
    let sights = PredictedFrames::of(&cell, &motion, &truth, 1).unwrap();
    let ahead = JointAhead::of(&truth, &joint, &sights).unwrap();
    assert_eq!(N, ahead.unknowns.dimension());
    let forward = Forward { cell: &cell, motion: &motion, ahead: &ahead, truth: &truth };
    let mut checked = 0;
    for sight in sights.list.iter().step_by(13) {
        let Some(rows) = Rows::<R, N>::of(&cell, &ahead, sight) else { continue };
        checked += 1;
        for (row, surface, at, from_middle) in places(&cell, &ahead, sight) {
            let expected = match ahead.joint.edge_on {
                Some(on) if surface == EDGE => {
                    let camera_from_base = sight.placement.base_from_camera().rotation.inverse();
                    let turned = |direction: &Vector3<f64>| camera_from_base * direction;
                    let ends = ends(&cell, (&ahead.joint, &ahead.along), turned, &sight.point_in_camera);
                    let places = stripe(&cell, ends[on].as_ref().unwrap()).unwrap().places;
                    let axis = axis_of_end(&cell, &places, &sight.point_in_camera);
                    forward.slopes_of_end((on, sight.time_s), &at, &axis)
                }
                _ => forward.slopes((surface, sight.time_s), (&at, from_middle)),
            };
            for k in 0..N {
                // Velocities are one-sided differences over a short time, of some 1 m/s² at most.
                let tolerance = if k == TIME_OFFSET { 1e-3 } else { 1e-7 };
                let (found, expected) = (rows.columns[(row, k)], expected[k]);
                assert!((found - expected).abs() < tolerance, "row {row}, {k}: {found}, {expected}");
            }
        }
    }
    assert!(checked > 5, "{checked} frames");
}

#[test]
fn rows_of_every_joint_move_as_the_forward_model_does() {
    rows_move_as_the_forward_model_does::<MEETING_ROWS, MEETING_ALL>(FILLET);
    rows_move_as_the_forward_model_does::<EDGED_ROWS, EDGED_ALL>(LAP);
    rows_move_as_the_forward_model_does::<EDGED_ROWS, EDGED_ALL>(ONE_PLATE);
}
