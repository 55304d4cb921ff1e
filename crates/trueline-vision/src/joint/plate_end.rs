//! Where the stripe on one plate ends: the line along it, and the place on that line.

use crate::frame::Frame;
use crate::line::Line2;
use crate::measure::stripe_end::{BANDS, Edge, EndFinder, EndSearch};
use crate::measure::stripe_meter::{Fit, StripeMeter};
use crate::measure::template::Template;
use crate::not_found::NotFound;
use crate::picture::Level;
use nalgebra::{Matrix2, Vector2};

/// Stripe on both sides of the search that is compared, px.
const COMPARE_PX: f64 = 60.0;
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

/// Where the stripe must still be on its line, in its thicknesses before the end; and how far beside it may be, in its
/// thicknesses and in standard deviations.
const BEFORE_SIGMAS: [f64; 2] = [3.0, 0.5];
const ROUNDED_SIGMAS: f64 = 0.3;
const ROUNDED: f64 = 4.0;

/// Nothing of a plate could be measured.
const NOTHING: NotFound = NotFound::TooLittle { visible: 0.0, needed: 0.0 };

/// Finds ends of plates; memory is kept from one to the next.
#[derive(Clone, Debug, Default)]
pub struct PlateEndFinder {
    /// Measures the stripe.
    pub meter: StripeMeter,
    ends: EndFinder,
}

impl PlateEndFinder {
    /// The end of the stripe on a plate, within `search_px` of the point of its line; `bands` says which bands across
    /// the stripe are looked at.
    ///
    /// # Errors
    /// Too little stripe, or light that does not end.
    pub fn find<L: Level>(
        &mut self,
        plate: &Plate,
        search_px: f64,
        bands: [bool; BANDS],
        frame: Frame<'_, L>,
    ) -> Result<(Edge, Fit), NotFound> {
        let span = [-plate.length_px.min(FIT_PX), -search_px];
        let (fit, template) = self.meter.fit(&plate.line, span, plate.sigma_px, frame).ok_or(NOTHING)?;
        let fit = self.meter.straight_end(fit);
        let near = fit.line.station(&plate.line.point);
        let reach = [near - search_px - COMPARE_PX, near + search_px + COMPARE_PX.min(search_px)];
        let band_px = self.meter.bands(&fit.line, reach, &template, frame, &mut self.ends.sections);
        let within = [near - search_px, near + search_px];
        let edge = self.ends.end(&EndSearch { within, band_px, used: bands, sigma_px: plate.sigma_px })?;
        if bands == [true; BANDS] {
            self.refuse_rounded(plate, &edge, &fit, &template, frame)?;
        }
        Ok((edge, fit))
    }
}

impl PlateEndFinder {
    /// Refuses an end before which the stripe leaves its line: the plate's edge is rounded, and the light ends somewhere on
    /// the rounding.
    fn refuse_rounded<L: Level>(
        &mut self,
        plate: &Plate,
        edge: &Edge,
        fit: &Fit,
        template: &Template,
        frame: Frame<'_, L>,
    ) -> Result<(), NotFound> {
        let span = BEFORE_SIGMAS.map(|sigmas| edge.s - sigmas * plate.sigma_px);
        let Some([shift_px, sigma_px]) = self.meter.shift_beside(fit, span, template, frame) else {
            return Ok(());
        };
        let most_px = (ROUNDED_SIGMAS * plate.sigma_px).max(ROUNDED * sigma_px);
        if shift_px.abs() > most_px {
            return Err(NotFound::RoundedEnd { shift_px: shift_px.abs(), most_px });
        }
        Ok(())
    }
}

/// The point at an edge and its covariance: along the line that of the edge, across it that of the line.
#[must_use]
pub(crate) fn edge_point(fit: &Fit, edge: &Edge) -> (Vector2<f64>, Matrix2<f64>) {
    let (along, across) = (fit.line.along, fit.line.normal());
    let covariance = along * along.transpose() * edge.sigma_px.powi(2)
        + across * across.transpose() * fit.variance_at(edge.s);
    (fit.line.at(edge.s), covariance)
}
