//! Start: from a guess, or from nothing.
//!
//! From nothing: all 24 attitudes of a cube times a coarse grid of time offsets, zero translation, the
//! lines by robust principal axes of the points that follow; then a redescending loss whose scale is
//! narrowed step by step (graduated non-convexity, \[Yang2020\]) on a thin sample of the observations.

use crate::config::Config;
use crate::error::Error;
use crate::input::noise_levels::NoiseLevels;
use crate::input::observations::{Observation, Observations};
use crate::order_statistics::median;
use crate::problem::line_problem::{LineProblem, placement};
use crate::problem::parameters::Parameters;
use crate::solve::refine::FitSettings;
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
/// Valleys that are followed to their bottom, on a denser sample: with little tilt a mirrored solution fits
/// almost as well as the true one.
const FINALISTS: usize = 4;
/// Observations of a line that decide between them.
const FINAL_SAMPLE: usize = 500;
/// Candidates nearer than this are in one valley.
const SAME_TURN_RAD: f64 = 0.05;
/// The same for the time offset, s.
const SAME_OFFSET_S: f64 = 0.02;

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

/// The start from nothing at all.
///
/// # Errors
/// [`Error::NoStart`] if no start leads to a finite cost.
pub fn from_nothing(
    observations: &Observations,
    config: &Config,
    noise: &NoiseLevels,
) -> Result<Parameters, Error> {
    let sample = thin(observations, SAMPLE);
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
    let followed = candidates.into_iter().filter_map(|candidate| {
        SCALES[1..].iter().try_fold(candidate, |candidate, scale| {
            narrow(observations, &sample, noise, (*scale, 12), candidate.parameters)
        })
    });
    let finalists: Vec<Parameters> =
        different(followed.collect()).into_iter().map(|c| c.parameters).collect();
    let twins: Vec<Parameters> = finalists.iter().filter_map(|p| twin(observations, &sample, p)).collect();
    let denser = thin(observations, FINAL_SAMPLE);
    let finished = finalists.into_iter().chain(twins).filter_map(|start| {
        let near = narrow(observations, &denser, noise, (SCALES[3], 30), start)?;
        narrow(observations, &denser, noise, (SCALES[5], 60), near.parameters)
    });
    let best = finished.min_by(|a, b| a.cost.total_cmp(&b.cost));
    best.map(|candidate| candidate.parameters).ok_or(Error::NoStart)
}

/// The solution that looks alike while the attitude is constant: the sheet leans against the line the
/// other way. Turned by half a turn about the line in base and about its own normal, the sheet keeps every
/// offset square to the line and reverses those along it, which a line cannot show. Only tilting tells
/// the two apart, so with little tilt a search can end in the wrong one.
#[must_use]
pub fn twin(observations: &Observations, sample: &[Observation], at: &Parameters) -> Option<Parameters> {
    let half_turn = |axis: &Vector3<f64>| so3::exp(&(axis * std::f64::consts::PI));
    let middle = &sample[sample.len() / 2];
    let base_from_tool = placement(observations, middle, at, &mut 0)?.base_from_tool.rotation;
    let line_in_tool = base_from_tool.inverse() * at.lines.first()?.direction();
    let rotation = half_turn(&line_in_tool)
        * at.tool_from_camera.rotation
        * half_turn(observations.sheet.plane().normal());
    // The middle of the points stays where it is.
    let centre = sample.iter().map(|o| o.point_in_camera).sum::<Vector3<f64>>() / sample.len() as f64;
    let shift = at.tool_from_camera.rotation * centre - rotation * centre;
    let tool_from_camera = se3::from_parts(rotation, at.tool_from_camera.translation.vector + shift);
    let guess = Guess { time_offset_s: at.time_offset_s, tool_from_camera };
    let lines = lines_for(observations, sample, &guess)?;
    Some(Parameters { time_offset_s: at.time_offset_s, tool_from_camera, lines })
}

/// Distance of the offsets from which another valley is looked for, s.
const OTHER_STEP_S: f64 = 0.1;

/// The best solution in another valley of the time offset than that of `best`, on a thin sample; `None`
/// if every start within the searched range falls back into that one.
#[must_use]
pub fn other_offset(
    observations: &Observations,
    settings: &FitSettings<'_>,
    best: &Parameters,
) -> Option<Parameters> {
    let sample = thin(observations, SAMPLE);
    let steps = (settings.config.offset_search_s / OTHER_STEP_S).round() as i32;
    let offsets = (-steps..=steps).map(|k| f64::from(k) * OTHER_STEP_S);
    let elsewhere = |at: &Parameters| {
        (at.time_offset_s - best.time_offset_s).abs() > SAME_OFFSET_S
            && at.time_offset_s.abs() <= settings.config.offset_search_s + OTHER_STEP_S
    };
    let follow = |scales: &[f64], iterations: usize, start: Parameters| {
        scales.iter().try_fold(Candidate { cost: f64::INFINITY, parameters: start }, |candidate, scale| {
            narrow(observations, &sample, &settings.noise, (*scale, iterations), candidate.parameters)
        })
    };
    let mut candidates: Vec<Candidate> = offsets
        .filter_map(|time_offset_s| {
            let guess = Guess { time_offset_s, tool_from_camera: best.tool_from_camera };
            let lines = lines_for(observations, &sample, &guess)?;
            let start = Parameters { time_offset_s, tool_from_camera: best.tool_from_camera, lines };
            follow(&SCALES[1..3], 8, start)
        })
        .filter(|candidate| elsewhere(&candidate.parameters))
        .collect();
    candidates.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    candidates.truncate(FINALISTS);
    let followed = candidates.into_iter().filter_map(|c| follow(&SCALES[3..], 30, c.parameters));
    let others = followed.filter(|candidate| elsewhere(&candidate.parameters));
    others.min_by(|a, b| a.cost.total_cmp(&b.cost)).map(|candidate| candidate.parameters)
}

/// The best few candidates of which no two are the same valley.
fn different(mut candidates: Vec<Candidate>) -> Vec<Candidate> {
    candidates.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    let mut chosen: Vec<Candidate> = Vec::new();
    for candidate in candidates {
        let same = |other: &Candidate| {
            let turn = other
                .parameters
                .tool_from_camera
                .rotation
                .angle_to(&candidate.parameters.tool_from_camera.rotation);
            let offset = (other.parameters.time_offset_s - candidate.parameters.time_offset_s).abs();
            turn < SAME_TURN_RAD && offset < SAME_OFFSET_S
        };
        if chosen.len() < FINALISTS && !chosen.iter().any(same) {
            chosen.push(candidate);
        }
    }
    chosen
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

/// Every n-th observation of each line, so that about `wanted` of each are left.
fn thin(observations: &Observations, wanted: usize) -> Vec<Observation> {
    let mut totals = vec![0_usize; observations.line_count];
    for o in &observations.list {
        totals[o.line as usize] += 1;
    }
    let mut seen = vec![0_usize; observations.line_count];
    let keep = |o: &&Observation| {
        let line = o.line as usize;
        seen[line] += 1;
        (seen[line] - 1).is_multiple_of(totals[line].div_ceil(wanted))
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
