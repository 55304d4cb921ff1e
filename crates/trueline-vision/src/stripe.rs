//! The stripe along a piece: its middle at every cut, and the line through them.

use crate::cut::{BESIDE, BLOCK, Background, Cut, band_cut, cut_stripe, smooth_amplitudes, stack_stripe};
use crate::edge::{BANDS, BandCut, COVERED};
use crate::fastest::fastest;
use crate::lens::Lens;
use crate::line::Line2;
use crate::picture::{Level, Picture};
use crate::regression::{Regression, Regressor, Shift, median};
use crate::template::{Stack, Template};
use crate::track::Track;
use crate::view::View;
use nalgebra::Vector2;

/// Cuts over which light is averaged to tell a gap from a dark grain of speckle.
const DARK_CUTS: usize = 5;
/// A stripe is there if it has this part of its usual amplitude.
const PRESENT: f64 = 0.25;

/// Beginnings of an arm that are tried without, px, and the longest as a part of the arm.
const STARTS_PX: [f64; 3] = [240.0, 120.0, 60.0];
const LONGEST_START: f64 = 0.3;
/// Standard deviations, and px, by which a beginning must be off to be left out: grey levels of a picture without
/// noise bend it by some hundredths of a pixel.
const BENT: f64 = 4.0;
const BENT_PX: f64 = 0.15;

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
        self.regression.variance_at(self.regression.centre + s)
    }
}

/// A point of the stripe's centre line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Middle {
    /// Ideal pixel.
    pub ideal: Vector2<f64>,
    /// Standard deviation across the stripe, px; along it a point is where its cut is.
    pub sigma_px: f64,
}

/// Whether the first shifts lie beside the line of all by more than two standard deviations of their mean: only
/// then is it worth a fit of their own.
fn hangs_off(start: &[Shift], all: &Regression) -> bool {
    let (mut sum, mut count) = (0.0, 0.0);
    for shift in start.iter().filter(|shift| shift.weight > 0.0) {
        let sigmas = (shift.shift_px - shift.response * all.shift_at(shift.s)) / all.sigma_px;
        sum += sigmas.clamp(-3.0, 3.0);
        count += 1.0;
    }
    // The covariance says how many shifts are worth one: neighbours share their speckle.
    let shared = all.covariance.m11 * all.count / (all.sigma_px * all.sigma_px);
    sum * sum > 4.0 * count * shared.max(1.0)
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
            // Exactly dark cuts have no amplitude to divide by.
            let response = if there { cut.response / cut.amplitude } else { 0.0 };
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

    /// The stripe's centre line: its middle at every cut of the last fit that shows it, along the line that was fitted
    /// from, and the standard deviation of each square to that line.
    pub fn middles<'a>(&'a self, line: &'a Line2, fit: &'a Fit) -> impl Iterator<Item = Middle> + 'a {
        self.shifts.iter().filter(|shift| shift.weight > 0.0).map(|shift| Middle {
            ideal: line.at(shift.s) + line.normal() * shift.shift_px,
            sigma_px: fit.regression.sigma_px,
        })
    }

    /// The last fit without its beginning, if that does not lie on the line of the rest: mirrored light near a
    /// corner pulls many cuts a little, and none of them far enough to be an outlier by itself.
    pub fn without_bent_start(&mut self, line: &Line2, fit: Fit) -> Fit {
        let Some([first, last]) = self.shifts.first().zip(self.shifts.last()).map(|(a, b)| [a.s, b.s]) else {
            return fit;
        };
        for start_px in STARTS_PX.into_iter().filter(|start_px| *start_px < LONGEST_START * (last - first)) {
            let split = self.shifts.partition_point(|shift| shift.s < first + start_px);
            let (start, rest) = self.shifts.split_at(split);
            if !hangs_off(start, &fit.regression) {
                continue;
            }
            let (Some(start), Some(rest)) = (self.regressor.fit(start), self.regressor.fit(rest)) else {
                continue;
            };
            let off = start.shift_px - rest.shift_at(start.centre);
            let variance = start.covariance.m11 + rest.variance_at(start.centre);
            if off.abs() > BENT_PX && off * off > BENT * BENT * variance {
                let at = Line2 { point: line.at(rest.centre), along: line.along };
                return Fit { line: at.moved(rest.shift_px, rest.slope), regression: rest, ..fit };
            }
        }
        fit
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
            for station in block.iter().step_by(4) {
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
