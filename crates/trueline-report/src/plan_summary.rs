//! A planned scan as words, as JSON and as a table over time.

use crate::number::digits_for;
use crate::{arm_summary, seam_error};
use serde_json::{Value, json};
use std::fmt::Write;
use trueline_dataset::unit::MM_PER_M;
use trueline_method::problem::parameters::{LINES, ROTATION, TIME_OFFSET, TRANSLATION};
use trueline_plan::constraints::Constraint;
use trueline_plan::design::Sweep;
use trueline_plan::{Cell, Goal, Plan, Prediction, Rehearsal, Shape, Target};

/// All that is told of a plan.
pub struct Source<'a> {
    /// What was known.
    pub cell: &'a Cell,
    /// What was planned.
    pub plan: &'a Plan,
    /// What calibrating its scan would say; `None` if that cannot be done.
    pub rehearsal: Option<&'a Rehearsal>,
    /// What was asked for.
    pub asked: Asked<'a>,
    /// Standard deviations that 95 % of the cells stay below in which the guess is wrong.
    pub wrong_guess: &'a [f64; LINES],
    /// What is promised as the scan goes on.
    pub over_time: &'a [(f64, Prediction)],
    /// How to make it again.
    pub command: &'a str,
}

/// What was asked of a plan.
#[derive(Clone, Copy, Debug, Default)]
pub struct Asked<'a> {
    /// Sigmas, if anything was.
    pub goal: Option<&'a Goal>,
    /// Seam error, m.
    pub seam_m: Option<f64>,
}

/// Names of the seven unknowns and the units that people read them in.
const UNKNOWNS: [(&str, &str); LINES] = [
    ("time offset", "ms"),
    ("rotation about tool x", "°"),
    ("rotation about tool y", "°"),
    ("rotation about tool z", "°"),
    ("translation x", "mm"),
    ("translation y", "mm"),
    ("translation z", "mm"),
];

/// What SI is multiplied with to be read in [`UNKNOWNS`]' unit.
fn scale(component: usize) -> f64 {
    match component {
        TRANSLATION.. => MM_PER_M,
        ROTATION.. => 1.0_f64.to_degrees(),
        _ => 1e3,
    }
}

/// What is wanted and missed, one sentence each.
#[must_use]
pub fn missed(source: &Source<'_>, goal: &Goal) -> Vec<String> {
    let plan = source.plan;
    let worse = |k: usize| {
        let (sigma, wanted) = (plan.prediction.sigma(k), goal.wanted(k)?);
        let (name, unit) = UNKNOWNS[k];
        let (sigma_shown, wanted_shown) = (sigma * scale(k), wanted * scale(k));
        let digits = digits_for(sigma_shown);
        (sigma > wanted)
            .then(|| format!("{name}: ± {sigma_shown:.digits$} {unit}, and {wanted_shown} {unit} is wanted"))
    };
    // Where only a seam error was asked for, nobody wants the sigmas by which paths are compared.
    let sigmas = if source.asked.seam_m.is_some() && *goal == Goal::default() { 0 } else { LINES };
    (0..sigmas).filter_map(worse).chain(missed_seam_error(source)).collect()
}

/// The seam error, if one was asked for that is not reached.
fn missed_seam_error(source: &Source<'_>) -> Option<String> {
    let wanted_mm = source.asked.seam_m? * MM_PER_M;
    match source.rehearsal.and_then(|rehearsal| rehearsal.seam_error) {
        Some(error) if error.rms_m * MM_PER_M <= wanted_mm => None,
        Some(error) => {
            let entry = seam_error::entry(&error);
            let parts = entry.budget_mm;
            let names = [
                ("noise", parts.noise),
                ("stamps", parts.stamps),
                ("the sensor's own calibration", parts.sensor),
                ("the robot's accuracy", parts.robot),
                ("the seam's form", parts.seam_form),
                ("the feature's bias", parts.feature_bias),
            ];
            let most = names.into_iter().max_by(|a, b| a.1.total_cmp(&b.1))?;
            Some(format!(
                "seam error: ± {:.3} mm, and {wanted_mm} mm is wanted; most of it, ± {:.3} mm, is {}",
                entry.rms_mm, most.1, most.0
            ))
        }
        None => Some(format!("seam error: it cannot be predicted, and {wanted_mm} mm is wanted")),
    }
}

/// The plan in a few lines; what is wanted is shown where the user has asked for it.
#[must_use]
pub fn text(source: &Source<'_>) -> String {
    let Source { cell, plan, wrong_guess, .. } = source;
    let asked = source.asked.goal.filter(|goal| source.asked.seam_m.is_none() || **goal != Goal::default());
    let design = plan.motion.design();
    let mut out = String::new();
    // Writing to a String cannot fail.
    let _ = writeln!(
        out,
        "Planned: {}, {:.1} s over {:.0} mm of seam, {:.0} images\n",
        in_words(design.shape),
        design.duration_s,
        cell.seam.length_m() * design.length_share * MM_PER_M,
        design.duration_s / cell.frame_period_s - 0.5,
    );
    for (k, (name, unit)) in UNKNOWNS.iter().enumerate() {
        let sigma = plan.prediction.sigma(k) * scale(k);
        let digits = digits_for(sigma);
        let wanted = asked.and_then(|goal| goal.wanted(k)).map(|wanted| {
            let mark = if plan.prediction.sigma(k) <= wanted { "reached" } else { "MISSED" };
            format!("   wanted {:.4} {unit}: {mark}", wanted * scale(k))
        });
        let wrong = wrong_guess[k] * scale(k);
        let guessed = if wrong > 1.01 * sigma {
            format!("   (up to {wrong:.digits$} {unit} in 95 % of cells with a wrong guess)")
        } else {
            String::new()
        };
        let wanted = wanted.unwrap_or_default();
        let _ = writeln!(out, "  {name:<24} ± {sigma:.digits$} {unit}{wanted}{guessed}");
    }
    let _ = writeln!(out);
    for (name, value) in facts(source) {
        let _ = writeln!(out, "  {name:<24} {value}");
    }
    out
}

/// How the sensor moves, what that takes of the limits, and how wrong the guess may be.
#[must_use]
pub fn facts(source: &Source<'_>) -> Vec<(String, String)> {
    let Source { cell, plan, .. } = source;
    let sweep = |(name, sweep, unit, factor): (&str, Sweep, &str, f64)| {
        let swung: Vec<String> = (sweep.swings.iter())
            .map(|swing| format!("± {:.1} at {:.2} Hz", swing.amplitude * factor, swing.frequency_hz))
            .collect();
        (name.to_owned(), format!("{:.1} {} {unit}", sweep.mean * factor, swung.join(" ")))
    };
    let mut facts: Vec<(String, String)> = sweeps(plan).into_iter().map(sweep).collect();
    let used: Vec<String> = Constraint::ALL
        .iter()
        .filter(|constraint| constraint.applies_in(cell))
        .map(|constraint| {
            format!("{} {:.0} %", constraint.name(), 100.0 * plan.constraints.used(*constraint))
        })
        .collect();
    facts.push(("of the limits it uses".to_owned(), used.join(", ")));
    facts.push(("where the guess is wrong".to_owned(), chances(source)));
    if let Target::Plates(_) = plan.target {
        facts.push((
            "measured".to_owned(),
            "whole stripes on both plates: calibrate with --use stripe".to_owned(),
        ));
    }
    facts.extend(rehearsed(source));
    facts.extend(arm_summary::fact(cell, plan));
    if plan.motion.design().shape == Shape::Spun {
        facts.push(("for".to_owned(), SPUN.to_owned()));
    }
    facts.push(("not checked".to_owned(), arm_summary::not_checked(cell).to_owned()));
    facts
}

/// What is to be known of a path with a pass that is spun.
const SPUN: &str =
    "the robot's own program (--program): `trueline scan` guides no path that turns by half a turn";

/// What calibrating the planned scan says.
fn rehearsed(source: &Source<'_>) -> Vec<(String, String)> {
    let Some(rehearsal) = source.rehearsal else { return Vec::new() };
    let mut lines = Vec::new();
    if let Some(error) = &rehearsal.seam_error {
        let entry = seam_error::entry(error);
        let assumed = if entry.robot_is_stated { "stated" } else { "assumed" };
        let wanted = source.asked.seam_m.map_or_else(String::new, |wanted_m| {
            let mark = if error.rms_m <= wanted_m { "reached" } else { "MISSED" };
            format!("; wanted {} mm: {mark}", wanted_m * MM_PER_M)
        });
        let by = if rehearsal.by_stripes { " from whole stripes" } else { "" };
        let said = format!(
            "± {:.3} mm{by} with a robot of {} mm ({assumed}), the sensor's own calibration and a feature bias of {} px \
             per 10°; the scan alone ± {:.3} mm{wanted}",
            entry.rms_mm, entry.robot_accuracy_mm, entry.feature_bias_px, entry.scan_alone_mm
        );
        lines.push(("seam error".to_owned(), said));
    }
    if let Some(rival) = &rehearsal.runner_up {
        let (ms, explains) = (rival.time_offset_s * 1e3, 100.0 * rival.test.explains);
        let said = if rehearsal.has_alias() {
            format!(
                "BEWARE: the path nearly repeats itself; a time offset of {ms:.0} ms would explain {explains:.0} % of the features as well. \
                 Another --seed or --duration-s may have none"
            )
        } else {
            format!("a time offset of {ms:.0} ms explains {explains:.0} % of the features")
        };
        lines.push(("the best other answer".to_owned(), said));
    }
    if !rehearsal.accepted {
        let said = "BEWARE: `calibrate` does not accept this scan where the guess is right";
        lines.push(("rehearsal".to_owned(), said.to_owned()));
    }
    lines
}

/// The same as JSON.
fn rehearsal_json(rehearsal: &Rehearsal) -> Value {
    let seam_error = rehearsal.seam_error.as_ref().map(seam_error::entry);
    let sigma = |k: usize| rehearsal.sigma[k].unwrap_or(f64::INFINITY);
    json!({
        "accepted": rehearsal.accepted,
        "by_stripes": rehearsal.by_stripes,
        "sigma": sigmas(&sigma),
        "seam_error": seam_error,
        "runner_up": rehearsal.runner_up.map(|rival| json!({
            "time_offset_s": rival.time_offset_s,
            "explains": rival.test.explains,
        })),
    })
}

/// How many frames see the seam where the guess is wrong.
fn chances(source: &Source<'_>) -> String {
    let Source { cell, plan, .. } = source;
    let guess = &cell.guess_error;
    if guess.is_none() {
        return "it is taken for exact: every frame sees the seam".to_owned();
    }
    let kept = |lost: f64| 100.0 * (1.0 - lost);
    format!(
        "hand-eye up to {:.1} mm and {:.2}° and line up to {:.1} mm off: 95 % of the cells keep at least {:.0} % of the frames, the worst \
         that was tried {:.0} %; the ± are those of the frames that stay",
        guess.translation_m * MM_PER_M,
        guess.rotation_rad.to_degrees(),
        guess.line_m * MM_PER_M,
        kept(plan.loss.of_most),
        kept(plan.loss.worst),
    )
}

fn in_words(shape: trueline_plan::Shape) -> &'static str {
    match shape {
        trueline_plan::Shape::S => "once along the seam, weaving",
        trueline_plan::Shape::C => "once along the seam in one bow",
        trueline_plan::Shape::TwoPasses => "there and back",
        trueline_plan::Shape::ThreePasses => "three passes: there, back and there",
        trueline_plan::Shape::Spun => "there, then back with the sensor spun by half a turn",
    }
}

/// What swings, its unit and what SI is multiplied with.
fn sweeps(plan: &Plan) -> [(&'static str, Sweep, &'static str, f64); 5] {
    let design = plan.motion.design();
    let [work, travel, spin] = design.tilts;
    let degrees = 1.0_f64.to_degrees();
    [
        ("seam along the stripe", design.stripe, "% of the stand-off", 100.0),
        ("stand-off", design.stand_off, "mm", MM_PER_M),
        ("work angle", work, "°", degrees),
        ("travel angle", travel, "°", degrees),
        ("spin", spin, "°", degrees),
    ]
}

/// The plan as JSON.
#[must_use]
pub fn json(source: &Source<'_>, goal: &Goal) -> Value {
    let Source { cell, plan, wrong_guess, .. } = source;
    let design = plan.motion.design();
    let sweeps: serde_json::Map<String, Value> = sweeps(plan)
        .into_iter()
        .map(|(name, s, unit, factor)| {
            let swings = s.swings.map(|swing| {
                json!({
                    "amplitude": swing.amplitude * factor,
                    "frequency_hz": swing.frequency_hz,
                    "phase_rad": swing.phase_rad,
                })
            });
            (name.replace(' ', "_"), json!({ "unit": unit, "mean": s.mean * factor, "swings": swings }))
        })
        .collect();
    let used: serde_json::Map<String, Value> = Constraint::ALL
        .iter()
        .map(|constraint| (constraint.name().replace(' ', "_"), json!(plan.constraints.used(*constraint))))
        .collect();
    json!({
        "tool": { "name": "trueline", "version": env!("CARGO_PKG_VERSION") },
        "reached": missed(source, goal).is_empty(),
        "missed": missed(source, goal),
        "rehearsal": source.rehearsal.map(rehearsal_json),
        "shape": design.shape.name(),
        "duration_s": design.duration_s,
        "ramp_s": design.ramp_s,
        "length_mm": cell.seam.length_m() * design.length_share * MM_PER_M,
        "centre_mm": cell.seam.length_m() * design.centre * MM_PER_M,
        "predicted_sigma": sigmas(&|k| plan.prediction.sigma(k)),
        "predicted_sigma_if_guess_is_wrong": sigmas(&|k| wrong_guess[k]),
        "frames_kept": {
            "by_95_percent_of_cells": 1.0 - plan.loss.of_most,
            "by_the_worst_cell_tried": 1.0 - plan.loss.worst,
        },
        "reach_checked": cell.arm.is_some(),
        "arm": arm_summary::json(cell, plan),
        "least_clearance_mm": arm_summary::least_clearance_mm(cell, plan),
        "score": plan.score,
        "sweeps": sweeps,
        "used_of_limits": used,
        "guess_error": {
            "translation_mm": cell.guess_error.translation_m * MM_PER_M,
            "rotation_deg": cell.guess_error.rotation_rad.to_degrees(),
            "line_mm": cell.guess_error.line_m * MM_PER_M,
        },
    })
}

/// What is infinite, because the seam leaves the view, is null.
fn sigmas(of: &dyn Fn(usize) -> f64) -> Value {
    let three = |first: usize, factor: f64| [0, 1, 2].map(|k| of(first + k) * factor);
    json!({
        "time_offset_s": of(TIME_OFFSET),
        "rotation_rad": three(ROTATION, 1.0),
        "translation_mm": three(TRANSLATION, MM_PER_M),
    })
}

/// The prediction over time as CSV; what is not visible yet is empty.
#[must_use]
pub fn over_time_csv(over_time: &[(f64, Prediction)]) -> String {
    let mut out = String::from(
        "time_s,time_offset_ms,rotation_x_deg,rotation_y_deg,rotation_z_deg,translation_x_mm,translation_y_mm,translation_z_mm\n",
    );
    for (time_s, prediction) in over_time {
        let _ = write!(out, "{time_s:.4}");
        for k in 0..LINES {
            if prediction.shows_all() {
                let _ = write!(out, ",{}", prediction.sigma(k) * scale(k));
            } else {
                out.push(',');
            }
        }
        out.push('\n');
    }
    out
}
