//! The external axes of a plan: their motion, their predicted ±, and parts that stay hidden.

use crate::number::digits_for;
use crate::page::Card;
use crate::plan_source::Source;
use crate::plan_swing::swung;
use serde_json::{Value, json};
use std::fmt::Write;
use trueline_dataset::unit::MM_PER_M;
use trueline_geometry::AxisKind;
use trueline_method::Warning;
use trueline_method::axes::finding::{AxisFinding, AxisPart};
use trueline_plan::{AxisCourse, CellAxis, expected_axes};

/// Name and unit of a part, and the factor from SI.
fn words(part: AxisPart) -> (&'static str, &'static str, f64) {
    match part {
        AxisPart::Direction => ("direction", "°", 1.0_f64.to_degrees()),
        AxisPart::Place => ("place", " mm", MM_PER_M),
        AxisPart::TimeOffset => ("time offset", " ms", 1e3),
    }
}

/// The ± of a part, or that it is hidden.
fn shown(axis: &AxisFinding, part: AxisPart) -> String {
    let (_, unit, factor) = words(part);
    axis.sigma(part).map_or_else(
        || "not determined".to_owned(),
        |sigma| {
            let value = sigma * factor;
            format!("± {value:.0$}{unit}", digits_for(value))
        },
    )
}

/// The parts of an axis with their ±.
fn parts(axis: &AxisFinding) -> impl Iterator<Item = (AxisPart, String)> + '_ {
    let own = AxisPart::ALL.into_iter().filter(|part| axis.moves && axis.has(*part));
    own.map(|part| (part, shown(axis, part)))
}

/// Lines of the summary, one for each part, and one for each that stays hidden.
#[must_use]
pub(crate) fn lines(source: &Source<'_>) -> String {
    let mut out = String::new();
    for axis in source.axes {
        for (part, value) in parts(axis) {
            // Writing to a String cannot fail.
            let _ = writeln!(out, "  {:<24} {value}", format!("{}: {}", axis.name, words(part).0));
        }
    }
    for hidden in expected_axes::hidden(source.axes, &source.plan.prediction) {
        let _ = writeln!(out, "  hidden: {hidden}");
    }
    out
}

/// A card of the axes; none without axes.
#[must_use]
pub(crate) fn card(source: &Source<'_>) -> Option<Card> {
    let own = |axis: &AxisFinding| -> Vec<String> {
        parts(axis).map(|(part, value)| format!("{}: {} {value}", axis.name, words(part).0)).collect()
    };
    (!source.axes.is_empty()).then(|| Card {
        name: "External axes",
        values: source.axes.iter().flat_map(own).collect(),
        meaning: "One standard deviation of noise, at the guess.".to_owned(),
    })
}

/// The motion of each axis, for the facts.
#[must_use]
pub(crate) fn motions(source: &Source<'_>) -> Vec<(String, String)> {
    let courses = source.cell.axes.iter().zip(&source.plan.motion.design().axes);
    let design = source.plan.motion.design();
    let moving_s = design.duration_s - design.ramp_s;
    let mut facts: Vec<(String, String)> =
        courses.map(|(axis, course)| motion(axis, course, moving_s)).collect();
    if !facts.is_empty() {
        let said =
            "axes.csv has the value of each at every time of path.csv: robot and axes must move in step";
        facts.push(("axes move".to_owned(), said.to_owned()));
    }
    facts
}

fn unit(axis: &CellAxis) -> (&'static str, f64) {
    match axis.record.kind {
        AxisKind::Rotary => ("°", 1.0_f64.to_degrees()),
        AxisKind::Linear => ("mm", MM_PER_M),
    }
}

/// The motion in words; the scan moves for so long, s.
fn motion(axis: &CellAxis, course: &AxisCourse, moving_s: f64) -> (String, String) {
    let (unit, factor) = unit(axis);
    let space = if unit == "°" { "" } else { " " };
    let name = format!("axis {}", axis.record.name);
    let value = |value: f64| format!("{:.1}{space}{unit}", value * factor + 0.0);
    match course {
        AxisCourse::Swings(sweep) => swung((&name, *sweep, unit, factor)),
        AxisCourse::Runs([from, to]) => (name, format!("runs once from {} to {}", value(*from), value(*to))),
        AxisCourse::Stands { places, move_s } => {
            let each_s = moving_s / places.len() as f64;
            let takes = match places.len() {
                1 => String::new(),
                _ => format!(", {:.1} s from one to the next, every {each_s:.1} s", move_s.min(each_s)),
            };
            let places: Vec<String> = places.iter().map(|place| value(*place)).collect();
            (name, format!("stands at {}{takes}", places.join(", ")))
        }
    }
}

/// The axes as JSON.
#[must_use]
pub(crate) fn json(source: &Source<'_>) -> Value {
    let hidden = expected_axes::hidden(source.axes, &source.plan.prediction);
    let design = source.plan.motion.design();
    let entry = |((axis, rough), course): ((&AxisFinding, &CellAxis), &AxisCourse)| {
        let sigma = |part: AxisPart, factor: f64| axis.sigma(part).map(|sigma| sigma * factor);
        let own = hidden.iter().filter_map(|warning| match warning {
            Warning::AxisNotShown { name, part, cure } if *name == axis.name => {
                Some(json!({ "part": part.code(), "cure": cure }))
            }
            _ => None,
        });
        json!({
            "name": axis.name,
            "kind": rough.record.kind.name(),
            "carries": rough.record.carries.name(),
            "motion": motion(rough, course, design.duration_s - design.ramp_s).1,
            "predicted_sigma": {
                "direction_deg": sigma(AxisPart::Direction, 1.0_f64.to_degrees()),
                "point_mm": sigma(AxisPart::Place, MM_PER_M),
                "time_offset_s": sigma(AxisPart::TimeOffset, 1.0),
            },
            "hidden": own.collect::<Vec<_>>(),
        })
    };
    source.axes.iter().zip(&source.cell.axes).zip(&design.axes).map(entry).collect()
}
