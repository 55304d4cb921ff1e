//! End of the stripe on one plate: the line along it, and the place on that line.

use crate::frame::Frame;
use crate::joint::arm_pair::needed_px;
use crate::line::Line2;
use crate::measure::stripe_end::{BANDS, Edge, EndFinder, EndSearch, LEFT};
use crate::measure::stripe_meter::{Fit, StripeMeter};
use crate::measure::template::Template;
use crate::not_found::NotFound;
use crate::picture::Level;
use nalgebra::{Matrix2, Vector2};

/// Stripe beyond the search that is compared, px, and before it: as a part of the plate's, and at most.
const COMPARE_PX: f64 = 60.0;
const COMPARED: f64 = 0.4;
const MOST_COMPARED_PX: f64 = 200.0;
/// How far back the line is fitted, px.
const FIT_PX: f64 = 1200.0;

/// The stripe on a plate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plate {
    /// Its line, which leads to its end; the point is near the end.
    pub line: Line2,
    /// Its length, px.
    pub length_px: f64,
    /// Its thickness, px.
    pub sigma_px: f64,
}

/// Search range of the end around the last edgel, px, and the distance over which the stripe is followed at a time.
const SEARCH_PX: f64 = 30.0;
const FOLLOWED_PX: f64 = 64.0;
const MOST_STEPS: usize = 6;
/// The shortest stretch along which a bent plate is fitted, px.
const SHORTEST_PX: f64 = 80.0;
/// Length of a plate used for the height of its end, m: a bow of 0.2 mm at 25 mm from the end then causes 0.006 mm, the whole plate
/// 0.04 mm.
const TIP_M: f64 = 8e-3;
/// Pixels next to the end that are excluded, in blurs and in thicknesses of the stripe: an edge that crosses it at a slant takes one
/// flank before the other.
const CLEAR_BLURS: f64 = 2.0;
const CLEAR_SIGMAS: f64 = 1.5;
/// An end found within this of its assumed place is not followed further, px.
const MOVED_PX: f64 = 10.0;
/// Light of this part of the stripe's is the stripe. It may be missing over this distance, in px and in its
/// thicknesses: grains of speckle are as long as it is thick.
const LIT: f64 = 0.4;
const DARK_PX: f64 = 16.0;
const DARK_SIGMAS: f64 = 4.0;

/// Range before the end in which the stripe must still be on its line, in its thicknesses; and its largest distance
/// from the line, in its thicknesses and in standard deviations.
const BEFORE_SIGMAS: [f64; 2] = [3.0, 0.5];
const ROUNDED_SIGMAS: f64 = 0.3;
const ROUNDED: f64 = 4.0;
/// By how many of its thicknesses it may at most, and how much further along than beside the line the plate's edge may be.
const ROUNDEST_SIGMAS: f64 = 0.6;
const ROUNDED_ALONG: f64 = 4.0;

/// Outward error of an end behind a lens that is out of focus, in estimated blurs. Such a lens makes an even disc of a
/// point. The light behind it ends at two of the fade's standard deviations, sharply as at an end that is further out. In
/// drawn pictures this is between nothing and the double of it.
const OUT_OF_FOCUS_BLURS: f64 = 0.75;

/// The stripe on a plate, measured.
struct MeasuredPlate {
    fit: Fit,
    template: Template,
    /// Assumed end along the fitted line.
    near: f64,
}

/// The stripe on a plate, and the search range of its end.
#[derive(Clone, Debug)]
pub(crate) struct EndSurroundings {
    /// The line along the plate.
    pub(crate) fit: Fit,
    template: Template,
    /// Start of the plate, along the line.
    first: f64,
    /// Length of it used for the height of its end, px.
    tip_px: f64,
    within: [f64; 2],
    band_px: f64,
    sigma_px: f64,
}

impl EndSurroundings {
    /// Covariance of an end, px², if the stripe's cross-section is flat: behind a lens that is out of focus, or saturated.
    /// The middle of two ends that face each other is not: both are too far out.
    pub(crate) fn out_of_focus(&self, edge: &Edge) -> Matrix2<f64> {
        let outward =
            OUT_OF_FOCUS_BLURS * edge.blur_px * self.template.flatness().sqrt() * self.fit.line.along;
        outward * outward.transpose()
    }
}

/// Nothing of a plate could be measured.
const NOTHING: NotFound = NotFound::TooLittle { visible: 0.0, needed: LEFT };

/// Finds ends of plates; memory is kept from one to the next.
#[derive(Clone, Debug, Default)]
pub struct PlateEndFinder {
    /// Measures the stripe.
    pub meter: StripeMeter,
    ends: EndFinder,
}

impl PlateEndFinder {
    /// The end of the stripe on a plate, near the point of its line: to within `known_px`, or else wherever the stripe leads.
    ///
    /// # Errors
    /// Too little stripe, or light that does not end.
    pub(crate) fn find<L: Level>(
        &mut self,
        plate: &Plate,
        known_px: Option<f64>,
        frame: Frame<'_, L>,
    ) -> Result<(Edge, EndSurroundings), NotFound> {
        let around = self.look(plate, known_px, frame)?;
        Ok((self.whole_end(&around, frame)?, around))
    }

    /// Measures the stripe on a plate, and the light around its end.
    ///
    /// # Errors
    /// Too little stripe.
    pub(crate) fn look<L: Level>(
        &mut self,
        plate: &Plate,
        known_px: Option<f64>,
        frame: Frame<'_, L>,
    ) -> Result<EndSurroundings, NotFound> {
        let search_px = known_px.unwrap_or(SEARCH_PX);
        let mut stripe = self.measure(plate, search_px, frame)?;
        if known_px.is_none() {
            for _ in 0..MOST_STEPS {
                let Some(further) = self.followed(&stripe, plate.sigma_px, frame) else { break };
                stripe = self.measure(&further, search_px, frame)?;
            }
        }
        let MeasuredPlate { fit, template, near } = stripe;
        let before_px = (COMPARED * plate.length_px).clamp(COMPARE_PX, MOST_COMPARED_PX);
        let reach = [near - search_px - before_px, near + search_px + COMPARE_PX.min(search_px)];
        let band_px = self.meter.bands(&fit.line, reach, &template, frame, &mut self.ends.sections);
        let within = [near - search_px, near + search_px];
        let (_, m_per_px) = frame.lens.on_sheet(&plate.line.point).ok_or(NOTHING)?;
        let tip_px = (TIP_M / (m_per_px * fit.line.along).norm()).max(needed_px(plate.sigma_px));
        let first = near - plate.length_px;
        Ok(EndSurroundings { fit, template, first, tip_px, within, band_px, sigma_px: plate.sigma_px })
    }

    fn measure<L: Level>(
        &mut self,
        plate: &Plate,
        search_px: f64,
        frame: Frame<'_, L>,
    ) -> Result<MeasuredPlate, NotFound> {
        let span = [-plate.length_px.min(FIT_PX), -search_px];
        let (fit, template) = self.meter.fit(&plate.line, span, plate.sigma_px, frame).ok_or(NOTHING)?;
        let fit = self.meter.straight_end(fit);
        Ok(MeasuredPlate { fit, template, near: fit.line.station(&plate.line.point) })
    }

    /// The plate up to the end of its stripe, if that is not the assumed end. A segment ends at its last edgel, and its
    /// line leaves a plate that is bent. Then half as much of it is used.
    fn followed<L: Level>(
        &mut self,
        stripe: &MeasuredPlate,
        sigma_px: f64,
        frame: Frame<'_, L>,
    ) -> Option<Plate> {
        let MeasuredPlate { fit, template, near, .. } = stripe;
        self.meter.section(&fit.line, [near - SEARCH_PX, near + FOLLOWED_PX], template, frame);
        let most_dark_px = DARK_PX.max(DARK_SIGMAS * sigma_px);
        let mut last = near - SEARCH_PX;
        for section in self.meter.sections() {
            if section.s - last > most_dark_px {
                break;
            }
            if section.amplitude > LIT * fit.amplitude {
                last = section.s;
            }
        }
        // The line was fitted about the middle of its straight part.
        let half_px = near - SEARCH_PX;
        let line = Line2 { point: fit.line.at(last), along: fit.line.along };
        if (last - near).abs() > MOVED_PX {
            return Some(Plate { line, length_px: half_px + last, sigma_px });
        }
        // Shifts that were measured from a line far from theirs are drawn to it: from the new line they are right.
        let length_px = half_px.max(SHORTEST_PX) + SEARCH_PX;
        let bent = self.leaves_line((fit, template, sigma_px), last, frame).is_some();
        bent.then_some(Plate { line, length_px, sigma_px })
    }

    /// Distance of the stripe from its line before its end at `end_s`, px, if that is more than chance and a relevant part
    /// of its thickness.
    fn leaves_line<L: Level>(
        &mut self,
        (fit, template, thickness_px): (&Fit, &Template, f64),
        end_s: f64,
        frame: Frame<'_, L>,
    ) -> Option<f64> {
        let span = BEFORE_SIGMAS.map(|sigmas| end_s - sigmas * thickness_px);
        let [shift_px, sigma_px] = self.meter.shift_beside(fit, span, template, frame)?;
        let most_px = (ROUNDED_SIGMAS * thickness_px).max(ROUNDED * sigma_px);
        (shift_px.abs() > most_px).then_some(shift_px.abs())
    }

    /// End near the last searched stripe, in some of the bands across it.
    ///
    /// # Errors
    /// Light that does not end.
    pub(crate) fn near_end(
        &mut self,
        around: &EndSurroundings,
        bands: [bool; BANDS],
    ) -> Result<Edge, NotFound> {
        let EndSurroundings { within, band_px, sigma_px, .. } = *around;
        self.ends.near_end(&EndSearch { within, band_px, used: bands, sigma_px })
    }

    /// The end of the last searched stripe, in some of the bands across it.
    ///
    /// # Errors
    /// Light that does not end.
    pub(crate) fn end(&mut self, around: &EndSurroundings, bands: [bool; BANDS]) -> Result<Edge, NotFound> {
        let EndSurroundings { within, band_px, sigma_px, .. } = *around;
        self.ends.end(&EndSearch { within, band_px, used: bands, sigma_px })
    }

    /// The same in all bands. If the stripe leaves its line before its end, the plate's edge is rounded, and the light ends
    /// somewhere on the rounding. The edge's standard deviation contains this.
    ///
    /// # Errors
    /// Light that does not end, or leaves its line by more than the stripe is thick.
    pub(crate) fn whole_end<L: Level>(
        &mut self,
        around: &EndSurroundings,
        frame: Frame<'_, L>,
    ) -> Result<Edge, NotFound> {
        let EndSurroundings { within, band_px, sigma_px, .. } = *around;
        let search = EndSearch { within, band_px, used: [true; BANDS], sigma_px };
        let near = self.ends.near_end(&search)?;
        let stripe = (&around.fit, &around.template, sigma_px);
        let Some(shift_px) = self.leaves_line(stripe, near.s, frame) else {
            return self.ends.refined(&search, &near);
        };
        let most_px = ROUNDEST_SIGMAS * sigma_px;
        if shift_px > most_px {
            return Err(NotFound::RoundedEnd { shift_px, most_px });
        }
        Ok(Edge { sigma_px: near.sigma_px.hypot(ROUNDED_ALONG * shift_px), rounded_px: shift_px, ..near })
    }

    /// The point at an edge and its covariance: along the line that of the edge, across it that of the line through the last of
    /// the stripe. The line through all of a bowed stripe passes beside its end, in every picture alike.
    pub(crate) fn edge_point<L: Level>(
        &mut self,
        around: &EndSurroundings,
        edge: &Edge,
        frame: Frame<'_, L>,
    ) -> (Vector2<f64>, Matrix2<f64>) {
        let tip = self.tip(around, edge, frame).unwrap_or(around.fit);
        let s = tip.line.station(&around.fit.line.at(edge.s));
        let (along, across) = (tip.line.along, tip.line.normal());
        let covariance = along * along.transpose() * edge.sigma_px.powi(2)
            + across * across.transpose() * (tip.variance_at(s) + edge.rounded_px.powi(2));
        (tip.line.at(s), covariance)
    }

    /// The line through the last of a stripe, up to where its end begins to fade. `None` if there is no more of it, or too
    /// little.
    fn tip<L: Level>(&mut self, around: &EndSurroundings, edge: &Edge, frame: Frame<'_, L>) -> Option<Fit> {
        let EndSurroundings { fit, template, first, tip_px, sigma_px, .. } = around;
        let last = edge.s - CLEAR_BLURS * edge.blur_px - CLEAR_SIGMAS * sigma_px;
        let span = [(last - tip_px).max(*first), last];
        let tip = self.meter.fit_with(&fit.line, span, template, frame)?;
        // The line of a stripe without a longer straight part is known already.
        (tip.regression.centre > 0.0).then(|| tip.with_noise_of(fit))
    }
}
