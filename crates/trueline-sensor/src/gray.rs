//! A gray picture in floating point.

use nalgebra::Vector2;

/// Gray levels row by row; pixel (0, 0) is the centre of the top-left one.
#[derive(Clone, Debug)]
pub struct Gray {
    width: usize,
    height: usize,
    levels: Vec<f32>,
}

impl Gray {
    /// A picture of `width` × `height` levels; `None` if that is not how many there are.
    #[must_use]
    pub fn new(width: usize, height: usize, levels: Vec<f32>) -> Option<Self> {
        (Some(levels.len()) == width.checked_mul(height) && !levels.is_empty()).then_some(Self {
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

    /// The level of a pixel of the picture.
    #[must_use]
    pub fn at(&self, column: usize, row: usize) -> f32 {
        self.levels[row * self.width + column]
    }

    /// The level between pixels, bilinear. `None` outside the picture.
    #[must_use]
    pub fn between(&self, pixel: &Vector2<f64>) -> Option<f64> {
        let inside = pixel.x >= 0.0
            && pixel.y >= 0.0
            && pixel.x <= (self.width - 1) as f64
            && pixel.y <= (self.height - 1) as f64;
        if !inside {
            return None;
        }
        let column = (pixel.x as usize).min(self.width.saturating_sub(2));
        let row = (pixel.y as usize).min(self.height.saturating_sub(2));
        let (right, below) = ((column + 1).min(self.width - 1), (row + 1).min(self.height - 1));
        let (x, y) = (pixel.x - column as f64, pixel.y - row as f64);
        let level = |c, r| f64::from(self.at(c, r));
        let above = level(column, row) * (1.0 - x) + level(right, row) * x;
        let under = level(column, below) * (1.0 - x) + level(right, below) * x;
        Some(above * (1.0 - y) + under * y)
    }

    /// Levels in 65,536 steps from the darkest to the brightest, and the size of a step, for comparisons within one picture.
    #[must_use]
    pub fn steps(&self) -> (Vec<u16>, f64) {
        let (low, high) = (self.levels.iter())
            .fold((f32::INFINITY, f32::NEG_INFINITY), |(low, high), level| {
                (low.min(*level), high.max(*level))
            });
        let step = ((high - low) / f32::from(u16::MAX)).max(f32::MIN_POSITIVE);
        (self.levels.iter().map(|level| ((level - low) / step).round() as u16).collect(), f64::from(step))
    }

    /// Half as large in each direction, every pixel the mean of four; pixel (c, r) of it is centred at
    /// (2c + ½, 2r + ½) of this one.
    #[must_use]
    pub fn halved(&self) -> Option<Self> {
        let (width, height) = (self.width / 2, self.height / 2);
        let mean = |c: usize, r: usize| {
            0.25 * (self.at(2 * c, 2 * r)
                + self.at(2 * c + 1, 2 * r)
                + self.at(2 * c, 2 * r + 1)
                + self.at(2 * c + 1, 2 * r + 1))
        };
        let levels =
            (0..height).flat_map(|r| (0..width).map(move |c| (c, r))).map(|(c, r)| mean(c, r)).collect();
        Self::new(width, height, levels)
    }

    /// This picture less another of the same size: the light of a lamp. `None` where sizes differ.
    #[must_use]
    pub fn less(&self, other: &Self) -> Option<Self> {
        if (self.width, self.height) != (other.width, other.height) {
            return None;
        }
        let levels = self.levels.iter().zip(&other.levels).map(|(a, b)| a - b).collect();
        Self::new(self.width, self.height, levels)
    }
}
