//! The light on the two surfaces beside a curved seam, and what a profiler's own software makes of it: a straight line through
//! each stripe, and the seam point where both meet.

use super::cell::{Cell, View};
use super::surface::Surface;
use crate::noise::Noise;
use crate::plates::{Crossing, MeasuredLine};
use nalgebra::Vector2;
use trueline_dataset::{Feature, Measured, PlateStripe, correlation_of};

/// Points of a stripe.
const LINE_POINTS: u32 = 40;
/// An outlier is off by up to this, m.
const OUTLIER_M: f64 = 8e-3;
/// A stated standard deviation is at least this, m: the weight of an exact stripe is finite.
const LEAST_SIGMA_M: f64 = 1e-8;

/// The surfaces beside a seam, and how their stripes are measured.
pub(super) struct Stripes {
    surfaces: [Surface; 2],
    reach_m: [f64; 2],
    noise_m: f64,
    outliers: f64,
    noise: Noise,
}

impl Stripes {
    /// Those of a cell and a seed; `None` of a scan without.
    pub(super) fn of(cell: &Cell, seed: u64) -> Option<Self> {
        let plates = cell.scan.plates?;
        Some(Self {
            surfaces: Surface::both(cell.scan.kind, plates.form_m, seed),
            reach_m: plates.reach_m,
            noise_m: cell.scan.noise_m,
            outliers: cell.scan.outliers,
            noise: Noise::new(seed, 37),
        })
    }

    /// The seam point and the stripes of a frame; `None` if the sheet does not cut both surfaces from one end of the reach to the
    /// other.
    pub(super) fn frame(&mut self, view: &View<'_>, stamp_ns: i64) -> Option<(Feature, [PlateStripe; 2])> {
        let s = view.seam_place()?;
        let light = [self.light(view, 0, s)?, self.light(view, 1, s)?];
        let lines = [self.line(&light[0])?, self.line(&light[1])?];
        let Crossing { at, covariance } = lines[0].crossing(&lines[1])?;
        let feature = Feature {
            stamp_ns,
            line: 0,
            frame: None,
            device_ns: None,
            measured: Measured::Profile(at.into()),
            sigma: Some([covariance.m11.sqrt(), covariance.m22.sqrt()]),
            correlation: correlation_of(&covariance),
        };
        let stripe = |plate: u32| {
            let MeasuredLine { points, sigma } = lines[plate as usize];
            let points = points.map(|point| Measured::Profile(point.into()));
            PlateStripe { stamp_ns, frame: None, plate, points, sigma }
        };
        Some((feature, [stripe(0), stripe(1)]))
    }

    /// The points of a surface in the sheet as an exact sensor reports them, from the seam outward.
    fn light(&self, view: &View<'_>, side: usize, seam: f64) -> Option<Vec<Vector2<f64>>> {
        let [near, far] = self.reach_m;
        let surface = &self.surfaces[side];
        let mut s = seam;
        let mut points = Vec::with_capacity(LINE_POINTS as usize);
        for k in 0..LINE_POINTS {
            let from_seam_m = near + (far - near) * f64::from(k) / f64::from(LINE_POINTS - 1);
            s = root(|s| view.out_of_sheet(&surface.point(s, from_seam_m)), s)?;
            if !surface.has(s) {
                return None;
            }
            points.push(view.reported(&surface.point(s, from_seam_m))?.into());
        }
        Some(points)
    }

    /// The line through noisy points, and now and then somewhere else.
    fn line(&mut self, light: &[Vector2<f64>]) -> Option<MeasuredLine> {
        let mut noisy = |at: &Vector2<f64>| at + Vector2::from_fn(|_, _| self.noise.normal(self.noise_m));
        let points: Vec<Vector2<f64>> = light.iter().map(&mut noisy).collect();
        let line = MeasuredLine::through(&points, self.noise_m)?;
        let is_off = self.noise.happens(self.outliers);
        let off_m = if is_off { self.noise.uniform(-OUTLIER_M, OUTLIER_M) } else { 0.0 };
        let line = line.displaced(off_m);
        Some(MeasuredLine { sigma: line.sigma.max(LEAST_SIGMA_M), ..line })
    }
}

/// The root of a function nearest to a place on the curve: outward in steps, then false position.
fn root(of: impl Fn(f64) -> f64, from: f64) -> Option<f64> {
    const STEP: f64 = 2e-3;
    const STEPS: i32 = 60;
    /// Of a length, m: beyond rounding.
    const CLOSE_M: f64 = 1e-13;
    let step = |k: i32, direction: f64| {
        let at = |k: i32| from + direction * STEP * f64::from(k);
        [at(k), at(k + 1)]
    };
    let [mut a, mut b] =
        (0..STEPS).flat_map(|k| [step(k, 1.0), step(k, -1.0)]).find(|[a, b]| of(*a) * of(*b) <= 0.0)?;
    let (mut at_a, mut at_b) = (of(a), of(b));
    for _ in 0..100 {
        if at_b.abs() < CLOSE_M || at_a == at_b {
            break;
        }
        let next = (a * at_b - b * at_a) / (at_b - at_a);
        let value = of(next);
        if value * at_b <= 0.0 {
            (a, at_a) = (b, at_b);
        } else {
            // An end that stays counts half: both ends move in.
            at_a *= 0.5;
        }
        (b, at_b) = (next, value);
    }
    Some(b)
}
