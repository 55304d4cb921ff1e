//! The bow of a face: what its surface is other than a straight line, and how both are told apart over another stretch of it.

/// What was taken out of a face.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Bow {
    /// From where to where along the face its line is that with equal weights.
    pub(super) place: Place,
    /// The parts of Legendre's second and third polynomial, mm.
    pub(super) parts: [f64; 2],
}

impl Bow {
    /// What of it is a line (its middle, and how much more at the end) over another place, and the bow that is left there: of u = a + c v with v from −1 to 1
    /// P₂(u) = (3a² + c² − 1)/2 + 3ac v + c² P₂(v), and P₃(u) likewise.
    pub(super) fn over(&self, place: &Place) -> ([f64; 2], Self) {
        let (a, c) = (self.place.of_one(place.middle), place.half / self.place.half);
        let [square, cube] = self.parts;
        let level =
            square * 0.5 * (3.0 * a * a + c * c - 1.0) + cube * (2.5 * (a.powi(3) + a * c * c) - 1.5 * a);
        let turn = square * 3.0 * a * c + cube * (2.5 * (3.0 * a * a * c + 0.6 * c.powi(3)) - 1.5 * c);
        let parts = [square * c * c + cube * 5.0 * a * c * c, cube * c.powi(3)];
        ([level, turn], Self { place: *place, parts })
    }
}

/// What plates are usually bowed by, mm, this far from the seam, mm: by the square of the distance, and by its cube.
const USUAL_BOW_MM: f64 = 0.2;
const USUAL_BOW_AT_MM: f64 = 25.0;

impl Bow {
    /// How a face continues beyond its line at a place near to it, and what that leaves of the variance there: both polynomials as far as they are told
    /// from the noise, of which the middle of the line has this variance. Of a short face they hardly are, and plates are bowed by so much and no more.
    pub(super) fn beyond_line(&self, at: f64, middle_variance_mm2: f64) -> BeyondLine {
        let (values, slopes) = (bent(at), bent_slopes(at));
        let [half, from_seam] = [1.0, at.abs()].map(|of_half| of_half * self.place.half / USUAL_BOW_AT_MM);
        // Parts of the polynomials in the square and in the cube of the distance from the seam.
        let square = 2.0 / 3.0 * half * half * (3.0 * from_seam).hypot(1.0);
        let usual_mm = [square, 0.4 * half.powi(3)].map(|part| part * USUAL_BOW_MM);
        let mut beyond = BeyondLine::default();
        for (k, squares_in_line) in [5.0, 7.0].into_iter().enumerate() {
            let noise = middle_variance_mm2 * squares_in_line;
            let told = usual_mm[k].powi(2) / (usual_mm[k].powi(2) + noise);
            beyond.shift_mm += told * self.parts[k] * values[k];
            beyond.slope += told * self.parts[k] * slopes[k] / self.place.half;
            beyond.variance_mm2 += told * noise * values[k] * values[k];
        }
        beyond
    }
}

/// What a bow adds to a line near to it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct BeyondLine {
    /// To its shift, mm.
    pub(super) shift_mm: f64,
    /// To its slope.
    pub(super) slope: f64,
    /// To its variance, mm².
    pub(super) variance_mm2: f64,
}

/// A stretch along a face: its first end at −1, its last at 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Place {
    /// Its middle, mm along the face.
    pub(super) middle: f64,
    /// Half of its length, mm.
    pub(super) half: f64,
}

impl Place {
    /// That between two places.
    pub(super) fn between(first: f64, last: f64) -> Self {
        Self { middle: 0.5 * (first + last), half: 0.5 * (last - first) }
    }

    /// Both ends.
    pub(super) fn ends(&self) -> [f64; 2] {
        [self.middle - self.half, self.middle + self.half]
    }

    /// Where a place is in it: −1 at its first end, 1 at its last.
    pub(super) fn of_one(&self, along: f64) -> f64 {
        (along - self.middle) / self.half
    }
}

/// Legendre's second and third polynomial.
pub(super) fn bent(at: f64) -> [f64; 2] {
    [1.5 * at * at - 0.5, at * (2.5 * at * at - 1.5)]
}

/// Their derivatives.
fn bent_slopes(at: f64) -> [f64; 2] {
    [3.0 * at, 7.5 * at * at - 1.5]
}
