//! Start: from a guess, or from nothing.
//!
//! From nothing: all 24 attitudes of a cube times a coarse grid of time offsets, zero translation, the
//! lines by robust principal axes of the points that follow; then a redescending loss whose scale is
//! narrowed step by step (graduated non-convexity, \[Yang2020\]) on a thin sample of the observations.

use crate::config::Config;
use crate::error::Error;
use crate::noise_levels::NoiseLevels;
use crate::observations::{Observation, Observations};
use crate::parameters::Parameters;
use crate::problem::{LineProblem, placement};
use nalgebra::Vector3;
use trueline_dataset::Guess;
use trueline_geometry::{Line, Pose, fit, se3, so3};
use trueline_lsq::{Loss, SolveOptions, solve};

/// Observations of a line that the search looks at.
const SAMPLE: usize = 160;
/// Distance of neighbouring offsets of the grid, s. The basin reaches about 0.4 s to either side.
const OFFSET_STEP_S: f64 = 0.4;
/// Scales of the loss, σ: the first is a good part of the field of view.
const SCALES: [f64; 6] = [1000.0, 300.0, 100.0, 30.0, 10.0, 5.0];
/// Starts that are followed beyond the first scale.
const SURVIVORS: usize = 24;

/// The lines that fit the points as they fall with a time offset and a hand-eye transform.
#[must_use]
pub fn lines_for(observations: &Observations, list: &[Observation], guess: &Guess) -> Option<Vec<Line>> {
    let at = Parameters {
        time_offset_s: guess.time_offset_s,
        tool_from_camera: guess.tool_from_camera,
        lines: Vec::new(),
    };
    let mut points: Vec<Vec<Vector3<f64>>> = vec![Vec::new(); observations.line_count];
    let mut hint = 0;
    for o in list {
        if let Some(placement) = placement(observations, o, &at, &mut hint) {
            points[o.line as usize].push(placement.point_in_base(&o.point_in_camera));
        }
    }
    points.iter().map(|points| if points.len() < 3 { None } else { fit::robust_line(points) }).collect()
}

/// The start from a guess of offset and hand-eye.
///
/// # Errors
/// [`Error::NoStart`] if no feature can be placed with it.
pub fn from_guess(observations: &Observations, guess: &Guess) -> Result<Parameters, Error> {
    let lines = lines_for(observations, &observations.list, guess).ok_or(Error::NoStart)?;
    Ok(Parameters { time_offset_s: guess.time_offset_s, tool_from_camera: guess.tool_from_camera, lines })
}

/// The same parameters with each line anchored amid its points and directed as the scan runs along it.
///
/// Medians, so that wild points do not matter. A scan without progress keeps the direction it has.
#[must_use]
pub fn with_lines_amid_points(observations: &Observations, mut at: Parameters) -> Parameters {
    let mut progress: Vec<Vec<(f64, f64)>> = vec![Vec::new(); observations.line_count];
    let mut hint = 0;
    for o in &observations.list {
        if let Some(placement) = placement(observations, o, &at, &mut hint) {
            let line = &at.lines[o.line as usize];
            let from_anchor = placement.point_in_base(&o.point_in_camera) - line.anchor();
            progress[o.line as usize].push((o.stamp_s, line.direction().dot(&from_anchor)));
        }
    }
    for (line, progress) in at.lines.iter_mut().zip(progress) {
        let median_time_s = median(progress.iter().map(|p| p.0));
        let median_along_m = median(progress.iter().map(|p| p.1));
        let (Some(time_s), Some(along_m)) = (median_time_s, median_along_m) else {
            continue;
        };
        let amid = line.anchor() + line.direction() * along_m;
        let votes: f64 = progress.iter().map(|p| ((p.0 - time_s) * (p.1 - along_m)).signum()).sum();
        *line = line.anchored_near(&amid);
        if votes < 0.0 {
            *line = line.reversed();
        }
    }
    at
}

fn median(values: impl Iterator<Item = f64>) -> Option<f64> {
    let mut values: Vec<f64> = values.collect();
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// The start from nothing at all.
///
/// # Errors
/// [`Error::NoStart`] if no start leads to a finite cost.
pub fn from_nothing(
    observations: &Observations,
    config: &Config,
    noise: &NoiseLevels,
) -> Result<Parameters, Error> {
    let sample = thin(observations);
    let mut candidates: Vec<Candidate> = starts(config)
        .iter()
        .filter_map(|guess| {
            let lines = lines_for(observations, &sample, guess)?;
            let start = Parameters {
                time_offset_s: guess.time_offset_s,
                tool_from_camera: guess.tool_from_camera,
                lines,
            };
            narrow(observations, &sample, noise, (SCALES[0], 6), start)
        })
        .collect();
    candidates.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    candidates.truncate(SURVIVORS);
    let mut best: Option<Candidate> = None;
    for candidate in candidates {
        let followed = SCALES[1..].iter().try_fold(candidate, |candidate, scale| {
            narrow(observations, &sample, noise, (*scale, 12), candidate.parameters)
        });
        if let Some(found) = followed
            && best.as_ref().is_none_or(|b| found.cost < b.cost)
        {
            best = Some(found);
        }
    }
    best.map(|candidate| candidate.parameters).ok_or(Error::NoStart)
}

struct Candidate {
    cost: f64,
    parameters: Parameters,
}

fn starts(config: &Config) -> Vec<Guess> {
    let steps = (config.offset_search_s / OFFSET_STEP_S).round() as i32;
    let offsets = (-steps..=steps).map(|k| f64::from(k) * OFFSET_STEP_S);
    let rotations = so3::cube_rotations();
    let with_offset = |time_offset_s: f64| {
        rotations.iter().map(move |rotation| {
            let tool_from_camera: Pose = se3::from_parts(*rotation, Vector3::zeros());
            Guess { time_offset_s, tool_from_camera }
        })
    };
    offsets.flat_map(with_offset).collect()
}

/// Every n-th observation of each line, so that about [`SAMPLE`] of each are left.
fn thin(observations: &Observations) -> Vec<Observation> {
    let mut totals = vec![0_usize; observations.line_count];
    for o in &observations.list {
        totals[o.line as usize] += 1;
    }
    let mut seen = vec![0_usize; observations.line_count];
    let keep = |o: &&Observation| {
        let line = o.line as usize;
        seen[line] += 1;
        (seen[line] - 1).is_multiple_of(totals[line].div_ceil(SAMPLE))
    };
    observations.list.iter().filter(keep).copied().collect()
}

fn narrow(
    observations: &Observations,
    sample: &[Observation],
    noise: &NoiseLevels,
    (scale, max_iterations): (f64, usize),
    start: Parameters,
) -> Option<Candidate> {
    let problem = LineProblem::coarse(observations, sample, Loss::GemanMcClure { scale }, noise);
    let options =
        SolveOptions { max_iterations, initial_damping: 1e-3, step_threshold: 1e-2, cost_threshold: 1e-4 };
    let solution = solve(&problem, start, &[], &options).ok()?;
    Some(Candidate { cost: solution.equations.cost, parameters: solution.state })
}
