//! Pose of a drawn curve in base: the scan's curve is laid over the drawing at every place of it, in both directions.
//!
//! At each start along the drawing the two curves are paired by arc length and aligned in closed form \[Kabsch1976\]. The best
//! few are refined with distances perpendicular to the curve only. A second place that fits as well within the tolerance is a
//! symmetry of the part.

use nalgebra::{Matrix3, Matrix6, Rotation3, SymmetricEigen, UnitQuaternion, Vector3, Vector6};
use trueline_geometry::{Polyline, Pose, se3, so3};

/// Distance of the starts along the drawing, m …
const START_M: f64 = 2e-3;
/// … and their maximum number.
const MOST_STARTS: usize = 20_000;
/// Points of the scan's curve that are paired at each start.
const PAIRED: usize = 48;
/// Places that are refined.
const REFINED: usize = 10;
/// Steps of the refinement.
const STEPS: usize = 25;
/// Damping of the refinement, as a fraction of the mean information.
const DAMPING: f64 = 1e-3;
/// This fraction of the scan's curve must lie beside the drawing.
const LEAST_BESIDE: f64 = 0.85;
/// Distance assigned to a point beyond an end of the drawing, m.
const BEYOND_M: f64 = 1e-3;
/// Two places are different if they are farther apart than this, rad and m.
const TWO: (f64, f64) = (2.0 * std::f64::consts::PI / 180.0, 1e-3);
/// A place fits as well as the best if its squares, over the tolerance, exceed the best's by less than this: three standard
/// deviations.
const AS_GOOD: f64 = 9.0;
/// Errors of a curve are independent over about this length, m.
const INDEPENDENT_M: f64 = 10e-3;
/// A direction is open if the part slides along it by more than this, m.
const SLIDES_M: f64 = 1e-3;

/// A turn that maps a drawing onto itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Symmetry {
    /// Unit vector of the axis in base.
    pub axis: Vector3<f64>,
    /// A point of it in base, m.
    pub point_m: Vector3<f64>,
    /// The turn, rad; `None` if any turn does.
    pub angle_rad: Option<f64>,
}

/// Points at even distances along a curve.
#[derive(Clone, Debug)]
pub(crate) struct Evenly {
    points: Vec<Vector3<f64>>,
    step_m: f64,
    /// Whether the curve is closed.
    pub closed: bool,
}

impl Evenly {
    /// Along straight segments between points, about `step_m` apart; `None` if they have no length.
    #[must_use]
    pub(crate) fn along(corners: &[Vector3<f64>], step_m: f64, closed: bool) -> Option<Self> {
        let ring = closed.then(|| corners[0]);
        let corners: Vec<Vector3<f64>> = corners.iter().copied().chain(ring).collect();
        let mut along_m = vec![0.0];
        for pair in corners.windows(2) {
            along_m.push(along_m[along_m.len() - 1] + (pair[1] - pair[0]).norm());
        }
        let length_m = *along_m.last()?;
        if !(length_m > 0.0 && length_m.is_finite()) {
            return None;
        }
        let count = ((length_m / step_m).ceil() as usize).clamp(8, 1_000_000);
        let step_m = length_m / count as f64;
        let mut piece = 0;
        let at = |k: usize| {
            let wanted_m = (k as f64 * step_m).min(length_m);
            while piece + 2 < along_m.len() && along_m[piece + 1] < wanted_m {
                piece += 1;
            }
            let (from_m, to_m) = (along_m[piece], along_m[piece + 1]);
            let part = if to_m > from_m { (wanted_m - from_m) / (to_m - from_m) } else { 0.0 };
            corners[piece] + (corners[piece + 1] - corners[piece]) * part
        };
        let last = if closed { count } else { count + 1 };
        Some(Self { points: (0..last).map(at).collect(), step_m, closed })
    }

    /// Points as they are.
    #[must_use]
    pub(crate) fn of_points(points: Vec<Vector3<f64>>) -> Self {
        Self { points, step_m: f64::EPSILON, closed: false }
    }

    /// A drawing, times a factor; ends nearer than `closed_m` coincide.
    #[must_use]
    pub(crate) fn of_drawing(curve: &Polyline, factor: f64, closed_m: f64) -> Option<Self> {
        let mut points: Vec<Vector3<f64>> = curve.points().iter().map(|point| point * factor).collect();
        let closed = points.len() > 3 && (points[0] - points[points.len() - 1]).norm() < closed_m;
        if closed {
            points.pop();
        }
        let length_m: f64 = points.windows(2).map(|pair| (pair[1] - pair[0]).norm()).sum();
        Self::along(&points, (0.5 * START_M).max(length_m / (2 * MOST_STARTS) as f64), closed)
    }

    /// Its length, m.
    #[must_use]
    pub(crate) fn length_m(&self) -> f64 {
        let pieces = if self.closed { self.points.len() } else { self.points.len() - 1 };
        pieces as f64 * self.step_m
    }

    /// The point at a length along it, m; `None` beyond the ends of an open curve.
    #[must_use]
    pub(crate) fn at(&self, along_m: f64) -> Option<Vector3<f64>> {
        let count = self.points.len();
        let place = along_m / self.step_m;
        let place = if self.closed { place.rem_euclid(count as f64) } else { place };
        let last = if self.closed { count } else { count - 1 };
        // Rounding: a millionth of a step beyond an end.
        if !(-1e-6..=last as f64 + 1e-6).contains(&place) {
            return None;
        }
        let before = (place.max(0.0) as usize).min(last - 1);
        let part = place - before as f64;
        Some(self.points[before] * (1.0 - part) + self.points[(before + 1) % count] * part)
    }

    fn tangent(&self, along_m: f64) -> Option<Vector3<f64>> {
        let ahead = self.at(along_m + self.step_m).or_else(|| self.at(along_m))?;
        let behind = self.at(along_m - self.step_m).or_else(|| self.at(along_m))?;
        (ahead - behind).try_normalize(f64::EPSILON)
    }

    /// Largest distance from the nearest straight line, m.
    #[must_use]
    pub(crate) fn bends_m(&self) -> f64 {
        bends_m(&self.points)
    }

    fn thinned(&self, most: usize) -> Vec<(f64, Vector3<f64>)> {
        let every = self.points.len().div_ceil(most).max(1);
        let own = self.points.iter().enumerate().step_by(every);
        own.map(|(k, point)| (k as f64 * self.step_m, *point)).collect()
    }
}

/// Largest distance of points from their nearest line, m.
#[must_use]
pub(crate) fn bends_m(points: &[Vector3<f64>]) -> f64 {
    let middle = points.iter().sum::<Vector3<f64>>() / points.len().max(1) as f64;
    let scatter: Matrix3<f64> = points.iter().map(|p| (p - middle) * (p - middle).transpose()).sum();
    let eigen = scatter.symmetric_eigen();
    let along = eigen.eigenvectors.column(eigen.eigenvalues.imax()).into_owned();
    let off = |p: &Vector3<f64>| (p - middle - along * along.dot(&(p - middle))).norm();
    points.iter().map(off).fold(0.0, f64::max)
}

/// A drawing laid over a scan's curve.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Laid {
    /// Pose of the part.
    pub base_from_part: Pose,
    /// Ends of the scan's curve on the drawing, m along it; the second is smaller if the directions are opposite.
    pub span_m: [f64; 2],
    /// Root mean square distance, m.
    pub rms_m: f64,
    /// Largest distance, m.
    pub worst_m: f64,
    /// Another place that fits as well.
    pub symmetry: Option<Symmetry>,
}

/// Lays a drawing over a scan's curve; `None` if the drawing is too short for it.
#[must_use]
pub(crate) fn laid(scan: &Evenly, drawing: &Evenly, tolerance_m: f64) -> Option<Laid> {
    let mut places: Vec<Place> = starts(scan, drawing)
        .into_iter()
        .take(REFINED)
        .filter_map(|start| start.refined(scan, drawing))
        .collect();
    places.sort_by(|a, b| a.squared.total_cmp(&b.squared));
    let best = places.first()?;
    let symmetry = best
        .slides(tolerance_m)
        .or_else(|| places[1..].iter().find_map(|other| best.is_turned(other, scan.length_m(), tolerance_m)));
    Some(Laid {
        base_from_part: best.base_from_part,
        span_m: best.span_m,
        rms_m: best.rms_m,
        worst_m: best.worst_m,
        symmetry,
    })
}

/// A start along the drawing.
struct Start {
    base_from_part: Pose,
    along_m: f64,
    forward: f64,
    squared: f64,
}

/// Starts that fit better than their neighbours, the best first.
fn starts(scan: &Evenly, drawing: &Evenly) -> Vec<Start> {
    let pairs = scan.thinned(PAIRED);
    let (length_m, over_m) = (drawing.length_m(), (1.0 - LEAST_BESIDE) * scan.length_m());
    let every_m = START_M.max(length_m / MOST_STARTS as f64);
    let mut found = Vec::new();
    for forward in [1.0, -1.0] {
        let (from_m, to_m) = match (drawing.closed, forward > 0.0) {
            (true, _) => (0.0, length_m),
            (false, true) => (-over_m, length_m - scan.length_m() + over_m),
            (false, false) => (scan.length_m() - over_m, length_m + over_m),
        };
        let count = ((to_m - from_m) / every_m).ceil();
        if count.is_nan() || count < 0.0 {
            continue;
        }
        let at = |k: usize| start(&pairs, drawing, from_m + k as f64 * every_m, forward);
        let own: Vec<Option<Start>> = (0..=count as usize).map(at).collect();
        let squared = |k: usize| own[k].as_ref().map_or(f64::INFINITY, |start| start.squared);
        let last = own.len() - 1;
        let beside = |k: usize| match drawing.closed {
            true => [(k + last) % (last + 1), (k + 1) % (last + 1)],
            false => [k.saturating_sub(1), (k + 1).min(last)],
        };
        let is_least = |k: usize| beside(k).iter().all(|other| squared(k) <= squared(*other));
        let least: Vec<bool> = (0..=last).map(is_least).collect();
        found.extend(own.into_iter().zip(least).filter_map(|(start, is_least)| start.filter(|_| is_least)));
    }
    found.sort_by(|a, b| a.squared.total_cmp(&b.squared));
    found
}

fn start(pairs: &[(f64, Vector3<f64>)], drawing: &Evenly, along_m: f64, forward: f64) -> Option<Start> {
    let both = pairs.iter().filter_map(|(m, point)| Some((*point, drawing.at(along_m + forward * m)?)));
    let both: Vec<(Vector3<f64>, Vector3<f64>)> = both.collect();
    if (both.len() as f64) < LEAST_BESIDE * pairs.len() as f64 || both.len() < 4 {
        return None;
    }
    let (base_from_part, squared) = over_each_other(&both)?;
    let squared = with_beyond(squared, both.len(), pairs.len());
    Some(Start { base_from_part, along_m, forward, squared })
}

/// Mean of squares including the points beyond an end, m². On a round curve every place fits as well; this selects the one that
/// contains all of the scan.
fn with_beyond(squared: f64, beside: usize, all: usize) -> f64 {
    let beyond = (all - beside) as f64;
    (squared * beside as f64 + beyond * BEYOND_M.powi(2)) / all as f64
}

/// The pose that aligns the second points with the first, and their mean squared distance, m² \[Kabsch1976\].
fn over_each_other(pairs: &[(Vector3<f64>, Vector3<f64>)]) -> Option<(Pose, f64)> {
    let count = pairs.len() as f64;
    let to = pairs.iter().map(|pair| pair.0).sum::<Vector3<f64>>() / count;
    let from = pairs.iter().map(|pair| pair.1).sum::<Vector3<f64>>() / count;
    let (mut product, mut squares) = (Matrix3::zeros(), 0.0);
    for (a, b) in pairs {
        let (a, b) = (a - to, b - from);
        product += b * a.transpose();
        squares += a.norm_squared() + b.norm_squared();
    }
    let svd = product.svd(true, true);
    let (u, vt) = (svd.u?, svd.v_t?);
    let sign = (vt.transpose() * u.transpose()).determinant().signum();
    let handed = Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, sign));
    let turned = vt.transpose() * handed * u.transpose();
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(turned));
    let values = svd.singular_values;
    let squared = (squares - 2.0 * (values[0] + values[1] + sign * values[2])).max(0.0) / count;
    Some((se3::from_parts(rotation, to - rotation * from), squared))
}

/// A refined place.
struct Place {
    base_from_part: Pose,
    span_m: [f64; 2],
    rms_m: f64,
    /// Mean of squares including points beyond an end, m².
    squared: f64,
    worst_m: f64,
    middle: Vector3<f64>,
    /// Sum of the squared derivatives of the distances by shift and turn about the middle.
    information: Matrix6<f64>,
}

impl Start {
    /// The place with the least distances perpendicular to the drawing; `None` if too little of the scan lies beside it.
    fn refined(&self, scan: &Evenly, drawing: &Evenly) -> Option<Place> {
        let points = scan.thinned(4 * PAIRED);
        let middle = points.iter().map(|(_, point)| point).sum::<Vector3<f64>>() / points.len() as f64;
        let mut along_m: Vec<f64> = points.iter().map(|(m, _)| self.along_m + self.forward * m).collect();
        let mut pose = self.base_from_part;
        let mut last = None;
        for _ in 0..STEPS {
            let (mut information, mut gradient) = (Matrix6::zeros(), Vector6::zeros());
            let (mut squares, mut worst_m, mut beside) = (0.0, 0.0_f64, 0_usize);
            for ((_, point), m) in points.iter().zip(&mut along_m) {
                let Some((off, tangent)) = across(drawing, &pose, point, m) else { continue };
                let across = Matrix3::identity() - tangent * tangent.transpose();
                let lever = point - off - middle;
                let by_turn = across * -so3::hat(&lever);
                let mut by_place = nalgebra::Matrix3x6::zeros();
                by_place.fixed_columns_mut::<3>(0).copy_from(&across);
                by_place.fixed_columns_mut::<3>(3).copy_from(&by_turn);
                information += by_place.tr_mul(&by_place);
                gradient += by_place.tr_mul(&off);
                squares += off.norm_squared();
                worst_m = worst_m.max(off.norm());
                beside += 1;
            }
            if (beside as f64) < LEAST_BESIDE * points.len() as f64 {
                return None;
            }
            last = Some(Place {
                base_from_part: pose,
                span_m: [*along_m.first()?, *along_m.last()?],
                rms_m: (squares / beside as f64).sqrt(),
                squared: with_beyond(squares / beside as f64, beside, points.len()),
                worst_m,
                middle,
                information,
            });
            // A straight or round curve slides along itself. A fraction of the other information damps this.
            let mean = |first: usize| (0..3).map(|k| information[(first + k, first + k)]).sum::<f64>() / 3.0;
            let damping = Vector6::from_fn(|k, _| DAMPING * if k < 3 { mean(0) } else { mean(3) });
            let step = (information + Matrix6::from_diagonal(&damping)).cholesky()?.solve(&gradient);
            let turn = UnitQuaternion::from_scaled_axis(step.fixed_rows::<3>(3).into_owned());
            let shift = step.fixed_rows::<3>(0).into_owned();
            let translation = turn * (pose.translation.vector - middle) + middle + shift;
            pose = se3::from_parts(turn * pose.rotation, translation);
            if shift.norm() < 1e-8 && step.fixed_rows::<3>(3).norm() < 1e-7 {
                break;
            }
        }
        last
    }
}

/// From the drawing to a point, perpendicular to it, and the tangent, in base; `along_m` follows the point along the drawing.
/// `None` beyond an end.
fn across(
    drawing: &Evenly,
    pose: &Pose,
    point: &Vector3<f64>,
    along_m: &mut f64,
) -> Option<(Vector3<f64>, Vector3<f64>)> {
    const FOLLOWS: usize = 3;
    let in_part = pose.rotation.inverse() * (point - pose.translation.vector);
    for _ in 0..FOLLOWS {
        let within_m = if drawing.closed { *along_m } else { along_m.clamp(0.0, drawing.length_m()) };
        let off = in_part - drawing.at(within_m)?;
        *along_m = within_m + drawing.tangent(within_m)?.dot(&off).clamp(-5e-3, 5e-3);
    }
    let (at, tangent) = (drawing.at(*along_m)?, drawing.tangent(*along_m)?);
    let off = in_part - at;
    Some((pose.rotation * (off - tangent * tangent.dot(&off)), pose.rotation * tangent))
}

impl Place {
    /// The direction in which the drawing slides along itself.
    fn slides(&self, tolerance_m: f64) -> Option<Symmetry> {
        // Turns are measured by the travel of a point at the mean distance from the middle.
        let (shifts, turns) = self.information.diagonal().into_iter().enumerate().fold(
            (0.0, 0.0),
            |(shifts, turns), (k, value)| {
                if k < 3 { (shifts + value, turns) } else { (shifts, turns + value) }
            },
        );
        let radius_m = (turns / f64::max(shifts, f64::MIN_POSITIVE)).sqrt();
        let units = Vector6::from_fn(|k, _| if k < 3 { 1.0 } else { 1.0 / radius_m });
        let scaled = Matrix6::from_fn(|i, j| self.information[(i, j)] * units[i] * units[j]);
        let eigen = SymmetricEigen::new(scaled);
        let least = eigen.eigenvalues.imin();
        let sigma_m = tolerance_m.hypot(self.rms_m) / eigen.eigenvalues[least].max(f64::MIN_POSITIVE).sqrt();
        let direction = eigen.eigenvectors.column(least).component_mul(&units);
        let (shift, turn) =
            (direction.fixed_rows::<3>(0).into_owned(), direction.fixed_rows::<3>(3).into_owned());
        let rate = turn.norm();
        // A straight curve slides without a turn, so it has no axis.
        let is_turn = rate * radius_m > 0.1;
        (sigma_m > SLIDES_M && is_turn).then(|| Symmetry {
            axis: turn / rate,
            point_m: self.middle + turn.cross(&shift) / rate.powi(2),
            angle_rad: None,
        })
    }

    /// The turn from this place to another that fits as well.
    fn is_turned(&self, other: &Self, length_m: f64, tolerance_m: f64) -> Option<Symmetry> {
        let pieces = 2.0 * (length_m / INDEPENDENT_M).max(1.0);
        let level = tolerance_m.powi(2) + self.rms_m.powi(2);
        let worse = pieces * (other.rms_m.powi(2) - self.rms_m.powi(2)) / level;
        let turn = (other.base_from_part.rotation * self.base_from_part.rotation.inverse()).scaled_axis();
        let to = |place: &Self, point: &Vector3<f64>| {
            place.base_from_part.rotation * point + place.base_from_part.translation.vector
        };
        let in_part =
            self.base_from_part.rotation.inverse() * (self.middle - self.base_from_part.translation.vector);
        let shift = to(other, &in_part) - self.middle;
        let angle = turn.norm();
        if worse > AS_GOOD || angle < TWO.0 && shift.norm() < TWO.1 {
            return None;
        }
        let axis = turn.try_normalize(TWO.0)?;
        // The point of the axis nearest to the middle, from the displacement of the middle by the turn.
        let flat = shift - axis * axis.dot(&shift);
        let point_m = self.middle + (flat + axis.cross(&flat) / (0.5 * angle).tan()) * 0.5;
        Some(Symmetry { axis, point_m, angle_rad: Some(angle) })
    }
}
