//! Motion of frames relative to their neighbours along the seam.
//!
//! The form of a seam is unknown. Sliding all frames along it has no effect, because another form would fit as well. Only frames that see one place
//! and slide differently, on another pass or at another attitude, meet different parts of the form. A form fixed in space would act as a landmark
//! and make the scan look better than it is.

use crate::adjustment::form::Hats;
use crate::order_statistics::quantile;
use nalgebra::SVector;

/// Spacing of places along a seam that define neighbours, m: that of its finest form.
const NEAR_M: f64 = 0.005;

/// Fraction of a seam's points that may lie beyond each of its ends.
const BEYOND: f64 = 0.002;

/// Neighbouring frames.
pub(crate) struct Neighbours {
    /// For each frame the first of two places and its share in each. `None` for a frame that was not seen.
    near: Vec<Option<(usize, [f64; 2])>>,
    places: usize,
}

impl Neighbours {
    /// Groups frames by line and place along it, m.
    #[must_use]
    pub(crate) fn of(frames: &[Option<(usize, f64)>]) -> Self {
        let lines = frames.iter().flatten().map(|(line, _)| line + 1).max().unwrap_or(0);
        let mut near = vec![None; frames.len()];
        let mut places = 0;
        for line in 0..lines {
            let along =
                || frames.iter().flatten().filter(|(own, _)| *own == line).map(|(_, along_m)| *along_m);
            // Points beyond are outliers.
            let ends = (quantile(along(), BEYOND), quantile(along(), 1.0 - BEYOND));
            let (Some(from_m), Some(to_m)) = ends else { continue };
            let hats = Hats::over([from_m, to_m], NEAR_M, lines);
            for (near, place) in near.iter_mut().zip(frames) {
                if let Some((_, along_m)) = place.filter(|(own, _)| *own == line) {
                    let (first, parts) = hats.at(along_m);
                    *near = Some((places + first, parts));
                }
            }
            places += hats.count + 1;
        }
        Self { near, places }
    }

    /// Values minus the mean of their neighbours. Missing values are skipped.
    #[must_use]
    pub(crate) fn beyond<const N: usize>(
        &self,
        values: &[Option<SVector<f64, N>>],
    ) -> Vec<Option<SVector<f64, N>>> {
        let mut sums = vec![(0.0, SVector::<f64, N>::zeros()); self.places];
        let known = || self.near.iter().zip(values).map(|(near, value)| near.zip(*value));
        for ((first, parts), value) in known().flatten() {
            for (k, part) in parts.into_iter().enumerate() {
                let (weight, sum) = &mut sums[first + k];
                *weight += part;
                *sum += value * part;
            }
        }
        let mean = |place: usize| {
            let (weight, sum) = &sums[place];
            if *weight > 0.0 { sum / *weight } else { SVector::zeros() }
        };
        let beyond = |((first, parts), value): ((usize, [f64; 2]), SVector<f64, N>)| {
            value - mean(first) * parts[0] - mean(first + 1) * parts[1]
        };
        known().map(|known| known.map(beyond)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector1;

    #[test]
    fn only_what_one_pass_slides_beyond_another_is_left() {
        // Two passes over one place, a frame that is alone, one that was not seen, and the same place of another line.
        let places = [Some((0, 0.1)), Some((0, 0.1)), Some((0, 0.3)), None, Some((1, 0.1))];
        let slides = [1.0, 3.0, 7.0, 2.0, 5.0].map(|slide| Some(Vector1::new(slide)));
        let apart = Neighbours::of(&places).beyond(&slides);
        let apart: Vec<_> = apart.into_iter().map(|value| value.map(|value| value.x)).collect();
        assert_eq!(apart, [Some(-1.0), Some(1.0), Some(0.0), None, Some(0.0)]);
    }
}
