//! Estimated plates: position, uncertainty and flatness.

use crate::assess::observability::is_null;
use crate::stripe::frames::{Sight, StripeFrame, StripeFrames};
use crate::stripe::state::StripeState;
use crate::stripe::target::{Bearing, Target};
use crate::thinning::stride;
use crate::{
    input::observations::Observations, order_statistics::quantile, stripe::frame_residual::placement,
};
use nalgebra::{DMatrix, Matrix2, SMatrix, SVector, Vector3};
use trueline_model::Plate;
use trueline_model::plate::{SURFACE_LENGTH_M, SURFACE_REACH_M, surface_terms};

/// One plate: the best-fitting plane of its visible surface.
///
/// The slope at the seam and a bow across the stripe are hard to separate. Their combined effect on the visible surface is known far better than
/// either.
#[derive(Clone, Debug, PartialEq)]
pub struct PlaneEstimate {
    /// Its number.
    pub number: usize,
    /// The plane, without its surface.
    pub plane: Plate,
    /// Standard deviation of its normal about the least certain axis, rad.
    pub sigma_rad: f64,
    /// Standard deviation of its offset at the middle of the scan, m.
    pub sigma_m: f64,
    /// Whether its normal, and its offset, are observable.
    pub seen: [bool; 2],
    /// Largest distance of its visible surface from the plane, m.
    pub bow_m: f64,
    /// Its support points.
    pub points: Vec<PlatePoint>,
}

/// A support point on its plate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlatePoint {
    /// In base, m.
    pub in_base: Vector3<f64>,
    /// Place along the seam from the scan's centre, and distance from the seam, m.
    pub place_m: [f64; 2],
    /// Its height above the plane on the sensor's side, m.
    pub height_m: f64,
}

/// The angle between the planes of a joint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointAngle {
    /// Number of the joint.
    pub joint: usize,
    /// Angle that the plates open towards the sensor, rad. Above π for an outside corner.
    pub value_rad: f64,
    /// Standard deviation, rad.
    pub sigma_rad: f64,
}

/// Height step between two parallel plates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointStep {
    /// Number of the joint.
    pub joint: usize,
    /// From the plate that bears the edge to the other, at the middle of the scan on the seam, m.
    pub value_m: f64,
    /// Standard deviation, m.
    pub sigma_m: f64,
}

/// Estimated plates of a scan.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Planes {
    /// The plates.
    pub plates: Vec<PlaneEstimate>,
    /// The angles of plates that meet.
    pub angles: Vec<JointAngle>,
    /// The steps of parallel plates.
    pub steps: Vec<JointStep>,
}

/// Fraction of the support points that may lie beyond each end of the visible range.
const BEYOND: f64 = 0.02;
/// Grid points along each axis at which a surface is evaluated.
const GRID: usize = 5;

/// The planes of a state, and the angle or step of each joint with visible plates. `covariance` is that of the tangent, and `null` holds its
/// unobservable directions.
#[must_use]
pub fn planes(
    observations: &Observations,
    frames: &StripeFrames,
    at: &StripeState,
    (covariance, null): (&DMatrix<f64>, &DMatrix<f64>),
) -> Planes {
    let unknowns = at.unknowns();
    let Planes { plates: mut all, mut angles, mut steps } = Planes::default();
    let seen = |(joint, _): &(usize, &Target)| !frames.without_plates.contains(joint);
    for (joint, target) in at.joints.iter().enumerate().filter(seen) {
        let (mut slopes, mut to_sensor) = (Vec::new(), Vector3::zeros());
        for (number, plate) in target.plates.iter().enumerate().filter(|(number, _)| target.seen[*number]) {
            let first = unknowns.plane(joint, number).start;
            let seen = seen_points(observations, &frames.list, at, (joint, number));
            let best = BestPlane::over(visible(plate, &seen).unwrap_or([[0.0, 1.0], [-1.0, 1.0]]));
            let slope = best.slope(at, (joint, number));
            to_sensor += seen.iter().map(|seen| seen.from - seen.point).sum::<Vector3<f64>>();
            let own = &slope * covariance * slope.transpose();
            let tilts: Matrix2<f64> = own.fixed_view::<2, 2>(0, 0).into_owned();
            let plane = best.of(plate);
            all.push(PlaneEstimate {
                number: 2 * joint + number,
                points: on_plane(&plane, &seen),
                plane,
                sigma_rad: tilts.symmetric_eigenvalues().max().max(0.0).sqrt(),
                sigma_m: own[(2, 2)].max(0.0).sqrt(),
                seen: [!(is_null(null, first) || is_null(null, first + 1)), !is_null(null, first + 2)],
                bow_m: best.bow_m(plate),
            });
            slopes.push(slope);
        }
        match (&all[..], &slopes[..], &target.edge) {
            ([.., one, other], _, None) => {
                let (value_rad, sigma_rad) =
                    angle([&one.plane, &other.plane], &to_sensor, &slopes, covariance);
                angles.push(JointAngle { joint, value_rad, sigma_rad });
            }
            ([.., one, other], [_, _], Some(edge)) => {
                let order = match edge.on {
                    Bearing::Plate(1) => [(other, 1), (one, 0)],
                    _ => [(one, 0), (other, 1)],
                };
                let (value_m, sigma_m) = step(order.map(|(plate, k)| (&plate.plane, &slopes[k])), covariance);
                steps.push(JointStep { joint, value_m, sigma_m });
            }
            _ => {}
        }
    }
    Planes { plates: all, angles, steps }
}

/// The distance of two nearly parallel planes along the normal of the first, at the middle of the scan, and its standard deviation, m. At that
/// point, the common origin of both, n₂·n₁ h = δ₂.
fn step(
    [(one, slope), (other, other_slope)]: [(&Plate, &DMatrix<f64>); 2],
    covariance: &DMatrix<f64>,
) -> (f64, f64) {
    let cosine = one.normal.dot(&other.normal);
    let slope = other_slope.row(2) / cosine - slope.row(2);
    let variance = (&slope * covariance * slope.transpose())[(0, 0)];
    ((other.offset_m / cosine - one.offset_m).abs(), variance.max(0.0).sqrt())
}

/// The angle between two planes on one side and its standard deviation, rad. `slopes` map the tangent to (θ_a, θ_o, δ) of each.
fn angle(
    [one, other]: [&Plate; 2],
    side: &Vector3<f64>,
    slopes: &[DMatrix<f64>],
    covariance: &DMatrix<f64>,
) -> (f64, f64) {
    let outward = [one, other].map(|plate| plate.chart.along.cross(&plate.normal));
    let axis = outward[0].cross(&outward[1]).normalize();
    // A rotation of a plate about the seam by θ opens the angle by −θ or θ, depending on the axis.
    let signs = [-axis.dot(&one.chart.along), axis.dot(&other.chart.along)];
    let slope = slopes[0].row(0) * signs[0] + slopes[1].row(0) * signs[1];
    let variance = (&slope * covariance * slope.transpose())[(0, 0)];
    let between = outward[0].angle(&outward[1]);
    let is_inside = (outward[0] + outward[1]).dot(side) >= 0.0;
    (if is_inside { between } else { std::f64::consts::TAU - between }, variance.max(0.0).sqrt())
}

/// Maps surface terms to the best-fitting plane of the visible surface.
struct BestPlane {
    places: Vec<[f64; 2]>,
    /// (1, r, s) of the best plane for each term.
    by_term: SMatrix<f64, 3, 7>,
}

impl BestPlane {
    /// Over ranges of r and s.
    fn over([reach, length]: [[f64; 2]; 2]) -> Self {
        let on = |range: [f64; 2], k: usize| range[0] + (range[1] - range[0]) * k as f64 / (GRID - 1) as f64;
        let places: Vec<[f64; 2]> =
            (0..GRID * GRID).map(|k| [on(reach, k % GRID), on(length, k / GRID)]).collect();
        let (mut normal, mut right) = (SMatrix::<f64, 3, 3>::zeros(), SMatrix::<f64, 3, 7>::zeros());
        for [r, s] in &places {
            let flat = Vector3::new(1.0, *r, *s);
            normal += flat * flat.transpose();
            right += flat * surface_terms(*r, *s).transpose();
        }
        // A plate visible at a single place has no plane of its own. The chart's plane is kept.
        let by_term = normal.try_inverse().map_or_else(SMatrix::zeros, |inverse| inverse * right);
        Self { places, by_term }
    }

    /// A plane a + b r + c s over a chart turns it by −b about the seam and by c perpendicular to it, and lifts it by a.
    fn turned([a, b, c]: [f64; 3]) -> Vector3<f64> {
        Vector3::new(-b / SURFACE_REACH_M, c / SURFACE_LENGTH_M, a)
    }

    fn of(&self, plate: &Plate) -> Plate {
        let beta = SVector::from(plate.surface_m);
        plate.retract(&Self::turned((self.by_term * beta).into()), &-beta)
    }

    /// Jacobian of the plane's tangent by the state's tangent: 3 × all unknowns.
    fn slope(&self, at: &StripeState, (joint, number): (usize, usize)) -> DMatrix<f64> {
        let unknowns = at.unknowns();
        let mut slope = DMatrix::zeros(3, unknowns.dimension());
        slope.view_mut((0, unknowns.plane(joint, number).start), (3, 3)).fill_with_identity();
        for (term, column) in unknowns.surface(joint, number).enumerate() {
            let turned = Self::turned(self.by_term.column(term).into_owned().into());
            slope.view_mut((0, column), (3, 1)).copy_from(&turned);
        }
        slope
    }

    /// Largest distance of the surface from it over the grid, m.
    fn bow_m(&self, plate: &Plate) -> f64 {
        let beta = SVector::from(plate.surface_m);
        let flat = self.by_term * beta;
        let off = |[r, s]: &[f64; 2]| {
            (surface_terms(*r, *s).dot(&beta) - flat.dot(&Vector3::new(1.0, *r, *s))).abs()
        };
        self.places.iter().map(off).fold(0.0, f64::max)
    }
}

/// A support point and the sensor's position, base frame, m.
struct SeenPoint {
    point: Vector3<f64>,
    from: Vector3<f64>,
}

/// Maximum number of support points of a plate evaluated. Beyond it every n-th frame is used.
const MOST_FRAMES: usize = 5000;

/// The support points of a plate.
fn seen_points(
    observations: &Observations,
    frames: &[StripeFrame],
    at: &StripeState,
    (joint, number): (usize, usize),
) -> Vec<SeenPoint> {
    let mut seen = Vec::new();
    let every = stride(frames.len(), MOST_FRAMES);
    for frame in frames.iter().filter(|frame| frame.joint == joint).step_by(every) {
        let Sight::Stripes(stripes) = &frame.sight else { continue };
        let Some(placement) = placement(observations, frame.stamp_s, at) else { continue };
        let from = placement.base_from_camera().translation.vector;
        for support in stripes[number].iter().flatten() {
            let there = at.shape.map_or(support.reported, |shape| shape.corrected(&support.reported).0);
            let point = placement.point_in_base(&observations.sheet.point(&there));
            seen.push(SeenPoint { point, from });
        }
    }
    seen
}

/// A point's place along the seam and distance from it, m.
fn place_m(plate: &Plate, point: &Vector3<f64>) -> [f64; 2] {
    let from_centre = point - plate.chart.centre;
    [plate.chart.along.dot(&from_centre), plate.chart.outward.dot(&from_centre)]
}

/// The visible range of r and s of a plate.
fn visible(plate: &Plate, seen: &[SeenPoint]) -> Option<[[f64; 2]; 2]> {
    let range = |axis: usize, unit_m: f64| {
        let places = || seen.iter().map(|seen| place_m(plate, &seen.point)[axis] / unit_m);
        Some([quantile(places(), BEYOND)?, quantile(places(), 1.0 - BEYOND)?])
    };
    Some([range(1, SURFACE_REACH_M)?, range(0, SURFACE_LENGTH_M)?])
}

/// The points relative to the best-fitting plane.
fn on_plane(plane: &Plate, seen: &[SeenPoint]) -> Vec<PlatePoint> {
    let on = |SeenPoint { point, from }: &SeenPoint| PlatePoint {
        in_base: *point,
        place_m: place_m(plane, point),
        height_m: plane.distance(point).value * plane.normal.dot(&(from - point)).signum(),
    };
    seen.iter().map(on).collect()
}
