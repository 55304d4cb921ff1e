//! The stripe along a segment: its middle at every section, and the line through them.

use crate::fastest::fastest;
use crate::frame::Frame;
use crate::line::Line2;
use crate::measure::cross_section::{
    BLOCK, Background, CrossSection, backgrounds_beside, band_section, section_stripe, smooth_amplitudes,
    stack_stripe,
};
use crate::measure::regression::{Regression, Regressor, Shift, median};
use crate::measure::section_view::SectionView;
use crate::measure::stripe_end::{BANDS, BandSection, COVERED};
use crate::measure::template::{Stack, Template};
use crate::measure::track::Track;
use crate::picture::{Level, Picture};
use nalgebra::Vector2;

/// Sections over which light is averaged to separate a gap from a dark grain of speckle.
const DARK_CUTS: usize = 5;
/// A stripe is there if it has this part of its usual amplitude.
const PRESENT: f64 = 0.25;

/// Least number of sections from which a stripe is learnt, if there are as many.
const LEARNT: usize = 250;

/// Beginnings of an arm that are tried without, px, and the longest as a part of the arm.
const STARTS_PX: [f64; 3] = [240.0, 120.0, 60.0];
const LONGEST_START: f64 = 0.3;
/// Standard deviations, and px, by which a beginning must be off to be left out. Grey levels of a picture without
/// noise bend it by some hundredths of a pixel.
const BENT: f64 = 4.0;
const BENT_PX: f64 = 0.15;

/// Lengths of the stretches before an end that are fitted by themselves, px, the whole last; and by how many standard
/// deviations a longer one may differ from them.
const ENDS_PX: [f64; 5] = [80.0, 160.0, 320.0, 640.0, f64::INFINITY];
const AGREES: f64 = 2.5;

/// Parts of a stripe for the comparison of skews, the fewest, and the required number of standard deviations between their
/// mean and zero.
const SKEW_PARTS: usize = 16;
const FEWEST_PARTS: f64 = 8.0;
const SKEWED: f64 = 3.5;

/// A measured segment of stripe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fit {
    /// Its line in the ideal picture; its point is where the regression is centred.
    pub line: Line2,
    /// The line that it was measured from, about which the regression is.
    pub from: Line2,
    /// The regression about the line that it was measured from.
    pub regression: Regression,
    /// Usual amplitude, in levels.
    pub amplitude: f64,
    /// Part of the sections that show the stripe.
    pub present: f64,
    /// Sections that show it.
    pub sections: usize,
    /// Distance of its ridge from the middle of its flanks, px, if that is more than chance: a stripe with a tail on one
    /// side has no better middle. The same in all pictures.
    pub skew_px: f64,
}

impl Fit {
    /// The same with the regression over a part of its sections.
    fn over(&self, part: &Regression) -> Self {
        let at = Line2 { point: self.from.at(part.centre), along: self.from.along };
        Self { line: at.moved(part.shift_px, part.slope), regression: *part, ..*self }
    }

    /// The same with the noise of a fit over more of the stripe.
    pub(crate) fn with_noise_of(&self, more: &Self) -> Self {
        Self { regression: self.regression.with_noise_of(&more.regression), skew_px: more.skew_px, ..*self }
    }

    /// Variance of the line square to itself at a distance along it from its point, px².
    #[must_use]
    pub(crate) fn variance_at(&self, s: f64) -> f64 {
        self.regression.variance_at(self.regression.centre + s) + self.skew_px * self.skew_px
    }
}

/// A point of the stripe's centre line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Middle {
    /// Ideal pixel.
    pub ideal: Vector2<f64>,
    /// Standard deviation across the stripe, px; along it a point is where its section is.
    pub sigma_px: f64,
}

/// Whether the first shifts lie beside the line of all by more than two standard deviations of their mean. Only then
/// they get a fit of their own.
fn hangs_off(start: &[Shift], all: &Regression) -> bool {
    let (mut sum, mut count) = (0.0, 0.0);
    for shift in start.iter().filter(|shift| shift.weight > 0.0) {
        let sigmas = (shift.shift_px - shift.response * all.shift_at(shift.s)) / all.sigma_px;
        sum += sigmas.clamp(-3.0, 3.0);
        count += 1.0;
    }
    sum * sum > 4.0 * count * all.shared()
}

/// Whether a regression over a longer stretch has the stripe somewhere else at `s` than one over a shorter stretch.
fn differs(shorter: &Regression, longer: &Regression, s: f64) -> bool {
    let off = shorter.shift_at(s) - longer.shift_at(s);
    // A longer stretch shows better how far neighbours share their speckle.
    let shared = (longer.shared() / shorter.shared()).max(1.0);
    off.abs() > BENT_PX && off * off > AGREES * AGREES * shared * shorter.variance_at(s)
}

/// Measures stripes; memory is kept from one to the next.
#[derive(Clone, Debug)]
pub struct StripeMeter {
    /// Sections that share a background.
    shared: usize,
    track: Track,
    backgrounds: Vec<Background>,
    sections: Vec<CrossSection>,
    shifts: Vec<Shift>,
    regressor: Regressor,
    stack: Stack,
    sorted: Vec<f64>,
    dark: Vec<[f64; 2]>,
}

impl Default for StripeMeter {
    fn default() -> Self {
        Self::sharing(BLOCK)
    }
}

impl StripeMeter {
    /// One for stripes on a painted surface: each section has a background of its own.
    #[must_use]
    pub fn on_paint() -> Self {
        Self::sharing(1)
    }

    fn sharing(shared: usize) -> Self {
        Self {
            shared,
            track: Track::default(),
            backgrounds: Vec::new(),
            sections: Vec::new(),
            shifts: Vec::new(),
            regressor: Regressor::default(),
            stack: Stack::default(),
            sorted: Vec::new(),
            dark: Vec::new(),
        }
    }

    /// The sections of the last measurement.
    #[must_use]
    pub fn sections(&self) -> &[CrossSection] {
        &self.sections
    }

    /// The light along a line in bands beside each other; returns the width of a band, px.
    pub fn bands<L: Level>(
        &mut self,
        line: &Line2,
        span: [f64; 2],
        template: &Template,
        frame: Frame<'_, L>,
        sections: &mut Vec<BandSection>,
    ) -> f64 {
        let width_px = 2.0 * COVERED * template.reach_px / BANDS as f64;
        self.track.lay(line, span, frame);
        self.measure_background(template.reach_px, frame.picture);
        let view = SectionView::new(frame.picture, self.track.by_columns);
        sections.clear();
        for (block, background) in self.track.stations.chunks(self.shared).zip(&self.backgrounds) {
            sections.extend(
                block.iter().filter_map(|station| band_section(&view, station, background, width_px)),
            );
        }
        width_px
    }

    /// Stretches of the last sections, along the line, in which there is less than a part of the stripe's usual
    /// light. Places with sparks beside the stripe do not count as dark.
    pub(crate) fn dark_stretches(&mut self, part: f64) -> &[[f64; 2]] {
        let usual = self.usual_amplitude();
        self.sorted.clear();
        self.sorted.extend(self.sections.iter().map(|section| section.background));
        let ground = median(&mut self.sorted);
        let light =
            |section: &CrossSection| section.own_amplitude.max(0.0) + (section.background - ground).max(0.0);
        let stretches = &mut self.dark;
        stretches.clear();
        let mut before_dark = false;
        for around in self.sections.windows(DARK_CUTS) {
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

    /// Measures the stripe along a stretch of a line known to a few px. `None` if there is too little of it.
    pub fn fit<L: Level>(
        &mut self,
        line: &Line2,
        span: [f64; 2],
        sigma_px: f64,
        frame: Frame<'_, L>,
    ) -> Option<(Fit, Template)> {
        let (first, template) = self.learn(line, span, sigma_px, frame)?;
        // Distances along the new line count from its own point.
        let start = line.station(&first.point);
        let fit = self.fit_with(&first, [span[0] - start, span[1] - start], &template, frame)?;
        Some((fit, template))
    }

    /// A first pass with broad weights at every second section: the line to a tenth of a pixel, and the stripe's
    /// cross-section.
    pub fn learn<L: Level>(
        &mut self,
        line: &Line2,
        span: [f64; 2],
        sigma_px: f64,
        frame: Frame<'_, L>,
    ) -> Option<(Line2, Template)> {
        let broad = Template::gaussian(sigma_px);
        self.track.lay(line, span, frame);
        while self.track.stations.len() > 2 * LEARNT {
            self.track.thin();
        }
        self.section_track(&broad, frame);
        let first = self.regress(line, &broad)?;
        let start = line.station(&first.line.point);
        self.track.lay_again(&first.line, [span[0] - start, span[1] - start], frame);
        // Flanks reach further than the broad weights do.
        let template = self.stack(PRESENT * first.amplitude, 1.5 * broad.reach_px, frame.picture)?;
        Some((first.line, if self.stack.meets_all_phases() { template } else { broad }))
    }

    /// Measures with given weights.
    pub fn fit_with<L: Level>(
        &mut self,
        line: &Line2,
        span: [f64; 2],
        template: &Template,
        frame: Frame<'_, L>,
    ) -> Option<Fit> {
        self.section(line, span, template, frame);
        self.regress(line, template)
    }

    /// The line through the sections.
    fn regress(&mut self, line: &Line2, template: &Template) -> Option<Fit> {
        let amplitude = self.usual_amplitude();
        if amplitude <= 0.0 {
            return None;
        }
        self.shifts.clear();
        let gain = template.gain;
        self.shifts.extend(self.sections.iter().map(|section| {
            let there = section.amplitude > PRESENT * amplitude;
            let per_px = section.amplitude * gain * section.stretch;
            let shift_px = if there { section.tilt / per_px } else { 0.0 };
            // Exactly dark sections have no amplitude to divide by.
            let response = if there { section.response / section.amplitude } else { 0.0 };
            Shift { s: section.s, shift_px, weight: f64::from(u8::from(there)), response }
        }));
        let regression = self.regressor.fit(&self.shifts)?;
        let sections = self.shifts.iter().filter(|shift| shift.weight > 0.0).count();
        let at = Line2 { point: line.at(regression.centre), along: line.along };
        Some(Fit {
            line: at.moved(regression.shift_px, regression.slope),
            from: *line,
            regression,
            amplitude,
            present: sections as f64 / self.sections.len().max(1) as f64,
            sections,
            skew_px: self.skew_px(gain),
        })
    }

    /// Distance of the ridge from the fit of the whole stripe, by parts of the last sections; zero if their scatter explains
    /// it.
    fn skew_px(&self, gain: f64) -> f64 {
        let part = self.sections.len().div_ceil(SKEW_PARTS).max(1);
        let (mut count, mut sum, mut squares) = (0.0, 0.0, 0.0);
        for (sections, shifts) in self.sections.chunks(part).zip(self.shifts.chunks(part)) {
            let there = sections.iter().zip(shifts).filter(|(_, shift)| shift.weight > 0.0);
            let (mut tilt, mut light) = (0.0, 0.0);
            for (section, _) in there {
                tilt += section.ridge_tilt - section.tilt;
                light += section.amplitude * gain * section.stretch;
            }
            if light > 0.0 {
                let skew = tilt / light;
                (count, sum, squares) = (count + 1.0, sum + skew, squares + skew * skew);
            }
        }
        let (mean, square) = (sum / f64::max(count, 1.0), squares / f64::max(count, 1.0));
        let variance = (square - mean * mean).max(0.0) / f64::max(count - 1.0, 1.0);
        if count >= FEWEST_PARTS && mean * mean > SKEWED * SKEWED * variance { mean } else { 0.0 }
    }

    /// The stripe's centre line: its middle at every section of the last fit that shows it, along the line of the first
    /// fit, with the standard deviation of each, perpendicular to this line.
    pub fn middles<'a>(&'a self, fit: &'a Fit) -> impl Iterator<Item = Middle> + 'a {
        self.shifts.iter().filter(|shift| shift.weight > 0.0).map(|shift| Middle {
            ideal: fit.from.at(shift.s) + fit.from.normal() * shift.shift_px,
            sigma_px: fit.regression.sigma_px,
        })
    }

    /// The last fit without its beginning, if that does not lie on the line of the rest. Mirrored light near a corner
    /// pulls many sections a little, and none of them far enough to be an outlier.
    pub(crate) fn without_bent_start(&mut self, fit: Fit) -> Fit {
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
                return fit.over(&rest);
            }
        }
        fit
    }

    /// The last fit, or the longest stretch up to its end that agrees with all shorter ones about the stripe's place
    /// at its end. Near the edge this is the line along a bent plate \[Lepski1991\].
    pub(crate) fn straight_end(&mut self, fit: Fit) -> Fit {
        let Some(last) = self.shifts.last().map(|shift| shift.s) else { return fit };
        let mut stretches = ENDS_PX.map(|end_px| {
            let split = self.shifts.partition_point(|shift| shift.s < last - end_px);
            if split > 0 { self.regressor.fit(&self.shifts[split..]) } else { None }
        });
        stretches[ENDS_PX.len() - 1] = Some(fit.regression);
        let agrees = |number: &usize| {
            let longer = stretches[*number];
            longer.is_some_and(|longer| {
                stretches[..*number].iter().flatten().all(|shorter| !differs(shorter, &longer, last))
            })
        };
        let Some(number) = (0..stretches.len()).rev().find(agrees) else { return fit };
        let Some(longest) = stretches[number].filter(|longest| *longest != fit.regression) else {
            return fit;
        };
        // A stretch is short because its scatter is small, which may be chance: the next longer one is more reliable.
        let longer = stretches[number + 1..].iter().flatten().next();
        let longest = longer.map_or(longest, |longer| longest.at_least_noise_of(longer));
        fit.over(&longest)
    }

    /// Distance of the stripe from a line over a short stretch of it, px, and its standard deviation: the mean, each
    /// section weighed by its light. `None` if there is none.
    pub(crate) fn shift_beside<L: Level>(
        &mut self,
        fit: &Fit,
        span: [f64; 2],
        template: &Template,
        frame: Frame<'_, L>,
    ) -> Option<[f64; 2]> {
        self.section(&fit.line, span, template, frame);
        let tilt: f64 = self.sections.iter().map(|section| section.tilt).sum();
        let light = |section: &CrossSection| section.own_amplitude.max(0.0) * template.gain * section.stretch;
        let lights: f64 = self.sections.iter().map(light).sum();
        let own_variance = fit.regression.sigma_px.powi(2) / self.sections.len() as f64;
        // Neighbours share their speckle as along the line.
        (lights > 0.0).then(|| [tilt / lights, (own_variance * fit.regression.shared()).sqrt()])
    }

    /// Measures sections of the stripe along a line.
    pub fn section<L: Level>(
        &mut self,
        line: &Line2,
        span: [f64; 2],
        template: &Template,
        frame: Frame<'_, L>,
    ) {
        self.track.lay(line, span, frame);
        self.section_track(template, frame);
    }

    fn section_track<L: Level>(&mut self, template: &Template, frame: Frame<'_, L>) {
        self.measure_background(template.reach_px, frame.picture);
        self.sections.clear();
        let view = SectionView::new(frame.picture, self.track.by_columns);
        fastest!(section_stripe(
            &view,
            &self.track.stations,
            (&self.backgrounds, self.shared),
            template,
            &mut self.sections
        ));
        smooth_amplitudes(&mut self.sections);
    }

    /// The template of the stripe on the track, with the amplitudes of the last sections.
    fn stack<L: Level>(&mut self, least: f64, reach_px: f64, picture: &Picture<'_, L>) -> Option<Template> {
        self.measure_background(reach_px, picture);
        self.stack.clear();
        let view = SectionView::new(picture, self.track.by_columns);
        let along = (view, self.track.stations.as_slice(), self.backgrounds.as_slice(), self.shared);
        fastest!(stack_stripe(&along, &self.sections, least, reach_px, &mut self.stack));
        self.stack.template()
    }

    /// The level beside the stripe, on each side, for each block of sections.
    fn measure_background<L: Level>(&mut self, reach_px: f64, picture: &Picture<'_, L>) {
        let view = SectionView::new(picture, self.track.by_columns);
        fastest!(backgrounds_beside(
            &view,
            &self.track.stations,
            (reach_px, self.shared),
            &mut self.backgrounds
        ));
    }

    /// Three quarters of the way up among the amplitudes: right with half of the stripe missing.
    fn usual_amplitude(&mut self) -> f64 {
        self.sorted.clear();
        self.sorted.extend(self.sections.iter().map(|section| section.amplitude));
        if self.sorted.is_empty() {
            return 0.0;
        }
        let at = self.sorted.len() * 3 / 4;
        *self.sorted.select_nth_unstable_by(at, f64::total_cmp).1
    }
}
