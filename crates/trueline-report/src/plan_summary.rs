//! A planned scan as words, as JSON and as a table over time.

use crate::number::digits_for;
use crate::plan_source::Source;
use crate::plan_swing::swung;
use crate::{arm_summary, plan_axes, plan_seam_error, seam_error};
use serde_json::{Value, json};
use std::fmt::Write;
use trueline_dataset::unit::MM_PER_M;
use trueline_method::problem::parameters::{LINES, ROTATION, TIME_OFFSET, TRANSLATION};
use trueline_plan::constraints::Constraint;
use trueline_plan::plan::DURATION_S;
use trueline_plan::sweep::Sweep;
use trueline_plan::{Goal, Plan, Prediction, Rehearsal, Shape, Target};

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

/// Factor from SI to the unit of [`UNKNOWNS`].
fn scale(component: usize) -> f64 {
    match component {
        TRANSLATION.. => MM_PER_M,
        ROTATION.. => 1.0_f64.to_degrees(),
        _ => 1e3,
    }
}

/// Missed requirements, one sentence each.
#[must_use]
pub fn missed(source: &Source<'_>, goal: &Goal) -> Vec<String> {
    let plan = source.plan;
    let worse = |k: usize| {
        let (sigma, wanted) = (plan.prediction.sigma(k), goal.wanted(k)?);
        let (name, unit) = UNKNOWNS[k];
        let (sigma_shown, wanted_shown) = (sigma * scale(k), wanted * scale(k));
        let digits = digits_for(sigma_shown);
        // Noise falls with the root of the time.
        let needs_s = plan.motion.design().duration_s * (sigma / wanted).powi(2);
        let cure = if needs_s <= DURATION_S[1] {
            format!("about {:.0} s would reach it (--longest-s), or wider limits", needs_s.ceil())
        } else {
            format!("no scan of up to {:.0} s would reach it within these limits", DURATION_S[1])
        };
        (sigma > wanted).then(|| {
            format!(
                "{name}: ± {sigma_shown:.digits$} {unit} from noise alone, {wanted_shown:.4} {unit} is \
                required; {cure}"
            )
        })
    };
    // If only a seam error was required, the sigmas that compare paths are not needed.
    let sigmas = if source.asked.seam_m.is_some() && *goal == Goal::default() { 0 } else { LINES };
    (0..sigmas).filter_map(worse).chain(plan_seam_error::missed(source)).collect()
}

/// The plan in a few lines; requirements are shown if the user has stated them.
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
    let is_rough = !cell.has_exact_guess();
    let brackets =
        if is_rough { "; in brackets, the limit for 95 % of the cells with a wrong guess" } else { "" };
    let _ = writeln!(out, "  One standard deviation of noise{brackets}:");
    for (k, (name, unit)) in UNKNOWNS.iter().enumerate() {
        let sigma = plan.prediction.sigma(k) * scale(k);
        let digits = digits_for(sigma);
        let wanted = asked.and_then(|goal| goal.wanted(k)).map_or_else(String::new, |wanted| {
            let mark = if plan.prediction.sigma(k) <= wanted { "reached" } else { "MISSED" };
            format!("   wanted {:.4} {unit}: {mark}", wanted * scale(k))
        });
        let wrong = wrong_guess[k] * scale(k);
        let guessed = if is_rough { format!(" ({wrong:.digits$})") } else { String::new() };
        let _ = writeln!(out, "  {name:<24} ± {sigma:.digits$}{guessed} {unit}{wanted}");
    }
    let _ = writeln!(out, "{}", plan_axes::lines(source));
    for (name, value) in facts(source) {
        let _ = writeln!(out, "  {name:<24} {value}");
    }
    out
}

/// The sensor's motion, its use of the limits, and the allowed error of the guess.
#[must_use]
pub fn facts(source: &Source<'_>) -> Vec<(String, String)> {
    let Source { cell, plan, .. } = source;
    let mut facts: Vec<(String, String)> = sweeps(plan).into_iter().map(swung).collect();
    facts.extend(plan_axes::motions(source));
    let used: Vec<String> = Constraint::ALL
        .iter()
        .filter(|constraint| constraint.applies_in(cell))
        .map(|constraint| (constraint.name(), plan.constraints.used(*constraint)))
        // Mostly there are no frames lost beyond the seam's ends.
        .filter(|(_, used)| *used >= 5e-3)
        .map(|(name, used)| format!("{name} {:.0} %", 100.0 * used))
        .collect();
    facts.push(("limits used".to_owned(), used.join(", ")));
    facts.push(("with a wrong guess".to_owned(), chances(source)));
    if let Target::Stripes(joint) = &plan.target {
        let of = match (joint.edge_on, joint.seen) {
            (None, _) => "on both plates",
            (Some(_), [true, true]) => "on both parallel plates, with the edge of one",
            (Some(_), _) => "on one plate, with its edge",
        };
        let measured = format!("whole stripes {of}: `simulate --plates`, `calibrate --use stripe`");
        facts.push(("measured".to_owned(), measured));
    }
    facts.extend(rehearsed(source));
    facts.extend(arm_summary::fact(cell, plan));
    if plan.motion.design().shape == Shape::Spun {
        facts.push(("half turn".to_owned(), half_turn(plan)));
    }
    facts.push(("not checked".to_owned(), arm_summary::not_checked(cell).to_owned()));
    facts
}

/// Remark on a path with a spun pass.
fn half_turn(plan: &Plan) -> String {
    let [from_s, to_s] = plan.motion.spun_s();
    format!(
        "takes {:.1} s without measurement; it reduces the seam error if the feature bias dominates, not if \
         noise does. Run it as the robot's own program (--program): `trueline scan` does not guide a half \
         turn",
        to_s - from_s
    )
}

/// Predicted calibration of the planned scan.
fn rehearsed(source: &Source<'_>) -> Vec<(String, String)> {
    let Some(rehearsal) = source.rehearsal else { return Vec::new() };
    let mut lines = plan_seam_error::rows(source);
    lines.push(("runner-up".to_owned(), runner_up(rehearsal)));
    if !rehearsal.accepted {
        let said = "WARNING: `calibrate` would not accept this scan, even with a correct guess";
        lines.push(("rehearsal".to_owned(), said.to_owned()));
    }
    lines
}

/// The next best time offset, and how much it explains.
fn runner_up(rehearsal: &Rehearsal) -> String {
    let Some(rival) = &rehearsal.runner_up else {
        return "none: no other time offset fits any part of the scan".to_owned();
    };
    let (ms, explains) = (rival.time_offset_s * 1e3, 100.0 * rival.test.explains);
    if rehearsal.has_alias() {
        format!(
            "WARNING: the path nearly repeats itself: a time offset of {ms:.0} ms also explains \
             {explains:.0} % of the features. Try another --seed or --duration-s"
        )
    } else if explains < 1.0 {
        "none: no other time offset explains 1 % of the features".to_owned()
    } else {
        format!("a time offset of {ms:.0} ms, which explains {explains:.0} % of the features")
    }
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

/// Number of frames with a visible seam if the guess is wrong.
fn chances(source: &Source<'_>) -> String {
    let Source { cell, plan, .. } = source;
    let guess = &cell.guess_error;
    if cell.has_exact_guess() {
        return "the guess is treated as exact: every frame sees the seam".to_owned();
    }
    let kept = |lost: f64| 100.0 * (1.0 - lost);
    format!(
        "with the hand-eye off by up to {:.1} mm and {:.2}° and the seam by up to {:.1} mm, 95 % of the simulated cells keep at least \
         {:.0} % of the frames, and the worst one keeps {:.0} %; the ± count only the frames that are kept",
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
        trueline_plan::Shape::ThreePasses => "three passes: there, back and there again",
        trueline_plan::Shape::Spun => "there, then back with the sensor spun by half a turn",
    }
}

/// Each swing, its unit and the factor from SI.
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
        .map(|constraint| (constraint.key().to_owned(), json!(plan.constraints.used(*constraint))))
        .collect();
    let [advice, longer, better_robots] = plan_seam_error::json(source);
    json!({
        "tool": { "name": "trueline", "version": env!("CARGO_PKG_VERSION") },
        "reached": missed(source, goal).is_empty(),
        "missed": missed(source, goal),
        "advice": advice,
        "longer_scans": longer,
        "with_better_robots": better_robots,
        "rehearsal": source.rehearsal.map(rehearsal_json),
        "shape": design.shape.name(),
        "duration_s": design.duration_s,
        "ramp_s": design.ramp_s,
        "length_mm": cell.seam.length_m() * design.length_share * MM_PER_M,
        "centre_mm": cell.seam.length_m() * design.centre * MM_PER_M,
        "predicted_sigma": sigmas(&|k| plan.prediction.sigma(k)),
        "axes": plan_axes::json(source),
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

/// Infinite values, because the seam leaves the view, are null.
fn sigmas(of: &dyn Fn(usize) -> f64) -> Value {
    let three = |first: usize, factor: f64| [0, 1, 2].map(|k| of(first + k) * factor);
    json!({
        "time_offset_s": of(TIME_OFFSET),
        "rotation_rad": three(ROTATION, 1.0),
        "translation_mm": three(TRANSLATION, MM_PER_M),
    })
}

/// The prediction over time as CSV; quantities that are not observable yet are empty.
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
