//! A scan over a seam with a drawing. First a curve of unknown form is fitted. Then the drawing is laid over it. Then all
//! unknowns are fitted again with the curve as drawn, to within a tolerance.

use crate::config::SeamCad;
use crate::curve::answer::{Answered, Asked, held_at};
use crate::curve::equations::{Known, State};
use crate::curve::estimate::CadEstimate;
use crate::curve::fit::{Fitted, Terms, Weighing};
use crate::curve::knots::{BEYOND, MOST_CONTROL};
use crate::curve::placed::Placed;
use crate::curve::registration::{Evenly, Laid, laid};
use crate::curve::seen::Seen;
use crate::curve::smoothness::Parts;
use crate::curve::solve::{Finished, first_factor, of_all};
use crate::curve::spline::Spline;
use crate::error::cad_problem::{CadProblem, CadUnit};
use nalgebra::Vector3;
use std::cmp::Ordering;

/// A drawing that bends by less than this fraction of its length is straight.
const STRAIGHT: f64 = 1e-3;
/// Ends of a drawing that are nearer than this coincide, m: programs write few decimals.
const CLOSED_M: f64 = 0.1e-3;
/// The scan's curve may be off the drawing by this multiple of the tolerance and of its own ±: its errors are similar all along
/// it.
const OFF_SIGMAS: (f64, f64) = (3.0, 6.0);
/// Beyond this distance a drawing is a different curve, however uncertain the scan's curve is, m.
const MOST_OFF_M: f64 = 5e-3;
/// If the scan does not determine all of the hand-eye transform, its curve is off by as much as that moves it, m.
const UNSEEN_M: f64 = 3e-3;
/// The residuals may grow by this factor; beyond it the drawing is a different curve.
const WORSE: f64 = 1.5;
/// … and so may the fraction of outliers.
const MORE_OFF: f64 = 0.1;
/// Rounds of noise level and weights, and steps of each.
const ROUNDS: usize = 4;
const STEPS: usize = 10;
/// Directions known to less than half of the required information are held.
const HELD: f64 = 1.0;
/// The scan's curve is sampled at this distance, m.
const SCAN_STEP_M: f64 = 1e-3;

/// Checks that a drawing can be used for a seam.
///
/// # Errors
/// If it is a straight line.
pub(crate) fn checked(cad: &SeamCad) -> Result<Evenly, CadProblem> {
    let straight = CadProblem::Straight { bends_m: 0.0 };
    let drawing = Evenly::of_drawing(&cad.curve, 1.0, closed_m(cad)).ok_or(straight)?;
    let bends_m = drawing.bends_m();
    if bends_m < STRAIGHT * drawing.length_m() {
        return Err(CadProblem::Straight { bends_m });
    }
    Ok(drawing)
}

/// Ends nearer than this coincide, also in a drawing in other units.
fn closed_m(cad: &SeamCad) -> f64 {
    let corners = cad.curve.points();
    let length_m: f64 = corners.windows(2).map(|pair| (pair[1] - pair[0]).norm()).sum();
    CLOSED_M.min(1e-3 * length_m).max(1e-12)
}

impl Asked<'_> {
    /// The answer with a drawing of the seam, from the answer without. A collapsed curve is returned as it is, because it is
    /// refused.
    ///
    /// # Errors
    /// If the drawing does not fit the scan.
    pub(crate) fn by_cad(&self, free: Answered, cad: &SeamCad) -> Result<Answered, CadProblem> {
        let drawing = checked(cad)?;
        if free.curve.collapsed_from_m.is_some() {
            return Ok(free);
        }
        let scan = scanned(&free.finished.fitted.state.spline);
        let limit_m = limit_m(&free, cad.tolerance_m);
        let laid = fitting(&scan, &drawing, cad, limit_m)?;
        let misses = |times: f64| CadProblem::NotTheReadings {
            times,
            rms_m: laid.rms_m,
            tolerance_m: cad.tolerance_m,
        };
        let (state, rounded_m) = self.placed(&free, &drawing, &laid).ok_or(misses(f64::INFINITY))?;
        let held = self.search.guess.filter(|_| free.is_held);
        let stated = held.map(held_at);
        let tolerance_m = cad.tolerance_m.hypot(rounded_m);
        let mut finished = self.finished(state, stated.as_ref(), tolerance_m).ok_or(misses(f64::INFINITY))?;
        finished.evidence = free.finished.evidence;
        finished.first_length_m = finished.fitted.state.seen_length_m();
        let rms_m = distance_m(&finished.fitted.state);
        let (times, before) = (finished.factor / free.finished.factor, free.share_off());
        let mut answer = self.concluded(finished, free.rivals.clone(), &free.course, (false, held));
        if times > WORSE || answer.share_off() > before + MORE_OFF || rms_m > limit_m {
            return Err(misses(times));
        }
        // A drawing with a tolerance above the error of the scan's own curve adds nothing.
        let used = is_surer(&answer, &free);
        let placed = answer.finished.fitted.state.placed.as_ref();
        let cad = placed.map(|placed| CadEstimate {
            used,
            base_from_part: placed.base_from_part,
            rms_m: if used { rms_m } else { laid.rms_m },
            symmetry: laid.symmetry,
        });
        if !used {
            answer = free;
        }
        answer.curve.cad = cad;
        Ok(answer)
    }

    /// The state with the drawing in place of the curve.
    fn placed(&self, free: &Answered, drawing: &Evenly, laid: &Laid) -> Option<(State, f64)> {
        let before = &free.finished.fitted.state;
        let (drawn, rounded_m) =
            part_of(drawing, laid.span_m, before.spline.closed, before.spline.spacing_m)?;
        let placed = Placed::new(drawn, laid.base_from_part);
        let (spline, u_m) = (placed.spline(), before.u_m.clone());
        let state = State { at: before.at, spline, u_m, placed: Some(placed), plates: None };
        Some((of_all(self.search.readings, &state), rounded_m))
    }

    /// The optimum with the drawing; directions that it does not determine are held.
    pub(crate) fn finished(
        &self,
        state: State,
        stated: Option<&Known>,
        tolerance_m: f64,
    ) -> Option<Finished> {
        let readings = self.search.readings;
        let mut known = stated.cloned().unwrap_or_else(|| Known::of_any_sensor(&state.at));
        let mut factor = first_factor(readings, &state);
        let (mut next, mut last) = (state, None::<Fitted>);
        for round in 0..ROUNDS {
            let weighing = Weighing::Noise { factor };
            let terms = Terms { readings, weighing, s3_m: tolerance_m, known: &known, steps: STEPS };
            let fitted = terms.fit(next)?;
            next = fitted.state.clone();
            if round == 0 && stated.is_none() {
                let seen = Seen::of_known_form(&Parts::of(&fitted, &known), tolerance_m, 1.0)?;
                known.hold(&next.at, &seen.holding(HELD));
            }
            factor = fitted.median_factor(readings);
            last = Some(fitted);
        }
        let weighing = Weighing::Fixed { factor, weights: last?.weights };
        let terms = Terms { readings, weighing, s3_m: tolerance_m, known: &known, steps: STEPS };
        let fitted = terms.fit(next)?;
        let parts = Parts::of(&fitted, &known);
        let root = parts.with(tolerance_m).root()?;
        let effective = parts.effective(&root);
        let variance = parts.noise_variance(effective);
        Some(Finished {
            evidence: [f64::NEG_INFINITY; 2],
            effective,
            variance,
            factor: factor * variance.sqrt(),
            seen: Seen::of_known_form(&parts, tolerance_m, variance)?,
            root,
            parts,
            s3_m: tolerance_m,
            fitted,
            first_length_m: 0.0,
        })
    }
}

/// Whether an answer determines more than another, or the same better.
fn is_surer(answer: &Answered, other: &Answered) -> bool {
    let shown = |answer: &Answered| answer.components.iter().filter(|seen| **seen).count();
    match shown(answer).cmp(&shown(other)) {
        Ordering::Equal if answer.is_held => answer.noise[(0, 0)] < other.noise[(0, 0)],
        Ordering::Equal => answer.noise.determinant() < other.noise.determinant(),
        more => more == Ordering::Greater,
    }
}

/// Allowed distance of the scan's curve from the drawing, m.
fn limit_m(free: &Answered, tolerance_m: f64) -> f64 {
    let sigmas = &free.curve.sigma_m;
    let mean = sigmas.iter().map(|sigma| sigma * sigma).sum::<f64>() / sigmas.len().max(1) as f64;
    let is_seen = free.components.iter().all(|seen| *seen);
    let unseen_m = if is_seen { 0.0 } else { UNSEEN_M };
    (OFF_SIGMAS.0 * tolerance_m.hypot(unseen_m)).hypot((OFF_SIGMAS.1 * mean.sqrt()).min(MOST_OFF_M))
}

/// The drawing, if it fits the scan's curve.
fn fitting(scan: &Evenly, drawing: &Evenly, cad: &SeamCad, limit_m: f64) -> Result<Laid, CadProblem> {
    let found = laid(scan, drawing, cad.tolerance_m);
    if let Some(found) = found.filter(|found| found.rms_m < limit_m) {
        return Ok(found);
    }
    for (unit, factor) in CadUnit::ALL {
        let other = Evenly::of_drawing(&cad.curve, factor, closed_m(cad) * factor);
        // A drawing much smaller than the scan fits anywhere; one a thousand times as long takes long.
        let within = |other: &Evenly| (0.8..100.0).contains(&(other.length_m() / scan.length_m()));
        let fits = other.filter(within).and_then(|other| laid(scan, &other, cad.tolerance_m));
        if let Some(fits) = fits.filter(|fits| fits.rms_m < limit_m) {
            return Err(CadProblem::OtherUnit { factor, unit, rms_m: fits.rms_m });
        }
    }
    Err(match found {
        None => CadProblem::TooShort { length_m: drawing.length_m(), scanned_m: scan.length_m() },
        Some(found) => {
            CadProblem::Off { rms_m: found.rms_m, worst_m: found.worst_m, tolerance_m: cad.tolerance_m }
        }
    })
}

/// A spline at even steps.
fn scanned(spline: &Spline) -> Evenly {
    let count = ((spline.length_m() / SCAN_STEP_M).ceil() as usize).max(8);
    let last = if spline.closed { count } else { count + 1 };
    let points: Vec<Vector3<f64>> =
        (0..last).map(|k| spline.point(spline.span_m() * k as f64 / count as f64)).collect();
    Evenly::along(&points, SCAN_STEP_M, spline.closed).unwrap_or_else(|| Evenly::of_points(points))
}

/// The part of a drawing that a scan covers, a little beyond its ends, in the scan's direction; all of a closed one. With the
/// root mean square distance of its spline from it, m, because a spline rounds corners.
fn part_of(drawing: &Evenly, span_m: [f64; 2], closed: bool, spacing_m: f64) -> Option<(Spline, f64)> {
    const PER_KNOT: f64 = 8.0;
    let forward = if span_m[1] >= span_m[0] { 1.0 } else { -1.0 };
    let is_ring = closed && drawing.closed;
    let (mut from_m, mut to_m) = (span_m[0], span_m[1]);
    if is_ring {
        to_m = from_m + forward * drawing.length_m();
    } else {
        from_m -= forward * BEYOND * spacing_m;
        to_m += forward * BEYOND * spacing_m;
    }
    if !drawing.closed {
        (from_m, to_m) = (from_m.clamp(0.0, drawing.length_m()), to_m.clamp(0.0, drawing.length_m()));
    }
    let length_m = (to_m - from_m).abs();
    let count = (PER_KNOT * length_m / spacing_m).ceil().clamp(16.0, PER_KNOT * MOST_CONTROL as f64) as usize;
    let along_m = |k: usize| length_m * k as f64 / count as f64;
    let last = if is_ring { count } else { count + 1 };
    let sample = |k: usize| Some((along_m(k), drawing.at(from_m + forward * along_m(k))?, 1.0));
    let samples: Option<Vec<(f64, Vector3<f64>, f64)>> = (0..last).map(sample).collect();
    let samples = samples?;
    let spline = Spline::through(&samples, length_m, spacing_m, is_ring, MOST_CONTROL)?;
    let off = samples.iter().map(|(u_m, point, _)| (spline.point(*u_m) - point).norm_squared());
    let rms_m = (off.sum::<f64>() / samples.len() as f64).sqrt();
    Some((spline, rms_m))
}

/// Root mean square distance of a curve from the placed drawing, m.
fn distance_m(state: &State) -> f64 {
    let Some(placed) = &state.placed else { return 0.0 };
    let drawn = placed.as_drawn();
    let steps = 4 * drawn.control.len();
    let off = |k: usize| {
        let basis = drawn.basis(drawn.span_m() * k as f64 / steps as f64);
        let (point, tangent) = drawn.at(&basis);
        let off = state.spline.at(&basis).0 - point;
        (off - tangent * (tangent.dot(&off) / tangent.norm_squared())).norm_squared()
    };
    ((0..steps).map(off).sum::<f64>() / steps as f64).sqrt()
}
