//! Predicted seam error of a plan: its size, its sources, and the remedies if a smaller one is required.

use crate::number::digits_for;
use crate::plan_source::Source;
use crate::seam_error::{self, BudgetPart, mm};
use serde_json::{Value, json};
use trueline_dataset::Sensor;
use trueline_dataset::unit::MM_PER_M;
use trueline_method::Config;
use trueline_method::assess::seam_error::SeamError;

/// The seam error with all that adds to it, and that of the scan alone.
pub(crate) fn rows(source: &Source<'_>) -> Vec<(String, String)> {
    let Some(error) = of(source) else { return Vec::new() };
    let by = if source.rehearsal.is_some_and(|rehearsal| rehearsal.by_stripes) {
        " from whole stripes"
    } else {
        ""
    };
    let levels = &error.levels;
    let wanted = source.asked.seam_m.map_or_else(String::new, |wanted_m| {
        let mark = if error.rms_m <= wanted_m { "reached" } else { "MISSED" };
        format!("; wanted {} mm: {mark}", wanted_m * MM_PER_M)
    });
    let are_pixels = matches!(source.cell.sensor, Sensor::CameraLaser { .. });
    let of_lengths = (!are_pixels).then(|| Config::default().length_per_px_m());
    let said = format!(
        "± {} in use{by}: the scan alone ± {}, and with it a robot accuracy of {} mm ({}), the sensor's own calibration and a feature bias of {} \
         per 10° of tilt (assumed){wanted}",
        mm(error.rms_m),
        mm(error.scan_alone_m()),
        levels.robot_accuracy_m * MM_PER_M,
        if levels.robot_is_stated { "stated" } else { "assumed" },
        seam_error::bias(levels.feature_bias_px, of_lengths),
    );
    let mut rows = vec![("seam error".to_owned(), said)];
    if source.asked.seam_m.is_some() {
        rows.extend(budget(error).iter().map(|part| {
            let share = 100.0 * part.share;
            let said = format!(
                "± {}  ({share:.0} % of the variance; {})",
                mm(part.sigma_m),
                cure(part, source, error)
            );
            (format!("  {}", part.name), said)
        }));
    }
    rows.extend(advice(source).into_iter().map(|said| ("  to get there".to_owned(), said)));
    rows.extend(longer(source).map(|said| ("  longer scans".to_owned(), said)));
    rows
}

/// The seam error that is predicted, all errors included: `± 0.31 mm`.
pub(crate) fn predicted(source: &Source<'_>) -> Option<String> {
    Some(format!("± {}", mm(of(source)?.rms_m)))
}

/// Text on a missed seam error.
pub(crate) fn missed(source: &Source<'_>) -> Option<String> {
    let wanted_m = source.asked.seam_m?;
    let wanted_mm = wanted_m * MM_PER_M;
    let Some(error) = of(source) else {
        return Some(format!("seam error: it cannot be predicted; {wanted_mm} mm is required"));
    };
    if error.rms_m <= wanted_m {
        return None;
    }
    let parts: Vec<String> =
        budget(error).iter().map(|part| format!("{} ± {}", part.name, mm(part.sigma_m))).collect();
    Some(format!(
        "seam error: ± {}, {wanted_mm} mm is required; largest first: {}",
        mm(error.rms_m),
        parts.join(", ")
    ))
}

/// Ways to reach a missed seam error, a sentence each; empty if none is missed.
pub(crate) fn advice(source: &Source<'_>) -> Vec<String> {
    if missed(source).is_none() {
        return Vec::new();
    }
    let mut list = Vec::new();
    let known = of(source).is_some_and(|error| error.levels.robot_is_stated);
    if let Some((_, best_m)) = source.better_robots.last() {
        let left = source.better_robots.iter().map(|(accuracy_m, left_m)| {
            format!("± {} with a robot accuracy of {} mm", mm(*left_m), accuracy_m * MM_PER_M)
        });
        let is_enough = source.asked.seam_m.is_some_and(|wanted_m| *best_m <= wanted_m);
        list.push(format!(
            "this path would give {}, {}. If your robot is better than {}, write accuracy_mm under [robot] \
            in the cell's sensor.toml and plan again",
            left.collect::<Vec<_>>().join(", "),
            if is_enough {
                "which is enough"
            } else {
                "which is not enough, but a path planned for that \
                robot may give less"
            },
            if known { "stated in that file" } else { "assumed" },
        ));
    }
    let parts = of(source).map(budget).unwrap_or_default();
    if parts.first().is_some_and(|part| matches!(part.name, "noise" | "stamps" | "seam form")) {
        list.push("allow a longer scan, --longest-s, or more tilt and stand-off under [limits]".to_owned());
    }
    list
}

/// Results of longer scans; `None` if none was planned.
pub(crate) fn longer(source: &Source<'_>) -> Option<String> {
    let (duration_s, left_m) = source.longer.first()?;
    Some(format!(
        "{duration_s:.1} s would give ± {}: more time reduces only noise and stamps, so the shorter scan was \
        chosen",
        mm(*left_m)
    ))
}

/// As JSON: the advice, and results of longer scans.
pub(crate) fn json(source: &Source<'_>) -> [Value; 3] {
    let pairs = |list: &[(f64, f64)], key: &str, unit: f64| {
        list.iter()
            .map(|(of, left_m)| json!({ key: of * unit, "seam_error_mm": left_m * MM_PER_M }))
            .collect::<Value>()
    };
    [
        json!(advice(source)),
        pairs(source.longer, "duration_s", 1.0),
        pairs(source.better_robots, "robot_accuracy_mm", MM_PER_M),
    ]
}

fn of<'a>(source: &Source<'a>) -> Option<&'a SeamError> {
    source.rehearsal.and_then(|rehearsal| rehearsal.seam_error.as_ref())
}

/// The parts that matter, largest first: a simulated robot gives no reason for doubt.
fn budget(error: &SeamError) -> Vec<BudgetPart> {
    seam_error::budget(error, false)
}

/// Remedy for a part, for a person who plans a scan.
fn cure(part: &BudgetPart, source: &Source<'_>, error: &SeamError) -> String {
    match part.name {
        "noise" => "falls with the square root of the duration".to_owned(),
        "robot" => {
            let accuracy_mm = error.levels.robot_accuracy_m * MM_PER_M;
            let digits = digits_for(accuracy_mm);
            let state = if error.levels.robot_is_stated { "stated" } else { "assumed" };
            format!(
                "proportional to its accuracy, {accuracy_mm:.digits$} mm {state}: accuracy_mm under [robot] in sensor.toml"
            )
        }
        "sensor" => "a smaller [uncertainty] in sensor.toml, if the sensor is more certain".to_owned(),
        "feature bias" if source.cell.limits.spun_pass => {
            "decreases with a more accurate robot, whose errors hide it; spun passes were tried too"
                .to_owned()
        }
        "feature bias" => {
            "decreases with a more accurate robot, whose errors hide it; with spun_pass = true under \
            [limits] a spun pass is tried too"
                .to_owned()
        }
        _ => part.cure.to_owned(),
    }
}
