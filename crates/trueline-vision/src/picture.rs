//! The picture as the detector sees it: grey levels of 8 or 16 bits, borrowed.

/// A grey level.
pub trait Level: Copy + Ord + Default + Into<f32> {
    /// Holds the sum of a few levels.
    type Sum: Copy + Default + From<Self> + Into<u32>;

    /// Two sums together. Sums of a few levels fit; nothing is checked, for a loop of checked additions is not done many at a
    /// time.
    fn together(a: Self::Sum, b: Self::Sum) -> Self::Sum;

    /// Bits by which the sum of 4^n levels must be shifted down to fit into 16 bits.
    fn excess_bits(n: u32) -> u32;
}

impl Level for u8 {
    type Sum = u16;

    #[inline(always)]
    fn together(a: u16, b: u16) -> u16 {
        a.wrapping_add(b)
    }

    fn excess_bits(n: u32) -> u32 {
        (2 * n).saturating_sub(8)
    }
}

impl Level for u16 {
    type Sum = u32;

    #[inline(always)]
    fn together(a: u32, b: u32) -> u32 {
        a.wrapping_add(b)
    }

    fn excess_bits(n: u32) -> u32 {
        2 * n
    }
}

/// A gray picture, row by row. Pixel (0, 0) is the top-left one.
#[derive(Clone, Copy, Debug)]
pub struct Picture<'a, L> {
    width: usize,
    height: usize,
    levels: &'a [L],
}

impl<'a, L: Level> Picture<'a, L> {
    /// A picture of `width` × `height` levels. `None` if that is not how many there are.
    #[must_use]
    pub fn new(width: usize, height: usize, levels: &'a [L]) -> Option<Self> {
        (levels.len() == width.checked_mul(height)? && !levels.is_empty()).then_some(Self {
            width,
            height,
            levels,
        })
    }

    /// Columns, px.
    #[must_use]
    pub fn width(&self) -> usize {
        self.width
    }

    /// Rows, px.
    #[must_use]
    pub fn height(&self) -> usize {
        self.height
    }

    /// A row.
    #[must_use]
    pub fn row(&self, row: usize) -> &'a [L] {
        &self.levels[row * self.width..(row + 1) * self.width]
    }

    /// All levels.
    #[must_use]
    pub fn levels(&self) -> &'a [L] {
        self.levels
    }
}
