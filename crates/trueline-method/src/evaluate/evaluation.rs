//! Distances of measured seam points from a reference.

use crate::config::Config;
use crate::error::Error;
use crate::evaluate::reference_curve::{Form, ReferenceCurve};
use crate::evaluate::seam_points::{self, SeamPoint};
use crate::input::skip::Skip;
use crate::order_statistics::median;
use nalgebra::Vector3;
use std::collections::BTreeMap;
use trueline_dataset::{Guess, Recording};

/// A point with its error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Deviation {
    /// The point.
    pub measured: SeamPoint,
    /// From the nearest point of the reference to the point, m in base.
    pub error_m: Vector3<f64>,
}

/// Statistics of errors, as in the paper's Table I.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Figures {
    /// Number of points.
    pub count: usize,
    /// RMS distance, m.
    pub rmse_m: f64,
    /// Mean distance, m. At most the RMS.
    pub mae_m: f64,
    /// Median distance, m, which is robust against outliers.
    pub median_m: f64,
    /// Largest distance, m.
    pub max_m: f64,
    /// Mean error in base, m: an offset of the whole seam.
    pub bias_m: Vector3<f64>,
}

impl Figures {
    /// Statistics of errors.
    #[must_use]
    pub fn of(errors: impl Iterator<Item = Vector3<f64>>) -> Self {
        let errors: Vec<Vector3<f64>> = errors.collect();
        let n = errors.len().max(1) as f64;
        let distances = || errors.iter().map(Vector3::norm);
        Self {
            count: errors.len(),
            rmse_m: (distances().map(|d| d * d).sum::<f64>() / n).sqrt(),
            mae_m: distances().sum::<f64>() / n,
            median_m: median(distances()).unwrap_or(0.0),
            max_m: distances().fold(0.0, f64::max),
            bias_m: errors.iter().sum::<Vector3<f64>>() / n,
        }
    }
}

/// Check of points against a tolerance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ToleranceCheck {
    /// Tolerance of a point, m.
    pub tolerance_m: f64,
    /// Points within the tolerance.
    pub near: usize,
    /// Points beyond it.
    pub far: usize,
    /// Features without a point where there should be one: off the image, or while the robot was not recorded. They count as beyond the tolerance,
    /// because a robot could not follow them.
    pub lost: usize,
    /// Points beyond the ends of the reference.
    pub beyond_ends: usize,
    /// Share of the points that the reference must cover.
    pub needed_coverage: f64,
}

/// A point further from its reference than this many median distances is an outlier. The median of a distance in the plane across a seam
/// is 1.18 standard deviations, so a normal error goes beyond once in 10⁷ points.
pub const OUTLIER_MEDIANS: f64 = 5.0;

/// No point nearer than this is an outlier, m: points without noise have no median distance.
const LEAST_OUTLIER_M: f64 = 5e-5;

/// Part of the points that must be within a tolerance: the rest are wild points, as every sensor has them.
pub const NEEDED_WITHIN: f64 = 0.95;

/// Default fraction of the scan that a reference must cover. A verdict on less than half does not hold for the scan.
pub const NEEDED_COVERAGE: f64 = 0.5;

impl ToleranceCheck {
    /// Number of points within the reference, and lost ones.
    #[must_use]
    pub fn judged(&self) -> usize {
        self.near + self.far + self.lost
    }

    /// Fraction of the judged points within the tolerance.
    #[must_use]
    pub fn within(&self) -> f64 {
        self.near as f64 / self.judged().max(1) as f64
    }

    /// Fraction of all points that are judged.
    #[must_use]
    pub fn coverage(&self) -> f64 {
        self.judged() as f64 / (self.judged() + self.beyond_ends).max(1) as f64
    }

    /// Whether enough points are within the tolerance.
    #[must_use]
    pub fn is_near_enough(&self) -> bool {
        self.within() >= NEEDED_WITHIN
    }

    /// Whether the reference covers enough of the scan.
    #[must_use]
    pub fn is_covered(&self) -> bool {
        self.coverage() >= self.needed_coverage
    }

    /// Whether both conditions hold.
    #[must_use]
    pub fn passed(&self) -> bool {
        self.is_near_enough() && self.is_covered()
    }
}

/// Evaluation of a calibration on a scan.
#[derive(Clone, Debug)]
pub struct Evaluation {
    /// Reference seams.
    pub references: Vec<ReferenceCurve>,
    /// Whether they were given. Else they were fitted to the calibrated points.
    pub known: bool,
    /// Every point with the calibration.
    pub calibrated: Vec<Deviation>,
    /// The same without the time offset.
    pub without_offset: Vec<Deviation>,
    /// Points beyond the ends of the reference, which both lists leave out.
    pub beyond_ends: usize,
    /// Features without a point, by reason.
    pub skipped: BTreeMap<Skip, usize>,
}

impl Evaluation {
    /// Median distance of the calibrated points from the fit to them, m. `None` if the reference was given.
    #[must_use]
    pub fn fitted_median_m(&self) -> Option<f64> {
        (!self.known).then(|| Figures::of(self.calibrated.iter().map(|point| point.error_m)).median_m)
    }

    /// Distance beyond which a calibrated point is an outlier, m.
    #[must_use]
    pub fn outlier_limit_m(&self) -> f64 {
        let of_all = Figures::of(self.calibrated.iter().map(|point| point.error_m));
        (OUTLIER_MEDIANS * of_all.median_m).max(LEAST_OUTLIER_M)
    }

    /// Figures over the calibrated points that are no outliers.
    #[must_use]
    pub fn without_outliers(&self) -> Figures {
        let limit_m = self.outlier_limit_m();
        Figures::of(self.calibrated.iter().map(|point| point.error_m).filter(|error| error.norm() <= limit_m))
    }

    /// Number of calibrated points that are outliers.
    #[must_use]
    pub fn outliers(&self) -> usize {
        self.calibrated.len() - self.without_outliers().count
    }

    /// The calibrated points against a tolerance, m; the reference must cover this part of them.
    #[must_use]
    pub fn check(&self, tolerance_m: f64, needed_coverage: f64) -> ToleranceCheck {
        let near = self.calibrated.iter().filter(|point| point.error_m.norm() <= tolerance_m).count();
        // A repeated row is not a separate point.
        let lost = self.skipped.iter().filter(|(why, _)| **why != Skip::Repeated).map(|(_, count)| count);
        ToleranceCheck {
            tolerance_m,
            near,
            far: self.calibrated.len() - near,
            lost: lost.sum(),
            beyond_ends: self.beyond_ends,
            needed_coverage,
        }
    }
}

/// Evaluates a calibration on a scan of given seams, or of seams with the best-fitting form.
///
/// # Errors
/// A recording that cannot be placed, or too few points for a fit.
pub fn evaluate(
    recording: &Recording,
    by: &Guess,
    known: Option<Vec<ReferenceCurve>>,
    form: Form,
) -> Result<Evaluation, Error> {
    let config = Config::default();
    let points = seam_points::place(recording, by, &config)?;
    let without = seam_points::place(recording, &Guess { time_offset_s: 0.0, ..*by }, &config)?;
    let is_known = known.is_some();
    let references = match known {
        Some(references) => references,
        None => fitted(&points.list, form).ok_or(Error::NothingToFit { points: points.list.len() })?,
    };
    if points.list.is_empty() {
        return Err(Error::NothingToFit { points: 0 });
    }
    let seams = points.list.iter().map(|p| p.line as usize + 1).max().unwrap_or(0);
    if seams > references.len() {
        return Err(Error::ReferenceMissing { seams, references: references.len() });
    }
    let (calibrated, beyond_ends) = against(&points.list, &references);
    if calibrated.is_empty() {
        let nearest_mm = nearest_m(&points.list, &references) * 1e3;
        return Err(Error::BeyondReference { points: beyond_ends, nearest_mm });
    }
    let (without_offset, _) = against(&without.list, &references);
    Ok(Evaluation {
        references,
        known: is_known,
        calibrated,
        without_offset,
        beyond_ends,
        skipped: points.skipped,
    })
}

/// A reference for each seam.
fn fitted(points: &[SeamPoint], form: Form) -> Option<Vec<ReferenceCurve>> {
    let seams = points.iter().map(|p| p.line).max()? + 1;
    let of = |seam: u32| {
        let own: Vec<Vector3<f64>> =
            points.iter().filter(|p| p.line == seam).map(|p| p.point_in_base).collect();
        ReferenceCurve::fitted(&own, form)
    };
    (0..seams).map(of).collect()
}

/// Distance of the nearest point from its reference, including the ends, m.
fn nearest_m(points: &[SeamPoint], references: &[ReferenceCurve]) -> f64 {
    let distance =
        |p: &SeamPoint| references.get(p.line as usize).map(|r| r.distance_with_ends(&p.point_in_base));
    points.iter().filter_map(distance).fold(f64::INFINITY, f64::min)
}

/// The errors of all points against the reference of each seam, and the number of points beyond its ends.
#[must_use]
pub fn against(points: &[SeamPoint], references: &[ReferenceCurve]) -> (Vec<Deviation>, usize) {
    let deviations: Vec<Deviation> = points
        .iter()
        .filter_map(|measured| {
            let error_m = references.get(measured.line as usize)?.deviation(&measured.point_in_base)?;
            Some(Deviation { measured: *measured, error_m })
        })
        .collect();
    let beyond = points.len() - deviations.len();
    (deviations, beyond)
}
