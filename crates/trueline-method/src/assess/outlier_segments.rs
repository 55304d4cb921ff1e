//! Stretches of the scan that disagree with the rest, and their cause: a clock step, or a detector that followed another line.

use crate::assess::residuals::FeatureResidual;
use crate::input::noise_levels::NoiseLevels;
use crate::input::observations::{Observation, Observations};
use crate::problem::line_problem::LineProblem;
use crate::problem::parameters::{Parameters, TIME_OFFSET, line_index};
use crate::problem::placement::placement;
use crate::solve::noise_scale::noise_factor;
use crate::thinning::stride;
use std::collections::BTreeSet;
use trueline_geometry::{Line, fit};
use trueline_lsq::{Loss, SolveOptions, solve};

/// Cause of a stretch of outliers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Cause {
    /// Another time offset, later by this much, s.
    ClockStep(f64),
    /// The recorded pose is constant.
    RobotStoodStill,
    /// Another line at this distance, m.
    OtherLine(f64),
    /// No known cause.
    Unknown,
}

/// A stretch of features, nearly all of which are outliers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OutlierSegment {
    /// First and last stamp, s.
    pub span_s: [f64; 2],
    /// Features in it.
    pub features: usize,
    /// Its cause.
    pub cause: Cause,
}

/// A stretch scores one for each outlier and loses this for each inlier. It ends below 60 % outliers.
const INLIER_COST: f64 = 1.5;
/// Least score of a reported stretch. 40 % of random outliers reach it once in 10⁵ features.
const LEAST_SCORE: f64 = 15.0;
/// Maximum number of reported stretches of a line.
const MOST: usize = 5;
/// Residuals above this multiple of the rest's are unexplained.
const EXPLAINED: f64 = 2.5;
/// Step between the offsets that are tried for a stretch, s.
const OFFSET_STEP_S: f64 = 0.002;
/// Maximum observations of a stretch evaluated.
const MOST_OF_STRETCH: usize = 80;

/// Finds the stretches, longest first, with their causes.
#[must_use]
pub fn find(
    observations: &Observations,
    features: &[FeatureResidual],
    at: &Parameters,
    noise: &NoiseLevels,
    offset_search_s: f64,
) -> Vec<OutlierSegment> {
    let mut found: Vec<OutlierSegment> = (0..observations.line_count as u32)
        .flat_map(|line| {
            let own: Vec<&FeatureResidual> = features.iter().filter(|f| f.line == line).collect();
            on_line(observations, &own, at, noise, offset_search_s)
        })
        .collect();
    found.sort_by_key(|d| std::cmp::Reverse(d.features));
    found
}

/// The stretches of one line. Those of another line may be inliers.
fn on_line(
    observations: &Observations,
    features: &[&FeatureResidual],
    at: &Parameters,
    noise: &NoiseLevels,
    offset_search_s: f64,
) -> Vec<OutlierSegment> {
    let mut scores: Vec<f64> =
        features.iter().map(|f| if f.is_outlier() { 1.0 } else { -INLIER_COST }).collect();
    let mut found = Vec::new();
    while found.len() < MOST {
        let (from, to, score) = best_stretch(&scores);
        if score < LEAST_SCORE {
            break;
        }
        let rows: BTreeSet<u32> = features[from..to].iter().map(|f| f.row).collect();
        let list: Vec<Observation> =
            observations.list.iter().filter(|o| rows.contains(&o.row)).copied().collect();
        found.push(OutlierSegment {
            span_s: [features[from].stamp_s, features[to - 1].stamp_s],
            features: to - from,
            cause: explain(observations, &list, at, noise, offset_search_s),
        });
        scores[from..to].fill(f64::NEG_INFINITY);
    }
    found
}

/// The stretch [from, to) with the largest sum.
fn best_stretch(scores: &[f64]) -> (usize, usize, f64) {
    let (mut best, mut from, mut sum) = ((0, 0, 0.0), 0, 0.0);
    for (k, score) in scores.iter().enumerate() {
        if sum <= 0.0 {
            (from, sum) = (k, 0.0);
        }
        sum += score;
        if sum > best.2 {
            best = (from, k + 1, sum);
        }
    }
    best
}

fn explain(
    observations: &Observations,
    list: &[Observation],
    at: &Parameters,
    noise: &NoiseLevels,
    offset_search_s: f64,
) -> Cause {
    if stood_still(observations, list, at) {
        return Cause::RobotStoodStill;
    }
    if let Some(step_s) = other_offset(observations, list, at, noise, offset_search_s) {
        return Cause::ClockStep(step_s);
    }
    other_line(observations, list, at, noise).map_or(Cause::Unknown, Cause::OtherLine)
}

/// Whether the robot's stream repeats one pose over nearly all of the stretch.
fn stood_still(observations: &Observations, list: &[Observation], at: &Parameters) -> bool {
    let still = list.iter().filter(|o| {
        let moving = placement(observations, o, at)
            .is_some_and(|p| p.velocity.norm() > 1e-9 || p.angular_velocity.norm() > 1e-9);
        !moving
    });
    still.count() * 10 > list.len() * 9
}

/// The change of the time offset that makes the stretch fit. All else is held except the seam's bow, which the rest of the scan does not determine
/// there.
fn other_offset(
    observations: &Observations,
    list: &[Observation],
    at: &Parameters,
    noise: &NoiseLevels,
    offset_search_s: f64,
) -> Option<f64> {
    let thin: Vec<Observation> = list.iter().step_by(stride(list.len(), MOST_OF_STRETCH)).copied().collect();
    let problem =
        LineProblem::coarse(observations, &thin, Loss::GemanMcClure { scale: 10.0 }, noise, at.unknowns());
    let with_offset = |time_offset_s: f64| Parameters { time_offset_s, ..at.clone() };
    let steps = (offset_search_s / OFFSET_STEP_S) as i32;
    let grid = (-steps..=steps).map(|k| at.time_offset_s + f64::from(k) * OFFSET_STEP_S);
    let cost = |offset: &f64| trueline_lsq::LeastSquares::cost(&problem, &with_offset(*offset));
    let start = grid.min_by(|a, b| cost(a).total_cmp(&cost(b)))?;
    let bows = at.unknowns().bow(0).start..at.unknowns().bow(at.lines.len()).start;
    let others: Vec<usize> = (0..at.dimension()).filter(|k| *k != TIME_OFFSET && !bows.contains(k)).collect();
    let found = solve(&problem, with_offset(start), &others, &SolveOptions::default()).ok()?.state;
    let step_s = found.time_offset_s - at.time_offset_s;
    let all = LineProblem::coarse(observations, list, Loss::Squared, noise, at.unknowns());
    let squared = all.squared_residuals(&found);
    // It must place most of the stretch, with residuals like the rest's.
    let fits = squared.len() * 2 > list.len() && noise_factor(&squared) < EXPLAINED;
    fits.then_some(step_s)
}

/// Distance of the stretch's own line, if it has one.
fn other_line(
    observations: &Observations,
    list: &[Observation],
    at: &Parameters,
    noise: &NoiseLevels,
) -> Option<f64> {
    let label = list.first()?.line;
    let own: Vec<Observation> = list.iter().filter(|o| o.line == label).copied().collect();
    let points: Vec<_> = own
        .iter()
        .filter_map(|o| Some(placement(observations, o, at)?.point_in_base(&o.point_in_camera)))
        .collect();
    let line: Line = fit::robust_line(&points)?;
    let mut with_line = at.clone();
    with_line.lines[label as usize] = line;
    let own_line = line_index(label as usize)..line_index(label as usize + 1);
    let fixed: Vec<usize> = (0..at.dimension()).filter(|k| !own_line.contains(k)).collect();
    let problem =
        LineProblem::coarse(observations, &own, Loss::GemanMcClure { scale: 10.0 }, noise, at.unknowns());
    let found = solve(&problem, with_line, &fixed, &SolveOptions::default()).ok()?.state;
    let squared = LineProblem::coarse(observations, &own, Loss::Squared, noise, at.unknowns())
        .squared_residuals(&found);
    let middle = points.iter().sum::<nalgebra::Vector3<f64>>() / points.len() as f64;
    let beside_m =
        at.lines[label as usize].distance(found.lines[label as usize].anchored_near(&middle).anchor());
    (noise_factor(&squared) < EXPLAINED).then_some(beside_m)
}
