//! The end face of a lap's upper plate: if lit, it leads from one stripe to the other.

use crate::frame::Frame;
use crate::line::Line2;
use crate::measure::regression::{Regressor, Shift};
use crate::measure::stripe_end::Edge;
use crate::measure::stripe_meter::Fit;
use crate::picture::Level;
use nalgebra::Vector2;

/// Part of the way from the upper stripe to the lower one in which only the face can be lit.
const BETWEEN: [f64; 2] = [0.3, 0.7];
/// Search range of the face on both sides of the plates' ends, px.
const AROUND_PX: f64 = 16.0;
/// Dark places: on both sides of the face, half way between the stripes if these are this many thicknesses away. Otherwise
/// beside the upper stripe, opposite to the lower one, px.
const CLEAR_SIGMAS: f64 = 4.0;
const DARK_PX: f64 = 24.0;
const DARK_ALONG_PX: f64 = 60.0;
/// Part of the upper plate's light that counts as light on the face.
const LIT: f64 = 0.08;
/// Standard deviations of the face's thickness within which its light is gathered.
const GATHERED: f64 = 3.0;

/// Finds where faces begin; memory is kept from one to the next.
#[derive(Clone, Debug, Default)]
pub(crate) struct FaceFinder {
    middles: Vec<Shift>,
    regressor: Regressor,
}

impl FaceFinder {
    /// Crossing of a face, a straight line, with the upper plate's stripe.
    pub(crate) fn edge<L: Level>(&mut self, face: &Face<'_, L>, sigma_px: f64) -> Option<Edge> {
        self.middles.clear();
        self.middles.extend(face.rows().filter_map(|row| face.middle(row, face.columns)));
        for _ in 0..2 {
            let fit = self.regressor.fit(&self.middles)?;
            // Only the light near the line that was found: elsewhere is noise.
            let window = |row: f64| {
                let middle = fit.shift_at(row);
                let half = GATHERED * sigma_px.max(1.5);
                [(middle - half).max(face.columns[0]), (middle + half).min(face.columns[1])]
            };
            self.middles.clear();
            self.middles.extend(face.rows().filter_map(|row| face.middle(row, window(row))));
        }
        let fit = self.regressor.fit(&self.middles)?;
        Some(Edge {
            s: fit.shift_at(0.0),
            sigma_px: fit.variance_at(0.0).sqrt(),
            blur_px: 0.0,
            rounded_px: 0.0,
        })
    }
}

/// The strip between the two stripes of a lap.
pub(crate) struct Face<'a, L> {
    line: Line2,
    columns: [f64; 2],
    rows: [f64; 2],
    dark: f64,
    frame: Frame<'a, L>,
}

impl<'a, L: Level> Face<'a, L> {
    /// The strip between the upper plate's stripe, which ends near `edge_s` on its line, and the lower one's
    /// start. `None` if it is not all in the picture.
    #[must_use]
    pub(crate) fn between(
        fit: &Fit,
        sigma_px: f64,
        edge_s: f64,
        lower_start: &Vector2<f64>,
        frame: Frame<'a, L>,
    ) -> Option<Self> {
        let line = fit.line;
        let (step, ahead) = (line.distance(lower_start), line.station(lower_start) - edge_s);
        let beside = -step.signum() * DARK_PX;
        let mut face = Self {
            line,
            columns: [edge_s + ahead.min(0.0) - AROUND_PX, edge_s + ahead.max(0.0) + AROUND_PX],
            rows: BETWEEN.map(|part| part * step),
            dark: 0.0,
            frame,
        };
        // Ambient light differs from place to place: that on both sides has its mean between them.
        let [from, to] = face.columns;
        let around = [[from - DARK_ALONG_PX, from], [to, to + DARK_ALONG_PX]]
            .map(|columns| face.dark_at(0.5 * step, columns));
        face.dark = match around {
            [Some(before), Some(after)] if 0.5 * step.abs() > CLEAR_SIGMAS * sigma_px => {
                0.5 * (before + after)
            }
            _ => face.dark_at(beside, [edge_s - DARK_ALONG_PX, edge_s])?,
        };
        // All of the strip must be there.
        (face.mean(face.rows[0], face.columns).is_some() && face.mean(face.rows[1], face.columns).is_some())
            .then_some(face)
    }

    /// Whether the face is lit, compared with a stripe of an amplitude and thickness.
    #[must_use]
    pub(crate) fn is_lit(&self, amplitude: f64, sigma_px: f64) -> bool {
        let (mut light, mut count) = (0.0, 0.0);
        for mean in self.rows().filter_map(|row| self.mean(row, self.columns)) {
            light += mean - self.dark;
            count += 1.0;
        }
        let light = light / f64::max(count, 1.0);
        light * (self.columns[1] - self.columns[0]) > LIT * amplitude * 2.5 * sigma_px
    }

    /// Mean level of five rows about one.
    fn dark_at(&self, row: f64, columns: [f64; 2]) -> Option<f64> {
        let rows = [-2.0, -1.0, 0.0, 1.0, 2.0];
        let sum: Option<f64> = rows.iter().map(|off| self.mean(row + off, columns)).sum();
        sum.map(|sum| sum / rows.len() as f64)
    }

    fn rows(&self) -> impl Iterator<Item = f64> + use<L> {
        let [from, to] = self.rows;
        let number = (to - from).abs().floor();
        (0..number as usize).map(move |k| from + (to - from) * (k as f64 + 0.5) / number)
    }

    /// Centre of the light in a row.
    fn middle(&self, row: f64, columns: [f64; 2]) -> Option<Shift> {
        let (mut light, mut moment) = (0.0, 0.0);
        for s in along(columns) {
            let above = (self.level(row, s)? - self.dark).max(0.0);
            light += above;
            moment += above * s;
        }
        (light > 0.0).then(|| Shift { s: row, shift_px: moment / light, weight: 1.0, response: 1.0 })
    }

    fn mean(&self, row: f64, columns: [f64; 2]) -> Option<f64> {
        let sum: Option<f64> = along(columns).map(|s| self.level(row, s)).sum();
        sum.map(|sum| sum / along(columns).count().max(1) as f64)
    }

    /// Level at a distance beside the line and along it; `None` out of the picture.
    fn level(&self, beside: f64, s: f64) -> Option<f64> {
        let Frame { picture, lens } = self.frame;
        let pixel = lens.distorted(&(self.line.at(s) + self.line.normal() * beside)).0;
        let (u, v) = (pixel.x.floor(), pixel.y.floor());
        if u < 0.0 || v < 0.0 || v + 1.0 >= picture.height() as f64 {
            return None;
        }
        let (p, q) = (pixel.x - u, pixel.y - v);
        let row = |k: usize| -> Option<f64> {
            let levels = picture.row(v as usize + k).get(u as usize..u as usize + 2)?;
            let [a, b] = [levels[0], levels[1]].map(|level| f64::from(Into::<f32>::into(level)));
            Some(a * (1.0 - p) + b * p)
        };
        Some(row(0)? * (1.0 - q) + row(1)? * q)
    }
}

fn along([from, to]: [f64; 2]) -> impl Iterator<Item = f64> {
    (0..(to - from).max(0.0) as usize + 1).map(move |k| from + k as f64)
}
