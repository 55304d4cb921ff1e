//! Proposes the next board for the laser plane: its stripe would reduce the plane's uncertainty most over the measured
//! range.

use super::joint::JointFit;
use crate::picture_fit::TWIST_REACH_M;
use crate::projection::{CAMERA_SIZE, project};
use crate::sheet_tilt;
use nalgebra::{Matrix3, RowVector3, Vector3};

/// Boards are tried nearer and farther than those before by this part of their distance.
const BEYOND: f64 = 0.25;

/// Turns of the stripe in the laser plane that are tried, rad: a board that is turned by 30° about the vertical.
const TURN_RAD: f64 = 0.52;

/// A board worth adding.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NextBoard {
    /// Distance of the stripe's middle along the camera's axis, m.
    pub depth_m: f64,
    /// Distances of the nearest and the farthest board so far, m.
    pub seen_m: [f64; 2],
    /// Place of the board's middle along the stripe: −1 left, 0 middle, 1 right.
    pub side: i32,
    /// Turn of the stripe: its left end comes nearer where positive, rad.
    pub turn_rad: f64,
    /// Uncertainty of the plane's offset over the points so far, root mean square, m.
    pub now_m: f64,
    /// And with that board, m.
    pub then_m: f64,
}

/// The best of three distances, three places and three rotations; `None` if none of them is in the picture.
#[must_use]
pub fn best(fit: &JointFit) -> Option<NextBoard> {
    let stripes = Stripes::of(fit)?;
    let covariance: Matrix3<f64> = fit.covariance.fixed_view::<3, 3>(CAMERA_SIZE, CAMERA_SIZE).into();
    let information = covariance.try_inverse()?;
    let now_m = stripes.uncertainty_m(fit, &covariance);
    let [near, far] = stripes.seen_m;
    let depths = [near * (1.0 - BEYOND), 0.5 * (near + far), far * (1.0 + BEYOND)];
    let sides = [-1, 0, 1];
    let turns = [-TURN_RAD, 0.0, TURN_RAD];
    depths
        .into_iter()
        .flat_map(|depth_m| sides.map(|side| (depth_m, side)))
        .flat_map(|(depth_m, side)| turns.map(|turn_rad| (depth_m, side, turn_rad)))
        .filter_map(|(depth_m, side, turn_rad)| {
            let added = stripes.information_of(fit, depth_m, side, turn_rad)?;
            let then_m = stripes.uncertainty_m(fit, &(information + added).try_inverse()?);
            Some(NextBoard { depth_m, seen_m: stripes.seen_m, side, turn_rad, now_m, then_m })
        })
        .min_by(|a, b| a.then_m.total_cmp(&b.then_m))
}

/// Properties of the stripes so far.
struct Stripes {
    middle: Vector3<f64>,
    /// Along the stripes, to the right in the picture; and square to that in the plane, away from the camera.
    along: Vector3<f64>,
    away: Vector3<f64>,
    half_length_m: f64,
    count: f64,
    seen_m: [f64; 2],
}

impl Stripes {
    fn of(fit: &JointFit) -> Option<Self> {
        let normal = fit.plane()?.normal().into_inner();
        let ends: Vec<(Vector3<f64>, Vector3<f64>)> = fit
            .points
            .iter()
            .filter_map(|points| {
                let left = points.iter().min_by(|a, b| a.x.total_cmp(&b.x))?;
                let right = points.iter().max_by(|a, b| a.x.total_cmp(&b.x))?;
                Some((*left, *right))
            })
            .collect();
        let count = ends.len() as f64;
        let along: Vector3<f64> = ends.iter().map(|(left, right)| right - left).sum::<Vector3<f64>>() / count;
        let along = (along - normal * normal.dot(&along)).try_normalize(1e-9)?;
        let away = normal.cross(&along);
        let away = away * away.z.signum();
        let depths = || ends.iter().map(|(left, right)| 0.5 * (left.z + right.z));
        Some(Self {
            middle: ends.iter().map(|(left, right)| 0.5 * (left + right)).sum::<Vector3<f64>>() / count,
            along,
            away,
            half_length_m: 0.5 * ends.iter().map(|(left, right)| (right - left).norm()).sum::<f64>() / count,
            count: fit.points.iter().map(Vec::len).sum::<usize>() as f64 / count,
            seen_m: [depths().fold(f64::INFINITY, f64::min), depths().fold(0.0, f64::max)],
        })
    }

    /// Information on (θ₁, θ₂, offset) of a board's stripe: its offset from the plane and its slope. `None` out of the picture.
    fn information_of(&self, fit: &JointFit, depth_m: f64, side: i32, turn_rad: f64) -> Option<Matrix3<f64>> {
        let axes = sheet_tilt::axes(&fit.plane()?);
        let direction = self.along * turn_rad.cos() + self.away * turn_rad.sin();
        let middle = self.middle
            + self.away * ((depth_m - self.middle.z) / self.away.z)
            + self.along * (f64::from(side) * self.half_length_m);
        for end in [-1.0, 1.0] {
            let (pixel, ..) = project(&fit.state.camera, &(middle + direction * (end * self.half_length_m)))?;
            let [width, height] = fit.state.camera.size.map(f64::from);
            if !(pixel.x > 0.0 && pixel.y > 0.0 && pixel.x < width && pixel.y < height) {
                return None;
            }
        }
        let of_pixels = (fit.stripe_sigma_px / fit.stripe_px_per_m).powi(2) / self.count;
        let flat = fit.flatness_m.powi(2);
        let offset_variance = flat + of_pixels;
        let slope_variance = flat / TWIST_REACH_M.powi(2) + of_pixels * 3.0 / self.half_length_m.powi(2);
        let (place, slope) = (middle.transpose() * axes, direction.transpose() * axes);
        let offset = RowVector3::new(place[0], place[1], -1.0);
        let slope = RowVector3::new(slope[0], slope[1], 0.0);
        let row = |row: RowVector3<f64>, variance: f64| row.transpose() * row / variance;
        Some(row(offset, offset_variance) + row(slope, slope_variance))
    }

    /// Root mean square standard deviation of the plane's offset at the points so far, m.
    fn uncertainty_m(&self, fit: &JointFit, covariance: &Matrix3<f64>) -> f64 {
        let Some(plane) = fit.plane() else { return f64::INFINITY };
        let axes = sheet_tilt::axes(&plane);
        let (mut sum, mut count) = (0.0, 0.0);
        for point in fit.points.iter().flatten() {
            let tilts = point.transpose() * axes;
            let d_distance = Vector3::new(tilts[0], tilts[1], -1.0);
            sum += d_distance.dot(&(covariance * d_distance));
            count += 1.0;
        }
        (sum / f64::max(count, 1.0)).max(0.0).sqrt()
    }
}
