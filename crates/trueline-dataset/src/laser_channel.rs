//! The channel of colour pictures that the laser lights.

use crate::decoded_picture::DecodedPicture;
use crate::gray_png::{GrayImage, Pixels};

/// Weights of red, green and blue in a gray level \[ITU-R BT.601\], as JPEG has them too.
const LUMA: [f64; 3] = [0.299, 0.587, 0.114];
/// Part of the pixels that a stripe lights.
const STRIPE: f64 = 0.005;
/// A channel must stand out by so many times what the gray levels do to be preferred to them.
const CLEARLY: f64 = 1.05;
const BINS: usize = 256;

/// What of a colour picture is looked at.
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

    /// The channel in which the brightest half percent of pictures stands out most; gray where none does clearly.
    #[must_use]
    pub(crate) fn of_laser<'a>(pictures: impl Iterator<Item = &'a DecodedPicture>) -> Self {
        let mut sums = [0.0; 4];
        for picture in pictures.filter(|picture| picture.channels >= 3) {
            for (sum, channel) in sums.iter_mut().zip(Self::ALL) {
                *sum += channel.excess(picture);
            }
        }
        let gray = sums[0];
        let best = Self::ALL.into_iter().zip(sums).max_by(|a, b| a.1.total_cmp(&b.1));
        best.filter(|(_, sum)| *sum > CLEARLY * gray).map_or(Self::Gray, |(channel, _)| channel)
    }

    /// Mean of the brightest pixels above the median, as a part of full scale.
    fn excess(self, picture: &DecodedPicture) -> f64 {
        let mut counts = [0_usize; BINS];
        match &picture.levels {
            Pixels::Eight(levels) => {
                levels.chunks_exact(picture.channels).for_each(|p| counts[self.level(p) as usize] += 1);
            }
            Pixels::Sixteen(levels) => {
                levels
                    .chunks_exact(picture.channels)
                    .for_each(|p| counts[self.level(p) as usize / BINS] += 1);
            }
        }
        let total: usize = counts.iter().sum();
        let stripe = ((STRIPE * total as f64) as usize).max(1);
        let (mut taken, mut light) = (0, 0.0);
        for (level, count) in counts.iter().enumerate().rev() {
            let some = (*count).min(stripe - taken);
            taken += some;
            light += (some * level) as f64;
        }
        let mut seen = 0;
        let median = counts.iter().position(|count| {
            seen += count;
            2 * seen >= total
        });
        (light / stripe as f64 - median.unwrap_or(0) as f64) / (BINS - 1) as f64
    }

    /// The level of a pixel with one to four channels; opacity does not count.
    fn level<L: Copy + Into<f64>>(self, pixel: &[L]) -> f64 {
        let [red, green, blue] = match pixel {
            [r, g, b, ..] => [(*r).into(), (*g).into(), (*b).into()],
            [level, ..] => return (*level).into(),
            [] => return 0.0,
        };
        match self {
            Self::Gray => (LUMA[0] * red + LUMA[1] * green + LUMA[2] * blue).round(),
            Self::Red => red,
            Self::Green => green,
            Self::Blue => blue,
        }
    }

    /// This channel of a picture.
    #[must_use]
    pub fn image(self, picture: DecodedPicture) -> GrayImage {
        let DecodedPicture { width, height, channels, levels } = picture;
        let pixels = match levels {
            levels if channels == 1 => levels,
            Pixels::Eight(levels) => {
                Pixels::Eight(levels.chunks_exact(channels).map(|p| self.level(p) as u8).collect())
            }
            Pixels::Sixteen(levels) => {
                Pixels::Sixteen(levels.chunks_exact(channels).map(|p| self.level(p) as u16).collect())
            }
        };
        GrayImage { width, height, pixels }
    }
}
