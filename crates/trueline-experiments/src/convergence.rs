//! The straight-weld calibration, step by step \[Yang2025, Figs. 6–8\].

use crate::block_by_block::{self, State, TimeJacobian};
use crate::published;
use crate::settings::Settings;
use nalgebra::Vector3;
use trueline_dataset::{Guess, Recording};
use trueline_geometry::{PlueckerLine, Pose, se3};
use trueline_method::input::timestamps::Sampling;
use trueline_method::solve::iteration_record::IterationRecord;
use trueline_method::{Calibration, Config, Error, ResidualKind, calibrate, input::observations};
use trueline_sim::simulate;

/// The unknowns at one step.
#[derive(Clone, Debug)]
pub struct Step {
    /// Time offset, s.
    pub time_offset_s: f64,
    /// Root mean square distance of the points from the line, m; `None` without a point.
    pub rms_m: Option<f64>,
    /// Hand-eye transform.
    pub tool_from_camera: Pose,
    /// The line.
    pub line: PlueckerLine,
}

/// One method's way.
#[derive(Clone, Debug)]
pub struct Track {
    /// The method.
    pub name: &'static str,
    /// Its steps over the first scan, the start first.
    pub steps: Vec<Step>,
    /// The same over the scans of the other repeats.
    pub others: Vec<Vec<Step>>,
}

impl Track {
    /// The ends of all repeats.
    pub fn ends(&self) -> impl Iterator<Item = &Step> {
        std::iter::once(&self.steps).chain(&self.others).filter_map(|steps| steps.last())
    }

    /// Smallest and largest value of all repeats after `step` steps. A repeat that has ended keeps its last value.
    #[must_use]
    pub fn band(&self, step: usize, of: &dyn Fn(&Step) -> f64) -> [f64; 2] {
        let at = |steps: &'_ Vec<Step>| steps.get(step).or(steps.last()).map(of);
        let values = std::iter::once(&self.steps).chain(&self.others).filter_map(at);
        values.fold([f64::NAN; 2], |[low, high], x| [low.min(x), high.max(x)])
    }
}

/// The paper's start: no time offset, and the error of the hand-eye in the published program, 3.7 mm and 1.7°. The line's
/// start is [`published::line_start`].
#[must_use]
pub(crate) fn papers_start(truth: &Guess) -> Guess {
    let (turn, shift) = (Vector3::new(0.01, 0.02, 0.02), Vector3::new(1e-3, 2e-3, 3e-3));
    Guess {
        time_offset_s: 0.0,
        tool_from_camera: se3::retract_decoupled(&truth.tool_from_camera, &turn, &shift),
    }
}

/// All methods' ways over one simulated scan, and its truth.
///
/// # Errors
/// Error of a calibration.
pub fn run(settings: &Settings) -> Result<(Vec<Track>, Step), Error> {
    let recording = simulate(&settings.scenario(), settings.seed).ok_or(Error::NoStart)?;
    let truth = recording.truth.as_ref().ok_or(Error::NoStart)?;
    let mut tracks = over(&recording, settings)?;
    for seed in settings.seed + 1..settings.seed + settings.repeats {
        let recording = simulate(&settings.scenario(), seed).ok_or(Error::NoStart)?;
        for (track, other) in tracks.iter_mut().zip(over(&recording, settings)?) {
            track.others.push(other.steps);
        }
    }
    let line = truth.lines.first().ok_or(Error::NoStart)?.to_pluecker();
    let truth = Step {
        time_offset_s: truth.parameters.time_offset_s,
        rms_m: None,
        tool_from_camera: truth.parameters.tool_from_camera,
        line,
    };
    Ok((tracks, truth))
}

/// All methods' ways over one scan.
fn over(recording: &Recording, settings: &Settings) -> Result<Vec<Track>, Error> {
    let truth = recording.truth.as_ref().ok_or(Error::NoStart)?;
    let start = papers_start(&truth.parameters);
    let corrected = blocks(recording, &start, TimeJacobian::Corrected, settings.iterations)?;
    let published = blocks(recording, &start, TimeJacobian::Published, settings.iterations)?;
    let first = corrected.steps.first().ok_or(Error::NoStart)?;
    Ok(vec![
        joint(recording, &start, ResidualKind::Sheet, first)?,
        joint(recording, &start, ResidualKind::PointToLine, first)?,
        corrected,
        published,
    ])
}

/// A joint solve. It asks for no line: from where all methods start, its first step puts one through the points.
fn joint(recording: &Recording, start: &Guess, residual: ResidualKind, first: &Step) -> Result<Track, Error> {
    let config = Config { residual, ..Config::default() };
    let calibration = calibrate(recording, Some(start), &config)?;
    let name = match residual {
        ResidualKind::Sheet => "trueline",
        ResidualKind::PointToLine => "joint, paper's residual",
    };
    let steps = std::iter::once(first.clone()).chain(steps_of(&calibration)).collect();
    Ok(Track { name, steps, others: Vec::new() })
}

fn steps_of(calibration: &Calibration) -> Vec<Step> {
    let step = |at: &IterationRecord| {
        Some(Step {
            time_offset_s: at.parameters.time_offset_s,
            rms_m: Some(at.rms_m),
            tool_from_camera: at.parameters.tool_from_camera,
            line: at.parameters.lines.first()?.to_pluecker(),
        })
    };
    let taken = calibration.findings.fit.iterations.iter().filter(|record| record.accepted);
    let mut steps: Vec<Step> = taken.filter_map(step).collect();
    let end = calibration.best_fit();
    steps.extend(end.lines.first().map(|line| Step {
        time_offset_s: end.time_offset_s,
        rms_m: Some(calibration.findings.fit.residuals.rms_m),
        tool_from_camera: end.tool_from_camera,
        line: line.to_pluecker(),
    }));
    steps
}

/// The baseline's way, its line starting as the paper's.
///
/// # Errors
/// Error of lifting the features.
pub fn blocks(
    recording: &Recording,
    start: &Guess,
    rule: TimeJacobian,
    iterations: usize,
) -> Result<Track, Error> {
    // Poses as recorded, as in the published program.
    let config = Config { residual: ResidualKind::PointToLine, ..Config::default() };
    let sampling = Sampling::of(recording, observations::origin_ns(recording));
    let observed = observations::observe(recording, &sampling, &config)?;
    let start = State {
        time_offset_s: start.time_offset_s,
        tool_from_camera: start.tool_from_camera,
        line: published::line_start(),
    };
    let visits = block_by_block::walk(&observed, start, rule, iterations);
    let steps = visits
        .into_iter()
        .map(|visit| Step {
            time_offset_s: visit.state.time_offset_s,
            rms_m: visit.rms_m,
            tool_from_camera: visit.state.tool_from_camera,
            line: visit.state.line.to_pluecker(),
        })
        .collect();
    let name = match rule {
        TimeJacobian::Corrected => "blocks, signs corrected",
        TimeJacobian::Published => "blocks, as published",
    };
    Ok(Track { name, steps, others: Vec::new() })
}
