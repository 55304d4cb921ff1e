//! Range data of a profiler as points: the "Scan3d" part of GenICam's standard features naming convention (SFNC).
//!
//! A frame of range data is a picture with profiles as rows. A pixel is a number that gives the coordinate C, the range,
//! by scale and offset. The coordinate A, along the stripe, is sent with it or follows in the same way from the column.

/// A profile of a frame.
#[derive(Clone, Debug, PartialEq)]
pub struct RangeProfile {
    /// How long after the first profile of its frame it was taken, ns.
    pub after_first_ns: i64,
    /// Of each column the position along the stripe and the range, m; `None` without a return.
    pub columns: Vec<Option<[f64; 2]>>,
}

impl RangeProfile {
    /// Its points, m.
    pub fn points(&self) -> impl Iterator<Item = [f64; 2]> {
        self.columns.iter().flatten().copied()
    }
}

/// From numbers to a coordinate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RangeAxis {
    /// Length of a count, m; negative where the axis runs the other way.
    pub scale_m: f64,
    /// Coordinate at zero counts, m.
    pub offset_m: f64,
    /// The code for a missing coordinate.
    pub invalid: Option<f64>,
}

impl RangeAxis {
    fn coordinate(&self, count: f64) -> Option<f64> {
        (self.invalid != Some(count)).then_some(self.offset_m + self.scale_m * count)
    }
}

/// From the numbers of a frame to its profiles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RangeScale {
    /// Along the stripe: coordinate A.
    pub along: RangeAxis,
    /// Range: coordinate C.
    pub range: RangeAxis,
    /// Whether both coordinates are sent, A before C; else A is counted in columns.
    pub sends_both: bool,
    /// Between the profiles of a frame, ns.
    pub line_period_ns: f64,
}

impl RangeScale {
    /// The profiles of a frame, one in each row; `width` is in columns.
    ///
    /// Rows that are cut off are left out.
    #[must_use]
    pub fn profiles(&self, counts: &[u16], width: usize) -> Vec<RangeProfile> {
        let row = width * if self.sends_both { 2 } else { 1 };
        let profile = |(number, row): (usize, &[u16])| RangeProfile {
            after_first_ns: (number as f64 * self.line_period_ns).round() as i64,
            columns: self.columns(row),
        };
        counts.chunks_exact(row.max(1)).enumerate().map(profile).collect()
    }

    fn columns(&self, row: &[u16]) -> Vec<Option<[f64; 2]>> {
        if self.sends_both {
            let point = |pair: &[u16]| {
                let [along, range] = [f64::from(pair[0]), f64::from(pair[1])];
                Some([self.along.coordinate(along)?, self.range.coordinate(range)?])
            };
            return row.chunks_exact(2).map(point).collect();
        }
        // A column's number is no measurement, so the code for "no range" does not occur in it.
        let along_m = |column: usize| self.along.offset_m + self.along.scale_m * column as f64;
        let point = |(column, count): (usize, &u16)| {
            Some([along_m(column), self.range.coordinate(f64::from(*count))?])
        };
        row.iter().enumerate().map(point).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SCALE: RangeScale = RangeScale {
        along: RangeAxis { scale_m: 1e-4, offset_m: -0.02, invalid: Some(0.0) },
        range: RangeAxis { scale_m: -1e-6, offset_m: 0.3, invalid: Some(0.0) },
        sends_both: false,
        line_period_ns: 1.5e6,
    };

    fn close(found: Option<[f64; 2]>, expected: [f64; 2]) -> bool {
        // The last digits of a product and a sum.
        found.is_some_and(|found| (0..2).all(|k| (found[k] - expected[k]).abs() < 1e-16))
    }

    #[test]
    fn columns_count_along_the_stripe_and_what_is_marked_is_left_out() {
        let profiles = SCALE.profiles(&[0, 50_000, 1, 65_535, 0, 100_u16], 3);
        assert_eq!(profiles.iter().map(|p| p.after_first_ns).collect::<Vec<_>>(), [0, 1_500_000]);
        assert_eq!(profiles[0].columns[0], None);
        assert!(close(profiles[0].columns[1], [-0.0199, 0.25]));
        assert!(close(profiles[0].columns[2], [-0.0198, 0.299_999]));
        // The first column of the second profile: its number is zero, which marks nothing there.
        assert!(close(profiles[1].columns[0], [-0.02, 0.3 - 0.065_535]));
        assert_eq!(profiles[1].points().count(), 2);
        let all = RangeScale { range: RangeAxis { invalid: None, ..SCALE.range }, ..SCALE };
        assert!(close(all.profiles(&[0], 1)[0].columns[0], [-0.02, 0.3]));
    }

    #[test]
    fn where_both_are_sent_a_point_needs_both() {
        let scale = RangeScale { sends_both: true, ..SCALE };
        let profiles = scale.profiles(&[300, 50_000, 0, 50_000, 300, 0, 7], 3);
        assert_eq!(profiles.len(), 1, "a row that is cut off is none");
        assert!(close(profiles[0].columns[0], [0.01, 0.25]));
        assert_eq!(profiles[0].columns[1..], [None, None]);
        assert!(scale.profiles(&[1, 2], 0).is_empty() || scale.profiles(&[1, 2], 0)[0].columns.is_empty());
    }
}
