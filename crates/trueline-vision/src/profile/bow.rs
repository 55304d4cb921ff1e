//! The bow of a face: the deviation of its surface from a straight line, and their separation over another stretch of it.

/// The part removed from a face.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Bow {
    /// From where to where along the face its line is that with equal weights.
    pub(super) place: Place,
    /// The parts of Legendre's second, third and fourth polynomial, mm; the last one is fitted to faces bent by more than
    /// usual plates.
    pub(super) parts: [f64; 3],
    /// Scatter of columns about the bowed face, mm.
    pub(super) spread_mm: f64,
}

impl Bow {
    /// Its line over another place (middle, and increase to the end), and the bow that remains there. Its powers of u = a +
    /// c v, with v from −1 to 1, are expanded into Legendre's polynomials of v.
    pub(super) fn over(&self, place: &Place) -> ([f64; 2], Self) {
        let (a, c) = (self.place.of_one(place.middle), place.half / self.place.half);
        let [square, cube, fourth] = self.parts;
        // Powers of u, each with its parts of the powers of v.
        let of_u = [
            0.375 * fourth - 0.5 * square,
            -1.5 * cube,
            1.5 * square - 3.75 * fourth,
            2.5 * cube,
            4.375 * fourth,
        ];
        let of_v = |power: usize| -> f64 {
            let steps = (power..=4).map(|k| of_u[k] * BINOMIAL[k][power] * a.powi((k - power) as i32));
            steps.sum::<f64>() * c.powi(power as i32)
        };
        let [one, first, second, third, last] = [0, 1, 2, 3, 4].map(of_v);
        let line = [one + second / 3.0 + last / 5.0, first + 0.6 * third];
        let parts = [second / 1.5 + last / 1.75, third / 2.5, last / 4.375];
        (line, Self { place: *place, parts, ..*self })
    }

    /// How far the face is off its line at a place, mm, and how much it is turned against it.
    pub(super) fn at(&self, at: f64) -> [f64; 2] {
        let sum = |of: [f64; 3]| self.parts.iter().zip(of).map(|(part, value)| part * value).sum::<f64>();
        [sum(bent(at)), sum(bent_slopes(at)) / self.place.half]
    }
}

const BINOMIAL: [[f64; 5]; 5] = [
    [1.0, 0.0, 0.0, 0.0, 0.0],
    [1.0, 1.0, 0.0, 0.0, 0.0],
    [1.0, 2.0, 1.0, 0.0, 0.0],
    [1.0, 3.0, 3.0, 1.0, 0.0],
    [1.0, 4.0, 6.0, 4.0, 1.0],
];

/// Usual bow of plates, mm, at this distance from the seam, mm: by the square of the distance, and by its cube.
const USUAL_BOW_MM: f64 = 0.2;
const USUAL_BOW_AT_MM: f64 = 25.0;
/// Squares of both parts in units of plates and noise: a larger sum is a bent face, once in 3,000 plates.
const BENT: f64 = 16.0;

impl Bow {
    /// By how much more than plates usually are the face is bent, squared: 1 where plates and chance explain it. The seam is at a place near to it, and
    /// the middle of the line has a variance.
    pub(super) fn excess(&self, seam_at: f64, middle_variance_mm2: f64) -> f64 {
        let squares = self.squares(seam_at, middle_variance_mm2);
        if squares > BENT { 0.5 * squares } else { 1.0 }
    }

    /// The squares of both parts in units of plates and noise: about two for a plate.
    pub(super) fn squares(&self, seam_at: f64, middle_variance_mm2: f64) -> f64 {
        let usual_mm = self.usual_mm(seam_at);
        let square = |k: usize| {
            self.parts[k].powi(2) / (usual_mm[k].powi(2) + middle_variance_mm2 * SQUARES_IN_LINE[k])
        };
        square(0) + square(1)
    }

    /// Squared difference of its bend from that of an arc with the bend of a longer stretch, in units of noise.
    pub(super) fn square_if_bent_like(&self, longer: &Self, middle_variance_mm2: f64) -> f64 {
        let as_bent_mm = longer.parts[0] * (self.place.half / longer.place.half).powi(2);
        (self.parts[0] - as_bent_mm).powi(2) / (middle_variance_mm2 * SQUARES_IN_LINE[0])
    }

    /// Parts of the polynomials in the usual bow of plates: in the square and the cube of the distance from the seam, and in
    /// its fourth power.
    fn usual_mm(&self, seam_at: f64) -> [f64; 3] {
        let [half, from_seam] =
            [1.0, seam_at.abs()].map(|of_half| of_half * self.place.half / USUAL_BOW_AT_MM);
        let square = 2.0 / 3.0 * half * half * (3.0 * from_seam).hypot(1.0);
        [square, 0.4 * half.powi(3), half.powi(4) / 4.375].map(|part| part * USUAL_BOW_MM)
    }

    /// Continuation of a face beyond its line at a place near to it, and the variance there. The polynomials are used as far
    /// as they exceed the noise; the middle of the line has this variance. On a short face they hardly exceed it, and the usual
    /// bow of plates is their prior. If a face is bent by more, its own bend is the prior, in the fourth polynomial as well.
    pub(super) fn beyond_line(&self, at: f64, middle_variance_mm2: f64) -> BeyondLine {
        let (values, slopes) = (bent(at), bent_slopes(at));
        let excess = self.excess(at, middle_variance_mm2);
        let [square, cube, fourth] = self.usual_mm(at).map(|part| part * part);
        let usual_mm2 = [square * excess, cube * excess, fourth * (excess - 1.0)];
        let mut beyond = BeyondLine::default();
        for (k, squares_in_line) in SQUARES_IN_LINE.into_iter().enumerate() {
            let noise = middle_variance_mm2 * squares_in_line;
            let told = if usual_mm2[k] > 0.0 { usual_mm2[k] / (usual_mm2[k] + noise) } else { 0.0 };
            beyond.shift_mm += told * self.parts[k] * values[k];
            beyond.slope += told * self.parts[k] * slopes[k] / self.place.half;
            beyond.variance_mm2 += told * noise * values[k] * values[k];
        }
        beyond
    }
}

/// A bow's addition to a line near to it.
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
    /// The place between two positions.
    pub(super) fn between(first: f64, last: f64) -> Self {
        Self { middle: 0.5 * (first + last), half: 0.5 * (last - first) }
    }

    /// Both ends.
    pub(super) fn ends(&self) -> [f64; 2] {
        [self.middle - self.half, self.middle + self.half]
    }

    /// Coordinate of a position in it: −1 at its first end, 1 at its last.
    pub(super) fn of_one(&self, along: f64) -> f64 {
        (along - self.middle) / self.half
    }
}

/// Ratio of the variance of each polynomial's part to that of a line's middle: 1 over the mean of its square.
const SQUARES_IN_LINE: [f64; 3] = [5.0, 7.0, 9.0];

/// Legendre's second, third and fourth polynomial.
pub(super) fn bent(at: f64) -> [f64; 3] {
    let square = at * at;
    [1.5 * square - 0.5, at * (2.5 * square - 1.5), (4.375 * square - 3.75) * square + 0.375]
}

/// Their derivatives.
fn bent_slopes(at: f64) -> [f64; 3] {
    [3.0 * at, 7.5 * at * at - 1.5, at * (17.5 * at * at - 7.5)]
}
