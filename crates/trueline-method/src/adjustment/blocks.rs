//! Systematic errors as blocks: columns beside the unknowns, each with unit prior variance, times an amplitude.

use crate::adjustment::clamped::Clamped;
use crate::adjustment::form::Hats;
use crate::adjustment::sights::{FORMS, Frame};
use crate::assess::robot_field::RobotField;
use crate::assess::tilt_bias::BIAS;
use crate::models;
use crate::problem::unknowns::TIME_OFFSET;
use nalgebra::{DVector, SVector, Vector3};
use std::ops::Range;

/// The error that a block describes.
#[derive(Clone)]
pub(crate) enum Kind {
    /// The form of a target beyond its bow, in each direction, with the prior standard deviation of each hat, m.
    Form { target: usize, directions: usize, hats: Hats, sigma_m: f64 },
    /// The robot, over its poses.
    Robot(RobotField),
    /// The detector's point as a function of the tilt, px per 10°.
    Detector { sigma_px: f64 },
    /// A step of the time offset at one time, s.
    Step { at_s: f64, is_later: bool, sigma_s: f64 },
    /// Place and direction of the external axes, with a standard deviation for each number, SI.
    Axes { sigmas: Vec<f64> },
    /// A lag of the robot behind its recorded poses beyond the assumed one, s.
    Lag { taken_s: f64, sigma_s: f64 },
    /// A lag of its own for each joint: a constant matrix of base from the twist of the tool to the twist by which it is late, s.
    JointLags { sigma_s: f64 },
    /// The place of the part in each pass after the first: shift and turn.
    Part(Clamped),
}

/// Lever that makes an angular velocity comparable with a velocity, m: joints of the wrist are nearer to the tool, those of the arm further away.
const LEVER_M: f64 = 0.5;

/// Motion of the tool at a frame: its velocity, and its angular velocity at the lever, m/s.
fn twist_m_s([velocity_m_s, turn_rad_s]: [Vector3<f64>; 2]) -> [f64; 6] {
    let (shift, turn) = (velocity_m_s, turn_rad_s * LEVER_M);
    [shift.x, shift.y, shift.z, turn.x, turn.y, turn.z]
}

/// A variance above this fraction of its bound is at the bound.
const LARGEST_PART: f64 = 0.98;

/// The size of a block as estimated from the scan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Amplitude {
    /// Variance, in units of the prior variance.
    pub theta: f64,
    /// Lower and upper bound.
    pub bounds: [f64; 2],
}

impl Amplitude {
    /// Held at its expected size.
    pub(crate) const HELD: Self = Self { theta: 1.0, bounds: [1.0, 1.0] };

    /// Whether it is at its upper bound.
    #[must_use]
    pub(crate) fn is_largest(&self) -> bool {
        self.is_free() && self.theta > LARGEST_PART * self.bounds[1]
    }

    /// Whether the scan determines it.
    #[must_use]
    pub(crate) fn is_free(&self) -> bool {
        self.bounds[0] < self.bounds[1]
    }
}

/// A block.
#[derive(Clone)]
pub(crate) struct Block {
    /// The error it describes.
    pub kind: Kind,
    /// Its columns.
    pub columns: Range<usize>,
    /// Its size.
    pub amplitude: Amplitude,
    /// Additional variance of each column, because a tack is no wave.
    pub own: Vec<f64>,
}

impl Block {
    /// A block of a kind, from a column on.
    #[must_use]
    pub(crate) fn new(kind: Kind, first: usize, amplitude: Amplitude) -> Self {
        let count = match &kind {
            Kind::Form { directions, hats, .. } => directions * hats.count,
            Kind::Robot(field) => 6 * field.modes(),
            Kind::Lag { .. } | Kind::Step { .. } => 1,
            Kind::Detector { .. } => BIAS,
            Kind::JointLags { .. } => 36,
            Kind::Part(clamped) => clamped.columns(),
            Kind::Axes { sigmas } => sigmas.len(),
        };
        Self { kind, columns: first..first + count, amplitude, own: vec![1.0; count] }
    }

    /// The robot's errors, of such a block.
    #[must_use]
    pub(crate) fn robot_field(&self) -> Option<&RobotField> {
        if let Kind::Robot(field) = &self.kind { Some(field) } else { None }
    }

    /// The moves of the part, of such a block.
    #[must_use]
    pub(crate) fn clamped(&self) -> Option<&Clamped> {
        if let Kind::Part(clamped) = &self.kind { Some(clamped) } else { None }
    }

    /// Prior variance of each column.
    #[must_use]
    pub(crate) fn variance(&self, k: usize) -> f64 {
        self.amplitude.theta * self.own[k]
    }

    /// Adds its columns for a frame: each residual in a row over all columns.
    pub(crate) fn fill<const ROWS: usize, const LOCAL: usize>(
        &self,
        frame: &Frame<ROWS, LOCAL>,
        rows: &mut [Vec<f64>; ROWS],
    ) {
        let first = self.columns.start;
        let mut add = |column: usize, value: SVector<f64, ROWS>| {
            rows.iter_mut().zip(value.iter()).for_each(|(row, value)| row[first + column] += value);
        };
        match &self.kind {
            Kind::Form { target, directions, hats, sigma_m } => {
                if frame.target != *target {
                    return;
                }
                for (place, along_m) in frame.along_m.iter().enumerate() {
                    let (first, parts) = hats.at(*along_m);
                    for (direction, by_form) in frame.by_form.iter().take(*directions).enumerate() {
                        let moved = by_form.column(place) * *sigma_m;
                        for (k, part) in parts.iter().enumerate().filter(|(k, _)| first + k < hats.count) {
                            add(direction * hats.count + first + k, moved * *part);
                        }
                    }
                }
            }
            Kind::Robot(field) => {
                let shift = frame.by_shift * field.sigmas.position_m;
                let turn = frame.by_turn * field.sigmas.attitude_rad;
                for (mode, part) in field.at(&frame.base_from_tool).iter().enumerate() {
                    for axis in 0..3 {
                        add(6 * mode + axis, shift.column(axis) * *part);
                        add(6 * mode + 3 + axis, turn.column(axis) * *part);
                    }
                }
            }
            Kind::Step { at_s, is_later, sigma_s } => {
                if (frame.stamp_s >= *at_s) == *is_later {
                    add(0, frame.by_unknowns.column(TIME_OFFSET) * *sigma_s);
                }
            }
            // The delay part of a lag belongs to the time offset. The remainder moves y by τ ÿ for each second.
            Kind::Lag { taken_s, sigma_s } => {
                add(0, frame.by_lag * (taken_s * sigma_s));
            }
            Kind::JointLags { sigma_s } => {
                let turn = frame.by_turn / LEVER_M;
                for (input, moves_m_s) in twist_m_s(frame.twist).into_iter().enumerate() {
                    for axis in 0..3 {
                        add(6 * input + axis, frame.by_shift.column(axis) * (moves_m_s * sigma_s));
                        add(6 * input + 3 + axis, turn.column(axis) * (moves_m_s * sigma_s));
                    }
                }
            }
            Kind::Part(clamped) => clamped.at(frame).for_each(|(column, moved)| add(column, moved)),
            Kind::Axes { sigmas } => {
                for (k, sigma) in sigmas.iter().enumerate() {
                    add(k, frame.by_axes.column(k) * *sigma);
                }
            }
            Kind::Detector { sigma_px } => {
                for k in 0..BIAS {
                    add(k, frame.by_bias.column(k) * *sigma_px);
                }
            }
        }
    }

    /// Its name among the blocks of a model. `None` for a step, which belongs to the clock, and for moves of the part, which refuse the scan.
    #[must_use]
    pub(crate) fn name(&self) -> Option<models::Block> {
        match self.kind {
            Kind::Form { .. } => Some(models::Block::SeamForm),
            Kind::Robot(_) => Some(models::Block::Robot),
            Kind::Detector { .. } => Some(models::Block::Detector),
            Kind::Lag { .. } | Kind::JointLags { .. } => Some(models::Block::PoseLag),
            Kind::Axes { .. } => Some(models::Block::Axes),
            Kind::Step { .. } | Kind::Part(_) => None,
        }
    }

    /// The assumed lag, s, if the block is the remainder of one.
    #[must_use]
    pub(crate) fn lag_s(&self) -> Option<f64> {
        if let Kind::Lag { taken_s, .. } = self.kind { Some(taken_s) } else { None }
    }

    /// Slope of a form at a frame, in each direction, dimensionless, from the coefficients of all columns.
    #[must_use]
    pub(crate) fn slope<const ROWS: usize, const LOCAL: usize>(
        &self,
        frame: &Frame<ROWS, LOCAL>,
        coefficients: &DVector<f64>,
    ) -> [f64; FORMS] {
        let Kind::Form { target, directions, hats, sigma_m } = &self.kind else { return [0.0; FORMS] };
        if frame.target != *target {
            return [0.0; FORMS];
        }
        let mut slopes = [0.0; FORMS];
        for (direction, slope) in slopes.iter_mut().enumerate().take(*directions) {
            let first = self.columns.start + direction * hats.count;
            *slope = hats.slope(frame.along_m[0], |k| coefficients[first + k] * sigma_m);
        }
        slopes
    }
}

impl Block {
    /// Shift of the point across the seam from forms of the seam, robot errors or lags of joints, m, from the coefficients of all columns. Zero for other blocks.
    #[must_use]
    pub(crate) fn offset_m<const ROWS: usize, const LOCAL: usize>(
        &self,
        frame: &Frame<ROWS, LOCAL>,
        coefficients: &DVector<f64>,
    ) -> [f64; 2] {
        match &self.kind {
            Kind::Form { target, hats, sigma_m, .. } if frame.target == *target => [0, 1].map(|direction| {
                let first = self.columns.start + direction * hats.count;
                hats.value(frame.along_m[0], |k| coefficients[first + k] * sigma_m)
            }),
            Kind::Robot(field) => {
                let mut shift = Vector3::zeros();
                for (mode, part) in field.at(&frame.base_from_tool).iter().enumerate() {
                    let first = self.columns.start + 6 * mode;
                    let three = |k: usize| coefficients.fixed_rows::<3>(k).into_owned() * *part;
                    shift += three(first) * field.sigmas.position_m;
                    shift += (three(first + 3) * field.sigmas.attitude_rad).cross(&frame.lever);
                }
                frame.across.map(|across| across.dot(&shift))
            }
            Kind::JointLags { sigma_s } => {
                let mut shift = Vector3::zeros();
                for (input, moves_m_s) in twist_m_s(frame.twist).into_iter().enumerate() {
                    let first = self.columns.start + 6 * input;
                    let three = |k: usize| coefficients.fixed_rows::<3>(k) * (moves_m_s * sigma_s);
                    shift += three(first) + (three(first + 3) / LEVER_M).cross(&frame.lever);
                }
                frame.across.map(|across| across.dot(&shift))
            }
            _ => [0.0; 2],
        }
    }
}
