//! The frames of a scan as the adjustment uses them: residual, Jacobian and the robot's pose.
//!
//! All are whitened by the noise of features, robot samples and stamps. A residual of pure noise has unit variance.

use crate::adjustment::neighbours::Neighbours;
use crate::assess::tilt_bias::{BIAS, TiltBias};
use crate::input::noise_levels::Whitener;
use crate::input::observations::{Observation, Observations};
use crate::problem::line_problem::LineProblem;
use crate::problem::parameters::Parameters;
use crate::problem::unknowns::{LOCAL_ALL, LOCAL_BOWED, ROTATION, TIME_OFFSET, TRANSLATION};
use crate::solve::seam_chart::with_shape;
use nalgebra::{Matrix2x3, Matrix3xX, SMatrix, SVector, Vector2, Vector3};
use trueline_geometry::{Line, Pose};
use trueline_model::Placement;

/// Maximum number of frames of all lines. The remaining errors are correlated, so more frames add no information.
const MOST_FRAMES: usize = 1_000;

/// Lines with fewer frames than this use all of them.
const LEAST_FRAMES: usize = 300;
/// The golden section. Its multiples are evenly spread modulo 1 and do not alias with a weave.
const GOLDEN: f64 = 0.618_033_988_749_895;

/// Picks one of a line's frames in each of equal stretches, at a varying place.
fn some_of(line: &[usize], most: usize) -> Vec<usize> {
    if line.len() <= most {
        return line.to_vec();
    }
    let stretch = line.len() as f64 / most as f64;
    let place = |k: usize| (k as f64 + (k as f64 * GOLDEN).fract()) * stretch;
    let mut some: Vec<usize> = (0..most).map(|k| line[(place(k) as usize).min(line.len() - 1)]).collect();
    // With hardly more frames than wanted, two stretches may share one.
    some.dedup();
    some
}

/// Half-width of the differences that give accelerations, s. They keep 87 % of a 3 Hz swing. Poses are smoothed over less.
const ACCELERATION_S: f64 = 0.03;

/// The selected frames of a scan, and the lines at the start of the adjustment.
pub(crate) struct Scan<'a> {
    problem: &'a LineProblem<'a>,
    /// The lines along which forms are measured. They stay fixed.
    pub seams: Vec<Line>,
    /// Indices in the problem's list, by line and then by time.
    chosen: Vec<usize>,
}

/// The residual of one seam point with its Jacobians.
#[derive(Clone, Debug)]
pub(crate) struct Frame {
    /// Index in the problem's list.
    pub index: usize,
    /// Its line.
    pub line: usize,
    /// When it was seen, s.
    pub stamp_s: f64,
    /// The whitened residual, measured minus predicted.
    pub residual: Vector2<f64>,
    /// Jacobian by the local unknowns.
    pub by_unknowns: SMatrix<f64, 2, LOCAL_ALL>,
    /// Jacobian by the measured point, axes of base, 1/m.
    pub by_point: Matrix2x3<f64>,
    /// Jacobian by each number of the detector's bias, 1 / (px per 10°).
    pub by_bias: SMatrix<f64, 2, BIAS>,
    /// The measured point from the tool's origin, axes of base, m.
    pub lever: Vector3<f64>,
    /// The robot's pose.
    pub base_from_tool: Pose,
    /// Unit vector from the seam to the sensor's origin, perpendicular to the seam, axes of base.
    pub towards_sensor: Vector3<f64>,
    /// The cross axes of the line in base.
    pub across: [Vector3<f64>; 2],
    /// Jacobian of the measured point by the numbers of the external axes, axes of base. No columns without axes.
    pub by_axes: Matrix3xX<f64>,
    /// Acceleration of the measured point, carried by the tool, axes of base, m/s².
    pub acceleration: Vector3<f64>,
    /// Velocity of the tool's origin, m/s, and angular velocity, rad/s, axes of base.
    pub twist: [Vector3<f64>; 2],
    /// Place along the seam, m from its anchor.
    pub along_m: f64,
    /// Jacobian of that place by the local unknowns.
    pub along_by_unknowns: SVector<f64, LOCAL_ALL>,
    /// The same relative to neighbouring frames, which see the same part of the seam.
    pub apart_by_unknowns: SVector<f64, LOCAL_ALL>,
}

/// The line of each frame and its place along it, m.
pub(crate) fn places(frames: &[Option<Frame>]) -> Vec<Option<(usize, f64)>> {
    let place = |frame: &Frame| (frame.line, frame.along_m);
    frames.iter().map(|frame| frame.as_ref().map(place)).collect()
}

impl<'a> Scan<'a> {
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
        Self { problem, seams: at.lines.clone(), chosen }
    }

    /// Poses of the robot at these frames.
    #[must_use]
    pub(crate) fn poses(&self, at: &Parameters) -> Vec<Pose> {
        let placed = self.selected().filter_map(|(_, o, _)| self.problem.placement(o, at));
        placed.map(|placement| placement.base_from_tool).collect()
    }

    fn selected(&self) -> impl Iterator<Item = (usize, &Observation, &Whitener)> {
        self.chosen.iter().map(|&index| (index, &self.problem.list[index], &self.problem.whiteners[index]))
    }

    /// Evaluates every frame at a state. `None` for frames that cannot be placed.
    #[must_use]
    pub(crate) fn frames(&self, at: &Parameters, tilt: &TiltBias) -> Vec<Option<Frame>> {
        let shaped = with_shape(self.problem.observations, at.clone());
        let mut frames: Vec<_> = self.selected().map(|chosen| self.frame(chosen, &shaped, tilt)).collect();
        let along: Vec<_> = frames.iter().map(|frame| Some(frame.as_ref()?.along_by_unknowns)).collect();
        let apart = Neighbours::of(&places(&frames)).beyond(&along);
        for (frame, apart) in frames.iter_mut().zip(apart) {
            if let (Some(frame), Some(apart)) = (frame, apart) {
                frame.apart_by_unknowns = apart;
            }
        }
        frames
    }

    fn frame(
        &self,
        (index, o, whitener): (usize, &Observation, &Whitener),
        at: &Parameters,
        tilt: &TiltBias,
    ) -> Option<Frame> {
        let placement = self.problem.placement(o, at)?;
        let (residual, by_unknowns) = self.problem.whitened_where((o, whitener), at, &placement)?;
        let by_point = self.problem.whitened_displacement((o, whitener), at, &placement)?;
        let measured = at.corrected(&self.problem.observations.sheet, &o.point_in_camera);
        let point = placement.point_in_base(&measured);
        let line = o.line as usize;
        let along = self.seams[line].direction();
        let axes = at.lines[line].axes();
        let towards = self.towards_sensor(&placement, &point);
        Some(Frame {
            index,
            line,
            stamp_s: o.stamp_s,
            residual,
            by_unknowns,
            by_point,
            by_bias: whitener.matrix() * tilt.slopes(o, at, &placement),
            lever: point - placement.base_from_tool.translation.vector,
            base_from_tool: placement.base_from_tool,
            towards_sensor: (towards - along * along.dot(&towards)).try_normalize(0.0)?,
            across: [axes.column(1).into_owned(), axes.column(2).into_owned()],
            by_axes: self.by_axes(o, at, &placement, &point)?,
            acceleration: self.acceleration(o, at, &measured),
            twist: [placement.velocity, placement.angular_velocity],
            along_m: along.dot(&(point - self.seams[line].anchor())),
            along_by_unknowns: self.along_by_unknowns(o, at, &placement, &along),
            apart_by_unknowns: SVector::zeros(),
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

    /// The residual and the place along the seam at a state near that of the frames.
    #[must_use]
    pub(crate) fn residual(&self, frame: &Frame, at: &Parameters) -> Option<(Vector2<f64>, f64)> {
        let (o, whitener) = (&self.problem.list[frame.index], &self.problem.whiteners[frame.index]);
        let placement = self.problem.placement(o, at)?;
        let residual = self.problem.residual(o, at)?;
        let measured = at.corrected(&self.problem.observations.sheet, &o.point_in_camera);
        let seam = &self.seams[frame.line];
        let along_m = seam.direction().dot(&(placement.point_in_base(&measured) - seam.anchor()));
        Some((whitener.apply(&residual), along_m))
    }
}
