//! Residuals in the seam's cross-section as series along time or along the seam.
//!
//! Long scans are sampled in stretches: twenty thousand frames are enough to characterise the noise. Its effect on the estimate is summed over all
//! frames.

use crate::assess::noise_filter::{Correlation, Whitened, Whitening};
use crate::assess::residuals::OUTLIER_SQUARED;
use crate::order_statistics::median;
use crate::problem::layout::Layout;
use crate::problem::line_problem::LineProblem;
use crate::problem::parameters::Parameters;
use nalgebra::{DMatrix, DVectorView, DVectorViewMut};

/// Variable of the correlation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Along {
    /// Time: correlated noise of detector or robot.
    Time,
    /// The seam: its form.
    Seam,
}

/// Minimum frames for an estimate of the correlation.
const LEAST_FRAMES: usize = 100;
/// Maximum number of frames evaluated …
const MOST_FRAMES: usize = 20_000;
/// … in evenly spread stretches of this length, which is long compared with any correlation tried.
const STRETCH: usize = 1_000;

/// Place of an observation.
#[derive(Clone, Copy, Debug)]
struct Place {
    index: u32,
    line: u32,
    time_s: f64,
    along_m: f64,
}

impl Place {
    fn of(&self, along: Along) -> f64 {
        match along {
            Along::Time => self.time_s,
            Along::Seam => self.along_m,
        }
    }
}

/// A solution with its residuals in the cross-section.
pub(crate) struct Sections<'a> {
    problem: &'a LineProblem<'a>,
    at: &'a Parameters,
    /// The root of the covariance, transposed, with a column for each unknown.
    root: DMatrix<f64>,
}

impl<'a> Sections<'a> {
    /// At a solution whose covariance has the root `root`.
    #[must_use]
    pub(crate) fn new(problem: &'a LineProblem<'_>, at: &'a Parameters, root: &DMatrix<f64>) -> Self {
        Self { problem, at, root: root.transpose() }
    }

    /// Number of unknowns in the root's coordinates.
    fn unknowns(&self) -> usize {
        self.root.nrows()
    }

    /// Writes both directions' rows of an observation into `rows`: the Jacobian in the root's coordinates and the residual. `None` for observations
    /// without weight, and for the paper's residual.
    fn rows(&self, index: usize, rows: &mut [f64]) -> Option<Place> {
        let (o, whitener) = (&self.problem.list[index], &self.problem.whiteners[index]);
        let placement = self.problem.placement(o, self.at)?;
        let section = self.problem.in_cross_section(o, self.at, &placement)?;
        if whitener.apply(&section.in_sheet).norm_squared() > OUTLIER_SQUARED {
            return None;
        }
        let line = o.line as usize;
        let width = self.unknowns() + 1;
        for (k, row) in rows.chunks_exact_mut(width).enumerate() {
            let (slopes, residual) = row.split_at_mut(width - 1);
            residual[0] = section.residual[k];
            let mut slopes = DVectorViewMut::from_slice(slopes, width - 1);
            slopes.fill(0.0);
            let by_local = section.jacobian.row(k).transpose();
            self.problem.unknowns.add_in_root(line, (by_local.as_slice(), 1.0), &self.root, &mut slopes);
        }
        let from_anchor = placement.point_in_base(&o.point_in_camera) - self.at.lines[line].anchor();
        let along_m = self.at.lines[line].direction().dot(&from_anchor);
        Some(Place { index: index as u32, line: o.line, time_s: o.stamp_s, along_m })
    }

    /// The places of all observations, including those without weight.
    fn places(&self) -> Vec<Place> {
        let place = |(index, (o, _)): (usize, (&crate::input::observations::Observation, _))| {
            let placement = self.problem.placement(o, self.at)?;
            let line = &self.at.lines[o.line as usize];
            let from_anchor = placement.point_in_base(&o.point_in_camera) - line.anchor();
            let along_m = line.direction().dot(&from_anchor);
            Some(Place { index: index as u32, line: o.line, time_s: o.stamp_s, along_m })
        };
        self.problem.selected().enumerate().filter_map(place).collect()
    }
}

/// The observations with weight, or stretches of them, with their rows.
pub(crate) struct SectionTable<'a> {
    sections: Sections<'a>,
    places: Vec<Place>,
    /// Rows of `places`, one direction after the other.
    rows: Vec<f64>,
    is_complete: bool,
}

/// An order of the table's rows.
pub(crate) struct Series {
    /// The variable of the order.
    pub along: Along,
    /// The median distance between successive frames, s or m: one step.
    step: f64,
    order: Vec<u32>,
    /// Steps from the previous sample. Infinite at the start of another line.
    apart_steps: Vec<f64>,
}

impl<'a> SectionTable<'a> {
    /// `None` for the paper's residual, and for too few observations.
    #[must_use]
    pub(crate) fn of(sections: Sections<'a>) -> Option<Self> {
        let count = sections.problem.list.len();
        let is_complete = count <= MOST_FRAMES;
        let width = 2 * (sections.unknowns() + 1);
        let (mut places, mut rows) = (Vec::new(), Vec::new());
        let mut row = vec![0.0; width];
        for index in stretches(count).flatten() {
            let Some(place) = sections.rows(index, &mut row) else { continue };
            places.push(place);
            rows.extend_from_slice(&row);
        }
        (places.len() >= LEAST_FRAMES).then_some(Self { sections, places, rows, is_complete })
    }

    /// The rows in order of time or place along the seam.
    #[must_use]
    pub(crate) fn along(&self, along: Along) -> Series {
        let places = &self.places;
        let mut order: Vec<u32> = (0..places.len() as u32).collect();
        let by = |of: &dyn Fn(&Place) -> f64, a: u32, b: u32| {
            let (a, b) = (&places[a as usize], &places[b as usize]);
            a.line.cmp(&b.line).then(of(a).total_cmp(&of(b)))
        };
        order.sort_by(|a, b| by(&|place| place.time_s, *a, *b));
        let two = |two: &[u32]| [places[two[0] as usize], places[two[1] as usize]];
        let distances = order.windows(2).map(two).filter(|[a, b]| a.line == b.line);
        let step = median(distances.map(|[a, b]| (b.of(along) - a.of(along)).abs())).unwrap_or(1.0);
        let step = step.max(f64::MIN_POSITIVE);
        order.sort_by(|a, b| by(&|place| place.of(along), *a, *b));
        let mut walk = Walk { along, step, last: None };
        let apart_steps = order.iter().map(|k| walk.apart_steps(&places[*k as usize])).collect();
        Series { along, step, order, apart_steps }
    }

    fn row(&self, series: &Series, k: usize, direction: usize) -> &[f64] {
        let width = self.sections.unknowns() + 1;
        let first = 2 * width * series.order[k] as usize + direction * width;
        &self.rows[first..first + width]
    }

    /// Steps from the previous sample, and the residual of one direction.
    pub(crate) fn residuals(
        &self,
        series: &Series,
        direction: usize,
    ) -> impl Iterator<Item = (f64, f64)> + Clone {
        let last = self.sections.unknowns();
        (0..series.order.len()).map(move |k| (series.apart_steps[k], self.row(series, k, direction)[last]))
    }

    /// One direction, whitened over the table.
    #[must_use]
    pub(crate) fn whitened(&self, series: &Series, direction: usize, correlation: Correlation) -> Whitened {
        let mut whitening = Whitening::new(correlation, self.sections.unknowns());
        for (k, apart_steps) in series.apart_steps.iter().enumerate() {
            whitening.take(*apart_steps, self.row(series, k, direction));
        }
        whitening.sums()
    }

    /// The innovations of r + J δ in the table, of unit variance times the level.
    #[must_use]
    pub(crate) fn innovations(
        &self,
        series: &Series,
        direction: usize,
        correlation: Correlation,
        step: DVectorView<'_, f64>,
    ) -> Vec<f64> {
        let mut whitening = Whitening::new(correlation, step.len());
        let innovation = |(k, apart_steps): (usize, &f64)| {
            let innovation = whitening.take(*apart_steps, self.row(series, k, direction));
            let (slopes, residual) = innovation.split_at(step.len());
            residual[0] + DVectorView::from_slice(slopes, step.len()).dot(&step)
        };
        series.apart_steps.iter().enumerate().map(innovation).collect()
    }

    /// Both directions whitened, each with its own correlation, and scaled from the table to the whole scan.
    #[must_use]
    pub(crate) fn whitened_as_if_all(&self, series: &Series, correlation: [Correlation; 2]) -> [Whitened; 2] {
        let looked_at: usize = stretches(self.sections.problem.list.len()).map(|stretch| stretch.len()).sum();
        let times = self.sections.problem.list.len() as f64 / looked_at as f64;
        [0, 1].map(|direction| self.whitened(series, direction, correlation[direction]).times(times))
    }

    /// All observations of the scan whitened, each direction with its own correlation. Observations outside the table are evaluated again.
    #[must_use]
    pub(crate) fn all_whitened(&self, series: &Series, correlation: [Correlation; 2]) -> [Whitened; 2] {
        if self.is_complete {
            return [0, 1].map(|direction| self.whitened(series, direction, correlation[direction]));
        }
        let unknowns = self.sections.unknowns();
        let mut order = self.sections.places();
        order.sort_by(|a, b| a.line.cmp(&b.line).then(a.of(series.along).total_cmp(&b.of(series.along))));
        let mut whitening = correlation.map(|correlation| Whitening::new(correlation, unknowns));
        let mut walk = Walk { along: series.along, step: series.step, last: None };
        let mut rows = vec![0.0; 2 * (unknowns + 1)];
        for place in &order {
            let Some(place) = self.sections.rows(place.index as usize, &mut rows) else {
                continue;
            };
            let apart_steps = walk.apart_steps(&place);
            for (whitening, row) in whitening.iter_mut().zip(rows.chunks_exact(unknowns + 1)) {
                whitening.take(apart_steps, row);
            }
        }
        whitening.map(Whitening::sums)
    }
}

/// Indices that are evaluated.
fn stretches(count: usize) -> impl Iterator<Item = std::ops::Range<usize>> {
    let (stretches, length) = match count {
        0..=MOST_FRAMES => (1, count),
        _ => (MOST_FRAMES / STRETCH, STRETCH),
    };
    (0..stretches).map(move |k| {
        let first = (count - length) * k / (stretches - 1).max(1);
        first..first + length
    })
}

/// Distances between successive observations.
struct Walk {
    along: Along,
    step: f64,
    last: Option<(u32, f64)>,
}

impl Walk {
    fn apart_steps(&mut self, place: &Place) -> f64 {
        let at = place.of(self.along);
        let apart = match self.last {
            Some((line, last)) if line == place.line => (at - last).max(0.0) / self.step,
            _ => f64::INFINITY,
        };
        self.last = Some((place.line, at));
        apart
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stretches_reach_from_end_to_end_and_are_as_many_as_are_looked_at() {
        assert_eq!(stretches(MOST_FRAMES).next(), Some(0..MOST_FRAMES));
        assert_eq!(stretches(MOST_FRAMES).count(), 1);
        let long: Vec<_> = stretches(360_000).collect();
        assert_eq!(long.iter().map(ExactSizeIterator::len).sum::<usize>(), MOST_FRAMES);
        assert_eq!((long[0].start, long[long.len() - 1].end), (0, 360_000));
        assert!(long.windows(2).all(|two| two[0].end <= two[1].start));
    }
}
