//! Seam points without the bend of their stripes.
//!
//! A detector lays a straight line through each stripe, and its seam point is where both meet. The stripe of a surface beside a curve is bent, so
//! that point is not on the seam. With the plates of an answer the difference is known: both support points of a plate lie on its predicted stripe.

use crate::curve::answer::{Answered, Asked};
use crate::curve::drift::DriftFree;
use crate::curve::readings::{Light, Readings};
use crate::curve::rows::ROWS;
use crate::curve::sight::{ByForm, sight};
use crate::curve::solve::{Search, refined};
use crate::curve::with_plates::WithPlates;
use crate::order_statistics::median;
use nalgebra::{Matrix2, Vector2};

impl Asked<'_> {
    /// The answer of the seam points if each is where two straight lines meet, by the bends of an answer with plates. Where that has no stripes the bend
    /// is unknown, and the seam point is not used. `rate_sigma_ppm` is the uncertainty of the clock rates of the stamps.
    #[must_use]
    pub(crate) fn without_bends(
        &self,
        seam: &Answered,
        plates: &WithPlates,
        rate_sigma_ppm: f64,
    ) -> Option<DriftFree> {
        let mut readings = plates.unbent(self.search.readings);
        for (k, reading) in readings.list.iter_mut().enumerate() {
            if !plates.explains(k) {
                reading.light = Light::Unused;
            }
        }
        let finished = refined(&readings, &seam.finished)?;
        let asked = Asked { search: Search { readings: &readings, ..self.search }, ..*self };
        let answer = asked.concluded(finished, seam.rivals.clone(), &seam.course, (false, None));
        Some(asked.without_drift(answer, rate_sigma_ppm))
    }
}

impl WithPlates {
    /// The same seam points, without the distance of the predicted lines' crossing from the seam.
    fn unbent(&self, readings: &Readings) -> Readings {
        let (mut unbent, own) = (readings.clone(), self.corrected());
        for (k, reading) in unbent.list.iter_mut().enumerate() {
            if let Some(off_m) = self.explains(k).then(|| self.off_m(&own, k)).flatten() {
                reading.off_m.fixed_rows_mut::<2>(0).copy_from(&off_m);
            }
        }
        unbent
    }

    /// Whether the seam points are where straight lines through bent stripes meet: the bends explain part of their residuals.
    #[must_use]
    pub(crate) fn are_bent(&self, readings: &Readings) -> bool {
        /// The median of some hundred squares is known to a few per cent.
        const LESS: f64 = 0.95;
        self.median_squared(&self.unbent(readings)) < LESS * self.median_squared(readings)
    }

    /// The seam points as they were probably measured: with the bends of their stripes or without.
    #[must_use]
    pub(crate) fn as_measured(&self, readings: &Readings) -> Readings {
        if self.are_bent(readings) { self.unbent(readings) } else { readings.clone() }
    }

    /// Median of the squared whitened residuals of seam points.
    fn median_squared(&self, readings: &Readings) -> f64 {
        let (sights, whiteners) = self.free.answer.seam_points(readings);
        let squared = sights.iter().zip(&whiteners).filter_map(|(seen, w)| Some(seen.as_ref()?.squared(w)));
        median(squared).unwrap_or(f64::INFINITY)
    }

    /// Distance of the predicted lines' crossing from the predicted seam point, in the sheet, m. `None` without stripes.
    fn off_m(&self, own: &Readings, k: usize) -> Option<Vector2<f64>> {
        let (fitted, reading) = (&self.free.answer.finished.fitted, &own.list[k]);
        let seen = fitted.sights[k].as_ref()?;
        let (ByForm::Feet(feet), Some(supports)) = (&seen.by_form, reading.supports()) else { return None };
        let on_stripe: [Vector2<f64>; ROWS] =
            std::array::from_fn(|row| supports[row].in_sheet - feet[row].normal * seen.residual[row]);
        let normals = [0, 2].map(|first| {
            let along = on_stripe[first + 1] - on_stripe[first];
            Vector2::new(-along.y, along.x).normalize()
        });
        let both = Matrix2::from_rows(&normals.map(|normal| normal.transpose()));
        let offsets = Vector2::new(normals[0].dot(&on_stripe[0]), normals[1].dot(&on_stripe[2]));
        let point = sight(own, reading, &fitted.state.at, &fitted.state.spline, seen.u_m)?;
        Some(both.try_inverse()? * offsets - (reading.in_sheet - point.of_point()?))
    }
}
