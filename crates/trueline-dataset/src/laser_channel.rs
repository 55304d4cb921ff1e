//! The channel of colour pictures that the laser lights.

use crate::decoded_picture::DecodedPicture;
use crate::gray_png::{GrayImage, Pixels};

/// Weights of red, green and blue in a gray level \[ITU-R BT.601\], as JPEG has them too.
const LUMA: [f64; 3] = [0.299, 0.587, 0.114];
/// Side of a tile, px, and the part of the tiles that a stripe crosses.
const TILE: usize = 16;
const STRIPE: f64 = 0.01;
/// A channel must stand out this many times more than gray to be preferred to it.
const CLEARLY: f64 = 1.05;

/// The channel used of a colour picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Channel {
    /// The gray level of all three.
    #[default]
    Gray,
    /// Red alone.
    Red,
    /// Green alone.
    Green,
    /// Blue alone.
    Blue,
}

impl Channel {
    /// Every channel.
    pub const ALL: [Self; 4] = [Self::Gray, Self::Red, Self::Green, Self::Blue];

    /// Its name.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Gray => "gray",
            Self::Red => "red",
            Self::Green => "green",
            Self::Blue => "blue",
        }
    }

    /// The channel with the most prominent bright spots; gray if none is clearly better.
    #[must_use]
    pub(crate) fn of_laser<'a>(pictures: impl Iterator<Item = &'a DecodedPicture>) -> Self {
        let sums = sums_of_excess(pictures, Self::level);
        let gray = sums[0];
        let best = Self::ALL.into_iter().zip(sums).max_by(|a, b| a.1.total_cmp(&b.1));
        best.filter(|(_, sum)| *sum > CLEARLY * gray).map_or(Self::Gray, |(channel, _)| channel)
    }

    /// The channel that exceeds the other two most, relative to the rest of the picture: only the laser has its colour.
    #[must_use]
    pub(crate) fn of_colour<'a>(pictures: impl Iterator<Item = &'a DecodedPicture>) -> Self {
        let sums = sums_of_excess(pictures, Self::above_others);
        let best = Self::ALL.into_iter().zip(sums).max_by(|a, b| a.1.total_cmp(&b.1));
        best.map_or(Self::Gray, |(channel, _)| channel)
    }

    /// Height of the brightest pixel above the mean of its tile, in the tiles with the largest height, as a part of full
    /// scale. If the channel is saturated, or a surface glows, all of a tile is bright.
    fn excess(self, picture: &DecodedPicture, level: impl Fn(Self, [f64; 3]) -> f64 + Copy) -> f64 {
        match &picture.levels {
            Pixels::Eight(levels) => self.excess_of(picture, levels, level) / f64::from(u8::MAX),
            Pixels::Sixteen(levels) => self.excess_of(picture, levels, level) / f64::from(u16::MAX),
        }
    }

    fn excess_of<L: Copy + Into<f64>>(
        self,
        picture: &DecodedPicture,
        levels: &[L],
        level: impl Fn(Self, [f64; 3]) -> f64 + Copy,
    ) -> f64 {
        let columns = picture.width.div_ceil(TILE);
        let mut tiles = vec![[0.0_f64; 3]; columns * picture.height.div_ceil(TILE)];
        let rows = levels.chunks_exact((picture.width * picture.channels).max(1)).enumerate();
        for (v, row) in rows {
            for (u, pixel) in row.chunks_exact(picture.channels).enumerate() {
                let level = level(self, rgb(pixel));
                let [peak, sum, count] = &mut tiles[v / TILE * columns + u / TILE];
                (*peak, *sum, *count) = (peak.max(level), *sum + level, *count + 1.0);
            }
        }
        let mut excess: Vec<f64> =
            tiles.iter().map(|[peak, sum, count]| peak - sum / count.max(1.0)).collect();
        let most = ((STRIPE * excess.len() as f64) as usize).clamp(1, excess.len().max(1));
        excess.sort_unstable_by(|a, b| b.total_cmp(a));
        excess.iter().take(most).sum::<f64>() / most as f64
    }

    /// The level of a pixel.
    fn level(self, [red, green, blue]: [f64; 3]) -> f64 {
        match self {
            Self::Gray => (LUMA[0] * red + LUMA[1] * green + LUMA[2] * blue).round(),
            Self::Red => red,
            Self::Green => green,
            Self::Blue => blue,
        }
    }

    /// Excess of a pixel's channel over both other channels; zero if negative, and for gray.
    fn above_others(self, [red, green, blue]: [f64; 3]) -> f64 {
        let above = match self {
            Self::Gray => 0.0,
            Self::Red => red - green.max(blue),
            Self::Green => green - red.max(blue),
            Self::Blue => blue - red.max(green),
        };
        above.max(0.0)
    }

    /// This channel of a picture.
    #[must_use]
    pub fn image(self, picture: DecodedPicture) -> GrayImage {
        if picture.channels == 1 {
            let DecodedPicture { width, height, levels, .. } = picture;
            return GrayImage { width, height, pixels: levels };
        }
        self.image_of(&picture, Self::level)
    }

    /// How far this channel of a picture stands above both others.
    #[must_use]
    pub(crate) fn colour_image(self, picture: &DecodedPicture) -> GrayImage {
        self.image_of(picture, Self::above_others)
    }

    fn image_of(self, picture: &DecodedPicture, level: impl Fn(Self, [f64; 3]) -> f64 + Copy) -> GrayImage {
        let DecodedPicture { width, height, channels, levels } = picture;
        let pixels = match levels {
            Pixels::Eight(levels) => {
                Pixels::Eight(levels.chunks_exact(*channels).map(|p| level(self, rgb(p)) as u8).collect())
            }
            Pixels::Sixteen(levels) => {
                Pixels::Sixteen(levels.chunks_exact(*channels).map(|p| level(self, rgb(p)) as u16).collect())
            }
        };
        GrayImage { width: *width, height: *height, pixels }
    }
}

/// How far each channel stands out in colour pictures, where of a pixel's red, green and blue it looks at a level.
fn sums_of_excess<'a>(
    pictures: impl Iterator<Item = &'a DecodedPicture>,
    level: impl Fn(Channel, [f64; 3]) -> f64 + Copy,
) -> [f64; 4] {
    let mut sums = [0.0; 4];
    for picture in pictures.filter(|picture| picture.channels >= 3) {
        for (sum, channel) in sums.iter_mut().zip(Channel::ALL) {
            *sum += channel.excess(picture, level);
        }
    }
    sums
}

/// Red, green and blue of a pixel with one to four channels; opacity does not count.
fn rgb<L: Copy + Into<f64>>(pixel: &[L]) -> [f64; 3] {
    match pixel {
        [r, g, b, ..] => [(*r).into(), (*g).into(), (*b).into()],
        [level, ..] => [(*level).into(); 3],
        [] => [0.0; 3],
    }
}
