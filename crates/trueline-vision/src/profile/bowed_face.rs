//! The line of a face that is not straight: that through its columns with equal weights.
//!
//! A robust line weighs the columns by how far they lie off it. On a bowed face these are its middle or its ends, depending
//! on the bow and its visible part. The line then lies beside that of the same columns with equal weights, in the same way
//! in neighbouring profiles. So the bow is fitted and taken out first. On an even face Legendre's second and third
//! polynomials have no part in a line. Without them the line and the noise remain, wherever along it the columns are.
//! Columns that are even across the view are not even along a bowed face. The second polynomial is zero at √(1/3) of the
//! half length, so the line meets a bow of second degree there: these are the support points.
//!
//! The line depends on where the face begins and ends. Half a column more of a face of 20 mm with a bow of 0.2 mm moves it
//! by 0.5 µm at the seam, as much as a third of its noise. A false column some millimetres beyond moves it by ten times as
//! much. So it ends at the seam, not at the next column, and at its last column, not beyond.

use super::bow::{Bow, Place, bent};
use super::face::{Face, RoughDirection};
use super::finder::{COUNTED_SIGMAS, ProfileFinder};
use crate::measure::regression::{Regression, RobustLine};
use nalgebra::{SMatrix, SVector};

impl ProfileFinder {
    /// A robust line through a run of the points as [`ProfileFinder::face`] has it, after the run's bow is taken out of
    /// them. The face ends to the left and to the right at a place along x if that is known, else at its last column. The
    /// spread of its points stays that about the bowed face.
    pub(super) fn face_without_bow(
        &mut self,
        from: usize,
        to: usize,
        ends_x: [Option<f64>; 2],
    ) -> Option<Face> {
        let about = self.take_run(from, to)?;
        let bowed = self.regressor.rough_line(&self.shifts)?;
        let sigma_px = self.regressor.spread(&bowed);
        let place = Place::between(self.shifts[0].s, self.shifts[self.shifts.len() - 1].s);
        let Some(mut bow) = self.bow(&bowed, COUNTED_SIGMAS * sigma_px, &place) else {
            return Some(Face::of(about, self.regressor.fit(&self.shifts)?));
        };
        let is_bent = bow.is_bent(&place);
        if is_bent {
            bow = self.nearer_bow::<5>(&bowed, &bow, COUNTED_SIGMAS * bow.spread_mm, &place)?;
        }
        self.place_by_column(&about, &bowed, &bow, &place);
        let limit_mm = COUNTED_SIGMAS * bow.spread_mm;
        let bow = match is_bent {
            true => self.nearer_bow::<5>(&bowed, &bow, limit_mm, &place)?,
            false => self.nearer_bow::<4>(&bowed, &bow, limit_mm, &place)?,
        };
        let [_, _, parts @ ..] = bow.terms;
        let spread_mm = bow.spread_mm;
        for shift in &mut self.shifts {
            let values = bent(place.of_one(shift.s));
            shift.shift_px -= parts.iter().zip(values).map(|(part, value)| part * value).sum::<f64>();
        }
        let straight = self.regressor.fit_near(&self.shifts, &bowed)?;
        let regression = Regression { sigma_px, ..straight };
        let bow = Bow { place, parts, spread_mm };
        let face = Face { bow: Some(bow), ..Face::of(about, regression) };
        let [first, last] = self.columns_on(&regression, COUNTED_SIGMAS * spread_mm)?;
        let at = |x: Option<f64>| Some(face.along_at(x?));
        Some(face.over(&Place::between(at(ends_x[0]).unwrap_or(first), at(ends_x[1]).unwrap_or(last))))
    }

    /// Places the shifts where their columns meet the bowed face.
    ///
    /// A profiler measures a range in each column, so the noise is along z, and the foot of a point moves along the face
    /// with its noise. A line through 20 mm of a face at 45° with 0.3 mm of noise would be turned by 1.4 mrad, in every
    /// profile to the same side.
    fn place_by_column(&mut self, about: &RoughDirection, line: &RobustLine, bow: &BowFit, place: &Place) {
        let per_shift = about.along.y / about.along.x;
        for shift in &mut self.shifts {
            let on_face = line.shift_at(shift.s) + bow.at(place.of_one(shift.s));
            shift.s -= per_shift * (shift.shift_px - on_face);
        }
    }

    /// The bow in the shifts about a face's line: first of the shifts within a limit of the line, then of those within
    /// their scatter of the bowed face; `None` with too few.
    fn bow(&self, line: &RobustLine, limit_mm: f64, place: &Place) -> Option<BowFit> {
        let rough = self.nearer_bow::<4>(line, &BowFit::default(), limit_mm, place)?;
        self.nearer_bow::<4>(line, &rough, COUNTED_SIGMAS * rough.spread_mm, place)
    }

    /// The first N terms of the bow nearer than before.
    fn nearer_bow<const N: usize>(
        &self,
        line: &RobustLine,
        from: &BowFit,
        limit_mm: f64,
        place: &Place,
    ) -> Option<BowFit> {
        let (mut normal, mut right) = (SMatrix::<f64, N, N>::zeros(), SVector::<f64, N>::zeros());
        let (mut squares, mut count) = (0.0, 0.0);
        for shift in &self.shifts {
            let every = terms(place.of_one(shift.s));
            let terms = SVector::<f64, N>::from_fn(|k, _| every[k]);
            let known: f64 = from.terms.iter().zip(every).map(|(term, value)| term * value).sum();
            let off = shift.shift_px - line.shift_at(shift.s) - known;
            if off.abs() > limit_mm {
                continue;
            }
            normal += terms * terms.transpose();
            right += terms * off;
            squares += off * off;
            count += 1.0;
        }
        let step = normal.cholesky()?.solve(&right);
        let spread_mm = ((squares - step.dot(&right)).max(0.0) / count).sqrt();
        let mut found = BowFit { spread_mm, count, ..*from };
        found.terms.iter_mut().zip(step.iter()).for_each(|(term, step)| *term += step);
        Some(found)
    }

    /// The first and the last column that lie no further from a line than a limit.
    fn columns_on(&self, line: &Regression, limit_mm: f64) -> Option<[f64; 2]> {
        let mut on_it =
            self.shifts.iter().filter(|shift| (shift.shift_px - line.shift_at(shift.s)).abs() <= limit_mm);
        let first = on_it.next()?;
        Some([first.s, on_it.next_back()?.s])
    }
}

/// Parts of a constant, of a line and of Legendre's second, third and fourth polynomial in shifts, mm, their scatter, and
/// their number.
#[derive(Clone, Copy, Debug, Default)]
struct BowFit {
    terms: [f64; 5],
    spread_mm: f64,
    count: f64,
}

impl BowFit {
    /// Its addition to the line at a place.
    fn at(&self, at: f64) -> f64 {
        self.terms.iter().zip(terms(at)).map(|(term, value)| term * value).sum()
    }

    /// Whether it is more than that of a plate.
    fn is_bent(&self, place: &Place) -> bool {
        let [_, _, parts @ ..] = self.terms;
        let bow = Bow { place: *place, parts, spread_mm: self.spread_mm };
        // The seam is hardly further away than the end of the face.
        bow.excess(1.0, self.spread_mm * self.spread_mm / self.count) > 1.0
    }
}

fn terms(at: f64) -> [f64; 5] {
    let [square, cube, fourth] = bent(at);
    [1.0, at, square, cube, fourth]
}
