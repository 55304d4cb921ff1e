//! The curve of a fit, with the ± of its points.

use crate::assess::share::{Share, ShareOf};
use crate::curve::equations::State;
use crate::curve::passes::Course;
use crate::curve::registration::Symmetry;
use crate::curve::sight::{ByForm, Sight};
use crate::curve::solve::Finished;
use crate::curve::spline::Basis;
use nalgebra::Vector3;
use std::ops::Range;
use trueline_geometry::Pose;

/// Allowed ratio of lengths after and before the joint fit: the curve may not shrink, and before the fit it cuts corners.
const LENGTH_WITHIN: [f64; 2] = [0.8, 1.5];
/// Least distance of the points of the curve, m, and their largest number.
const POINTS: (f64, usize) = (2e-3, 200);

/// The curve of a scan.
#[derive(Clone, Debug, PartialEq)]
pub struct CurveEstimate {
    /// Whether the curve is closed.
    pub closed: bool,
    /// Its length, m.
    pub length_m: f64,
    /// Number of knots.
    pub knots: usize,
    /// Distance of the knots, m.
    pub spacing_m: f64,
    /// Standard deviation of the third differences of its control points, m, by restricted maximum likelihood.
    pub s3_m: f64,
    /// Effective number of unknowns of curve, clock and hand-eye transform.
    pub effective_unknowns: f64,
    /// Its seams: one, unless the features name several lines.
    pub seams: Vec<SeamOfCurve>,
    /// Points of the curve in base, m, in the order of the scan.
    pub points_m: Vec<Vector3<f64>>,
    /// Standard deviation of each point perpendicular to the curve, root mean square of both directions, m. By stripes alone the seam may lie beside it
    /// by the bow of its plates, which is in here.
    pub sigma_m: Vec<f64>,
    /// Whether no place was seen twice.
    pub is_one_pass: bool,
    /// Length of one weave period, m; `None` without a weave.
    pub weave_m: Option<f64>,
    /// Whether the curve needs knots that follow the weave. Weave and curve can then not be separated.
    pub is_near_weave: bool,
    /// Its length before the joint fit, m, if it shrank or grew too much.
    pub collapsed_from_m: Option<f64>,
    /// Distance between the places of the part in two passes, m, if it moved and nothing was stated about it.
    pub part_moved_m: Option<f64>,
    /// Restricted log likelihood of the curve, and of one without third differences.
    pub log_evidence: [f64; 2],
    /// The drawing of the part, if it was used.
    pub cad: Option<CadEstimate>,
}

/// A drawing, placed by the scan.
#[derive(Clone, Debug, PartialEq)]
pub struct CadEstimate {
    /// Whether the answer uses the drawing: it is more certain than the one without.
    pub used: bool,
    /// Pose of the part.
    pub base_from_part: Pose,
    /// Root mean square distance of the curve from the drawing, m.
    pub rms_m: f64,
    /// A turn that maps the drawing onto itself: the rotation about its axis is chosen, not measured.
    pub symmetry: Option<Symmetry>,
}

/// One of the seams of a curve.
#[derive(Clone, Debug, PartialEq)]
pub struct SeamOfCurve {
    /// Its label among the lines of the features.
    pub label: u32,
    /// Its length, m.
    pub length_m: f64,
    /// Its points of the curve.
    pub points: Range<usize>,
}

/// Distance of the seam from where its plates seem to meet, if both bow across the seam as much as the seam bends, root mean square of both directions,
/// m. Two support points do not show a bow: κ r₁ r₂/2 beside the line through them. 0 without plates.
fn bow_m(finished: &Finished) -> f64 {
    let (spline, sights) = (&finished.fitted.state.spline, &finished.fitted.sights);
    let of_sight = |seen: &Sight| {
        let ByForm::Feet(feet) = &seen.by_form else { return None };
        let basis = spline.basis(seen.u_m);
        let (slope, second) = (spline.at(&basis).1, spline.second(&basis, seen.u_m));
        let bend = slope.cross(&second).norm() / slope.norm().powi(3);
        let of_plate = |first: usize| 0.5 * bend * feet[first].by_angle * feet[first + 1].by_angle;
        Some(0.5 * (of_plate(0).powi(2) + of_plate(2).powi(2)))
    };
    let squares: Vec<f64> = sights.iter().flatten().filter_map(of_sight).collect();
    (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt()
}

/// The curve of a fit over lines with these labels, with the contributions of the errors.
#[must_use]
pub(crate) fn estimate(
    (finished, labels): (&Finished, &[u32]),
    shares: &[Share],
    course: &Course,
    is_near_weave: bool,
) -> CurveEstimate {
    let state = &finished.fitted.state;
    let spline = &state.spline;
    let length_m = spline.length_m();
    let inverse = finished.root.inverse() * finished.variance;
    let bow_m = bow_m(finished);
    // The curve consists of the detected points, whatever the radius of their edge.
    let of_curve = || shares.iter().filter(|share| share.of != ShareOf::EdgeRadius);
    let sigma_m = |basis: &Basis| {
        let mut variance = 0.0;
        for weights in &across(state, basis) {
            for (i, a) in weights {
                for (j, b) in weights {
                    let own = |share: &Share| share.columns.row(*i).dot(&share.columns.row(*j));
                    variance += a * b * (inverse[(*i, *j)] + of_curve().map(own).sum::<f64>());
                }
            }
        }
        (0.5 * variance).max(0.0).sqrt().hypot(bow_m)
    };
    let (mut points_m, mut sigmas_m, mut seams) = (Vec::new(), Vec::new(), Vec::new());
    for (label, piece) in labels.iter().zip(spline.pieces()) {
        let (first_m, piece) = (piece.start as f64 * spline.spacing_m, spline.piece(piece));
        let own_m = piece.length_m();
        let count = ((own_m / POINTS.0).ceil() as usize).clamp(2, POINTS.1);
        let first = points_m.len();
        for k in 0..=count {
            let basis = spline.basis(first_m + piece.span_m() * k as f64 / count as f64);
            points_m.push(spline.at(&basis).0);
            sigmas_m.push(sigma_m(&basis));
        }
        seams.push(SeamOfCurve { label: *label, length_m: own_m, points: first..points_m.len() });
    }
    let change = state.seen_length_m() / finished.first_length_m;
    let is_kept = (LENGTH_WITHIN[0]..LENGTH_WITHIN[1]).contains(&change);
    CurveEstimate {
        closed: spline.closed,
        length_m,
        knots: (spline.span_m() / spline.spacing_m).round() as usize + usize::from(!spline.closed),
        spacing_m: spline.spacing_m,
        s3_m: finished.s3_m,
        effective_unknowns: finished.effective,
        seams,
        points_m,
        sigma_m: sigmas_m,
        is_one_pass: course.is_one_pass,
        weave_m: course.weave_m(length_m),
        is_near_weave,
        collapsed_from_m: (!is_kept).then_some(finished.first_length_m),
        part_moved_m: None,
        log_evidence: finished.evidence,
        cad: None,
    }
}

/// Derivatives of a point of the curve by all unknowns, in its two normals: index and size.
fn across(state: &State, basis: &Basis) -> [Vec<(usize, f64)>; 2] {
    let spline = &state.spline;
    let control = |m: usize| spline.index(basis.first + m);
    let normals = state.normals()[control(1)];
    [0, 1].map(|side| {
        let of_form = (0..4).map(|m| (2 * control(m) + side, basis.value[m]));
        let mut weights: Vec<(usize, f64)> = of_form.collect();
        if let Some(placed) = &state.placed {
            let (normal, first) = (normals[side], 2 * spline.control.len());
            let lever = spline.at(basis).0 - placed.middle();
            let turn = lever.cross(&normal);
            let of_place = normal.iter().chain(turn.iter()).copied().chain([normal.dot(&lever)]);
            weights.extend(of_place.enumerate().map(|(k, size)| (first + k, size)));
        }
        weights
    })
}
