//! Findings of the doctor, as words and as JSON.

use serde_json::{Value, json};
use std::fmt::Write;
use trueline_method::diagnose::doctor::Diagnosis;
use trueline_method::diagnose::outcome::Outcome;

/// The diagnosis in a few lines of plain text; `all` also lists the mistakes that were ruled out.
#[must_use]
pub fn text(d: &Diagnosis, all: bool) -> String {
    let mut out = String::new();
    // Writing to a String cannot fail.
    if d.findings.is_empty() {
        let but = if d.as_recorded.said.is_empty() {
            "."
        } else {
            ", but the scan does not determine \
            everything:"
        };
        let _ = writeln!(out, "Nothing is wrong with the recording's units, frames and orders{but}");
    } else {
        let _ = writeln!(out, "Found:");
    }
    for finding in &d.findings {
        let _ = writeln!(out, "  - {finding}");
    }
    let _ = writeln!(out, "\n  {:<40} {}", "as recorded", fit(&d.as_recorded));
    for reason in &d.as_recorded.said {
        let _ = writeln!(out, "  {:<40} {reason}", "");
    }
    let told = |name: &str| all || d.explained_by.iter().any(|explains| explains.as_str() == name);
    for trial in d.trials.iter().filter(|trial| told(&trial.name)) {
        let _ = writeln!(out, "  {:<40} {}", format!("if undone: {}", trial.name), fit(&trial.outcome));
    }
    let hidden = d.trials.iter().filter(|trial| !told(&trial.name)).count();
    if hidden > 0 {
        let _ = writeln!(out, "  {hidden} other mistakes ruled out; --verbose lists them");
    }
    if !d.not_tried.is_empty() {
        let _ = writeln!(
            out,
            "  {} mistakes were not tried for lack of time; --longest-s allows more",
            d.not_tried.len()
        );
    }
    out
}

fn fit(outcome: &Outcome) -> String {
    match outcome.noise_factor {
        Some(factor) if outcome.fits() => format!("fits: residuals {factor:.1} times the expected noise"),
        Some(factor) if outcome.explained <= 0.5 => {
            format!(
                "does not fit: {:.0} % of the features are outliers, the rest {factor:.1} times the noise",
                100.0 * (1.0 - outcome.explained)
            )
        }
        Some(factor) => format!("does not fit: residuals {factor:.0} times the expected noise"),
        None => "no result".to_owned(),
    }
}

/// The same as JSON.
#[must_use]
pub fn json(d: &Diagnosis) -> Value {
    let outcome = |o: &Outcome| json!({ "fits": o.fits(), "noise_factor": o.noise_factor, "explained": o.explained, "reasons": o.said });
    json!({
        "findings": d.findings,
        "explained_by": d.explained_by,
        "not_tried": d.not_tried,
        "as_recorded": outcome(&d.as_recorded),
        "without": d.trials.iter().map(|t| json!({ "mistake": t.name, "outcome": outcome(&t.outcome) })).collect::<Vec<_>>(),
    })
}
