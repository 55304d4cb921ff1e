//! Which parts of a picture the laser can reach: tiles near the stripe.

/// Side of a tile, px.
pub const TILE: usize = 16;

/// The tiles of a picture that are worked on.
#[derive(Clone, Debug)]
pub(crate) struct Patches {
    columns: usize,
    rows: usize,
    marked: Vec<bool>,
}

/// Pixels from..to in columns and rows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Patch {
    /// First column and the one after the last.
    pub columns: [usize; 2],
    /// First row and the one after the last.
    pub rows: [usize; 2],
}

impl Patches {
    /// No tiles of a picture of this size.
    #[must_use]
    pub(crate) fn none(size: [usize; 2]) -> Self {
        let [columns, rows] = size.map(|n| n.div_ceil(TILE));
        Self { columns, rows, marked: vec![false; columns * rows] }
    }

    /// Forgets all.
    pub(crate) fn clear(&mut self) {
        self.marked.fill(false);
    }

    /// Marks the tiles within `reach` px of a pixel.
    pub(crate) fn mark(&mut self, pixel: [f64; 2], reach: f64) {
        let span = |centre: f64, count: usize| {
            let low = ((centre - reach) / TILE as f64).floor().max(0.0) as usize;
            let high = ((centre + reach) / TILE as f64).floor();
            low..if high < 0.0 { 0 } else { (high as usize + 1).min(count) }
        };
        for row in span(pixel[1], self.rows) {
            for column in span(pixel[0], self.columns) {
                self.marked[row * self.columns + column] = true;
            }
        }
    }

    /// The marked tiles of a picture of this size.
    pub(crate) fn iter(&self, size: [usize; 2]) -> impl Iterator<Item = Patch> + '_ {
        self.marked.iter().enumerate().filter(|(_, marked)| **marked).map(move |(index, _)| {
            let span = |tile: usize, n: usize| [tile * TILE, ((tile + 1) * TILE).min(n)];
            Patch { columns: span(index % self.columns, size[0]), rows: span(index / self.columns, size[1]) }
        })
    }
}
