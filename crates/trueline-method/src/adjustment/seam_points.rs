//! Seam points as sights of the adjustment.

use crate::adjustment::neighbours::Neighbours;
use crate::adjustment::sights::{Frame, Sights, State, places};
use crate::assess::tilt_bias::TiltBias;
use crate::input::noise_levels::Whitener;
use crate::input::observations::{Observation, Observations};
use crate::input::shape_prior::ShapePrior;
use crate::problem::known::Known;
use crate::problem::line_problem::LineProblem;
use crate::problem::parameters::Parameters;
use crate::problem::unknowns::{LOCAL_ALL, LOCAL_BOWED, ROTATION, TIME_OFFSET, TRANSLATION, Unknowns};
use crate::solve::seam_chart::with_shape;
use nalgebra::{DVector, Matrix2, Matrix3xX, SVector, Vector2, Vector3};
use std::ops::Range;
use trueline_geometry::{Line, Pose, so3};
use trueline_model::Placement;

/// Maximum number of frames of all lines. The remaining errors are correlated, so more frames add no information.
const MOST_FRAMES: usize = 1_000;

/// Lines with fewer frames than this use all of them.
const LEAST_FRAMES: usize = 300;
/// The golden section. Its multiples are evenly spread modulo 1 and do not alias with a weave.
const GOLDEN: f64 = 0.618_033_988_749_895;

/// Picks one of a target's frames in each of equal stretches, at a varying place.
pub(crate) fn some_of(target: &[usize], most: usize) -> Vec<usize> {
    if target.len() <= most {
        return target.to_vec();
    }
    let stretch = target.len() as f64 / most as f64;
    let place = |k: usize| (k as f64 + (k as f64 * GOLDEN).fract()) * stretch;
    let mut some: Vec<usize> = (0..most).map(|k| target[(place(k) as usize).min(target.len() - 1)]).collect();
    // With hardly more frames than wanted, two stretches may share one.
    some.dedup();
    some
}

/// Half-width of the differences that give accelerations, s. They keep 87 % of a 3 Hz swing. Poses are smoothed over less.
pub(crate) const ACCELERATION_S: f64 = 0.03;

/// A frame of a seam point.
pub(crate) type SeamFrame = Frame<2, LOCAL_ALL>;

impl State for Parameters {
    type Layout = Unknowns;
    const LOCAL_SHAPE: usize = LOCAL_BOWED;

    fn layout(&self) -> Unknowns {
        self.unknowns()
    }

    fn dimension(&self) -> usize {
        Self::dimension(self)
    }

    fn retract(&self, step: &DVector<f64>) -> Self {
        Self::retract(self, step)
    }

    fn known(&self, shape_prior: Option<&ShapePrior>) -> Known {
        Self::known(self, shape_prior)
    }

    fn targets(&self) -> usize {
        self.lines.len()
    }

    fn bends(&self) -> Range<usize> {
        let unknowns = self.unknowns();
        unknowns.bow(0).start..unknowns.bow(unknowns.lines).start
    }

    fn shape(&self) -> Range<usize> {
        self.unknowns().shape()
    }
}

/// Selected seam points of a scan, and the lines at the start of the adjustment.
pub(crate) struct SeamPoints<'a> {
    problem: &'a LineProblem<'a>,
    /// The detector's tilt convention.
    pub tilt: TiltBias,
    /// The lines along which forms are measured. They stay fixed.
    pub seams: Vec<Line>,
    /// Indices in the problem's list, by line and then by time.
    chosen: Vec<usize>,
}

impl Sights<2, LOCAL_ALL> for SeamPoints<'_> {
    type State = Parameters;

    fn directions(&self) -> usize {
        2
    }

    fn frames(&self, at: &Parameters) -> Vec<Option<SeamFrame>> {
        let shaped = with_shape(self.problem.observations, at.clone());
        let mut frames: Vec<_> = self.selected().map(|chosen| self.frame(chosen, &shaped)).collect();
        let along: Vec<_> = frames.iter().map(|frame| Some(frame.as_ref()?.along_by_unknowns)).collect();
        let apart = Neighbours::of(&places(&frames)).beyond(&along);
        for (frame, apart) in frames.iter_mut().zip(apart) {
            if let (Some(frame), Some(apart)) = (frame, apart) {
                frame.apart_by_unknowns = apart;
            }
        }
        frames
    }

    fn residual(&self, frame: &SeamFrame, at: &Parameters) -> Option<(Vector2<f64>, f64)> {
        let (o, whitener) = (&self.problem.list[frame.index], &self.problem.whiteners[frame.index]);
        let placement = self.problem.placement(o, at)?;
        let residual = self.problem.residual(o, at)?;
        let measured = at.corrected(&self.problem.observations.sheet, &o.point_in_camera);
        let seam = &self.seams[frame.target];
        let along_m = seam.direction().dot(&(placement.point_in_base(&measured) - seam.anchor()));
        Some((whitener.apply(&residual), along_m))
    }

    fn poses(&self, at: &Parameters) -> Vec<Pose> {
        let placed = self.selected().filter_map(|(_, o, _)| self.problem.placement(o, at));
        placed.map(|placement| placement.base_from_tool).collect()
    }
}

impl<'a> SeamPoints<'a> {
    /// Selects frames of each line of a problem at a state.
    #[must_use]
    pub(crate) fn of(problem: &'a LineProblem<'_>, at: &Parameters) -> Self {
        let lines = at.lines.len();
        let mut of_line = vec![Vec::new(); lines];
        for (index, o) in problem.list.iter().enumerate() {
            of_line[o.line as usize].push(index);
        }
        let most = (MOST_FRAMES / lines.max(1)).max(LEAST_FRAMES);
        let chosen = of_line.into_iter().flat_map(|line| some_of(&line, most)).collect();
        let mut all = Self { problem, tilt: TiltBias::about(&[]), seams: at.lines.clone(), chosen };
        all.tilt = TiltBias::about(&all.poses(at));
        all
    }

    fn selected(&self) -> impl Iterator<Item = (usize, &Observation, &Whitener)> {
        self.chosen.iter().map(|&index| (index, &self.problem.list[index], &self.problem.whiteners[index]))
    }

    fn frame(
        &self,
        (index, o, whitener): (usize, &Observation, &Whitener),
        at: &Parameters,
    ) -> Option<SeamFrame> {
        let placement = self.problem.placement(o, at)?;
        let (residual, by_unknowns) = self.problem.whitened_where((o, whitener), at, &placement)?;
        let by_point = self.problem.whitened_displacement((o, whitener), at, &placement)?;
        let measured = at.corrected(&self.problem.observations.sheet, &o.point_in_camera);
        let point = placement.point_in_base(&measured);
        let target = o.line as usize;
        let along = self.seams[target].direction();
        let axes = at.lines[target].axes();
        let across = [axes.column(1).into_owned(), axes.column(2).into_owned()];
        let by_form =
            |across: &Vector3<f64>| Matrix2::from_columns(&[-(by_point * across), Vector2::zeros()]);
        let lever = point - placement.base_from_tool.translation.vector;
        let towards = self.towards_sensor(&placement, &point);
        let along_m = along.dot(&(point - self.seams[target].anchor()));
        Some(Frame {
            index,
            target,
            stamp_s: o.stamp_s,
            residual,
            is_there: [true; 2],
            by_unknowns,
            by_shift: by_point,
            by_turn: by_point * -so3::hat(&lever),
            by_bias: whitener.matrix() * self.tilt.slopes(o, at, &placement),
            by_axes: by_point * self.by_axes(o, at, &placement, &point)?,
            by_lag: by_point * self.acceleration(o, at, &measured),
            by_form: [by_form(&across[0]), by_form(&across[1]), Matrix2::zeros()],
            along_m: [along_m; 2],
            along_by_unknowns: self.along_by_unknowns(o, at, &placement, &along),
            apart_by_unknowns: SVector::zeros(),
            lever,
            base_from_tool: placement.base_from_tool,
            twist: [placement.velocity, placement.angular_velocity],
            towards_sensor: (towards - along * along.dot(&towards)).try_normalize(0.0)?,
            across,
        })
    }

    /// The view of an image starts at the camera's origin. A profile sensor's origin may lie anywhere along the range, so the range direction is
    /// used. Its sign is that of the radius and does not matter.
    fn towards_sensor(&self, placement: &Placement, point: &Vector3<f64>) -> Vector3<f64> {
        let Observations { are_pixels, sheet, .. } = self.problem.observations;
        let base_from_camera = placement.base_from_camera();
        if *are_pixels {
            base_from_camera.translation.vector - point
        } else {
            base_from_camera.rotation * sheet.axes().column(1)
        }
    }

    fn by_axes(
        &self,
        o: &Observation,
        at: &Parameters,
        placement: &Placement,
        point: &Vector3<f64>,
    ) -> Option<Matrix3xX<f64>> {
        let Some(axes) = &self.problem.observations.robot.axes else { return Some(Matrix3xX::zeros(0)) };
        axes.d_point(&placement.base_from_tool, point, o.stamp_s - at.time_offset_s)
    }

    /// Acceleration from places before and after, without the place itself. The noise of that place is in the residual too and would look like a
    /// lag. Zero if the path is too short.
    fn acceleration(&self, o: &Observation, at: &Parameters, measured: &Vector3<f64>) -> Vector3<f64> {
        let place = |later: f64| {
            let o = Observation { stamp_s: o.stamp_s + later * ACCELERATION_S, ..*o };
            Some(self.problem.placement(&o, at)?.point_in_base(measured))
        };
        let both = |away: f64| Some(place(away)? + place(-away)?);
        let second =
            both(2.0).zip(both(1.0)).map(|(far, near)| (far - near) / (3.0 * ACCELERATION_S.powi(2)));
        second.unwrap_or_else(Vector3::zeros)
    }

    /// d s / d unknowns. Only unknowns that move the measured point move its place along the seam.
    fn along_by_unknowns(
        &self,
        o: &Observation,
        at: &Parameters,
        placement: &Placement,
        along: &Vector3<f64>,
    ) -> SVector<f64, LOCAL_ALL> {
        let sheet = &self.problem.observations.sheet;
        let measured = at.corrected(sheet, &o.point_in_camera);
        let by = placement.jacobian(&measured);
        let mut all = SVector::<f64, LOCAL_ALL>::zeros();
        all[TIME_OFFSET] = along.dot(&by.d_point_d_time_offset);
        all.fixed_rows_mut::<3>(ROTATION).copy_from(&by.d_point_d_rotation.tr_mul(along));
        all.fixed_rows_mut::<3>(TRANSLATION).copy_from(&by.d_point_d_translation.tr_mul(along));
        let by_shape =
            at.shape.and_then(|shape| shape.d_corrected_d_shape(&sheet.coordinates(&o.point_in_camera)));
        if let Some(by_shape) = by_shape {
            let in_sensor = placement.base_from_camera().rotation.inverse() * along;
            let in_sheet = sheet.axes().tr_mul(&in_sensor);
            all.fixed_rows_mut::<5>(LOCAL_BOWED).copy_from(&by_shape.tr_mul(&in_sheet));
        }
        all
    }
}
