//! The line of a face that is not straight: that through its columns with equal weights.
//!
//! A robust line weighs the columns by how far they lie off it. Of a bowed face these are its middle or its ends, as the bow has it and as much of it is seen:
//! the line then lies beside that of the same columns with equal weights, in neighbouring profiles alike. So the bow is fitted and taken
//! out first. On an even face Legendre's second and third polynomial have no part in a line, and what is left after them is the line and the noise,
//! wherever along it the columns are: those that are even across the view are not so along a bowed face. The second polynomial is zero at (one third)½ of the half
//! length, so that the line meets a bow of second degree there: these are the support points.

use super::face::Face;
use super::finder::{COUNTED_SIGMAS, ProfileFinder};
use crate::measure::regression::{Regression, RobustLine};
use nalgebra::{Matrix4, Vector4};

impl ProfileFinder {
    /// A robust line through a run of the points as [`ProfileFinder::face`] has it, after the run's bow is taken out of them. The spread of its points stays that
    /// about the bowed face.
    pub(super) fn face_without_bow(&mut self, from: usize, to: usize) -> Option<Face> {
        let about = self.take_run(from, to)?;
        let bowed = self.regressor.rough_line(&self.shifts)?;
        let sigma_px = self.regressor.spread(&bowed);
        let place = Place::of(self.shifts.iter().map(|shift| shift.s));
        let Some([of_square, of_cube]) = self.bow(&bowed, COUNTED_SIGMAS * sigma_px, &place) else {
            return Some(Face::of(about, self.regressor.fit(&self.shifts)?));
        };
        for shift in &mut self.shifts {
            let [square, cube] = bent(place.of_one(shift.s));
            shift.shift_px -= of_square * square + of_cube * cube;
        }
        let straight = self.regressor.fit_near(&self.shifts, &bowed)?;
        let regression = Regression { sigma_px, ..straight };
        let even_support = Some([place.middle, place.half / 3_f64.sqrt()]);
        Some(Face { even_support, ..Face::of(about, regression) })
    }

    /// The parts of both polynomials in the shifts about a face's line, of those that are not further off it than a limit; `None` of too few.
    fn bow(&self, line: &RobustLine, limit_mm: f64, place: &Place) -> Option<[f64; 2]> {
        let (mut normal, mut right) = (Matrix4::zeros(), Vector4::zeros());
        for shift in &self.shifts {
            let off = shift.shift_px - line.shift_at(shift.s);
            if off.abs() > limit_mm {
                continue;
            }
            let at = place.of_one(shift.s);
            let [square, cube] = bent(at);
            let terms = Vector4::new(1.0, at, square, cube);
            normal += terms * terms.transpose();
            right += terms * off;
        }
        let parts = normal.cholesky()?.solve(&right);
        Some([parts[2], parts[3]])
    }
}

/// Where columns lie between the first, at −1, and the last, at 1.
struct Place {
    middle: f64,
    half: f64,
}

impl Place {
    fn of(along: impl Iterator<Item = f64>) -> Self {
        let (least, most) =
            along.fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), s| (least.min(s), most.max(s)));
        Self { middle: 0.5 * (least + most), half: 0.5 * (most - least) }
    }

    fn of_one(&self, along: f64) -> f64 {
        (along - self.middle) / self.half
    }
}

/// Legendre's second and third polynomial.
fn bent(at: f64) -> [f64; 2] {
    [1.5 * at * at - 0.5, at * (2.5 * at * at - 1.5)]
}
