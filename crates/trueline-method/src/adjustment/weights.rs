//! Weights of the frames.

use crate::adjustment::sights::Frame;
use crate::assess::outliers::Outliers;
use nalgebra::SVector;

/// Residuals beyond this are down-weighted, in standard deviations \[Huber1964\].
const HUBER: f64 = 2.5;
/// Maximum fraction of frames left out.
const MOST_OUT: f64 = 0.45;

/// A frame's place in a series and its deviation in standard deviations. `None` if it cannot be evaluated.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Off {
    /// The line.
    pub line: usize,
    /// Its size.
    pub sigmas: Option<f64>,
}

/// Weights of the frames.
#[derive(Clone, Debug, Default)]
pub(crate) struct Weights {
    /// The weight of each frame.
    pub of: Vec<f64>,
    /// Frames beyond the cut by themselves, among those evaluated.
    pub outliers: Outliers,
}

/// Deviation of each frame, from its residuals and their spread. The residuals of a frame count as the two of a seam point would.
#[must_use]
pub(crate) fn off<const ROWS: usize, const LOCAL: usize>(
    frames: &[Option<Frame<ROWS, LOCAL>>],
    left: &[Option<SVector<f64, ROWS>>],
    spread: [f64; ROWS],
) -> Vec<Off> {
    let mut line = 0;
    let off = |(frame, left): (&Option<Frame<ROWS, LOCAL>>, &Option<SVector<f64, ROWS>>)| {
        let Some((frame, left)) = frame.as_ref().zip(left.as_ref()) else {
            return Off { line, sigmas: None };
        };
        line = frame.target;
        let there = frame.is_there.iter().filter(|is_there| **is_there).count().max(1);
        let square: f64 = left.iter().zip(spread).map(|(left, spread)| (left / spread).powi(2)).sum();
        Off { line, sigmas: Some((square * 2.0 / there as f64).sqrt()) }
    };
    frames.iter().zip(left).map(off).collect()
}

/// The weight of each frame. It is 0 beyond `cut` standard deviations, and between two such frames: what disturbs both disturbs it too.
#[must_use]
pub(crate) fn weights(frames: &[Off], cut: f64) -> Weights {
    let mut known: Vec<f64> = frames.iter().filter_map(|frame| frame.sigmas).collect();
    known.sort_by(f64::total_cmp);
    // More are beyond it than may be left out, if most frames are outliers.
    let beyond = known.iter().filter(|sigmas| **sigmas > cut).count();
    let most = known.get(((1.0 - MOST_OUT) * known.len() as f64) as usize).copied().unwrap_or(cut);
    let cut = cut.max(most);
    let mut weights: Vec<f64> = frames
        .iter()
        .map(|frame| match frame.sigmas {
            Some(sigmas) if sigmas <= cut => (HUBER / sigmas).min(1.0),
            _ => 0.0,
        })
        .collect();
    let is_out: Vec<bool> = weights.iter().map(|weight| *weight == 0.0).collect();
    for k in 1..frames.len().saturating_sub(1) {
        let alike = frames[k - 1].line == frames[k].line && frames[k + 1].line == frames[k].line;
        if alike && is_out[k - 1] && is_out[k + 1] {
            weights[k] = 0.0;
        }
    }
    Weights { of: weights, outliers: Outliers { count: beyond, of: known.len() } }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_frame_between_two_that_are_out_is_out() {
        let frames: Vec<Off> = [0.5, 2.0, 9.0, 1.0, 9.0, 5.0, 1.0, 1.0, 1.0]
            .map(|sigmas| Off { line: 0, sigmas: Some(sigmas) })
            .into();
        let found = weights(&frames, 5.5);
        assert_eq!(found.of, [1.0, 1.0, 0.0, 0.0, 0.0, 0.5, 1.0, 1.0, 1.0]);
        // It is no outlier itself.
        assert_eq!(found.outliers, Outliers { count: 2, of: 9 });
        // Another line's neighbours have no information.
        let mut apart = frames;
        apart[4].line = 1;
        assert_eq!(weights(&apart, 5.5).of[3], 1.0);
    }

    #[test]
    fn most_frames_are_kept_however_far_off_they_are() {
        let frames: Vec<Off> = (0..100).map(|k| Off { line: 0, sigmas: Some(f64::from(k)) }).collect();
        let found = weights(&frames, 4.0);
        let out = found.of.iter().filter(|weight| **weight == 0.0).count();
        assert!((40..=45).contains(&out), "{out}");
        // All beyond 4 are outliers nevertheless.
        assert_eq!(found.outliers, Outliers { count: 95, of: 100 });
    }
}
