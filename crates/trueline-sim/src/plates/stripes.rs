//! Support points of the stripes on two plates, and the seam point at their crossing.

use super::measured_line::{Crossing, MeasuredLine};
use super::straight_line::StraightLine;
use super::surface::{PlateInBase, PlatePair, Plates};
use crate::capture::SheetAxes;
use crate::noise::Noise;
use crate::scenario::{Scenario, SensorModel};
use crate::shutter::{Exposed, Shutter};
use crate::{motion::Motion, simulate_along};
use nalgebra::{Matrix2, Point3, UnitVector3, Vector2, Vector3};
use trueline_dataset::{Feature, Measured, PlateStripe, Recording};
use trueline_geometry::{Line, Pose};
use trueline_model::Camera;

/// Places at which a stripe is cast.
const PLACES: usize = 24;
/// A stripe of fewer pixels does not count.
const LEAST_PX: f64 = 40.0;
/// The height of a plate's end is that of this length before it, m.
const TIP_M: f64 = 8e-3;
/// A shift small enough for differences, m.
const SMALL_M: f64 = 1e-6;

/// Scans two plates with the camera of a scenario: a recording with stripes, and with the seam points at their crossing or
/// at the edge. Outliers and drop-outs follow the scenario, plate by plate and frame by frame. `None` for a scenario without
/// a camera or a line.
#[must_use]
pub fn scan_plates(scenario: &Scenario, plates: &Plates, seed: u64) -> Option<Recording> {
    let motion = Motion::new(scenario)?;
    scan_plates_along(scenario, plates, &|time_s| motion.base_from_tool(time_s), seed)
}

/// The same with a prescribed motion of the robot: `base_from_tool` gives its true pose at a time since the start, s.
#[must_use]
pub fn scan_plates_along(
    scenario: &Scenario,
    plates: &Plates,
    base_from_tool: &dyn Fn(f64) -> Pose,
    seed: u64,
) -> Option<Recording> {
    let SensorModel::CameraLaser { camera, .. } = &scenario.cell.sensor else { return None };
    let mut recording = simulate_along(scenario, base_from_tool, seed);
    recording.features.clear();
    let sheet = SheetAxes::of(&scenario.cell.sensor);
    let both = PlateInBase::both(scenario, plates)?;
    let view = View { camera, sheet: &sheet, plates, reported: &|point| point };
    let (mut stamps, mut noise, mut chance) = (Noise::new(seed, 2), Noise::new(seed, 4), Noise::new(seed, 3));
    let mut shutter = Shutter::new(scenario);
    for _ in 0..shutter.count() {
        let Exposed { frame, exposed_s, stamp_ns } = shutter.expose(&mut stamps);
        if chance.happens(scenario.disturbance.drop_fraction) {
            continue;
        }
        let base_from_camera = base_from_tool(exposed_s) * scenario.cell.tool_from_camera;
        let seen = both.each_ref().map(|plate| view.stripe(plate, &base_from_camera, &mut noise));
        let mut edge_of = |k: usize| {
            seen[k].as_ref()?;
            view.edge(&both[k], &base_from_camera, &mut noise)
        };
        let (seam, stripes) = match (plates.pair, &seen) {
            (PlatePair::Meeting, [Some(left), Some(right)]) => (left.line.crossing(&right.line), vec![0, 1]),
            (PlatePair::Lap { .. }, [Some(_), Some(_)]) => (edge_of(plates.edge_on), vec![0, 1]),
            (PlatePair::Edge, _) => (edge_of(plates.edge_on), vec![plates.edge_on]),
            (PlatePair::Butt { .. }, [Some(_), Some(_)]) => {
                (view.middle([edge_of(0), edge_of(1)], &both, &base_from_camera), vec![0, 1])
            }
            _ => continue,
        };
        let Some((pixel, sigma)) = seam.and_then(|at| view.distorted(&at)) else { continue };
        let feature = |measured, sigma| Feature {
            stamp_ns,
            line: 0,
            frame: Some(frame),
            device_ns: None,
            measured,
            sigma: Some(sigma),
            correlation: 0.0,
        };
        recording.features.push(feature(Measured::Pixel(pixel), sigma));
        for plate in stripes {
            let is_off = chance.happens(scenario.disturbance.outlier_fraction);
            let shift_px = if is_off { chance.uniform(-60.0, 60.0) } else { 0.0 };
            let reported = seen[plate].as_ref().and_then(|seen| view.reported(seen, shift_px));
            let Some((points, sigma)) = reported else { continue };
            recording.stripes.push(PlateStripe {
                stamp_ns,
                frame: Some(frame),
                plate: plate as u32,
                points,
                sigma,
            });
        }
    }
    Some(recording)
}

/// A straight line through a piece of stripe in ideal pixels, with its errors.
struct Seen {
    line: MeasuredLine,
    /// Unit vector square to the true stripe.
    normal: Vector2<f64>,
    length_px: f64,
}

struct View<'a> {
    camera: &'a Camera,
    sheet: &'a SheetAxes,
    plates: &'a Plates,
    /// A changed sensor's reading of a true point, camera frame.
    reported: &'a dyn Fn(Vector3<f64>) -> Vector3<f64>,
}

/// A seam of a production, and the sensor that looks at its plates.
pub(crate) struct SeamView<'a> {
    /// The camera.
    pub camera: &'a Camera,
    /// Its laser sheet.
    pub sheet: &'a SheetAxes,
    /// How the plates stand and are measured.
    pub plates: &'a Plates,
    /// The seam.
    pub line: Line,
    /// Direction of the view.
    pub approach: UnitVector3<f64>,
    /// A changed sensor's reading of a true point, camera frame.
    pub reported: &'a dyn Fn(Vector3<f64>) -> Vector3<f64>,
}

impl SeamView<'_> {
    /// The support points of both plates' stripes with their standard deviations; `None` if one of the stripes is not
    /// visible.
    pub(crate) fn seen(
        &self,
        base_from_camera: &Pose,
        noise: &mut Noise,
    ) -> Option<[([Measured; 2], f64); 2]> {
        let view =
            View { camera: self.camera, sheet: self.sheet, plates: self.plates, reported: self.reported };
        let both = PlateInBase::about(&self.line, &self.approach, self.plates);
        let [left, right] = both.each_ref().map(|plate| view.stripe(plate, base_from_camera, noise));
        Some([view.reported(&left?, 0.0)?, view.reported(&right?, 0.0)?])
    }
}

impl View<'_> {
    /// Ideal pixel of a point in base; `None` out of view.
    fn ideal(&self, base_from_camera: &Pose, in_base: &Vector3<f64>) -> Option<Vector2<f64>> {
        let point = (self.reported)((base_from_camera.inverse() * Point3::from(*in_base)).coords);
        self.camera.project(&point)?;
        Some((point.xy() / point.z).component_mul(&self.camera.focal) + self.camera.centre)
    }

    /// The straight line through a plate's stripe, as even columns would give it, with noise.
    fn stripe(&self, plate: &PlateInBase, base_from_camera: &Pose, noise: &mut Noise) -> Option<Seen> {
        let seen = self.line(plate, base_from_camera, self.plates.reach_m, noise)?;
        (seen.length_px >= LEAST_PX).then_some(seen)
    }

    /// The same through a piece of it, between two distances from the seam, m.
    fn line(
        &self,
        plate: &PlateInBase,
        base_from_camera: &Pose,
        [near, far]: [f64; 2],
        noise: &mut Noise,
    ) -> Option<Seen> {
        let mut places = Vec::with_capacity(PLACES);
        for k in 0..PLACES {
            let from_seam_m = near + (far - near) * k as f64 / (PLACES - 1) as f64;
            let point = plate.cut(self.sheet, base_from_camera, from_seam_m)?;
            let Some(ideal) = self.ideal(base_from_camera, &point) else { break };
            places.push((ideal, point));
        }
        let line = StraightLine::through(&places)?;
        let sigma_px = self.plates.column_sigma_px * (2.0 * self.plates.alike_px / line.length_px).sqrt();
        let point = places[places.len() / 2].1;
        let raised = self.ideal(base_from_camera, &(point + plate.normal * SMALL_M))?;
        let there = self.ideal(base_from_camera, &point)?;
        let rough_px = line.normal().dot(&(raised - there)) / SMALL_M * self.plates.roughness_m;
        let points = line.supports.map(|at| {
            let error = noise.normal(sigma_px) + noise.normal(rough_px.abs());
            at + line.normal() * error
        });
        let measured = MeasuredLine { points, sigma: sigma_px };
        Some(Seen { line: measured, normal: line.normal(), length_px: line.length_px })
    }

    /// End of the stripe at the plate's edge. Along the stripe it has its own noise; across the stripe it is on the
    /// line through its last millimetres. The line through all of a bowed stripe passes beside its end.
    fn edge(&self, plate: &PlateInBase, base_from_camera: &Pose, noise: &mut Noise) -> Option<Crossing> {
        let [near, far] = self.plates.reach_m;
        let tip = self.line(plate, base_from_camera, [near, far.min(near.max(TIP_M))], noise)?;
        let there = self.ideal(base_from_camera, &plate.cut(self.sheet, base_from_camera, 0.0)?)?;
        let [a, b] = tip.line.points;
        let along = (b - a).normalize();
        let sigma_px = self.plates.edge_sigma_px;
        let at = a + along * (along.dot(&(there - a)) + noise.normal(sigma_px));
        let across = Vector2::new(-along.y, along.x);
        let covariance = along * along.transpose() * sigma_px.powi(2)
            + across * across.transpose() * tip.line.variance_at(&at);
        Some(Crossing { at, covariance })
    }

    /// The middle between two measured edges: where the true middle is, and half of the error of each.
    fn middle(
        &self,
        measured: [Option<Crossing>; 2],
        plates: &[PlateInBase; 2],
        base_from_camera: &Pose,
    ) -> Option<Crossing> {
        let [left, right] = plates.each_ref().map(|plate| plate.cut(self.sheet, base_from_camera, 0.0));
        let (left, right) = (left?, right?);
        let [a, b] = measured;
        let (a, b) = (a?, b?);
        let error =
            a.at - self.ideal(base_from_camera, &left)? + b.at - self.ideal(base_from_camera, &right)?;
        let at = self.ideal(base_from_camera, &(0.5 * (left + right)))? + 0.5 * error;
        Some(Crossing { at, covariance: 0.25 * (a.covariance + b.covariance) })
    }

    /// The distorted support points, displaced by `shift_px`, and their standard deviation perpendicular to the
    /// stripe there.
    fn reported(&self, seen: &Seen, shift_px: f64) -> Option<([Measured; 2], f64)> {
        let there = |at: &Vector2<f64>| {
            let shifted = at + seen.normal * shift_px;
            let (pixel, jacobian) = self.distort(&shifted)?;
            let along = jacobian * Vector2::new(seen.normal.y, -seen.normal.x);
            let square = Vector2::new(-along.y, along.x).normalize();
            Some((
                Measured::Pixel(pixel.into()),
                square.dot(&(jacobian * seen.normal)).abs() * seen.line.sigma,
            ))
        };
        let (a, b) = (there(&seen.line.points[0])?, there(&seen.line.points[1])?);
        Some(([a.0, b.0], (a.1 * b.1).sqrt()))
    }

    fn distorted(&self, crossing: &Crossing) -> Option<([f64; 2], [f64; 2])> {
        let (pixel, jacobian) = self.distort(&crossing.at)?;
        let covariance = jacobian * crossing.covariance * jacobian.transpose();
        Some((pixel.into(), [covariance.m11.sqrt(), covariance.m22.sqrt()]))
    }

    /// A distorted pixel, and how it moves with the ideal one.
    fn distort(&self, ideal: &Vector2<f64>) -> Option<(Vector2<f64>, Matrix2<f64>)> {
        let Camera { centre, focal, distortion, size } = self.camera;
        let (there, slope) = distortion.distort(&(ideal - centre).component_div(focal));
        let pixel = there.component_mul(focal) + centre;
        let inside = |x: f64, n: u32| x >= -0.5 && x <= f64::from(n) - 0.5;
        let scale = Matrix2::from_diagonal(focal);
        let back = Matrix2::from_diagonal(&focal.map(f64::recip));
        (inside(pixel.x, size[0]) && inside(pixel.y, size[1])).then_some((pixel, scale * slope * back))
    }
}
