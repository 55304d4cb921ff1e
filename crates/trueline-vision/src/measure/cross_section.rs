//! Sections through the stripe: its measurement in one column, or row, of the picture.

use crate::measure::section_view::SectionView;
use crate::measure::stripe_end::{BANDS, BandSection};
use crate::measure::template::{Stack, Template};
use crate::measure::track::Station;
use crate::picture::Level;

/// Sections that share a background.
pub(crate) const BLOCK: usize = 16;
/// Pixels next to the stripe that give the background.
pub(crate) const BESIDE: usize = 4;
/// One in this number of sections measures the background.
const ASKED: usize = 4;
/// Sections to each side over which the amplitude is averaged.
const SMOOTH: usize = 6;

/// Levels to both sides of the stripe.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Background {
    pub(crate) below: f32,
    pub(crate) above: f32,
}

/// The level beside the stripe, on each side, for each block of stations; `shared` of them, [`BLOCK`] at most, are a block.
#[inline(always)]
pub(crate) fn backgrounds_beside<L: Level>(
    view: &SectionView<'_, L>,
    stations: &[Station],
    (reach_px, shared): (f64, usize),
    backgrounds: &mut Vec<Background>,
) {
    backgrounds.clear();
    let mut last = Background::default();
    for block in stations.chunks(shared) {
        let mut sides = [[0.0_f32; BLOCK / ASKED]; 2];
        let mut count = 0;
        for station in block.iter().step_by(ASKED) {
            let reach = reach_px * station.stretch.abs() + BESIDE as f64 + 1.0;
            let Some(pixels) = view.pixels(station.centre, reach) else { continue };
            let (first, end) = (*pixels.start(), *pixels.end() + 1);
            for (side, from) in sides.iter_mut().zip([first, end - BESIDE]) {
                side[count] = view.mean::<BESIDE>(station.at, from);
            }
            count += 1;
        }
        if count > 0 {
            // The median: spatter beside the stripe is not background.
            let [below, above] = sides.map(|mut side| {
                let side = &mut side[..count];
                *side.select_nth_unstable_by(count / 2, f32::total_cmp).1
            });
            last = Background { below, above };
        }
        backgrounds.push(last);
    }
}

/// The stripe at one section.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CrossSection {
    /// Distance along the line, px.
    pub s: f64,
    /// Column (or row) of the section.
    pub(crate) at: usize,
    /// Amplitude of the stripe on the line, averaged over neighbours, in levels.
    pub amplitude: f64,
    /// Amplitude at this section alone.
    pub own_amplitude: f64,
    /// Level beside the stripe.
    pub(crate) background: f64,
    /// Odd-weighted sum: the effect of a shift.
    pub(crate) tilt: f64,
    /// The same of the stripe's ridge alone.
    pub(crate) ridge_tilt: f64,
    /// Change of `tilt` with a shift, per px and gain, in levels.
    pub(crate) response: f64,
    pub(crate) stretch: f64,
}

/// One section for each station with all its pixels in the picture.
#[inline(always)]
pub(crate) fn section_stripe<L: Level>(
    view: &SectionView<'_, L>,
    stations: &[Station],
    (backgrounds, shared): (&[Background], usize),
    template: &Template,
    sections: &mut Vec<CrossSection>,
) {
    for (block, background) in stations.chunks(shared).zip(backgrounds) {
        for station in block {
            let reach = template.reach_px * station.stretch.abs();
            let Some(pixels) = view.pixels(station.centre, reach) else { continue };
            let middle = 0.5 * (background.below + background.above);
            let slope = (background.above - background.below) / (2.0 * reach as f32 + BESIDE as f32 + 2.0);
            let first = *pixels.start() as f64 - station.centre;
            let mut behind = middle + slope * first as f32;
            let levels = view.levels(station.at, pixels).map(|level| {
                let above = level - behind;
                behind += slope;
                above
            });
            let [tilt, even, response, ridge_tilt] =
                template.weigh(first / station.stretch, 1.0 / station.stretch, levels);
            let stretch = station.stretch.abs();
            sections.push(CrossSection {
                s: station.s,
                at: station.at,
                amplitude: 0.0,
                own_amplitude: f64::from(even) / (template.energy * stretch),
                background: f64::from(middle),
                tilt: f64::from(tilt),
                ridge_tilt: f64::from(ridge_tilt),
                response: f64::from(response) / stretch,
                stretch,
            });
        }
    }
}

/// The light at a station, band by band; `None` if the stripe is not all in the picture there.
pub(crate) fn band_section<L: Level>(
    view: &SectionView<'_, L>,
    station: &Station,
    background: &Background,
    width_px: f64,
) -> Option<BandSection> {
    let half_px = 0.5 * BANDS as f64 * width_px;
    let pixels = view.pixels(station.centre, half_px * station.stretch.abs() + 0.5)?;
    let middle = 0.5 * f64::from(background.below + background.above);
    // A pixel counts in each band as far as it covers it: whole ones would brighten and dim a band on a flank with the pixel grid.
    let (mut light, mut covered) = ([0.0; BANDS], [0.0_f64; BANDS]);
    let half_pixel = 0.5 / (station.stretch.abs() * width_px);
    for (pixel, level) in pixels.clone().zip(view.levels(station.at, pixels)) {
        let middle_of = ((pixel as f64 - station.centre) / station.stretch + half_px) / width_px;
        let [from, to] = [middle_of - half_pixel, middle_of + half_pixel];
        for band in from.max(0.0) as usize..BANDS.min((to + 1.0).max(0.0) as usize) {
            let part = (to.min(band as f64 + 1.0) - from.max(band as f64)).max(0.0);
            light[band] += part * (f64::from(level) - middle);
            covered[band] += part;
        }
    }
    for (light, covered) in light.iter_mut().zip(covered) {
        *light /= covered.max(f64::MIN_POSITIVE);
    }
    Some(BandSection { s: station.s, light })
}

/// Adds the stripe at each station to a stack, scaled to amplitude one.
#[inline(always)]
pub(crate) fn stack_stripe<L: Level>(
    (view, stations, backgrounds, shared): &(SectionView<'_, L>, &[Station], &[Background], usize),
    sections: &[CrossSection],
    least: f64,
    reach_px: f64,
    stack: &mut Stack,
) {
    let mut sections = sections.iter().peekable();
    let rising = stations.first().zip(stations.last()).is_some_and(|(first, last)| first.at <= last.at);
    for (block, background) in stations.chunks(*shared).zip(*backgrounds) {
        for station in block {
            // Not every station has been measured, and the line has moved since: some at its ends have gone.
            let passed = |section: &&CrossSection| {
                if rising { section.at < station.at } else { section.at > station.at }
            };
            while sections.next_if(passed).is_some() {}
            let Some(section) = sections.next_if(|section| section.at == station.at) else { continue };
            let reach = reach_px * station.stretch.abs();
            let Some(pixels) = view.pixels(station.centre, reach) else { continue };
            if section.amplitude <= least {
                continue;
            }
            let (per_px, scale) = ((1.0 / station.stretch) as f32, (1.0 / section.amplitude) as f32);
            let middle = 0.5 * (background.below + background.above);
            let mut distance = (*pixels.start() as f64 - station.centre) as f32 * per_px;
            for level in view.levels(station.at, pixels) {
                stack.add(distance, (level - middle) * scale);
                distance += per_px;
            }
        }
    }
}

/// Moving average over neighbours.
pub(crate) fn smooth_amplitudes(sections: &mut [CrossSection]) {
    let count = sections.len();
    let mut sum = 0.0;
    let mut held = 0_usize;
    for k in 0..count + SMOOTH {
        if k < count {
            sum += sections[k].own_amplitude;
            held += 1;
        }
        if k > 2 * SMOOTH {
            sum -= sections[k - 2 * SMOOTH - 1].own_amplitude;
            held -= 1;
        }
        if k >= SMOOTH {
            sections[k - SMOOTH].amplitude = sum / held as f64;
        }
    }
}
