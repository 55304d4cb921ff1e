//! The report of a plan: its prediction, the path, the view, its use of the limits.

use crate::number::digits_for;
use crate::page::render::render;
use crate::page::{
    Axis, Block, Card, Chart, Colour, Columns, Drawn, Mark, Page, Section, Series, Tone, Verdict,
};
use crate::plan_axes;
use crate::plan_film;
use crate::plan_seam_error;
use crate::plan_source::Source;
use crate::plan_summary;
use trueline_dataset::unit::MM_PER_M;
use trueline_method::problem::parameters::{LINES, ROTATION, TIME_OFFSET, TRANSLATION};
use trueline_plan::constraints::Constraint;
use trueline_plan::predicted_frames::exposures;
use trueline_plan::{Cell, Plan, Prediction};

/// Times at which the motion is drawn.
const SAMPLES: usize = 1500;

/// Renders the report.
#[must_use]
pub fn html(source: &Source<'_>) -> String {
    let Source { cell, plan, wrong_guess, .. } = source;
    let asked = source.asked.goal;
    let missed = asked.map(|goal| plan_summary::missed(source, goal)).unwrap_or_default();
    let mut page = Page {
        title: "A planned scan".to_owned(),
        verdict: Verdict {
            text: sentence(source, missed.is_empty()),
            tone: asked.map_or(Tone::Plain, |_| Tone::of(missed.is_empty())),
        },
        ..Page::default()
    };
    let mut first = Vec::new();
    if !missed.is_empty() {
        first.push(Block::Notice { heading: "Requirements missed", items: missed, bad: true });
        let mut advice = plan_seam_error::advice(source);
        advice.extend(plan_seam_error::longer(source));
        if !advice.is_empty() {
            first.push(Block::Notice { heading: "Remedies", items: advice, bad: false });
        }
    }
    first.push(Block::Cards(cards(plan, wrong_guess).into_iter().chain(plan_axes::card(source)).collect()));
    let columns = &mut page.columns;
    let sections = [
        ("promise", "", first),
        ("space", "In space", vec![plan_film::block(cell, plan, columns)]),
        ("time", "Over time", over_time(source, columns)),
        ("limits", "Limits", vec![limits(cell, plan), room(cell, plan, columns)]),
        ("made", "How this was made", vec![Block::Facts(made(source))]),
    ];
    page.sections = sections
        .into_iter()
        .map(|(id, heading, blocks)| Section { id, heading, blocks, folded: id == "developers" })
        .collect();
    render(&page)
}

fn sentence(source: &Source<'_>, reached: bool) -> String {
    let seconds = source.plan.motion.design().duration_s;
    let error = plan_seam_error::predicted(source).map(|error| format!("Seam error {error}: "));
    let scan = match (source.asked.goal.is_some(), reached) {
        (true, true) => format!("this scan of {seconds:.1} s reaches the required accuracy."),
        (true, false) => {
            format!("the best scan found, of {seconds:.1} s, does not reach the required accuracy.")
        }
        (false, _) => format!("a scan of {seconds:.1} s within all limits."),
    };
    match error {
        Some(error) => error + &scan,
        None => first_upper(&scan),
    }
}

fn first_upper(text: &str) -> String {
    let mut rest = text.chars();
    rest.next().map_or_else(String::new, |first| first.to_uppercase().chain(rest).collect())
}

fn cards(plan: &Plan, wrong_guess: &[f64; LINES]) -> Vec<Card> {
    let sigma = |k: usize, factor: f64, unit: &str| {
        let value = plan.prediction.sigma(k) * factor;
        let unit = if unit == "°" { unit.to_owned() } else { format!(" {unit}") };
        format!("± {value:.0$}{unit}  (± {1:.0$}{unit})", digits_for(value), wrong_guess[k] * factor)
    };
    let three = |first: usize, factor: f64, unit: &str| {
        ["x", "y", "z"]
            .iter()
            .enumerate()
            .map(|(k, axis)| format!("{axis} {}", sigma(first + k, factor, unit)))
            .collect()
    };
    vec![
        Card {
            name: "Time offset",
            values: vec![sigma(TIME_OFFSET, 1e3, "ms")],
            meaning:
                "One standard deviation of noise; in brackets, the limit for 95 % of the cells with a wrong guess."
                    .to_owned(),
        },
        Card {
            name: "Rotation",
            values: three(ROTATION, 1.0_f64.to_degrees(), "°"),
            meaning: "About the tool's axes.".to_owned(),
        },
        Card {
            name: "Translation",
            values: three(TRANSLATION, MM_PER_M, "mm"),
            meaning: "Along the tool's axes.".to_owned(),
        },
    ]
}

fn times(plan: &Plan, count: usize) -> impl Iterator<Item = f64> {
    let duration_s = plan.motion.design().duration_s;
    (0..=count).map(move |k| duration_s * k as f64 / count as f64)
}

fn over_time(source: &Source<'_>, columns: &mut Columns) -> Vec<Block> {
    let known: Vec<&(f64, Prediction)> = source.over_time.iter().filter(|(_, p)| p.shows_all()).collect();
    let x = columns.add(known.iter().map(|(t, _)| *t));
    let mut chart = |id, title, axis: &str, rows: Vec<(&str, usize, f64)>| {
        let series = rows
            .into_iter()
            .enumerate()
            .map(|(k, (name, component, factor))| {
                let y = columns.add(known.iter().map(|(_, p)| p.sigma(component) * factor));
                Series::line(name, x, y, Colour::of(k))
            })
            .collect();
        Block::Chart(Chart {
            id,
            title,
            explanation: "One standard deviation if the scan stopped at this time.".to_owned(),
            alternative: format!("{title} over time in s, logarithmic"),
            wide: false,
            drawn: Drawn::Plot { x: Axis::of("time (s)"), y: Axis::log(axis), series, marks: Vec::new() },
        })
    };
    let degrees = 1.0_f64.to_degrees();
    let three = |first: usize, factor: f64| {
        vec![("x", first, factor), ("y", first + 1, factor), ("z", first + 2, factor)]
    };
    let mut blocks = vec![
        chart("sigma-time", "Sigma of the time offset", "± (ms)", vec![("time offset", TIME_OFFSET, 1e3)]),
        chart("sigma-rotation", "Sigma of the rotation", "± (°)", three(ROTATION, degrees)),
        chart("sigma-translation", "Sigma of the translation", "± (mm)", three(TRANSLATION, MM_PER_M)),
    ];
    blocks.push(sweeps(source.plan, columns));
    blocks.push(place_in_sheet(source.plan, columns));
    blocks
}

fn sweeps(plan: &Plan, columns: &mut Columns) -> Block {
    let x = columns.add(times(plan, SAMPLES));
    let series = ["work angle", "travel angle", "spin"]
        .iter()
        .enumerate()
        .map(|(k, name)| {
            let y =
                columns.add(times(plan, SAMPLES).map(|t| plan.motion.station(t).tilt_rad[k].to_degrees()));
            Series::line(name, x, y, Colour::of(k))
        })
        .collect();
    Block::Chart(Chart {
        id: "tilts",
        title: "Attitude",
        explanation:
            "Work angle about the seam, travel angle about the stripe, spin about the range direction."
                .to_owned(),
        alternative: "Work angle, travel angle and spin in degrees over time in s".to_owned(),
        wide: false,
        drawn: Drawn::Plot { x: Axis::of("time (s)"), y: Axis::of("tilt (°)"), series, marks: Vec::new() },
    })
}

fn place_in_sheet(plan: &Plan, columns: &mut Columns) -> Block {
    let x = columns.add(times(plan, SAMPLES).map(|t| plan.motion.station(t).stripe_m * MM_PER_M));
    let y = columns.add(times(plan, SAMPLES).map(|t| plan.motion.station(t).stand_off_m * MM_PER_M));
    Block::Chart(Chart {
        id: "in-the-sheet",
        title: "Where the seam appears in the view",
        explanation: "With a correct guess. A wider sweep gives more information.".to_owned(),
        alternative: "Stand-off in mm over the place along the stripe in mm".to_owned(),
        wide: false,
        drawn: Drawn::Plot {
            x: Axis::of("along the stripe (mm)"),
            y: Axis::of("stand-off (mm)"),
            series: vec![Series::line("seam", x, y, Colour::A)],
            marks: Vec::new(),
        },
    })
}

fn limits(cell: &Cell, plan: &Plan) -> Block {
    let used = Constraint::ALL.iter().filter(|constraint| constraint.applies_in(cell));
    let (names, values) = used.map(|d| (d.name().to_owned(), 100.0 * plan.constraints.used(*d))).unzip();
    Block::Chart(Chart {
        id: "limits-used",
        title: "Share of each limit that is used",
        explanation:
            "Measured on the path at 250 Hz. For the field of view this includes the frames that cells with a wrong guess may lose."
                .to_owned(),
        alternative: "Bars: per cent of each limit that the path uses".to_owned(),
        wide: false,
        drawn: Drawn::Bars {
            names,
            values,
            axis: Axis::of("used (%)"),
            mark: Some(Mark { name: "the limit".to_owned(), at: 100.0, upright: true }),
        },
    })
}

fn room(cell: &Cell, plan: &Plan, columns: &mut Columns) -> Block {
    let exposed: Vec<f64> = exposures(cell, &plan.motion, 1).collect();
    let x = columns.add(exposed.iter().copied());
    let room = columns.add(exposed.iter().map(|t| 100.0 * cell.view.room(&plan.motion.point_in_camera(*t))));
    let seen = columns.add(plan.seen_by.iter().map(|share| 100.0 * share.seam));
    Block::Chart(Chart {
        id: "room",
        title: "Frames in which the seam is in view",
        explanation: "Share of the possible cells that see the seam in each frame; and, with a correct \
            guess, the distance of the seam from the edge of the usable view, in per cent of half the view."
            .to_owned(),
        alternative: "Per cent of the cells that see the seam, and distance of the seam from the edge of the view in per cent of half the view, over time in s".to_owned(),
        wide: false,
        drawn: Drawn::Plot {
            x: Axis::of("time (s)"),
            y: Axis::of("cells, margin (%)"),
            series: vec![
                Series::line("cells that see it", x, seen, Colour::A),
                Series::line("margin with a correct guess", x, room, Colour::B),
            ],
            marks: vec![Mark { name: "out of view below".to_owned(), at: 0.0, upright: false }],
        },
    })
}

/// Facts that the charts do not show.
fn made(source: &Source<'_>) -> Vec<(String, String)> {
    let mut facts = plan_summary::facts(source);
    facts.push(("command".to_owned(), source.command.to_owned()));
    facts
}
