//! Points for a chart: as many as it can show, evenly out of all.

/// Most points of a series.
const MOST: usize = 2000;

/// Every `n`-th point, to limit their number.
#[derive(Debug)]
pub(crate) struct Thinned {
    points: Vec<[f64; 2]>,
    every: usize,
    seen: usize,
}

impl Default for Thinned {
    fn default() -> Self {
        Self { points: Vec::new(), every: 1, seen: 0 }
    }
}

impl Thinned {
    /// Takes a point, or leaves it out.
    pub(crate) fn add(&mut self, point: Option<[f64; 2]>) {
        let Some(point) = point else { return };
        if self.seen.is_multiple_of(self.every) {
            self.points.push(point);
        }
        self.seen += 1;
        if self.points.len() == 2 * MOST {
            let mut number = 0;
            self.points.retain(|_| {
                number += 1;
                number % 2 == 1
            });
            self.every *= 2;
        }
    }

    /// The remaining ones.
    pub(crate) fn into_points(self) -> Vec<[f64; 2]> {
        self.points
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_are_left_out_evenly() {
        let mut thinned = Thinned::default();
        thinned.add(None);
        (0..100_000).for_each(|k| thinned.add(Some([f64::from(k), 0.0])));
        let points = thinned.into_points();
        assert!((MOST..2 * MOST).contains(&points.len()));
        assert!(points.windows(2).all(|pair| pair[1][0] - pair[0][0] == points[1][0] - points[0][0]));
    }
}
