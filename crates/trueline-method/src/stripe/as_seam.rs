//! Converts the plates' answer into that of a seam: the intersection of the plates as a line with a bow, with its covariance.
//!
//! On the seam (r = 0) the surface terms move the plates by f_k(s) = β₃ s² + β₇ s³, and the seam by u(s) with n_k·u = f_k. The even part of u is the
//! bow. The odd part turns the line: over the visible half-length ℓ, s³ is fitted by ⅗ ℓ² s. A line with a bow cannot follow the rest.

use crate::problem::parameters::{Parameters, line_index};
use crate::stripe::state::StripeState;
use nalgebra::{DMatrix, DVector, Matrix3, Unit, Vector3};
use trueline_geometry::Line;
use trueline_model::plate::SURFACE_LENGTH_M;
use trueline_model::{Curvature, Plate};

/// Index of the term s² among a plate's surface terms.
const SQUARE: usize = 2;
/// Index of the term s³.
const CUBE: usize = 6;
/// Step of the differences. The map is smooth over millimetres, and these steps are below a micrometre.
const STEP: f64 = 1e-6;

/// The seam of a state. ℓ of each line is taken from `like`.
#[must_use]
pub(crate) fn parameters(at: &StripeState, like: &Parameters) -> Option<Parameters> {
    let mut seam = Parameters {
        time_offset_s: at.time_offset_s,
        tool_from_camera: at.tool_from_camera,
        lines: Vec::new(),
        curvatures: Vec::new(),
        shape: at.shape,
    };
    for (target, bow) in at.joints.iter().zip(&like.curvatures) {
        let form = Meeting::of(&target.pair_at_seam(), bow.half_length_m)?;
        let line = Line::new(form.middle, &Unit::try_new(form.along, 1e-9)?);
        let axes = line.axes();
        let across = |k: usize| axes.column(k).dot(&form.bow);
        seam.curvatures.push(Curvature { bow_m: [across(1), across(2)], middle_m: 0.0, ..*bow });
        seam.lines.push(line);
    }
    Some(seam)
}

/// The intersection of two surfaces: of two plates, or of an edge and the plate that bears it.
struct Meeting {
    /// The middle of the best-fitting straight line, m.
    middle: Vector3<f64>,
    /// Its direction, not of unit length.
    along: Vector3<f64>,
    /// The bow between middle and ends, m.
    bow: Vector3<f64>,
}

impl Meeting {
    fn of([one, other]: &[Plate; 2], half_length_m: f64) -> Option<Self> {
        let (n1, n2) = (one.normal.into_inner(), other.normal.into_inner());
        let towards = one.chart.along;
        let direction = n1.cross(&n2).normalize();
        let direction = if direction.dot(&towards) < 0.0 { -direction } else { direction };
        // Both plates fix the point across the seam. The middle of the scan fixes it along the seam.
        let inverse =
            Matrix3::from_rows(&[n1.transpose(), n2.transpose(), direction.transpose()]).try_inverse()?;
        let square_to = |on: [f64; 2]| inverse * Vector3::new(on[0], on[1], 0.0);
        let of_plates = |term: usize| square_to([one.surface_m[term], other.surface_m[term]]);
        let relative = half_length_m / SURFACE_LENGTH_M;
        let bow = of_plates(SQUARE) * relative.powi(2);
        let turn = of_plates(CUBE) * (0.6 * relative.powi(2) / SURFACE_LENGTH_M);
        let middle = one.chart.centre + square_to([one.offset_m, other.offset_m]);
        Some(Self {
            middle: middle + bow * trueline_model::curvature::MEAN_SQUARE,
            along: direction + turn,
            bow,
        })
    }
}

/// Jacobian of the seam's tangent by the plates' tangent, by central differences: seam × plates.
#[must_use]
pub(crate) fn slope(at: &StripeState, like: &Parameters) -> Option<DMatrix<f64>> {
    let middle = parameters(at, like)?;
    let (from, to) = (at.unknowns(), middle.unknowns());
    let mut slope = DMatrix::zeros(to.dimension(), from.dimension());
    // Clock, hand-eye and shape are equal in both.
    slope.view_mut((0, 0), (line_index(0), line_index(0))).fill_with_identity();
    to.shape().zip(from.shape()).for_each(|(row, column)| slope[(row, column)] = 1.0);
    for column in line_index(0)..from.shape().start {
        let moved = |by: f64| {
            let mut step = DVector::zeros(from.dimension());
            step[column] = by;
            parameters(&at.retract(&step), like)
        };
        let (more, less) = (moved(STEP)?, moved(-STEP)?);
        for k in 0..middle.lines.len() {
            let axes = middle.lines[k].axes();
            let turned = (more.lines[k].direction() - less.lines[k].direction()) / (2.0 * STEP);
            let shifted = (more.lines[k].anchor() - less.lines[k].anchor()) / (2.0 * STEP);
            // A rotation by θ about u₂ and u₃ moves the direction by θ₃ u₂ − θ₂ u₃.
            let numbers = [-axes.column(2).dot(&turned), axes.column(1).dot(&turned)];
            let offsets = [axes.column(1).dot(&shifted), axes.column(2).dot(&shifted)];
            let first = line_index(k);
            numbers.into_iter().chain(offsets).enumerate().for_each(|(j, d)| slope[(first + j, column)] = d);
            for (j, row) in to.bow(k).enumerate() {
                let bow = more.curvatures[k].bow_m[j] - less.curvatures[k].bow_m[j];
                slope[(row, column)] = bow / (2.0 * STEP);
            }
        }
    }
    Some(slope)
}
