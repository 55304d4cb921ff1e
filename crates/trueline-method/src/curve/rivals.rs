//! Other answers to a scan over a curve: at other time offsets, or with the sensor turned by half a turn.
//!
//! A circle at even speed looks the same at every time offset, a weave one period later, and with the sensor turned by half a turn
//! half a period later. So every offset is tried from the best attitude and its three half-turns, and compared reading by reading.

use crate::curve::equations::{Known, whiteners};
use crate::curve::fit::Fitted;
use crate::curve::joint::{Rough, rough};
use crate::curve::readings::Readings;
use crate::curve::rows::Whitener;
use crate::curve::sight::Sight;
use crate::curve::starts::{Candidate, offsets_s, same, sifted};
use crate::hypotheses::paired_test::{PairedTest, tested};
use crate::hypotheses::rivals::half_turned;
use crate::parallel;
use nalgebra::{UnitVector3, Vector3};
use trueline_dataset::Guess;

/// Another answer.
#[derive(Clone, Debug)]
pub(crate) struct Rival {
    /// The answer.
    pub rough: Rough,
    /// Comparison with the best.
    pub test: PairedTest,
    /// Its noise factor: residuals divided by the expected noise.
    pub factor: f64,
}

impl Rival {
    /// Whether it explains more than half of what the best does.
    #[must_use]
    pub(crate) fn is_named(&self) -> bool {
        self.test.explains > NAMED * self.test.best_explains
    }
}

/// A rival is named if it explains more than this fraction of the readings that the best explains.
const NAMED: f64 = 0.5;
/// Windows explain at least as much as a curve. An answer of which they explain less than this is no rival.
const WORTH_FITTING: f64 = 0.35;
/// Maximum number of fitted rivals.
const MOST: usize = 8;
/// Windows of the search, s.
const WINDOW_S: f64 = 2.0;

/// Rivals of an answer, the most dangerous first.
#[must_use]
pub(crate) fn find(readings: &Readings, best: &Rough, within_s: f64, threads: usize) -> Vec<Rival> {
    let at = best.fitted.state.at;
    let starts: Vec<Guess> = offsets_s(within_s)
        .into_iter()
        .flat_map(|shift_s| attitudes(readings, &at).map(|turned| Guess { time_offset_s: shift_s, ..turned }))
        .collect();
    let candidates = sifted(readings, &starts, WINDOW_S, threads);
    compared(readings, best, &candidates, None, threads)
}

/// The different candidates, compared with the best, with the prior of the hand-eye transform, if stated.
#[must_use]
pub(crate) fn compared(
    readings: &Readings,
    best: &Rough,
    candidates: &[Candidate],
    stated: Option<&Known>,
    threads: usize,
) -> Vec<Rival> {
    let at = best.fitted.state.at;
    let is_worth = |candidate: &&Candidate| 1.0 - candidate.cost > WORTH_FITTING && !same(&candidate.at, &at);
    let worth: Vec<&Candidate> = candidates.iter().filter(is_worth).take(MOST).collect();
    let fitted = parallel::map(threads, worth.len(), |k| rough(readings, &worth[k].at, stated));
    let mut rivals: Vec<Rival> = Vec::new();
    for rival in fitted.into_iter().flatten() {
        let found = |other: &Guess| same(other, &rival.fitted.state.at);
        if found(&at) || rivals.iter().any(|rival| found(&rival.rough.fitted.state.at)) {
            continue;
        }
        if let Some(test) = compare(readings, &best.fitted, &rival.fitted) {
            let factor = rival.fitted.median_factor(readings);
            rivals.push(Rival { rough: rival, test, factor });
        }
    }
    rivals.sort_by(|a, b| b.is_named().cmp(&a.is_named()).then_with(|| a.test.z.total_cmp(&b.test.z)));
    rivals
}

/// The best attitude and its half-turns about the sheet's normal and axes, through the mean measured point.
fn attitudes(readings: &Readings, at: &Guess) -> [Guess; 4] {
    let count = readings.list.len().max(1) as f64;
    let centre = readings.list.iter().map(|reading| reading.point).sum::<Vector3<f64>>() / count;
    let axes = readings.sheet.axes();
    let about = |axis: UnitVector3<f64>| Guess {
        tool_from_camera: half_turned(&at.tool_from_camera, &axis, &centre),
        ..*at
    };
    let axis = |k: usize| UnitVector3::new_normalize(axes.column(k).into_owned());
    [*at, about(*readings.sheet.plane().normal()), about(axis(0)), about(axis(1))]
}

/// Comparison of a rival with the best, reading by reading.
fn compare(readings: &Readings, best: &Fitted, rival: &Fitted) -> Option<PairedTest> {
    let factor = best.median_factor(readings).min(rival.median_factor(readings));
    let squares = |fitted: &Fitted| -> Vec<f64> {
        let whiteners = whiteners(readings, &fitted.sights);
        let of = |(seen, whitener): (&Option<Sight>, &Whitener)| {
            seen.as_ref().map_or(f64::NAN, |seen| seen.squared(whitener) / (factor * factor))
        };
        fitted.sights.iter().zip(&whiteners).map(of).collect()
    };
    let (of_best, of_rival) = (squares(best), squares(rival));
    let frames = of_best.into_iter().zip(of_rival).enumerate();
    let frames = frames.map(|(frame, (best, rival))| (frame as u32, best, rival));
    let apart_s = best.state.at.time_offset_s - rival.state.at.time_offset_s;
    tested(frames, 0.0, apart_s)
}
