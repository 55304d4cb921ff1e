//! Derivative of a residual by displacements in S: its two rows b₁, b₂, plain and whitened.
//!
//! A residual in the sheet has derivative one by a displacement along its own axis of the sheet and zero along the other. Multiplications by one or
//! zero are skipped.

use super::lanes::{Lanes, Vectors};

/// The rows of a residual.
pub(crate) trait DisplacementRows<const FUSED: bool>: Copy {
    /// The same, whitened.
    type Whitened: WhitenedRows<FUSED>;

    /// Effect of a displacement on the residual.
    fn of(&self, displacement: Vectors<FUSED>) -> [Lanes<FUSED>; 2];

    /// b₁·b₁, b₁·b₂ and b₂·b₂.
    fn products(&self) -> [Lanes<FUSED>; 3];

    /// Times a whitener: w₁₁, w₂₁ and w₂₂ of its lower triangle.
    fn whitened(&self, w: &[Lanes<FUSED>; 3]) -> Self::Whitened;
}

/// The whitened rows of a residual.
pub(crate) trait WhitenedRows<const FUSED: bool>: Copy {
    /// Effect of a displacement on the whitened residual.
    fn of(&self, displacement: Vectors<FUSED>) -> [Lanes<FUSED>; 2];

    /// Effect of a displacement along each axis.
    fn along_axes(&self) -> [[Lanes<FUSED>; 2]; 3];

    /// Effect of a rotation about each axis, with this lever: a × b.
    fn about_axes(&self, lever: Vectors<FUSED>) -> [[Lanes<FUSED>; 2]; 3];
}

/// (1, 0, −slope₁) and (0, 1, −slope₂): the intersection of a line with the sheet z = 0.
#[derive(Clone, Copy, Debug)]
pub(crate) struct InSheetRows<const FUSED: bool> {
    /// Motion of the intersection along each of the sheet's axes when the line rises by one.
    pub slopes: [Lanes<FUSED>; 2],
}

/// (w₁₁, 0, z₁) and (w₂₁, w₂₂, z₂).
#[derive(Clone, Copy, Debug)]
pub(crate) struct WhitenedInSheetRows<const FUSED: bool> {
    w: [Lanes<FUSED>; 3],
    z: [Lanes<FUSED>; 2],
}

impl<const FUSED: bool> DisplacementRows<FUSED> for InSheetRows<FUSED> {
    type Whitened = WhitenedInSheetRows<FUSED>;

    #[inline(always)]
    fn of(&self, displacement: Vectors<FUSED>) -> [Lanes<FUSED>; 2] {
        let ([x, y, z], [first, second]) = (displacement.0, self.slopes);
        [x.plus_product(-first, z), y.plus_product(-second, z)]
    }

    #[inline(always)]
    fn products(&self) -> [Lanes<FUSED>; 3] {
        let (one, [first, second]) = (Lanes::splat(1.0), self.slopes);
        [one.plus_product(first, first), first * second, one.plus_product(second, second)]
    }

    #[inline(always)]
    fn whitened(&self, w: &[Lanes<FUSED>; 3]) -> Self::Whitened {
        let [first, second] = self.slopes;
        WhitenedInSheetRows { w: *w, z: [-(w[0] * first), -((w[1] * first).plus_product(w[2], second))] }
    }
}

impl<const FUSED: bool> WhitenedRows<FUSED> for WhitenedInSheetRows<FUSED> {
    #[inline(always)]
    fn of(&self, displacement: Vectors<FUSED>) -> [Lanes<FUSED>; 2] {
        let ([x, y, z], w) = (displacement.0, self.w);
        [(w[0] * x).plus_product(self.z[0], z), (w[1] * x).plus_product(w[2], y).plus_product(self.z[1], z)]
    }

    #[inline(always)]
    fn along_axes(&self) -> [[Lanes<FUSED>; 2]; 3] {
        [[self.w[0], self.w[1]], [Lanes::splat(0.0), self.w[2]], self.z]
    }

    #[inline(always)]
    fn about_axes(&self, lever: Vectors<FUSED>) -> [[Lanes<FUSED>; 2]; 3] {
        let ([x, y, z], w) = (lever.0, self.w);
        let first = [y * self.z[0], (z * w[0]).plus_product(-x, self.z[0]), -(y * w[0])];
        let second = lever.cross(Vectors([w[1], w[2], self.z[1]])).0;
        [[first[0], second[0]], [first[1], second[1]], [first[2], second[2]]]
    }
}

/// Any rows.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FullRows<const FUSED: bool>(pub [Vectors<FUSED>; 2]);

impl<const FUSED: bool> DisplacementRows<FUSED> for FullRows<FUSED> {
    type Whitened = Self;

    #[inline(always)]
    fn of(&self, displacement: Vectors<FUSED>) -> [Lanes<FUSED>; 2] {
        [self.0[0].dot(displacement), self.0[1].dot(displacement)]
    }

    #[inline(always)]
    fn products(&self) -> [Lanes<FUSED>; 3] {
        let [first, second] = self.0;
        [first.dot(first), first.dot(second), second.dot(second)]
    }

    #[inline(always)]
    fn whitened(&self, w: &[Lanes<FUSED>; 3]) -> Self {
        let [first, second] = self.0;
        Self([first.scaled(w[0]), first.scaled(w[1]).plus_scaled(second, w[2])])
    }
}

impl<const FUSED: bool> WhitenedRows<FUSED> for FullRows<FUSED> {
    #[inline(always)]
    fn of(&self, displacement: Vectors<FUSED>) -> [Lanes<FUSED>; 2] {
        [self.0[0].dot(displacement), self.0[1].dot(displacement)]
    }

    #[inline(always)]
    fn along_axes(&self) -> [[Lanes<FUSED>; 2]; 3] {
        let [first, second] = [self.0[0].0, self.0[1].0];
        [[first[0], second[0]], [first[1], second[1]], [first[2], second[2]]]
    }

    #[inline(always)]
    fn about_axes(&self, lever: Vectors<FUSED>) -> [[Lanes<FUSED>; 2]; 3] {
        let [first, second] = [lever.cross(self.0[0]).0, lever.cross(self.0[1]).0];
        [[first[0], second[0]], [first[1], second[1]], [first[2], second[2]]]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rows of the sheet against the full rows, plain and whitened.
    fn alike<const FUSED: bool>() {
        let lanes = |seed: f64| Lanes::<FUSED>([1.0, 2.0, 3.0, 4.0].map(|k: f64| (k * seed).sin()));
        let in_sheet = InSheetRows { slopes: [lanes(0.7), lanes(1.9)] };
        let (zero, one, [first, second]) = (Lanes::splat(0.0), Lanes::splat(1.0), in_sheet.slopes);
        let full = FullRows([Vectors([one, zero, -first]), Vectors([zero, one, -second])]);
        let (vector, w) =
            (Vectors([lanes(0.3), lanes(1.1), lanes(2.3)]), [lanes(0.9), lanes(3.1), lanes(0.2)]);
        let (white, white_full) = (in_sheet.whitened(&w), full.whitened(&w));
        let near = |found: Lanes<FUSED>, expected: Lanes<FUSED>| {
            // Sums of three products of numbers below one.
            (0..4)
                .for_each(|k| assert!((found.0[k] - expected.0[k]).abs() < 1e-15, "{found:?} {expected:?}"));
        };
        for row in 0..2 {
            near(DisplacementRows::of(&in_sheet, vector)[row], DisplacementRows::of(&full, vector)[row]);
            near(white.of(vector)[row], WhitenedRows::of(&white_full, vector)[row]);
            for axis in 0..3 {
                near(white.along_axes()[axis][row], white_full.along_axes()[axis][row]);
                near(white.about_axes(vector)[axis][row], white_full.about_axes(vector)[axis][row]);
            }
        }
        for k in 0..3 {
            near(in_sheet.products()[k], full.products()[k]);
        }
        // W b by its definition.
        let plain = DisplacementRows::of(&full, vector);
        near(white.of(vector)[0], w[0] * plain[0]);
        near(white.of(vector)[1], w[1] * plain[0] + w[2] * plain[1]);
    }

    #[test]
    fn rows_of_the_sheet_are_rows_like_any_others() {
        alike::<false>();
        alike::<true>();
    }
}
