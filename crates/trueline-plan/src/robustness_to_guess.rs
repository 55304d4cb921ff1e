//! Cells with a wrong guess, and their view of a scan that was planned at the guess.
//!
//! Every path uses the same cells (common random numbers), so that paths can be compared.

use crate::cell::Cell;
use crate::cell_axis::disturbed;
use crate::joint::Joint;
use crate::motion::Motion;
use crate::seam::Seam;
use crate::stripes_ahead::{ends, is_in_view};
use crate::truth::Truth;
use nalgebra::{Matrix3, Vector3};
use trueline_geometry::{Axis, Pose};
use trueline_method::input::axis_chain::AxisChain;
use trueline_model::sheet_residual::MIN_SINE;

/// A pose of the tool, prepared for many questions.
struct ToolPose {
    tool_from_base: Matrix3<f64>,
    origin: Vector3<f64>,
}

impl ToolPose {
    fn of(base_from_tool: &Pose) -> Self {
        let turn = base_from_tool.rotation.to_rotation_matrix().into_inner();
        Self { tool_from_base: turn.transpose(), origin: base_from_tool.translation.vector }
    }
}

/// Result of one frame.
enum Frame {
    /// It sees the seam, there in the camera.
    Seen(Vector3<f64>),
    /// The seam is out of view.
    OutOfView,
    /// The sheet meets the line beyond an end of the seam.
    BeyondEnd,
}

/// A cell with another hand-eye transform and another seam than was guessed.
#[derive(Clone, Debug)]
pub struct WrongCell {
    /// Hand-eye transform.
    tool_from_camera: Pose,
    /// The seam.
    seam: Seam,
    /// The external axes.
    axes: Vec<Axis>,
    camera_from_tool: Matrix3<f64>,
    camera_origin: Vector3<f64>,
    normal_in_tool: Vector3<f64>,
    sheet_offset_m: f64,
    middle: Vector3<f64>,
    direction: Vector3<f64>,
    half_length_m: f64,
}

impl WrongCell {
    fn new(cell: &Cell, (tool_from_camera, seam): (Pose, Seam), axes: Vec<Axis>) -> Option<Self> {
        let normal_in_tool = tool_from_camera.rotation * cell.sheet.plane().normal().into_inner();
        let camera_origin = tool_from_camera.translation.vector;
        Some(Self {
            camera_from_tool: tool_from_camera.rotation.to_rotation_matrix().into_inner().transpose(),
            camera_origin,
            normal_in_tool,
            sheet_offset_m: cell.sheet.plane().offset() + normal_in_tool.dot(&camera_origin),
            middle: 0.5 * (seam.from_m + seam.to_m),
            direction: seam.direction()?.into_inner(),
            // A closed seam has no end.
            half_length_m: if cell.course.as_ref().is_some_and(|course| course.closed) {
                f64::INFINITY
            } else {
                0.5 * seam.length_m()
            },
            tool_from_camera,
            seam,
            axes,
        })
    }

    /// The truth in it.
    #[must_use]
    pub fn truth(&self) -> Option<Truth> {
        let (tool_from_camera, axes) = (self.tool_from_camera, self.axes.clone());
        Some(Truth { tool_from_camera, line: self.seam.line()?, axes })
    }

    /// Visible parts, in a frame taken at a pose of the tool, of the seam and of the plates of a joint.
    #[must_use]
    pub(crate) fn sees(&self, cell: &Cell, joint: Option<&Joint>, base_from_tool: &Pose) -> SeenBy {
        let tool = ToolPose::of(base_from_tool);
        let mut seen = SeenBy::default();
        if let Frame::Seen(corner) = self.frame(cell, &tool) {
            seen.seam = 1.0;
            if let Some(which) = joint.and_then(|joint| self.stripes(cell, &tool, (joint, &corner))) {
                seen.stripes[which] = 1.0;
            }
        }
        seen
    }

    /// Crossing of the sheet with the line, and result of the frame.
    fn frame(&self, cell: &Cell, tool: &ToolPose) -> Frame {
        let middle = tool.tool_from_base * (self.middle - tool.origin);
        let direction = tool.tool_from_base * self.direction;
        let toward = self.normal_in_tool.dot(&direction);
        if toward.abs() <= MIN_SINE {
            return Frame::OutOfView;
        }
        let along = (self.sheet_offset_m - self.normal_in_tool.dot(&middle)) / toward;
        let in_camera = self.camera_from_tool * (middle + direction * along - self.camera_origin);
        if !cell.view.contains(&in_camera) {
            return Frame::OutOfView;
        }
        if along.abs() > self.half_length_m { Frame::BeyondEnd } else { Frame::Seen(in_camera) }
    }

    /// Plates with stripes in view about a point of the seam, as an index into [`SeenBy::stripes`]; the plates turn with the
    /// seam.
    fn stripes(
        &self,
        cell: &Cell,
        tool: &ToolPose,
        (joint, corner): (&Joint, &Vector3<f64>),
    ) -> Option<usize> {
        let in_camera = |direction: &Vector3<f64>| self.camera_from_tool * (tool.tool_from_base * direction);
        let joint = joint.about(&self.direction);
        let ends = ends(cell, (&joint, &self.direction), in_camera, corner);
        let is_seen = ends.map(|ends| ends.is_some_and(|ends| is_in_view(cell, &ends)));
        match is_seen {
            [true, false] => Some(0),
            [false, true] => Some(1),
            [true, true] => Some(2),
            [false, false] => None,
        }
    }
}

/// Share of the cells that see something in a frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SeenBy {
    /// The seam.
    pub seam: f64,
    /// With it the stripe of the first plate alone, of the second alone, and both; zero if plates are not used.
    pub stripes: [f64; 3],
}

/// A sample of cells.
#[derive(Clone, Debug)]
pub struct WrongCells {
    cells: Vec<WrongCell>,
}

/// The first seeds are those of the search; a prediction is judged by cells that no search has used.
const SEARCH_SEED: u64 = 0;
/// See [`SEARCH_SEED`].
const PROMISE_SEED: u64 = 1 << 32;
/// Cells that a search asks.
const SEARCH_CELLS: u64 = 120;
/// Cells that a promise is judged by.
const PROMISE_CELLS: u64 = 240;
/// One of this many cells is used for the stripes: each weighs the frames equally, and no limit depends on them.
const STRIPES_ONE_IN: usize = 6;
/// See [`WrongCells::for_wrong_guesses`].
const WRONG_GUESSES: u64 = 40;

impl WrongCells {
    /// The cells for a search.
    #[must_use]
    pub(crate) fn for_search(cell: &Cell) -> Self {
        Self::sample(cell, SEARCH_SEED, SEARCH_CELLS)
    }

    /// The cells for a prediction.
    #[must_use]
    pub(crate) fn for_promise(cell: &Cell) -> Self {
        Self::sample(cell, PROMISE_SEED, PROMISE_CELLS)
    }

    /// Wrong by anything within the cell's errors; the guess itself if nothing is wrong.
    fn sample(cell: &Cell, seed: u64, count: u64) -> Self {
        let count = if cell.has_exact_guess() { 1 } else { count };
        let drawn = |k: u64| {
            let truth = cell.guess_error.disturbed(&cell.tool_from_camera, &cell.seam, seed + k);
            WrongCell::new(cell, truth, disturbed(&cell.axes, seed + k))
        };
        Self { cells: (0..count).filter_map(drawn).collect() }
    }

    /// A sample of cells for the effect of a wrong guess on the sigmas.
    #[must_use]
    pub(crate) fn for_wrong_guesses(cell: &Cell) -> Self {
        Self::sample(cell, PROMISE_SEED, WRONG_GUESSES)
    }

    /// Each.
    pub fn iter(&self) -> impl Iterator<Item = &WrongCell> {
        self.cells.iter()
    }

    /// View of all of them in frames of a motion, taken at these times, s, and poses about the guessed seam, and of the plates of a joint.
    #[must_use]
    pub(crate) fn look(
        &self,
        (cell, motion): (&Cell, &Motion),
        joint: Option<&Joint>,
        poses: impl Iterator<Item = (f64, Pose)>,
    ) -> Views {
        let mut views =
            Views { seen_by: Vec::new(), lost: vec![[0; 2]; self.cells.len()], cells: self.cells.len() };
        let asked = self.cells.len().div_ceil(STRIPES_ONE_IN);
        let axes: Option<Vec<AxisChain>> =
            motion.axes().map(|axes| self.cells.iter().map(|wrong| axes.at_places(&wrong.axes)).collect());
        for (time_s, pose) in poses {
            let tool = ToolPose::of(&pose);
            let robot = motion.axes().and_then(|axes| axes.without_axes(&pose, time_s));
            let (mut seen, mut stripes) = (0_u32, [0_u32; 3]);
            for (k, (wrong, [out_of_view, beyond_end])) in self.cells.iter().zip(&mut views.lost).enumerate()
            {
                // About a wrong axis the same robot is elsewhere at the seam.
                let own = axes.as_ref().zip(robot).map(|(axes, robot)| (&axes[k], robot));
                let own = own.and_then(|(axes, robot)| axes.lines_from_carrier(&robot, time_s));
                let own = own.map(|own| ToolPose::of(&own));
                let tool = own.as_ref().unwrap_or(&tool);
                match wrong.frame(cell, tool) {
                    Frame::Seen(corner) => {
                        seen += 1;
                        let joint = joint.filter(|_| k < asked);
                        let which = joint.and_then(|joint| wrong.stripes(cell, tool, (joint, &corner)));
                        which.into_iter().for_each(|which| stripes[which] += 1);
                    }
                    Frame::OutOfView => *out_of_view += 1,
                    Frame::BeyondEnd => *beyond_end += 1,
                }
            }
            let share = |count: u32, of: usize| f64::from(count) / of.max(1) as f64;
            let stripes = stripes.map(|count| share(count, asked));
            views.seen_by.push(SeenBy { seam: share(seen, self.cells.len()), stripes });
        }
        views
    }
}

/// View of wrong cells in the frames of a scan.
#[derive(Clone, Debug)]
pub struct Views {
    /// Share of the cells that see each frame.
    pub seen_by: Vec<SeenBy>,
    /// Frames that each cell loses: out of view, beyond an end.
    lost: Vec<[u32; 2]>,
    cells: usize,
}

/// Part of the cells that may lose more than [`LOSS`] of their frames.
const EXCEPTIONS: f64 = 0.05;
/// Part of the frames that all other cells may lose.
pub const LOSS: f64 = 0.05;
/// Part of the frames that no cell may lose.
pub(crate) const WORST_LOSS: f64 = 0.25;

/// Frames that cells lose.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Loss {
    /// Largest loss of 95 % of the cells.
    pub of_most: f64,
    /// The cell that loses most.
    pub worst: f64,
    /// Part of all losses that are beyond an end of the seam.
    pub beyond_end: f64,
}

impl Loss {
    /// The used part of the allowed loss.
    #[must_use]
    pub fn used(&self) -> f64 {
        (self.of_most / LOSS).max(self.worst / WORST_LOSS)
    }
}

impl Views {
    /// The loss.
    #[must_use]
    pub fn loss(&self) -> Loss {
        let frames = self.seen_by.len().max(1) as f64;
        let mut lost: Vec<f64> =
            self.lost.iter().map(|[out, beyond]| f64::from(out + beyond) / frames).collect();
        lost.sort_by(|a, b| b.total_cmp(a));
        let exceptions = (EXCEPTIONS * self.cells as f64) as usize;
        let [out, beyond] = [0, 1].map(|k| self.lost.iter().map(|l| f64::from(l[k])).sum::<f64>());
        Loss {
            of_most: lost.get(exceptions).copied().unwrap_or(1.0),
            worst: lost.first().copied().unwrap_or(1.0),
            beyond_end: if beyond > 0.0 { beyond / (out + beyond) } else { 0.0 },
        }
    }
}
