//! The stripes of a frame as a sight of the adjustment: support points on plates, an edge point, or a seam point where the stripes are missing.

use crate::adjustment::seam_points::{ACCELERATION_S, some_of};
use crate::adjustment::sights::{FORMS, Frame, Sights, State};
use crate::assess::tilt_bias::{BIAS, TiltBias};
use crate::input::shape_prior::ShapePrior;
use crate::problem::known::Known;
use crate::problem::placement::placement_at;
use crate::stripe::fit::StripeFit;
use crate::stripe::frame_residual::{
    EDGE_ROW, FrameGradients, FrameResidual, ROWS, linearize_frame, residual_of_frame,
};
use crate::stripe::frames::{Sight, StripeFrame};
use crate::stripe::problem::StripeProblem;
use crate::stripe::state::StripeState;
use crate::stripe::target::EDGE;
use crate::stripe::unknowns::{LOCAL_ALL, LOCAL_SHAPE, OFFSET_OF_PLANE, StripeUnknowns, local_of_surface};
use crate::stripe::weighed_frame::WeighedFrame;
use nalgebra::{Const, DMatrix, DVector, Dyn, OMatrix, SMatrix, SVector, Vector2, Vector3};
use std::ops::Range;
use trueline_geometry::{Pose, Trajectory, so3};
use trueline_model::{Placement, SheetShape};

/// Maximum number of frames that are used. Of more, one in each of equal stretches.
const MOST_FRAMES: usize = 6_000;
/// Maximum number of rows for each residual of a frame, over which frames are averaged.
const MOST_ROWS: usize = 1_000;

/// A frame of stripes.
pub(crate) type PlateFrame = Frame<ROWS, LOCAL_ALL>;

impl State for StripeState {
    type Layout = StripeUnknowns;
    const LOCAL_SHAPE: usize = LOCAL_SHAPE;

    fn layout(&self) -> StripeUnknowns {
        self.unknowns()
    }

    fn dimension(&self) -> usize {
        self.unknowns().dimension()
    }

    fn retract(&self, step: &DVector<f64>) -> Self {
        Self::retract(self, step)
    }

    fn known(&self, shape_prior: Option<&ShapePrior>) -> Known {
        Self::known(self, shape_prior)
    }

    fn targets(&self) -> usize {
        self.joints.len()
    }

    fn bends(&self) -> Range<usize> {
        let unknowns = self.unknowns();
        unknowns.asked_for()..unknowns.shape().start
    }

    fn shape(&self) -> Range<usize> {
        self.unknowns().shape()
    }
}

/// The stripes of a scan, with the weights of a fit.
pub(crate) struct PlateSights<'a> {
    problem: &'a StripeProblem<'a>,
    /// The detector's tilt convention.
    tilt: TiltBias,
    /// Indices of the frames, by joint and then by time.
    chosen: Vec<usize>,
    /// Directions that the scan does not determine.
    unseen: DMatrix<f64>,
    /// The robot's path by every other sample, and by those between. `None` if it is too short.
    pub halves: Option<[Trajectory; 2]>,
}

impl<'a> PlateSights<'a> {
    /// Of a fit, with the directions that it does not determine.
    #[must_use]
    pub(crate) fn of(fit: &'a StripeFit<'_>, unseen: DMatrix<f64>) -> Self {
        let (problem, joints) = (&fit.problem, fit.state().joints.len());
        let mut of_joint = vec![Vec::new(); joints];
        for (index, weighed) in problem.frames.iter().enumerate() {
            of_joint[weighed.frame.joint].push(index);
        }
        let most = MOST_FRAMES / joints.max(1);
        let chosen: Vec<usize> = of_joint.into_iter().flat_map(|joint| some_of(&joint, most)).collect();
        let mut all = Self { problem, tilt: TiltBias::about(&[]), chosen, unseen, halves: None };
        all.tilt = TiltBias::about(&all.poses(fit.state()));
        all
    }

    /// When the light of its frames fell, s, rising.
    #[must_use]
    pub(crate) fn exposures_s(&self, time_offset_s: f64) -> Vec<f64> {
        let mut exposures_s: Vec<f64> =
            self.selected().map(|(_, weighed)| weighed.frame.stamp_s - time_offset_s).collect();
        exposures_s.sort_by(f64::total_cmp);
        exposures_s
    }

    fn selected(&self) -> impl Iterator<Item = (usize, &WeighedFrame)> {
        self.chosen.iter().map(|&index| (index, &self.problem.frames[index]))
    }

    fn frame(&self, (index, weighed): (usize, &WeighedFrame), at: &StripeState) -> Option<PlateFrame> {
        let (observations, whitener) = (self.problem.observations, &weighed.whitener);
        let placement = weighed.placement(observations, at)?;
        let (parts, gradients) = linearize_frame(observations, &weighed.frame, at, &placement)?;
        let (residual, by_unknowns) = weighed.whitened(&(parts, gradients));
        let (by_shift, by_turn) = (whitener * parts.d_displacement, whitener * parts.d_turn);
        let (seam, along_m) = self.along_m(&weighed.frame, at, &placement);
        let plate = &at.joints[weighed.frame.joint].plates[0];
        let [shift, turn] = self.accelerations(weighed, at, &placement);
        Some(Frame {
            index,
            target: weighed.frame.joint,
            stamp_s: weighed.frame.stamp_s,
            residual,
            is_there: std::array::from_fn(|row| whitener[(row, row)] != 0.0),
            by_unknowns: by_unknowns.transpose(),
            by_shift,
            by_turn,
            by_bias: self.by_bias(weighed, (&parts, &placement), at),
            // With external axes only seam points are used.
            by_axes: OMatrix::zeros_generic(Const, Dyn(0)),
            by_lag: by_shift * shift + by_turn * turn,
            by_form: std::array::from_fn(|surface| whitener * heights(&gradients, surface)),
            along_m,
            along_by_unknowns: SVector::zeros(),
            apart_by_unknowns: SVector::zeros(),
            lever: seam - placement.base_from_tool.translation.vector,
            base_from_tool: placement.base_from_tool,
            twist: [placement.velocity, placement.angular_velocity],
            towards_sensor: plate.normal.into_inner(),
            across: [plate.chart.outward, plate.normal.into_inner()],
        })
    }

    /// A point of the stripes in base, and the place along the seam of each of their points, m. A missing one has the place of another.
    fn along_m(
        &self,
        frame: &StripeFrame,
        at: &StripeState,
        placement: &Placement,
    ) -> (Vector3<f64>, [f64; ROWS]) {
        let (sheet, chart) = (&self.problem.observations.sheet, &at.joints[frame.joint].plates[0].chart);
        let point = |reported: &Vector2<f64>| {
            let there = at.shape.map_or(*reported, |shape| shape.corrected(reported).0);
            placement.point_in_base(&sheet.point(&there))
        };
        let place = |point: &Vector3<f64>| chart.along.dot(&(point - chart.centre));
        match &frame.sight {
            Sight::Seam(seam) => {
                let seam = point(&seam.reported);
                (seam, [place(&seam); ROWS])
            }
            Sight::Stripes(stripes) => {
                let own = [0, 1].map(|plate| Some(stripes[plate]?.map(|support| point(&support.reported))));
                let other = own[0].or(own[1]).unwrap_or_default();
                let [[a, b], [c, d]] = own.map(|own| own.unwrap_or(other));
                let edge = frame.edge.map_or(a, |edge| point(&edge.reported));
                (edge, [a, b, c, d, edge].map(|point| place(&point)))
            }
        }
    }

    /// Acceleration of the tool's origin, m/s², and of its attitude, rad/s², axes of base: from poses before and after, without the pose itself. The
    /// noise of that pose is in the residual too and would look like a lag. Zero if the path is too short.
    fn accelerations(&self, weighed: &WeighedFrame, at: &StripeState, here: &Placement) -> [Vector3<f64>; 2] {
        let moved = |later: f64| {
            let stamp_s = weighed.frame.stamp_s + later * ACCELERATION_S;
            let there = weighed.pose_error.placement(self.problem.observations, stamp_s, at)?.base_from_tool;
            let turn = so3::log(&(there.rotation * here.base_from_tool.rotation.inverse()));
            Some([there.translation.vector, turn])
        };
        let both = |away: f64| moved(away).zip(moved(-away));
        let Some((far, near)) = both(2.0).zip(both(1.0)) else { return [Vector3::zeros(); 2] };
        [0, 1].map(|k| (far.0[k] + far.1[k] - near.0[k] - near.1[k]) / (3.0 * ACCELERATION_S.powi(2)))
    }

    fn by_bias(
        &self,
        weighed: &WeighedFrame,
        (parts, placement): (&FrameResidual, &Placement),
        at: &StripeState,
    ) -> SMatrix<f64, ROWS, BIAS> {
        let in_sensor = self.tilt.in_sensor(&at.tool_from_camera, placement);
        let by_px = weighed.whitener * by_px(&weighed.frame, parts);
        let mut by_bias = SMatrix::<f64, ROWS, BIAS>::zeros();
        for axis in 0..3 {
            by_bias.fixed_columns_mut::<2>(2 * axis).copy_from(&(by_px * in_sensor[axis]));
        }
        by_bias
    }
}

impl Sights<ROWS, LOCAL_ALL> for PlateSights<'_> {
    type State = StripeState;

    fn directions(&self) -> usize {
        self.problem.unknowns.surfaces()
    }

    fn frames(&self, at: &StripeState) -> Vec<Option<PlateFrame>> {
        let origin = self.problem.observations.shape_origin_m.into();
        let shaped = StripeState { shape: at.shape.or(Some(SheetShape::exact_about(&origin))), ..at.clone() };
        self.selected().map(|weighed| self.frame(weighed, &shaped)).collect()
    }

    fn residual(&self, frame: &PlateFrame, at: &StripeState) -> Option<(SVector<f64, ROWS>, f64)> {
        let weighed = &self.problem.frames[frame.index];
        let placement = weighed.placement(self.problem.observations, at)?;
        let residual = residual_of_frame(self.problem.observations, &weighed.frame, at, &placement)?;
        Some((weighed.whitener * (residual + weighed.pose_error.in_residual), frame.along_m[0]))
    }

    fn together(&self) -> usize {
        self.chosen.len().div_ceil(MOST_ROWS)
    }

    fn poses(&self, at: &StripeState) -> Vec<Pose> {
        let placed =
            self.selected().filter_map(|(_, weighed)| weighed.placement(self.problem.observations, at));
        placed.map(|placement| placement.base_from_tool).collect()
    }

    fn along_halves(
        &self,
        frame: &PlateFrame,
        at: &StripeState,
    ) -> Option<[SMatrix<f64, ROWS, LOCAL_ALL>; 2]> {
        let weighed = &self.problem.frames[frame.index];
        let exposure_s = weighed.frame.stamp_s - at.time_offset_s;
        let along = |path: &Trajectory| {
            let placement = placement_at(path, exposure_s, &at.tool_from_camera)?;
            let (_, gradients) = linearize_frame(self.problem.observations, &weighed.frame, at, &placement)?;
            Some((gradients * weighed.whitener.transpose()).transpose())
        };
        let [one, other] = self.halves.as_ref()?;
        Some([along(one)?, along(other)?])
    }

    fn unseen(&self) -> Option<&DMatrix<f64>> {
        Some(&self.unseen)
    }
}

/// Residuals by the height of a surface at the place of each, before whitening: a diagonal matrix. A form moves a surface as its offset does.
fn heights(gradients: &FrameGradients, surface: usize) -> SMatrix<f64, ROWS, ROWS> {
    let by_offset = gradients.row(local_of_surface(surface)[0] + OFFSET_OF_PLANE);
    SMatrix::from_diagonal(&by_offset.transpose())
}

/// Derivative of each residual by a pixel along the image's rows and across them, m.
fn by_px(frame: &StripeFrame, parts: &FrameResidual) -> SMatrix<f64, ROWS, 2> {
    let mut moved = SMatrix::<f64, ROWS, 2>::zeros();
    let mut set = |row: usize, sheet_per_px: &SMatrix<f64, 2, 2>| {
        moved.set_row(row, &(parts.d_reported.row(row) * sheet_per_px));
    };
    match &frame.sight {
        Sight::Seam(seam) => (0..2).for_each(|row| set(row, &seam.sheet_per_px)),
        Sight::Stripes(stripes) => {
            for (plate, supports) in stripes.iter().enumerate() {
                supports.iter().flatten().enumerate().for_each(|(k, s)| set(2 * plate + k, &s.sheet_per_px));
            }
            if let Some(edge) = frame.edge.filter(|_| parts.has_edge) {
                set(EDGE_ROW, &edge.sheet_per_px);
            }
        }
    }
    moved
}

const _: () = assert!(FORMS == EDGE + 1);
