//! Start: from a guess, or from the data alone.
//!
//! Without a guess: all 24 attitudes of a cube times a coarse grid of time offsets, zero translation, and the lines from robust principal axes of
//! the resulting points. `solve::narrowing` follows. For a standing robot see `solve::linear_start`.

use crate::config::Config;
use crate::error::Error;
use crate::input::noise_levels::NoiseLevels;
use crate::input::observations::{Observation, Observations};
use crate::parallel;
use crate::problem::parameters::Parameters;
use crate::problem::placement::placement;
use crate::solve::linear_start;
use crate::solve::narrowing::{Candidate, Narrowing, SAME_OFFSET_S, SCALES, Stage, sample, thin};
use crate::solve::placed_lines::lines_for;
use nalgebra::Vector3;
use trueline_dataset::Guess;
use trueline_geometry::{Pose, se3, so3};

/// Breadth of a search.
#[derive(Clone, Copy, Debug)]
pub struct Breadth {
    /// Step of the grid of time offsets, s.
    offset_step_s: f64,
    /// Number of starts that are followed beyond the first scale.
    survivors: usize,
    /// Number of minima that are solved in full. With little tilt a mirrored solution fits almost as well as the true one.
    finalists: usize,
}

impl Breadth {
    /// For scans of 20 s. The basin of convergence extends about 0.4 s to either side.
    pub(crate) const USUAL: Self = Self { offset_step_s: 0.4, survivors: 24, finalists: 4 };
    /// For a time offset known to a fraction of a second, with wrong answers far from the right one.
    pub(crate) const GLANCE: Self = Self { offset_step_s: 0.4, survivors: 8, finalists: 2 };
    /// If the usual search found nothing good. In a scan of a few seconds a wrong attitude can fit for a while.
    pub const WIDE: Self = Self { offset_step_s: 0.2, survivors: 100, finalists: 12 };
    /// For a standing robot. With a dozen readings hundreds of wrong attitudes leave small residuals, and solving from each takes a millisecond.
    pub const STOPS: Self = Self { offset_step_s: 0.2, survivors: 1_000, finalists: 100 };
}

/// Observations of a line used to choose between the finalists.
const FINAL_SAMPLE: usize = 500;
/// Candidates nearer than this may be in one local minimum.
const SAME_TURN_RAD: f64 = 0.05;

/// The start from a guess of time offset and hand-eye.
///
/// # Errors
/// [`Error::NoStart`] if it places no feature.
pub fn from_guess(observations: &Observations, guess: &Guess) -> Result<Parameters, Error> {
    let lines = lines_for(observations, &observations.list, guess).ok_or(Error::NoStart)?;
    Ok(Parameters::straight(guess, lines))
}

/// The start without a guess.
///
/// # Errors
/// [`Error::NoStart`] if no start leads to a finite cost.
pub fn from_nothing(
    observations: &Observations,
    config: &Config,
    noise: &NoiseLevels,
    breadth: Breadth,
) -> Result<Parameters, Error> {
    let sample = sample(observations);
    let on_sample = Narrowing::new(observations, &sample, noise);
    let starts = if config.at_stops {
        linear_start::starts(observations, &sample)
    } else {
        cube_starts(observations, &sample, config, breadth)
    };
    let mut candidates = parallel::filter_map(config.threads, &starts, |start| {
        on_sample.narrow(Stage { scale: SCALES[0], iterations: 6 }, start.clone())
    });
    candidates.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    candidates.truncate(breadth.survivors);
    let followed = parallel::filter_map(config.threads, &candidates, |candidate| {
        on_sample.follow(&SCALES[1..], 12, candidate.parameters.clone())
    });
    let mut ends: Vec<Parameters> =
        different(followed, breadth.finalists).into_iter().map(|c| c.parameters).collect();
    let mirrors: Vec<Parameters> = ends.iter().filter_map(|p| mirrored(observations, &sample, p)).collect();
    ends.extend(mirrors);
    let denser = thin(observations, FINAL_SAMPLE);
    let on_denser = on_sample.among(&denser);
    let finished = parallel::filter_map(config.threads, &ends, |end| {
        let near = on_denser.narrow(Stage { scale: SCALES[3], iterations: 30 }, end.clone())?;
        on_denser.narrow(Stage { scale: SCALES[5], iterations: 60 }, near.parameters)
    });
    let best = finished.into_iter().min_by(|a, b| a.cost.total_cmp(&b.cost));
    best.map(|candidate| candidate.parameters).ok_or(Error::NoStart)
}

/// The solution that is indistinguishable at a constant attitude: the sheet is tilted against the line in the opposite direction. A half turn of the
/// sheet about the line in base and then about its own normal keeps every offset perpendicular to the line. It reverses offsets along the line,
/// which are not measured. Only tilting separates the two, so with little tilt a search can end in the wrong one.
#[must_use]
pub fn mirrored(observations: &Observations, sample: &[Observation], at: &Parameters) -> Option<Parameters> {
    let half_turn = |axis: &Vector3<f64>| so3::exp(&(axis * std::f64::consts::PI));
    let middle = sample.get(sample.len() / 2)?;
    let base_from_tool = placement(observations, middle, at)?.base_from_tool.rotation;
    let line_in_tool = base_from_tool.inverse() * at.lines.first()?.direction();
    let rotation = half_turn(&line_in_tool)
        * at.tool_from_camera.rotation
        * half_turn(observations.sheet.plane().normal());
    // The middle of the points is kept in place.
    let centre = sample.iter().map(|o| o.point_in_camera).sum::<Vector3<f64>>() / sample.len() as f64;
    let shift = at.tool_from_camera.rotation * centre - rotation * centre;
    let tool_from_camera = se3::from_parts(rotation, at.tool_from_camera.translation.vector + shift);
    let guess = Guess { time_offset_s: at.time_offset_s, tool_from_camera };
    let lines = lines_for(observations, sample, &guess)?;
    Some(Parameters::straight(&guess, lines))
}

/// The best few candidates in distinct local minima.
fn different(mut candidates: Vec<Candidate>, most: usize) -> Vec<Candidate> {
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
        if chosen.len() < most && !chosen.iter().any(same) {
            chosen.push(candidate);
        }
    }
    chosen
}

/// All attitudes of a cube at all time offsets of the grid, with zero translation.
fn cube_starts(
    observations: &Observations,
    sample: &[Observation],
    config: &Config,
    breadth: Breadth,
) -> Vec<Parameters> {
    let steps = (config.offset_search_s / breadth.offset_step_s).round() as i32;
    let offsets = (-steps..=steps).map(|k| f64::from(k) * breadth.offset_step_s);
    let rotations = so3::cube_rotations();
    let with_offset = |time_offset_s: f64| {
        rotations.iter().map(move |rotation| {
            let tool_from_camera: Pose = se3::from_parts(*rotation, Vector3::zeros());
            Guess { time_offset_s, tool_from_camera }
        })
    };
    let guesses: Vec<Guess> = offsets.flat_map(with_offset).collect();
    parallel::filter_map(config.threads, &guesses, |guess| {
        Some(Parameters::straight(guess, lines_for(observations, sample, guess)?))
    })
}
