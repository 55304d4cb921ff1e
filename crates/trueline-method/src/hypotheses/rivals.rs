//! Rivals: other solutions that explain most of the same scan, at other time offsets or with the sensor turned by 180°.
//!
//! A straight line looks the same one period of the path later. With the sensor turned by 180° about an axis of its sheet, half a period is enough.
//! Every time offset is therefore tried from the best attitude and from its half-turns about the sheet's normal and both of its axes, through the
//! mean measured point. For the mirrored attitude at the same time offset see [`crate::hypotheses::mirror`].

use crate::assess::residuals::OUTLIER_SQUARED;
use crate::error::Error;
use crate::hypotheses::paired_test::{PairedTest, compare};
use crate::input::observations::Observation;
use crate::parallel;
use crate::problem::line_problem::LineProblem;
use crate::problem::parameters::{LINES, Parameters, ROTATION, TIME_OFFSET};
use crate::solve::fit::Fit;
use crate::solve::narrowing::{Candidate, Narrowing, SAME_OFFSET_S, sample};
use crate::solve::placed_lines::lines_for;
use crate::solve::solver::Solver;
use nalgebra::{UnitVector3, Vector3};
use trueline_dataset::Guess;
use trueline_geometry::{Pose, se3, so3};
use trueline_lsq::Loss;

/// A rival, refined to convergence with the same unknowns as the best solution.
#[derive(Clone, Debug)]
pub struct Rival {
    /// The solution.
    pub fit: Fit,
    /// Comparison with the best.
    pub test: PairedTest,
}

impl Rival {
    /// Whether it explains more than half of the features that the best explains, and is therefore reported.
    #[must_use]
    pub(crate) fn is_named(&self) -> bool {
        self.test.explains > NAMED * self.test.best_explains
    }
}

/// Least share of the best's explained features for a reported rival.
const NAMED: f64 = 0.5;
/// Step between the time offsets that are tried, s.
const OFFSET_STEP_S: f64 = 0.1;
/// Scales of the loss for a coarse solve, σ …
const ROUGH_SCALES: [f64; 2] = [300.0, 100.0];
/// … and for the full solve.
const FINE_SCALES: [f64; 3] = [30.0, 10.0, 5.0];
/// Number of starts that are solved in full.
const FINALISTS: usize = 8;
/// Solutions nearer than this in attitude (and in time offset) are one, rad.
const SAME_TURN_RAD: f64 = 0.05;
/// A finalist that explains less than this fraction of the sample is refined only if it is the best.
const WORTH_REFINING: f64 = 0.3;

/// Finds rivals of a solution other than its mirror image: the reported ones first, each group by rising z.
///
/// The best rival is always included, so that a result can state how clear the decision was.
#[must_use]
pub fn find(solver: &Solver<'_>, best: &Fit, mirror: Option<&Parameters>) -> Vec<Rival> {
    let Solver { observations, settings } = *solver;
    // At stops there are other attitudes, but no other time offsets.
    if settings.fixed.contains(&TIME_OFFSET) && !settings.config.at_stops {
        return Vec::new();
    }
    let sample = sample(observations);
    let search = Search { solver, sample: &sample, best: best.parameters() };
    let mut finalists = search.finalists();
    let explained = |candidate: &Candidate| search.explains(&candidate.parameters);
    let worth: Vec<bool> = finalists.iter().map(|c| explained(c) > WORTH_REFINING).collect();
    let mut index = 0;
    finalists.retain(|_| {
        index += 1;
        index == 1 || worth[index - 1]
    });
    let mut rivals: Vec<Rival> = Vec::new();
    for finalist in finalists {
        let Ok(fit) = solver.fit(finalist.parameters).and_then(|rough| followed(solver, best, rough)) else {
            continue;
        };
        let found = |other: &Parameters| same(other, fit.parameters());
        let known = rivals.iter().any(|rival| found(rival.fit.parameters()));
        if known || mirror.is_some_and(found) || found(best.parameters()) {
            continue;
        }
        if let Some(test) = compare(observations, settings.config, best, &fit) {
            rivals.push(Rival { fit, test });
        }
    }
    rivals.sort_by(|a, b| b.is_named().cmp(&a.is_named()).then_with(|| a.test.z.total_cmp(&b.test.z)));
    rivals
}

/// Converges a rival, unless it is far worse already. With gross errors, or hardly any tilt, it may still converge to a known solution.
fn followed(solver: &Solver<'_>, best: &Fit, rough: Fit) -> Result<Fit, Error> {
    let test = compare(solver.observations, solver.settings.config, best, &rough);
    if test.is_some_and(|test| test.is_far_worse()) { Ok(rough) } else { solver.converge(&rough) }
}

/// Whether two solutions are identical.
fn same(one: &Parameters, other: &Parameters) -> bool {
    let turn_rad = one.tool_from_camera.rotation.angle_to(&other.tool_from_camera.rotation);
    turn_rad < SAME_TURN_RAD && (one.time_offset_s - other.time_offset_s).abs() < SAME_OFFSET_S
}

/// The sensor turned by half a turn about an axis (camera frame) through a point (camera frame, m).
#[must_use]
pub(crate) fn half_turned(tool_from_camera: &Pose, axis: &UnitVector3<f64>, centre: &Vector3<f64>) -> Pose {
    let rotation = tool_from_camera.rotation * so3::exp(&(axis.into_inner() * std::f64::consts::PI));
    let shift = tool_from_camera.rotation * centre - rotation * centre;
    se3::from_parts(rotation, tool_from_camera.translation.vector + shift)
}

struct Search<'a> {
    solver: &'a Solver<'a>,
    sample: &'a [Observation],
    best: &'a Parameters,
}

impl Search<'_> {
    fn finalists(&self) -> Vec<Candidate> {
        let steps = (self.solver.settings.config.offset_search_s / OFFSET_STEP_S).round() as i32;
        let middle_s = self.middle_s();
        let threads = self.solver.settings.config.threads;
        let attitudes = self.attitudes();
        let guesses: Vec<Guess> = (-steps..=steps)
            .map(|k| middle_s + f64::from(k) * OFFSET_STEP_S)
            .flat_map(|time_offset_s| {
                attitudes.iter().map(move |attitude| Guess { time_offset_s, tool_from_camera: *attitude })
            })
            .collect();
        let elsewhere = |candidate: &Candidate| self.is_elsewhere(&candidate.parameters);
        let mut candidates = parallel::filter_map(threads, &guesses, |guess| {
            self.follow(&ROUGH_SCALES, 8, self.start(guess)?).filter(elsewhere)
        });
        keep_different(&mut candidates, FINALISTS);
        let mut finalists = parallel::filter_map(threads, &candidates, |candidate| {
            self.follow(&FINE_SCALES, 30, candidate.parameters.clone()).filter(elsewhere)
        });
        keep_different(&mut finalists, FINALISTS);
        finalists
    }

    /// The best attitude and its half-turns. Only the best if the hand-eye transform is held.
    fn attitudes(&self) -> Vec<Pose> {
        let best = self.best.tool_from_camera;
        if (ROTATION..LINES).any(|k| self.solver.settings.fixed.contains(&k)) {
            return vec![best];
        }
        let sheet = &self.solver.observations.sheet;
        let count = self.sample.len() as f64;
        let centre = self.sample.iter().map(|o| o.point_in_camera).sum::<Vector3<f64>>() / count;
        let axes = sheet.axes();
        let turns = [
            *sheet.plane().normal(),
            UnitVector3::new_normalize(axes.column(0).into_owned()),
            UnitVector3::new_normalize(axes.column(1).into_owned()),
        ];
        std::iter::once(best).chain(turns.iter().map(|axis| half_turned(&best, axis, &centre))).collect()
    }

    fn start(&self, guess: &Guess) -> Option<Parameters> {
        let lines = lines_for(self.solver.observations, self.sample, guess)?;
        Some(Parameters::straight(guess, lines))
    }

    /// The coarse solve may rotate a held hand-eye transform. The final fit holds it.
    fn follow(&self, scales: &[f64], iterations: usize, start: Parameters) -> Option<Candidate> {
        let Solver { observations, settings } = self.solver;
        Narrowing::new(observations, self.sample, &settings.noise).follow(scales, iterations, start)
    }

    fn is_elsewhere(&self, at: &Parameters) -> bool {
        let from_middle_s = (at.time_offset_s - self.middle_s()).abs();
        !same(at, self.best) && from_middle_s <= self.solver.settings.config.offset_search_s + OFFSET_STEP_S
    }

    /// The middle of the range of time offsets, s: zero, or that of a best solution outside the range about zero.
    fn middle_s(&self) -> f64 {
        let best_s = self.best.time_offset_s;
        if best_s.abs() <= self.solver.settings.config.offset_search_s { 0.0 } else { best_s }
    }

    /// Fraction of the sample within a wide limit. It is used to drop starts that explain almost nothing.
    fn explains(&self, at: &Parameters) -> f64 {
        let loss = Loss::Squared;
        let Solver { observations, settings } = self.solver;
        let problem = LineProblem::coarse(observations, self.sample, loss, &settings.noise, at.unknowns());
        let limit = 4.0 * OUTLIER_SQUARED;
        let squared = problem.squared_residuals(at);
        squared.iter().filter(|s| **s <= limit).count() as f64 / squared.len().max(1) as f64
    }
}

/// Keeps the best few distinct solutions, by rising cost.
fn keep_different(candidates: &mut Vec<Candidate>, most: usize) {
    candidates.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    let mut kept: Vec<Candidate> = Vec::new();
    for candidate in candidates.drain(..) {
        if kept.len() < most && !kept.iter().any(|k| same(&k.parameters, &candidate.parameters)) {
            kept.push(candidate);
        }
    }
    *candidates = kept;
}
