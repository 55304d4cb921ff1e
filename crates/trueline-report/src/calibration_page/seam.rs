//! The seam as it was measured, before and after.

use super::Shown;
use crate::page::{Axis, Block, Chart, Colour, Columns, Drawn, Series};
use nalgebra::Vector3;
use std::collections::BTreeSet;
use trueline_dataset::unit::MM_PER_M;

pub(super) fn blocks(shown: &Shown<'_>, columns: &mut Columns) -> Vec<Block> {
    let lines = &shown.calibration.best_fit().lines;
    if lines.is_empty() {
        // Along and across a line. For a curve the scene shows its place, and the residuals the distances of the points.
        return Vec::new();
    }
    let place = |line: u32, point: &Vector3<f64>| {
        let line = &lines[line as usize];
        let across = line.offset_of(point) * MM_PER_M;
        (line.direction().dot(&(point - line.anchor())) * MM_PER_M, across)
    };
    let mut charts = Vec::new();
    let views = [
        ("seam-2", "Seam from one side", "across the line (mm)", 0),
        ("seam-3", "Seam from the other side", "perpendicular to that (mm)", 1),
    ];
    for (id, title, axis, part) in views {
        let mut series = Vec::new();
        let wild: BTreeSet<u32> = shown.features.iter().filter(|f| f.is_outlier()).map(|f| f.row).collect();
        let before: Vec<(f64, f64)> = shown
            .before
            .iter()
            .filter(|d| !wild.contains(&d.measured.row))
            .map(|d| place(d.measured.line, &d.measured.point_in_base))
            .map(|(along, across)| (along, across[part]))
            .collect();
        let mut add = |name: &str, points: Vec<(f64, f64)>, colour| {
            let (x, y): (Vec<f64>, Vec<f64>) = points.into_iter().unzip();
            series.push(Series::points(name, columns.add(x), columns.add(y), colour));
        };
        add("before: without the time offset", before, Colour::Bad);
        let after = shown.features.iter().filter(|f| !f.is_outlier()).map(|f| {
            let (along, across) = place(f.line, &f.point_in_base);
            (along, across[part])
        });
        add("after calibration", after.collect(), Colour::A);
        charts.push(Block::Chart(Chart {
            id,
            title,
            explanation: format!(
                "Seam points in base, without the time offset and as calibrated. The line is at 0.{}",
                match shown.calibration.findings.fit.residuals.outliers {
                    0 => String::new(),
                    n => format!(" {n} outliers are left out of both."),
                }
            ),
            alternative: format!(
                "Seam points over their place along the line in mm, {axis}, before and after calibration. After it they are within {:.3} mm (root mean square).",
                shown.calibration.findings.fit.residuals.rms_m * MM_PER_M
            ),
            wide: false,
            drawn: Drawn::Plot { x: Axis::of("along the line (mm)"), y: Axis::of(axis), series, marks: Vec::new() },
        }));
    }
    charts
}
