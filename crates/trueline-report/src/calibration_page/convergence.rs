//! Every step of the joint solve \[Yang2025, Figs. 6–8\].

use crate::page::{Axis, Block, Chart, Colour, Column, Columns, Drawn, Series};
use trueline_dataset::unit::MM_PER_M;
use trueline_geometry::{Line, se3};
use trueline_method::Calibration;
use trueline_method::problem::parameters::TIME_OFFSET;
use trueline_method::solve::iteration_record::IterationRecord;

pub(super) fn blocks(c: &Calibration, columns: &mut Columns) -> Vec<Block> {
    let steps: Vec<&IterationRecord> =
        c.findings.fit.iterations.iter().filter(|step| step.accepted).collect();
    if steps.is_empty() {
        return vec![Block::Text("The solver took no step.".to_owned())];
    }
    let index = columns.add((0..steps.len()).map(|k| k as f64));
    let curves = [
        Some(distance(&steps)),
        c.is_known(TIME_OFFSET).then(|| time_offset(&steps, c)),
        Some(translation(&steps, c)),
        Some(rotation(&steps, c)),
        Some(lines(&steps, c)),
    ];
    curves.into_iter().flatten().map(|curves| curves.chart(index, steps.len(), columns)).collect()
}

/// Curves over the steps, in one chart.
struct Curves {
    id: &'static str,
    title: &'static str,
    explanation: &'static str,
    y: Axis,
    curves: Vec<(String, Vec<f64>)>,
}

impl Curves {
    fn chart(self, index: Column, steps: usize, columns: &mut Columns) -> Block {
        let series = (self.curves.into_iter().enumerate())
            .map(|(k, (name, values))| Series::steps(&name, index, columns.add(values), Colour::of(k)))
            .collect();
        Block::Chart(Chart {
            id: self.id,
            title: self.title,
            explanation: self.explanation.to_owned(),
            alternative: format!("{} for each of {steps} steps", self.title),
            wide: false,
            drawn: Drawn::Plot { x: Axis::of("step"), y: self.y, series, marks: Vec::new() },
        })
    }
}

fn all(steps: &[&IterationRecord], of: impl Fn(&IterationRecord) -> f64) -> Vec<f64> {
    steps.iter().map(|step| of(step)).collect()
}

/// Distance of a quantity from its end after each step, times `units`. The end itself has no place on a logarithmic axis:
/// it is left out.
fn distances(steps: &[&IterationRecord], of: impl Fn(&IterationRecord) -> f64, units: f64) -> Vec<f64> {
    all(steps, |step| of(step).abs() * units).into_iter().map(above_zero).collect()
}

fn above_zero(distance: f64) -> f64 {
    if distance > 0.0 { distance } else { f64::NAN }
}

fn distance(steps: &[&IterationRecord]) -> Curves {
    Curves {
        id: "convergence-rms",
        title: "Distance from the line",
        explanation: "RMS over all usable features except outliers (the paper's Fig. 6 b). The search for a \
            start is not shown.",
        y: Axis::log("RMS (mm)"),
        curves: vec![("RMS".to_owned(), all(steps, |step| step.rms_m * MM_PER_M))],
    }
}

fn time_offset(steps: &[&IterationRecord], c: &Calibration) -> Curves {
    let end_s = c.best_fit().time_offset_s;
    Curves {
        id: "convergence-offset",
        title: "Time offset, distance from the result",
        explanation: "The paper's Fig. 6 a, as distance from the result.",
        y: Axis::log("off by (ms)"),
        curves: vec![(
            "time offset".to_owned(),
            distances(steps, |step| step.parameters.time_offset_s - end_s, 1e3),
        )],
    }
}

const AXES: [&str; 3] = ["x", "y", "z"];

fn translation(steps: &[&IterationRecord], c: &Calibration) -> Curves {
    let end = c.best_fit().tool_from_camera.translation.vector;
    let off = |k: usize| {
        distances(steps, move |step| (step.parameters.tool_from_camera.translation.vector - end)[k], MM_PER_M)
    };
    Curves {
        id: "convergence-translation",
        title: "Hand-eye translation, distance from the result",
        explanation: "The paper's Fig. 8, as distance from the result.",
        y: Axis::log("off by (mm)"),
        curves: (0..3).map(|k| (AXES[k].to_owned(), off(k))).collect(),
    }
}

fn rotation(steps: &[&IterationRecord], c: &Calibration) -> Curves {
    let end = &c.best_fit().tool_from_camera;
    let off = |k: usize| {
        let turn = move |step: &IterationRecord| {
            se3::difference_decoupled(&step.parameters.tool_from_camera, end).0[k]
        };
        distances(steps, turn, 1_f64.to_degrees())
    };
    Curves {
        id: "convergence-rotation",
        title: "Hand-eye rotation, distance from the result",
        explanation: "About the tool's axes.",
        y: Axis::log("off by (°)"),
        curves: (0..3).map(|k| (AXES[k].to_owned(), off(k))).collect(),
    }
}

fn lines(steps: &[&IterationRecord], c: &Calibration) -> Curves {
    Curves {
        id: "convergence-line",
        title: "Lines, distance from the result",
        explanation: "Angle between the directions, and distance at the middle of the result (the paper's \
            Fig. 7 shows four numbers that depend on the base frame).",
        y: Axis::log("off by (mm, or mrad)"),
        curves: line_curves(steps, &c.best_fit().lines),
    }
}

fn line_curves(steps: &[&IterationRecord], end: &[Line]) -> Vec<(String, Vec<f64>)> {
    end.iter()
        .enumerate()
        .flat_map(|(k, last)| {
            let of = |value: &dyn Fn(&Line) -> f64| {
                steps
                    .iter()
                    .map(|step| above_zero(step.parameters.lines.get(k).map_or(f64::NAN, value)))
                    .collect::<Vec<f64>>()
            };
            let angle = of(&|line| {
                let cosine = line.direction().dot(&last.direction()).abs().min(1.0);
                cosine.acos() * 1e3
            });
            let distance = of(&|line| line.distance(last.anchor()) * MM_PER_M);
            [(format!("line {k}: direction (mrad)"), angle), (format!("line {k}: distance (mm)"), distance)]
        })
        .collect()
}
