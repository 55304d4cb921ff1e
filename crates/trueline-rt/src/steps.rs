//! The usual step of a stream, on line.

/// Steps that are remembered.
const STEPS: usize = 64;
/// Steps from one look at the median to the next.
const LOOK: usize = 8;
/// Fewest steps for a usual value.
const FEWEST: usize = 8;

/// The last steps between the times of a stream, and their median.
#[derive(Clone, Debug)]
pub(crate) struct Steps {
    steps_s: [f64; STEPS],
    count: usize,
    median_s: f64,
}

impl Steps {
    pub(crate) fn new() -> Self {
        Self { steps_s: [0.0; STEPS], count: 0, median_s: 0.0 }
    }

    /// A step, s; values that are not positive are ignored.
    pub(crate) fn push(&mut self, step_s: f64) {
        if step_s.is_nan() || step_s <= 0.0 {
            return;
        }
        self.steps_s[self.count % STEPS] = step_s;
        self.count += 1;
        if self.count.is_multiple_of(LOOK) || self.count == STEPS - 1 {
            let filled = self.count.min(STEPS);
            let mut steps_s = self.steps_s;
            let (_, middle, _) = steps_s[..filled].select_nth_unstable_by(filled / 2, f64::total_cmp);
            self.median_s = *middle;
        }
    }

    /// The median, s; `None` of too few.
    pub(crate) fn median_s(&self) -> Option<f64> {
        (self.count >= FEWEST).then_some(self.median_s)
    }
}
