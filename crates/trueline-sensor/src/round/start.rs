//! Where the fit starts when nothing is known: time offsets and attitudes of the sensor all around.
//!
//! With offset and attitude given, the two coordinates of the circle's centre in the sheet are linear in the sphere's centre and the sensor's
//! place, whichever side of the sheet the sphere is on. The radii of the circles then give the distance from the sheet: its value is the one
//! that most cuts agree with, on one side or the other.

use super::model::RoundState;
use super::problem::Scan;
use super::sheet_frame::SheetFrame;
use crate::board_hand_eye::unknowns::Unknowns;
use nalgebra::{Matrix3, SMatrix, SVector, UnitQuaternion, Vector3};
use std::f64::consts::TAU;
use trueline_geometry::statistics::{median, quantile};
use trueline_geometry::{Pose, se3};

/// Time offsets tried to either side of zero.
const STEPS: i32 = 40;
/// Directions of the sheet's normal that are tried, a whole sphere of them, some 29° apart.
const DIRECTIONS: usize = 48;
/// Turns about each of them.
const TURNS: usize = 12;
/// Turn from one direction to the next about the pole, rad: it fills a sphere evenly.
const GOLDEN_RAD: f64 = 2.399_963_229_728_653;
/// Attitudes that are kept of each offset, and starts in all.
const KEPT: usize = 3;
const MOST: usize = 48;
/// A cut is off by about this at a start, m: an attitude is 15° off.
const OFF_M: f64 = 5e-3;
/// The sphere is about so far from the middle of the robot's path, and the sensor from its tool, m.
const FAR_M: f64 = 1.0;
/// Least part of the cuts with a pose of the robot at an offset.
const LEAST_PART: f64 = 0.5;
/// A sphere of unknown radius is larger by this than all but the largest of its circles.
const LARGER: f64 = 1.02;
const LARGE: f64 = 0.9;

/// A cut with the robot's pose at it.
struct Placed {
    base_from_tool: Matrix3<f64>,
    /// The tool from the middle of the path, m.
    from_middle_m: Vector3<f64>,
    /// Centre and radius of the circle, m.
    seen: Vector3<f64>,
}

/// All cuts at a time offset.
struct AtOffset {
    placed: Vec<Placed>,
    middle_m: Vector3<f64>,
    offset_s: f64,
    radius_m: f64,
}

/// An attitude with what follows linearly from it.
struct Attitude {
    /// Median of the squared distances in the sheet, m².
    squared: f64,
    /// `tool_from_sheet`: columns e₁, e₂, n.
    axes: Matrix3<f64>,
    /// The sphere's centre from the middle of the path, m.
    center_m: Vector3<f64>,
    /// The sheet's origin along its own axes in the tool frame, m; the third is not known.
    origin_m: [f64; 2],
}

/// Offsets to start from within plus and minus a reach, s.
pub(super) fn offsets_s(scan: &Scan<'_>, reach_s: f64) -> Vec<f64> {
    if !scan.robot.has_time_offset() {
        return vec![0.0];
    }
    (-STEPS..=STEPS).map(|k| reach_s * f64::from(k) / f64::from(STEPS)).collect()
}

/// Starts all around at some offsets, the likeliest first.
pub(super) fn starts(scan: &Scan<'_>, offsets_s: &[f64]) -> Vec<RoundState> {
    let attitudes = attitudes();
    let mut all: Vec<(f64, RoundState)> = Vec::new();
    for offset_s in offsets_s {
        let Some(at) = AtOffset::of(scan, *offset_s) else { continue };
        let mut found: Vec<Attitude> = attitudes.iter().filter_map(|axes| at.with_attitude(axes)).collect();
        found.sort_by(|a, b| a.squared.total_cmp(&b.squared));
        let of = |attitude: &Attitude| (attitude.squared, at.state(attitude, scan.sheet));
        all.extend(found.iter().take(KEPT).map(of));
    }
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    all.into_iter().take(MOST).map(|(_, state)| state).collect()
}

/// A start with a hand-eye transform that is known about.
pub(super) fn with_hand_eye(scan: &Scan<'_>, offset_s: f64, tool_from_camera: &Pose) -> Option<RoundState> {
    let at = AtOffset::of(scan, offset_s)?;
    let turn = tool_from_camera.rotation.to_rotation_matrix().into_inner();
    let mut state = at.state(&at.with_attitude(&(turn * scan.sheet.axes()))?, scan.sheet);
    state.unknowns.tool_from_camera = *tool_from_camera;
    Some(state)
}

/// Attitudes of the sheet on the tool all around: columns e₁, e₂, n.
fn attitudes() -> Vec<Matrix3<f64>> {
    let mut all = Vec::new();
    for k in 0..DIRECTIONS {
        let z = 1.0 - (2 * k + 1) as f64 / DIRECTIONS as f64;
        let (sine, around) = ((1.0 - z * z).sqrt(), GOLDEN_RAD * k as f64);
        let normal = Vector3::new(sine * around.cos(), sine * around.sin(), z);
        let beside = if z.abs() < 0.9 { Vector3::z() } else { Vector3::x() };
        let first = normal.cross(&beside).normalize();
        for turn in 0..TURNS {
            let about = UnitQuaternion::from_scaled_axis(normal * (TAU * turn as f64 / TURNS as f64));
            let e1 = about * first;
            all.push(Matrix3::from_columns(&[e1, normal.cross(&e1), normal]));
        }
    }
    all
}

impl AtOffset {
    fn of(scan: &Scan<'_>, offset_s: f64) -> Option<Self> {
        let of = |k: usize| {
            let pose = scan.robot.at(k, offset_s)?.base_from_tool;
            Some((pose, scan.cuts[k].measured()))
        };
        let all: Vec<(Pose, Vector3<f64>)> = (0..scan.cuts.len()).filter_map(of).collect();
        if (all.len() as f64) < LEAST_PART * scan.cuts.len() as f64 || all.is_empty() {
            return None;
        }
        let middle_m =
            all.iter().map(|(pose, _)| pose.translation.vector).sum::<Vector3<f64>>() / all.len() as f64;
        // Some arcs may be of something else, and larger.
        let large_m = quantile(all.iter().map(|(_, seen)| seen.z), LARGE)?;
        let placed = all.into_iter().map(|(pose, seen)| Placed {
            base_from_tool: pose.rotation.to_rotation_matrix().into_inner(),
            from_middle_m: pose.translation.vector - middle_m,
            seen,
        });
        let radius_m = scan.radius_m.unwrap_or(LARGER * large_m);
        Some(Self { placed: placed.collect(), middle_m, offset_s, radius_m })
    }

    /// What follows from an attitude: a = (R e₁)ᵀ(B − t) − τ₁, b likewise.
    fn with_attitude(&self, axes: &Matrix3<f64>) -> Option<Attitude> {
        let (mut information, mut pull) = (SMatrix::<f64, 5, 5>::zeros(), SVector::<f64, 5>::zeros());
        let rows = |placed: &Placed| {
            [0, 1].map(|j| {
                let along: Vector3<f64> = placed.base_from_tool * axes.column(j);
                let mut row = SVector::<f64, 5>::zeros();
                row.fixed_rows_mut::<3>(0).copy_from(&along);
                row[3 + j] = -1.0;
                (row, placed.seen[j] + along.dot(&placed.from_middle_m))
            })
        };
        for placed in &self.placed {
            for (row, value) in rows(placed) {
                information += row * row.transpose();
                pull += row * value;
            }
        }
        // What is known beforehand decides where the robot keeps its attitude.
        information += SMatrix::<f64, 5, 5>::identity() * (OFF_M / FAR_M).powi(2);
        let found = information.cholesky()?.solve(&pull);
        let squared = |placed: &Placed| {
            rows(placed).iter().map(|(row, value)| (row.dot(&found) - value).powi(2)).sum::<f64>()
        };
        Some(Attitude {
            squared: median(self.placed.iter().map(squared))?,
            axes: *axes,
            center_m: found.fixed_rows::<3>(0).into(),
            origin_m: [found[3], found[4]],
        })
    }

    fn state(&self, attitude: &Attitude, sheet: &SheetFrame) -> RoundState {
        let Attitude { axes, center_m, origin_m: [first, second], .. } = attitude;
        let origin = axes * Vector3::new(*first, *second, self.third(attitude));
        let turn = axes * sheet.axes().transpose();
        let rotation = UnitQuaternion::from_matrix(&turn);
        RoundState {
            unknowns: Unknowns {
                time_offset_s: self.offset_s,
                tool_from_camera: se3::from_parts(rotation, origin - turn * sheet.origin_m()),
                base_from_target: se3::from_parts(UnitQuaternion::identity(), self.middle_m + center_m),
            },
            radius_m: self.radius_m,
            shape: SVector::zeros(),
        }
    }

    /// Where the sheet lies along its normal, m: |n·p − κ| = √(R² − ρ²) in most cuts.
    fn third(&self, attitude: &Attitude) -> f64 {
        let normal: Vector3<f64> = attitude.axes.column(2).into();
        let at = |placed: &Placed| {
            let along = (placed.base_from_tool * normal).dot(&(attitude.center_m - placed.from_middle_m));
            (along, (self.radius_m.powi(2) - placed.seen.z.powi(2)).max(0.0).sqrt())
        };
        let all: Vec<(f64, f64)> = self.placed.iter().map(at).collect();
        let off = |third: f64| {
            all.iter().map(|(along, away)| ((along - third).abs() - away).abs().min(OFF_M)).sum::<f64>()
        };
        let candidates = all.iter().flat_map(|(along, away)| [along - away, along + away]);
        candidates
            .map(|third| (off(third), third))
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .map_or(0.0, |best| best.1)
    }
}
