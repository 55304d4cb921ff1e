//! The stripe along a piece: its middle at every cut, and the line through them.

use crate::edge::{BANDS, BandCut, COVERED};
use crate::fastest::fastest;
use crate::lens::Lens;
use crate::line::Line2;
use crate::picture::{Level, Picture};
use crate::regression::{Regression, Regressor, Shift, median};
use crate::template::{Stack, Template};
use crate::track::{Station, Track};

/// Cuts that share a background.
const BLOCK: usize = 16;
/// Pixels beside the stripe from which the background is taken.
const BESIDE: usize = 4;
/// Cuts to each side over which the amplitude is averaged.
const SMOOTH: usize = 6;
/// Cuts over which light is averaged to tell a gap from a dark grain of speckle.
const DARK_CUTS: usize = 5;
/// A stripe is there if it has this part of its usual amplitude.
const PRESENT: f64 = 0.25;

/// Levels to both sides of the stripe.
#[derive(Clone, Copy, Debug, Default)]
struct Background {
    below: f32,
    above: f32,
}

/// The stripe at one cut.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cut {
    /// Distance along the line, px.
    pub s: f64,
    /// Column (or row) of the cut.
    at: usize,
    /// Amplitude of the stripe on the line, averaged over neighbours, in levels.
    pub amplitude: f64,
    /// Amplitude at this cut alone.
    pub own_amplitude: f64,
    /// Level beside the stripe.
    background: f64,
    /// Odd-weighted sum: what a shift adds.
    tilt: f64,
    /// What a shift adds to `tilt`, per px and gain, in levels.
    response: f64,
    stretch: f64,
}

/// A measured piece of stripe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fit {
    /// Its line in the ideal picture; its point is where the regression is centred.
    pub line: Line2,
    /// The regression about the line that it was measured from.
    pub regression: Regression,
    /// Usual amplitude, in levels.
    pub amplitude: f64,
    /// Part of the cuts that show the stripe.
    pub present: f64,
    /// Cuts that show it.
    pub cuts: usize,
}

impl Fit {
    /// Variance of the line square to itself at a distance along it from its point, px².
    #[must_use]
    pub fn variance_at(&self, s: f64) -> f64 {
        let c = &self.regression.covariance;
        c.m11 + 2.0 * c.m12 * s + c.m22 * s * s
    }
}

/// Measures stripes; memory is kept from one to the next.
#[derive(Clone, Debug, Default)]
pub struct StripeMeter {
    track: Track,
    backgrounds: Vec<Background>,
    cuts: Vec<Cut>,
    shifts: Vec<Shift>,
    regressor: Regressor,
    stack: Stack,
    sorted: Vec<f64>,
    dark: Vec<[f64; 2]>,
}

impl StripeMeter {
    /// The cuts of the last measurement.
    #[must_use]
    pub fn cuts(&self) -> &[Cut] {
        &self.cuts
    }

    /// The light along a line in bands beside each other; returns the width of a band, px.
    pub fn bands<L: Level>(
        &mut self,
        line: &Line2,
        span: [f64; 2],
        template: &Template,
        scene: (&Picture<'_, L>, &Lens),
        cuts: &mut Vec<BandCut>,
    ) -> f64 {
        let width_px = 2.0 * COVERED * template.reach_px / BANDS as f64;
        self.track.lay(line, span, scene);
        self.measure_background(template.reach_px, scene.0);
        let view = View::new(scene.0, self.track.by_columns);
        cuts.clear();
        for (block, background) in self.track.stations.chunks(BLOCK).zip(&self.backgrounds) {
            cuts.extend(block.iter().filter_map(|station| band_cut(&view, station, background, width_px)));
        }
        width_px
    }

    /// Stretches of the last cuts, along the line, in which there is less than a part of the stripe's usual
    /// light. Where sparks beside the stripe make its surroundings bright, it is not taken for dark.
    pub fn dark_stretches(&mut self, part: f64) -> &[[f64; 2]] {
        let usual = self.usual_amplitude();
        self.sorted.clear();
        self.sorted.extend(self.cuts.iter().map(|cut| cut.background));
        let ground = median(&mut self.sorted);
        let light = |cut: &Cut| cut.own_amplitude.max(0.0) + (cut.background - ground).max(0.0);
        let stretches = &mut self.dark;
        stretches.clear();
        let mut before_dark = false;
        for around in self.cuts.windows(DARK_CUTS) {
            let mean = around.iter().map(light).sum::<f64>() / around.len() as f64;
            let dark = mean < part * usual;
            let s = around[DARK_CUTS / 2].s;
            match stretches.last_mut() {
                Some(stretch) if dark && before_dark => stretch[1] = s,
                _ if dark => stretches.push([s, s]),
                _ => {}
            }
            before_dark = dark;
        }
        &self.dark
    }

    /// Measures the stripe along a stretch of a line that is known to a few px. `None` if there is too little
    /// of it.
    pub fn fit<L: Level>(
        &mut self,
        line: &Line2,
        span: [f64; 2],
        sigma_px: f64,
        scene: (&Picture<'_, L>, &Lens),
    ) -> Option<(Fit, Template)> {
        let (first, template) = self.learn(line, span, sigma_px, scene)?;
        // Distances along the new line count from its own point.
        let start = line.station(&first.point);
        let fit = self.fit_with(&first, [span[0] - start, span[1] - start], &template, scene)?;
        Some((fit, template))
    }

    /// A first look with broad weights at every second cut: the line to a tenth of a pixel, and what the
    /// stripe's cross-section is.
    pub fn learn<L: Level>(
        &mut self,
        line: &Line2,
        span: [f64; 2],
        sigma_px: f64,
        scene: (&Picture<'_, L>, &Lens),
    ) -> Option<(Line2, Template)> {
        let broad = Template::gaussian(sigma_px);
        self.track.lay(line, span, scene);
        self.track.thin();
        self.cut_track(&broad, scene);
        let first = self.regress(line, &broad)?;
        let start = line.station(&first.line.point);
        self.track.lay_again(&first.line, [span[0] - start, span[1] - start], scene);
        // Flanks reach further than the broad weights do.
        let template = self.stack(PRESENT * first.amplitude, 1.5 * broad.reach_px, scene.0)?;
        Some((first.line, template))
    }

    /// Measures with given weights.
    pub fn fit_with<L: Level>(
        &mut self,
        line: &Line2,
        span: [f64; 2],
        template: &Template,
        scene: (&Picture<'_, L>, &Lens),
    ) -> Option<Fit> {
        self.cut(line, span, template, scene);
        self.regress(line, template)
    }

    /// The line through the cuts.
    fn regress(&mut self, line: &Line2, template: &Template) -> Option<Fit> {
        let amplitude = self.usual_amplitude();
        if amplitude <= 0.0 {
            return None;
        }
        self.shifts.clear();
        let gain = template.gain;
        self.shifts.extend(self.cuts.iter().map(|cut| {
            let there = cut.amplitude > PRESENT * amplitude;
            let per_px = cut.amplitude * gain * cut.stretch;
            let shift_px = if there { cut.tilt / per_px } else { 0.0 };
            let response = cut.response / cut.amplitude;
            Shift { s: cut.s, shift_px, weight: f64::from(u8::from(there)), response }
        }));
        let regression = self.regressor.fit(&self.shifts)?;
        let cuts = self.shifts.iter().filter(|shift| shift.weight > 0.0).count();
        let at = Line2 { point: line.at(regression.centre), along: line.along };
        Some(Fit {
            line: at.moved(regression.shift_px, regression.slope),
            regression,
            amplitude,
            present: cuts as f64 / self.cuts.len().max(1) as f64,
            cuts,
        })
    }

    /// Cuts the stripe along a line.
    pub fn cut<L: Level>(
        &mut self,
        line: &Line2,
        span: [f64; 2],
        template: &Template,
        scene: (&Picture<'_, L>, &Lens),
    ) {
        self.track.lay(line, span, scene);
        self.cut_track(template, scene);
    }

    fn cut_track<L: Level>(&mut self, template: &Template, scene: (&Picture<'_, L>, &Lens)) {
        self.measure_background(template.reach_px, scene.0);
        self.cuts.clear();
        let view = View::new(scene.0, self.track.by_columns);
        fastest!(cut_stripe(&view, &self.track.stations, &self.backgrounds, template, &mut self.cuts));
        smooth_amplitudes(&mut self.cuts);
    }

    /// The template of the stripe on the track; amplitudes are those of the last cuts.
    fn stack<L: Level>(&mut self, least: f64, reach_px: f64, picture: &Picture<'_, L>) -> Option<Template> {
        self.measure_background(reach_px, picture);
        self.stack.clear();
        let view = View::new(picture, self.track.by_columns);
        let scene = (view, self.track.stations.as_slice(), self.backgrounds.as_slice());
        fastest!(stack_stripe(&scene, &self.cuts, least, reach_px, &mut self.stack));
        self.stack.template()
    }

    /// The level beside the stripe, on each side, for each block of cuts.
    fn measure_background<L: Level>(&mut self, reach_px: f64, picture: &Picture<'_, L>) {
        let view = View::new(picture, self.track.by_columns);
        self.backgrounds.clear();
        let mut last = Background::default();
        for block in self.track.stations.chunks(BLOCK) {
            let mut sides = [[0.0_f32; BLOCK]; 2];
            let mut count = 0;
            for station in block.iter().step_by(2) {
                let reach = reach_px * station.stretch.abs() + BESIDE as f64 + 1.0;
                let Some(pixels) = view.pixels(station.centre, reach) else { continue };
                let (first, end) = (*pixels.start(), *pixels.end() + 1);
                for (side, from) in sides.iter_mut().zip([first, end - BESIDE]) {
                    let levels = view.levels(station.at, from..=from + BESIDE - 1);
                    side[count] = levels.sum::<f32>() / BESIDE as f32;
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
            self.backgrounds.push(last);
        }
    }

    /// Three quarters of the way up among the amplitudes: right with half of the stripe missing.
    fn usual_amplitude(&mut self) -> f64 {
        self.sorted.clear();
        self.sorted.extend(self.cuts.iter().map(|cut| cut.amplitude));
        if self.sorted.is_empty() {
            return 0.0;
        }
        let at = self.sorted.len() * 3 / 4;
        *self.sorted.select_nth_unstable_by(at, f64::total_cmp).1
    }
}

/// One cut for each station whose pixels are all in the picture.
#[inline(always)]
fn cut_stripe<L: Level>(
    view: &View<'_, L>,
    stations: &[Station],
    backgrounds: &[Background],
    template: &Template,
    cuts: &mut Vec<Cut>,
) {
    for (block, background) in stations.chunks(BLOCK).zip(backgrounds) {
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
            let [tilt, even, response, _] =
                template.weigh(first / station.stretch, 1.0 / station.stretch, levels);
            let stretch = station.stretch.abs();
            cuts.push(Cut {
                s: station.s,
                at: station.at,
                amplitude: 0.0,
                own_amplitude: f64::from(even) / (template.energy * stretch),
                background: f64::from(middle),
                tilt: f64::from(tilt),
                response: f64::from(response) / stretch,
                stretch,
            });
        }
    }
}

/// The light at a station, band by band; `None` if the stripe is not all in the picture there.
fn band_cut<L: Level>(
    view: &View<'_, L>,
    station: &Station,
    background: &Background,
    width_px: f64,
) -> Option<BandCut> {
    let half_px = 0.5 * BANDS as f64 * width_px;
    let pixels = view.pixels(station.centre, half_px * station.stretch.abs())?;
    let middle = 0.5 * f64::from(background.below + background.above);
    let (mut light, mut counts) = ([0.0; BANDS], [0.0_f64; BANDS]);
    for (pixel, level) in pixels.clone().zip(view.levels(station.at, pixels)) {
        let distance = (pixel as f64 - station.centre) / station.stretch + half_px;
        let band = ((distance / width_px).max(0.0) as usize).min(BANDS - 1);
        light[band] += f64::from(level) - middle;
        counts[band] += 1.0;
    }
    // A band narrower than a pixel may hold none: its neighbour's light is the nearest there is.
    let mut last = 0.0;
    for (light, count) in light.iter_mut().zip(counts) {
        *light = if count > 0.0 { *light / count } else { last };
        last = *light;
    }
    Some(BandCut { s: station.s, light })
}

/// Adds the stripe at each station to a stack, scaled to amplitude one.
#[inline(always)]
fn stack_stripe<L: Level>(
    (view, stations, backgrounds): &(View<'_, L>, &[Station], &[Background]),
    cuts: &[Cut],
    least: f64,
    reach_px: f64,
    stack: &mut Stack,
) {
    let mut cuts = cuts.iter().peekable();
    let rising = stations.first().zip(stations.last()).is_some_and(|(first, last)| first.at <= last.at);
    for (block, background) in stations.chunks(BLOCK).zip(*backgrounds) {
        for station in block {
            // Not every station has been cut, and the line has moved since: some at its ends have gone.
            let passed = |cut: &&Cut| if rising { cut.at < station.at } else { cut.at > station.at };
            while cuts.next_if(passed).is_some() {}
            let Some(cut) = cuts.next_if(|cut| cut.at == station.at) else { continue };
            let reach = reach_px * station.stretch.abs();
            let Some(pixels) = view.pixels(station.centre, reach) else { continue };
            if cut.amplitude <= least {
                continue;
            }
            let (per_px, scale) = ((1.0 / station.stretch) as f32, (1.0 / cut.amplitude) as f32);
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
fn smooth_amplitudes(cuts: &mut [Cut]) {
    let count = cuts.len();
    let mut sum = 0.0;
    let mut held = 0_usize;
    for k in 0..count + SMOOTH {
        if k < count {
            sum += cuts[k].own_amplitude;
            held += 1;
        }
        if k > 2 * SMOOTH {
            sum -= cuts[k - 2 * SMOOTH - 1].own_amplitude;
            held -= 1;
        }
        if k >= SMOOTH {
            cuts[k - SMOOTH].amplitude = sum / held as f64;
        }
    }
}

/// A picture read along columns or along rows.
struct View<'a, L> {
    levels: &'a [L],
    /// From one cut to the next, and from one pixel of a cut to the next.
    steps: [usize; 2],
    limit: usize,
}

impl<'a, L: Level> View<'a, L> {
    fn new(picture: &Picture<'a, L>, by_columns: bool) -> Self {
        let width = picture.width();
        let (steps, limit) = if by_columns { ([1, width], picture.height()) } else { ([width, 1], width) };
        Self { levels: picture.levels(), steps, limit }
    }

    /// Pixels of a cut around a centre; `None` if they are not all in the picture.
    fn pixels(&self, centre: f64, reach: f64) -> Option<std::ops::RangeInclusive<usize>> {
        let (first, last) = ((centre - reach).ceil(), (centre + reach).floor());
        (first >= 0.0 && last < self.limit as f64 && first <= last).then_some(first as usize..=last as usize)
    }

    /// The levels of some pixels of a cut.
    #[inline(always)]
    fn levels(&self, cut: usize, pixels: std::ops::RangeInclusive<usize>) -> impl Iterator<Item = f32> + '_ {
        let [along, across] = self.steps;
        let start = cut * along;
        let (first, last) = (start + pixels.start() * across, start + pixels.end() * across);
        self.levels[first..=last].iter().step_by(across).map(|level| (*level).into())
    }
}
