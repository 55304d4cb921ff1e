//! A picture read along columns or along rows, whichever crosses the stripe.

use crate::picture::{Level, Picture};

/// A picture read along columns or along rows.
pub(crate) struct SectionView<'a, L> {
    levels: &'a [L],
    /// From one section to the next, and from one pixel of a section to the next.
    steps: [usize; 2],
    limit: usize,
}

impl<'a, L: Level> SectionView<'a, L> {
    pub(crate) fn new(picture: &Picture<'a, L>, by_columns: bool) -> Self {
        let width = picture.width();
        let (steps, limit) = if by_columns { ([1, width], picture.height()) } else { ([width, 1], width) };
        Self { levels: picture.levels(), steps, limit }
    }

    /// Pixels of a section around a centre; `None` if they are not all in the picture.
    pub(crate) fn pixels(&self, centre: f64, reach: f64) -> Option<std::ops::RangeInclusive<usize>> {
        let (first, last) = ((centre - reach).ceil(), (centre + reach).floor());
        (first >= 0.0 && last < self.limit as f64 && first <= last).then_some(first as usize..=last as usize)
    }

    /// The levels of some pixels of a section.
    #[inline(always)]
    pub(crate) fn levels(
        &self,
        section: usize,
        pixels: std::ops::RangeInclusive<usize>,
    ) -> impl Iterator<Item = f32> + '_ {
        let [along, across] = self.steps;
        let start = section * along;
        let (first, last) = (start + pixels.start() * across, start + pixels.end() * across);
        self.levels[first..=last].iter().step_by(across).map(|level| (*level).into())
    }

    /// Mean level of some pixels of a section from one on.
    #[inline(always)]
    pub(crate) fn mean<const COUNT: usize>(&self, section: usize, first: usize) -> f32 {
        let [along, across] = self.steps;
        let start = section * along + first * across;
        let levels: [f32; COUNT] = std::array::from_fn(|k| self.levels[start + k * across].into());
        levels.iter().sum::<f32>() / COUNT as f32
    }
}
