//! One channel of a mosaic of colours, at every pixel.

use crate::pixel_format::Mosaic;
use trueline_dataset::Channel;

/// Columns and rows to a neighbour.
type Step = [isize; 2];

const SELF: &[Step] = &[[0, 0]];
const BESIDE: &[Step] = &[[-1, 0], [1, 0]];
const ABOVE: &[Step] = &[[0, -1], [0, 1]];
const CROSS: &[Step] = &[[-1, 0], [1, 0], [0, -1], [0, 1]];
const CORNERS: &[Step] = &[[-1, -1], [1, -1], [-1, 1], [1, 1]];
/// Weights 1 2 1 along rows and columns: red, green and blue as 1 : 2 : 1 about every pixel of any colour.
const ALL: &[Step] = &[
    [-1, -1],
    [1, -1],
    [-1, 1],
    [1, 1],
    [-1, 0],
    [-1, 0],
    [1, 0],
    [1, 0],
    [0, -1],
    [0, -1],
    [0, 1],
    [0, 1],
    [0, 0],
    [0, 0],
    [0, 0],
    [0, 0],
];

/// A channel of a mosaic: a pixel's own level if it has that colour, else the mean of the nearest ones with it. The
/// neighbours lie evenly about it, so that nothing is moved. Gray is the mean of all around it.
pub(crate) fn plane<L: Copy + Into<u32> + TryFrom<u32> + Default>(
    levels: &[L],
    [width, height]: [usize; 2],
    mosaic: Mosaic,
    channel: Channel,
) -> Vec<L> {
    let mut plane = Vec::with_capacity(levels.len());
    for row in 0..height {
        let steps = [0, 1].map(|column| steps(mosaic, channel, [column, row % 2]));
        for column in 0..width {
            let steps = steps[column % 2];
            let level = |[right, down]: &Step| -> u32 {
                levels[beside(row, *down, height) * width + beside(column, *right, width)].into()
            };
            let sum: u32 = steps.iter().map(level).sum();
            let count = steps.len() as u32;
            plane.push(L::try_from((sum + count / 2) / count).unwrap_or_default());
        }
    }
    plane
}

/// Places of the channel about a pixel at a place modulo two.
fn steps(mosaic: Mosaic, channel: Channel, [column, row]: [usize; 2]) -> &'static [Step] {
    let red = mosaic.red();
    let own = match channel {
        Channel::Gray => return ALL,
        Channel::Green if (column + row) % 2 != (red[0] + red[1]) % 2 => return SELF,
        Channel::Green => return CROSS,
        Channel::Red => red,
        Channel::Blue => red.map(|place| 1 - place),
    };
    match (column == own[0], row == own[1]) {
        (true, true) => SELF,
        (false, true) => BESIDE,
        (true, false) => ABOVE,
        (false, false) => CORNERS,
    }
}

/// A neighbour's place. Beyond the border the mosaic continues with the pixel on the other side, which has the same
/// colour.
fn beside(at: usize, by: isize, count: usize) -> usize {
    match at.checked_add_signed(by) {
        Some(at) if at < count => at,
        _ => at.saturating_add_signed(-by).min(count.saturating_sub(1)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A picture with channels that are different planes of the pixel coordinates. Inside, linear levels are found
    /// exactly.
    fn level(channel: usize, [u, v]: [usize; 2]) -> u16 {
        (1000 * (channel + 1) + 12 * u + 20 * v) as u16
    }

    fn mosaic_of(mosaic: Mosaic, [width, height]: [usize; 2]) -> Vec<u16> {
        let [u0, v0] = mosaic.red();
        let colour = |u: usize, v: usize| match (u % 2 == u0, v % 2 == v0) {
            (true, true) => 0,
            (false, false) => 2,
            _ => 1,
        };
        (0..width * height)
            .map(|i| [i % width, i / width])
            .map(|[u, v]| level(colour(u, v), [u, v]))
            .collect()
    }

    #[test]
    fn each_channel_is_found_where_it_is_and_nothing_is_moved() {
        let size = [8, 6];
        for mosaic in [Mosaic::Gr, Mosaic::Rg, Mosaic::Gb, Mosaic::Bg] {
            let levels = mosaic_of(mosaic, size);
            for (number, channel) in [Channel::Red, Channel::Green, Channel::Blue].into_iter().enumerate() {
                let found = plane(&levels, size, mosaic, channel);
                for place in (1..5).flat_map(|v| (1..7).map(move |u| [u, v])) {
                    let found = found[place[1] * size[0] + place[0]];
                    assert_eq!(found, level(number, place), "{mosaic:?} {channel:?} {place:?}");
                }
            }
            let gray = plane(&levels, size, mosaic, Channel::Gray);
            for [u, v] in (1..5).flat_map(|v| (1..7).map(move |u| [u, v])) {
                // A quarter of red, a half of green, a quarter of blue: that of green.
                assert_eq!(gray[v * size[0] + u], level(1, [u, v]), "{mosaic:?} {u} {v}");
            }
        }
    }

    #[test]
    fn behind_the_border_colours_go_on() {
        // Red alone is bright: its plane is bright everywhere, and that of blue nowhere.
        for mosaic in [Mosaic::Gr, Mosaic::Rg, Mosaic::Gb, Mosaic::Bg] {
            let [u0, v0] = mosaic.red();
            let levels: Vec<u8> =
                (0..20).map(|i| if (i % 5) % 2 == u0 && (i / 5) % 2 == v0 { 255 } else { 0 }).collect();
            assert_eq!(plane(&levels, [5, 4], mosaic, Channel::Red), [255; 20], "{mosaic:?}");
            assert_eq!(plane(&levels, [5, 4], mosaic, Channel::Blue), [0; 20], "{mosaic:?}");
            assert_eq!(plane(&levels, [5, 4], mosaic, Channel::Green), [0; 20], "{mosaic:?}");
        }
    }
}
