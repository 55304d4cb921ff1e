//! The plates of the joint: the answers of seam points and of whole stripes side by side, and where each plate is not flat.

use crate::number::digits_for;
use crate::page::{Axis, Block, Chart, Drawn, Heat, Table, TableRow};
use crate::stripes::fact;
use std::collections::BTreeSet;
use trueline_dataset::unit::MM_PER_M;
use trueline_method::Calibration;
use trueline_method::order_statistics::median;
use trueline_method::problem::parameters::{LINES, ROTATION, TIME_OFFSET, TRANSLATION};
use trueline_method::stripe::outcome::{Answer, StripeEstimate};
use trueline_method::stripe::planes::{PlaneEstimate, PlatePoint};

/// Cells along the seam.
const CELLS_ALONG: usize = 24;
/// Cells away from it: the most that leave hardly any empty. A constant stand-off shows each stripe's two support points at the same
/// places.
const CELLS_AWAY: [usize; 3] = [8, 4, 2];
/// Part of the cells in which a plate must have been seen.
const FILLED: f64 = 0.9;
/// Plates that are drawn: names of charts are fixed.
const IDS: [&str; 4] = ["plate-0", "plate-1", "plate-2", "plate-3"];
const TITLES: [&str; 4] = ["Plate 0", "Plate 1", "Plate 2", "Plate 3"];

/// Empty if no plates were estimated.
pub(super) fn blocks(c: &Calibration) -> Vec<Block> {
    let estimate = c.findings.stripes.as_ref().and_then(|stripes| stripes.estimate.as_ref());
    let Some(estimate) = estimate else { return Vec::new() };
    let mut blocks = vec![Block::Table(side_by_side(estimate)), Block::Facts(angles(estimate))];
    let maps = estimate.planes.iter().zip(IDS.into_iter().zip(TITLES));
    blocks.extend(maps.filter_map(|(plane, names)| Some(Block::Chart(map(plane, names)?))));
    blocks
}

/// One standard deviation of both answers, and the gain of the stripes.
fn side_by_side(estimate: &StripeEstimate) -> Table {
    let row = |name: &str, of: &dyn Fn(&Answer) -> Option<f64>, scale: f64, unit: &str| {
        let [seam, stripe] = [&estimate.seam, &estimate.stripe].map(of);
        let said = |sigma: Option<f64>| match sigma.map(|sigma| sigma * scale) {
            Some(sigma) => format!("± {sigma:.0$}{unit}", digits_for(sigma)),
            None => "not determined".to_owned(),
        };
        let gain = match seam.zip(stripe) {
            Some((seam, stripe)) if stripe > 0.0 => format!("{:.1} ×", seam / stripe),
            _ => String::new(),
        };
        TableRow::plain(vec![name.to_owned(), said(seam), said(stripe), gain])
    };
    let degrees = 1_f64.to_degrees();
    let all = |answer: &Answer| answer.seam_error.as_ref().map(|error| error.rms_m);
    Table {
        head: ["of one scan", "by seam points", "by whole stripes", "gain by stripes"]
            .map(str::to_owned)
            .to_vec(),
        rows: vec![
            row("time offset", &|a| root_sum(a, TIME_OFFSET..ROTATION), 1e3, " ms"),
            row("rotation, all axes", &|a| root_sum(a, ROTATION..TRANSLATION), degrees, "°"),
            row("translation, all axes", &|a| root_sum(a, TRANSLATION..LINES), MM_PER_M, " mm"),
            // What the scan alone leaves differs: the answer that estimates more of the robot and the detector pays for it in noise.
            row("seam error", &all, MM_PER_M, " mm"),
        ],
    }
}

/// Root of the summed variances; `None` if one of them is not observable.
fn root_sum(answer: &Answer, range: std::ops::Range<usize>) -> Option<f64> {
    let seen = range.clone().all(|k| answer.observability.observable_components[k]);
    seen.then(|| range.map(|k| answer.covariance[(k, k)].max(0.0)).sum::<f64>().sqrt())
}

fn angles(estimate: &StripeEstimate) -> Vec<(String, String)> {
    let mut facts = Vec::new();
    let joints: BTreeSet<usize> = estimate.planes.iter().map(|plane| plane.number / 2).collect();
    facts.extend(joints.into_iter().filter_map(|joint| {
        let (what, value) = fact(estimate, joint)?;
        Some((format!("{what} of plates {} and {}", 2 * joint, 2 * joint + 1), value))
    }));
    let apart = match estimate.sigmas_apart {
        Some(sigmas) if sigmas < 1.0 => "less than 1 σ apart: they agree".to_owned(),
        Some(sigmas) => format!("{sigmas:.1} σ apart (they agree up to 3 σ)"),
        None => "they cannot be compared".to_owned(),
    };
    facts.push(("both answers".to_owned(), apart));
    facts
}

/// Height of each support point of a plate over its best plane, as the median of its part of the plate, m; `None` as for
/// [`map`].
pub(super) fn relief_m(plane: &PlaneEstimate) -> Option<Vec<f64>> {
    let grid = Grid::over(plane)?;
    let heights: Vec<f64> =
        grid.heights_m(plane).into_iter().map(|of| median(of.into_iter()).unwrap_or(0.0)).collect();
    Some(plane.points.iter().map(|point| heights[grid.cell_of(point)]).collect())
}

/// The median height of the support points in each part of a plate; `None` if it was seen in one place alone.
fn map(plane: &PlaneEstimate, (id, title): (&'static str, &'static str)) -> Option<Chart> {
    let grid = Grid::over(plane)?;
    let cells = grid.cells(plane);
    let strongest = cells.iter().map(|cell| cell[2].abs()).fold(0.0, f64::max);
    let bow_mm = plane.bow_m * MM_PER_M;
    let [x, y] = grid.limits.map(|ends| ends.map(|m| m * MM_PER_M));
    Some(Chart {
        id,
        title,
        explanation: format!(
            "Height of the stripe's support points above the best-fit plane, positive on the sensor's side. \
            The fitted smooth surface has a bow of {bow_mm:.0$} mm.",
            digits_for(bow_mm)
        ),
        alternative: format!("Map of a plate: heights above its best plane, at most {strongest:.3} mm"),
        wide: false,
        drawn: Drawn::Heat(Box::new(Heat {
            x: Axis::of("along the seam (mm)").between(x[0], x[1]),
            y: Axis::of("away from the seam (mm)").between(y[0], y[1]),
            cell: [0, 1].map(|axis| grid.side_m(axis) * MM_PER_M),
            cells,
            strongest,
            signed: true,
            unit: "height (mm)".to_owned(),
            short: "mm".to_owned(),
            equal: false,
        })),
    })
}

/// A plate in cells, along the seam and away from it.
#[derive(Clone, Copy)]
struct Grid {
    limits: [[f64; 2]; 2],
    counts: [usize; 2],
}

impl Grid {
    /// The finest grid with cells that the points of a plate nearly fill; `None` if it was seen in one place alone.
    fn over(plane: &PlaneEstimate) -> Option<Self> {
        let limits = [0, 1].map(|axis| {
            let places = || plane.points.iter().map(|point| point.place_m[axis]);
            [places().fold(f64::INFINITY, f64::min), places().fold(f64::NEG_INFINITY, f64::max)]
        });
        if !limits.iter().all(|[low, high]| (high - low).is_finite() && high > low) {
            return None;
        }
        let grids = CELLS_AWAY.map(|away| Self { limits, counts: [CELLS_ALONG, away] });
        let filled = |grid: &Self| grid.cells(plane).len() as f64 >= FILLED * grid.size() as f64;
        grids.iter().find(|grid| filled(grid)).or(grids.last()).copied()
    }

    fn size(&self) -> usize {
        self.counts[0] * self.counts[1]
    }

    fn side_m(&self, axis: usize) -> f64 {
        (self.limits[axis][1] - self.limits[axis][0]) / self.counts[axis] as f64
    }

    /// Number of the cell that a point is in.
    fn cell_of(&self, point: &PlatePoint) -> usize {
        let [along, away] = [0, 1].map(|axis| {
            let from = point.place_m[axis] - self.limits[axis][0];
            ((from / self.side_m(axis)) as usize).min(self.counts[axis] - 1)
        });
        away * self.counts[0] + along
    }

    /// Heights of the points of each cell, m.
    fn heights_m(&self, plane: &PlaneEstimate) -> Vec<Vec<f64>> {
        let mut heights = vec![Vec::new(); self.size()];
        plane.points.iter().for_each(|point| heights[self.cell_of(point)].push(point.height_m));
        heights
    }

    /// Middle, median height and number of points of each cell that has some, mm.
    fn cells(&self, plane: &PlaneEstimate) -> Vec<[f64; 4]> {
        let middle_mm =
            |axis: usize, k: usize| (self.limits[axis][0] + (k as f64 + 0.5) * self.side_m(axis)) * MM_PER_M;
        let cell = |(k, of): (usize, &Vec<f64>)| {
            let height_mm = median(of.iter().copied())? * MM_PER_M;
            let [along, away] = [k % self.counts[0], k / self.counts[0]];
            Some([middle_mm(0, along), middle_mm(1, away), height_mm, of.len() as f64])
        };
        self.heights_m(plane).iter().enumerate().filter_map(cell).collect()
    }
}
