//! Whole stripes: how far the support points of both plates are from where the stored calibration puts them.
//!
//! Each plate runs through its seam, so it moves with it: by n·δ with a shift, by ω·o with a turn ω, o the
//! direction in the plate away from the seam. Its own are the roll about the seam, which no seam point shows,
//! and the seven terms of its surface. The residual is [`StripeOnPlate`]'s, at the pose as reported. A
//! derivative that shares an error with the residual is biased if nothing else varies it. Residual, foot and
//! plate's coordinates all share the robot's error. So derivatives are taken at the best estimate of the true
//! pose: the reported pose, corrected by the four residuals of the image. Those by the shape are taken at the
//! best estimate of the true point: the measured point, corrected likewise.

use super::linearized::{LOCAL, SEAM, Seam, d_point_d_shape};
use super::row::{Row, SHARED};
use super::unknowns::LOCAL_OF_STRIPE;
use super::weld_error::LEAST_FEATURES;
use crate::parameters::{SHAPE, TIME_OFFSET};
use nalgebra::{Matrix2, SMatrix, SVector, UnitVector3, Vector2, Vector3};
use std::f64::consts::{PI, TAU};
use trueline_geometry::so3;
use trueline_method::evaluate::placed_features::{PlacedFeatures, PlacedStripes};
use trueline_method::order_statistics::median;
use trueline_method::stripe::frames::reported;
use trueline_model::{ByLinks, Placement, Plate, PoseGradient, StripeJacobian, StripeOnPlate};

/// Stripes that differ in direction by less (sine) are of parallel plates: 6°.
const LEAST_ANGLE_SINE: f64 = 0.1;

/// The rows of all stripes of seams with enough of them.
#[must_use]
pub(crate) fn plate_rows(of: &PlacedFeatures, seams: &[Seam], shape_origin_m: [f64; 2]) -> Vec<Row> {
    let mut rows = Vec::new();
    for (line, seam) in seams.iter().enumerate() {
        let own: Vec<&PlacedStripes> = of.stripes.iter().filter(|s| s.line as usize == line).collect();
        if own.len() < LEAST_FEATURES || are_parallel(&own) {
            continue;
        }
        let plates = [0, 1].map(|number| flat_plate(of, &own, seam, number));
        let [Some(left), Some(right)] = plates else { continue };
        let view = JointView { of, seam, plates: [left, right], shape_origin_m };
        rows.extend(own.iter().filter_map(|stripes| view.rows(stripes)).flatten());
    }
    rows
}

/// Whether the stripes on both plates run side by side in most images: the plates of a lap, with one beyond the seam.
fn are_parallel(own: &[&PlacedStripes]) -> bool {
    let sine = |stripes: &&PlacedStripes| {
        let along = stripes.plates.map(|[near, far]| (far.reported - near.reported).normalize());
        along[0].perp(&along[1]).abs()
    };
    median(own.iter().map(sine)).is_some_and(|sine| sine < LEAST_ANGLE_SINE)
}

/// A flat plate through the seam, rolled about it to where most of its support points are.
#[must_use]
fn flat_plate(of: &PlacedFeatures, own: &[&PlacedStripes], seam: &Seam, number: usize) -> Option<Plate> {
    let axes = seam.line.axes();
    let away = |stripes: &&PlacedStripes| {
        stripes.plates[number].map(|support| {
            let point = stripes.placement.point_in_base(&of.sheet.point(&support.reported));
            let from = point - seam.line.anchor();
            Vector2::new(axes.column(1).dot(&from), axes.column(2).dot(&from))
        })
    };
    let away: Vec<Vector2<f64>> = own.iter().flat_map(away).collect();
    let middle = away.iter().sum::<Vector2<f64>>();
    let about = middle.y.atan2(middle.x);
    let strays = away.iter().map(|at| (at.y.atan2(at.x) - about + PI).rem_euclid(TAU) - PI);
    let angle = about + median(strays)?;
    let outward: Vector3<f64> = axes.column(1) * angle.cos() + axes.column(2) * angle.sin();
    let along = seam.line.direction();
    Plate::flat(*seam.line.anchor(), &UnitVector3::new_normalize(outward.cross(&along)), &along)
}

/// A joint as the sensor sees it.
struct JointView<'a> {
    of: &'a PlacedFeatures,
    seam: &'a Seam,
    plates: [Plate; 2],
    shape_origin_m: [f64; 2],
}

/// Residuals of an image: two of each plate.
const IMAGE: usize = 4;

/// An image with its residuals at the reported pose, and the errors estimated from them.
struct Errors {
    residual: SVector<f64, IMAGE>,
    shared: SMatrix<f64, IMAGE, SHARED>,
    own: SVector<f64, IMAGE>,
    /// Σ⁻¹ r.
    weighed: SVector<f64, IMAGE>,
}

impl JointView<'_> {
    /// The rows of both plates in one image.
    fn rows(&self, stripes: &PlacedStripes) -> Option<[Row; 2]> {
        let errors = self.errors(stripes)?;
        let placement = self.best_placement(stripes, &errors);
        let mut jacobian = SMatrix::<f64, IMAGE, LOCAL_OF_STRIPE>::zeros();
        for (k, parts) in self.parts(&placement, stripes)?.iter().enumerate() {
            let strays = parts.normal * (errors.own[k] * errors.weighed[k]);
            let best = stripes.plates[k / 2][k % 2].reported - strays;
            let links = placement.carried(&parts.by_pose);
            jacobian.row_mut(k).tr_copy_from(&self.derivatives(k / 2, (parts, &links), &best));
        }
        Some([0, 1].map(|plate| {
            let first = 2 * plate;
            Row {
                stamp_s: stripes.stamp_s,
                line: stripes.line as usize,
                plate: Some(plate),
                residual: errors.residual.fixed_rows::<2>(first).into(),
                jacobian: jacobian.fixed_rows::<2>(first).into(),
                covariance: Matrix2::new(errors.own[first], 0.0, 0.0, errors.own[first + 1]),
                shared: errors.shared.fixed_rows::<2>(first).into(),
                weight: 1.0,
            }
        }))
    }

    fn parts(&self, placement: &Placement, stripes: &PlacedStripes) -> Option<[StripeJacobian; IMAGE]> {
        let on_plate = |k: usize| {
            let on = StripeOnPlate { plate: &self.plates[k], sheet: &self.of.sheet, shape: None };
            on.linearize_supports(placement, &reported(&stripes.plates[k]))
        };
        let ([a, b], [c, d]) = (on_plate(0)?, on_plate(1)?);
        Some([a, b, c, d])
    }

    fn errors(&self, stripes: &PlacedStripes) -> Option<Errors> {
        let (mut residual, mut own) = (SVector::zeros(), SVector::zeros());
        let mut shared = SMatrix::<f64, IMAGE, SHARED>::zeros();
        let noise = &self.of.noise;
        for (k, parts) in self.parts(&stripes.placement, stripes)?.iter().enumerate() {
            residual[k] = parts.residual;
            own[k] = stripes.plates[k / 2][k % 2].sigma_m.powi(2);
            let PoseGradient { by_shift, by_turn } = parts.by_pose;
            let mut row = shared.row_mut(k);
            row.fixed_columns_mut::<3>(0).tr_copy_from(&(by_shift * noise.robot_sigma_m));
            row.fixed_columns_mut::<3>(3).tr_copy_from(&(by_turn * self.of.robot_sigma_rad));
            let late = stripes.placement.carried(&parts.by_pose)[TIME_OFFSET];
            row[SHARED - 1] = late * noise.stamp_sigma_s;
        }
        let covariance = SMatrix::from_diagonal(&own) + shared * shared.transpose();
        let weighed = covariance.cholesky()?.solve(&residual);
        Some(Errors { residual, shared, own, weighed })
    }

    /// The pose of the robot less its expected errors.
    fn best_placement(&self, stripes: &PlacedStripes, errors: &Errors) -> Placement {
        let expected = errors.shared.transpose() * errors.weighed;
        let mut placement = stripes.placement;
        let robot = &mut placement.base_from_tool;
        robot.translation.vector -= expected.fixed_rows::<3>(0) * self.of.noise.robot_sigma_m;
        robot.rotation = so3::exp(&(-expected.fixed_rows::<3>(3) * self.of.robot_sigma_rad)) * robot.rotation;
        placement
    }

    fn derivatives(
        &self,
        plate: usize,
        (parts, links): (&StripeJacobian, &ByLinks),
        best: &Vector2<f64>,
    ) -> SVector<f64, LOCAL_OF_STRIPE> {
        let mut all = SVector::<f64, LOCAL_OF_STRIPE>::zeros();
        let by_shape = d_point_d_shape(&(best - Vector2::from(self.shape_origin_m)));
        all.fixed_rows_mut::<SHAPE>(TIME_OFFSET).copy_from(links);
        all.fixed_rows_mut::<5>(SHAPE).copy_from(&(by_shape.transpose() * parts.normal));
        let (axes, plate) = (self.seam.line.axes(), &self.plates[plate]);
        for (k, axis) in [axes.column(1), axes.column(2)].iter().enumerate() {
            all[SEAM + k] = parts.d_plate.y * plate.chart.outward.dot(axis);
            // d_plate counts an offset along the normal.
            all[SEAM + 2 + k] = parts.d_plate.z * plate.normal.dot(axis);
        }
        all[LOCAL] = parts.d_plate.x;
        all.fixed_rows_mut::<{ Plate::SURFACE }>(LOCAL + 1).copy_from(&parts.d_surface);
        all
    }
}
