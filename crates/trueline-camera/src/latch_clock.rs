//! The camera's clock on the PC's, from questions and answers.
//!
//! The PC notes its time, has the camera latch its clock, and notes its time again. The latch happened in between,
//! independently of the network. Exchanges that were quick pin it down best.

/// One exchange.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LatchSample {
    /// Steady clock of the PC before the question was sent, ns.
    pub before_ns: i64,
    /// The camera's clock when it was latched, ns or ticks.
    pub device_ns: i64,
    /// Steady clock of the PC when the answer came, ns.
    pub after_ns: i64,
}

impl LatchSample {
    fn round_trip_ns(&self) -> i64 {
        self.after_ns - self.before_ns
    }

    fn middle_ns(&self) -> i64 {
        self.before_ns + self.round_trip_ns() / 2
    }
}

/// Fewer exchanges do not determine a rate, and quarters of fewer determine nothing.
const LEAST_SAMPLES: usize = 4;
/// The slopes between all pairs are computed, so their number is bounded.
const MOST_KEPT: usize = 400;
/// No quartz is further off, parts per million.
const MOST_DRIFT_PPM: f64 = 500.0;

/// The map from the camera's clock to the PC's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LatchMap {
    at_device_ns: i64,
    at_host_ns: i64,
    host_per_device: f64,
    /// By how much the camera's clock gains on the PC's, parts per million.
    pub drift_ppm: f64,
    /// Half of the quickest round trip, s: the error if one way took all of the time. In the middle of the exchanges;
    /// twice as much at their ends.
    pub sigma_s: f64,
    /// Exchanges that the map was made of, slow ones included.
    pub samples: usize,
    /// Distance of the map from the range that the worst exchange allows, s: zero, or little, unless a clock was set.
    pub contradiction_s: f64,
}

impl LatchMap {
    /// The map that agrees with the quickest quarter of the exchanges; `None` of fewer than four.
    #[must_use]
    pub fn of(samples: &[LatchSample]) -> Option<Self> {
        if samples.len() < LEAST_SAMPLES {
            return None;
        }
        let mut quick = samples.to_vec();
        quick.sort_by_key(LatchSample::round_trip_ns);
        quick.truncate((samples.len() / 4).clamp(LEAST_SAMPLES, MOST_KEPT));
        let best_ns = quick[0].round_trip_ns();
        quick.sort_by_key(|sample| sample.device_ns);
        let at = quick[quick.len() / 2];
        let points: Vec<[f64; 2]> = quick
            .iter()
            .map(|s| [(s.device_ns - at.device_ns) as f64, (s.middle_ns() - at.middle_ns()) as f64])
            .collect();
        let host_per_device = plausible(slope(&points)?, &quick);
        let mut map = Self {
            at_device_ns: at.device_ns,
            at_host_ns: at.middle_ns(),
            host_per_device,
            drift_ppm: (1.0 / host_per_device - 1.0) * 1e6,
            sigma_s: best_ns as f64 * 0.5e-9,
            samples: samples.len(),
            contradiction_s: 0.0,
        };
        map.at_host_ns += map.offset_ns(samples, &quick, best_ns);
        map.contradiction_s = samples.iter().map(|s| map.outside_ns(s)).max().unwrap_or(0) as f64 * 1e-9;
        Some(map)
    }

    /// Steady time of the PC at a time of the camera, ns.
    #[must_use]
    pub fn host_ns(&self, device_ns: i64) -> i64 {
        let since = device_ns.saturating_sub(self.at_device_ns) as f64 * self.host_per_device;
        self.at_host_ns.saturating_add(since.round() as i64)
    }

    /// Shift of the line, ns, to the middle of the range that all exchanges allow: a slow way there may have had a
    /// quick way back. If no line of this rate agrees with all, a clock was set, and the middle of the quick ones must
    /// do.
    fn offset_ns(&self, samples: &[LatchSample], quick: &[LatchSample], best_ns: i64) -> i64 {
        let least = samples.iter().map(|s| s.before_ns - self.host_ns(s.device_ns)).max();
        let most = samples.iter().map(|s| s.after_ns - self.host_ns(s.device_ns)).min();
        let (least, most) = least.zip(most).unwrap_or_default();
        if least - most <= best_ns {
            return least + (most - least) / 2;
        }
        let mut offsets: Vec<i64> = quick.iter().map(|s| s.middle_ns() - self.host_ns(s.device_ns)).collect();
        offsets.sort_unstable();
        offsets[offsets.len() / 2]
    }

    fn outside_ns(&self, sample: &LatchSample) -> i64 {
        let host_ns = self.host_ns(sample.device_ns);
        (sample.before_ns - host_ns).max(host_ns - sample.after_ns).max(0)
    }
}

/// A rate that no quartz has is one only where the exchanges cannot be explained by round trips in a short span: then
/// the clock does not count nanoseconds.
fn plausible(host_per_device: f64, samples: &[LatchSample]) -> f64 {
    let worst_ns = samples.iter().map(LatchSample::round_trip_ns).max().unwrap_or(0);
    let ends = samples.first().zip(samples.last());
    let span_ns = ends.map_or(0, |(first, last)| (last.middle_ns() - first.middle_ns()).abs()).max(1);
    let explained = worst_ns as f64 / span_ns as f64;
    if (MOST_DRIFT_PPM * 1e-6..explained).contains(&(host_per_device - 1.0).abs()) {
        1.0
    } else {
        host_per_device
    }
}

/// The middle one of the slopes between all pairs, pairs far apart counting for more: a third of the points can lie
/// anywhere.
fn slope(points: &[[f64; 2]]) -> Option<f64> {
    let mut slopes = Vec::with_capacity(points.len() * points.len() / 2);
    for (number, first) in points.iter().enumerate() {
        for second in &points[number + 1..] {
            let run = second[0] - first[0];
            if run > 0.0 {
                slopes.push([(second[1] - first[1]) / run, run]);
            }
        }
    }
    weighted_median(&mut slopes).filter(|slope| slope.is_finite() && *slope > 0.0)
}

/// Of values with weights.
fn weighted_median(values: &mut [[f64; 2]]) -> Option<f64> {
    values.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let half = 0.5 * values.iter().map(|[_, weight]| weight).sum::<f64>();
    let mut sum = 0.0;
    values
        .iter()
        .find(|[_, weight]| {
            sum += weight;
            sum >= half
        })
        .map(|[value, _]| *value)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    const START_NS: i64 = 1_700_000_000_000_000_000;
    const EPOCH_NS: i64 = 42_000_000_000;

    /// Exchanges over a network with a least delay each way and a tail that now and then takes milliseconds.
    fn exchanges(count: usize, every_s: f64, ppm: f64, seed: u64) -> Vec<LatchSample> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut delay_ns = || {
            let tail = -rng.random_range(1e-9_f64..1.0).ln() * 30e3;
            let held_up = if rng.random_bool(0.2) { rng.random_range(0.5e6..8e6) } else { 0.0 };
            (60e3 + tail + held_up) as i64
        };
        (0..count)
            .map(|number| {
                let before_ns = START_NS + (number as f64 * every_s * 1e9) as i64;
                let latched_ns = before_ns + delay_ns();
                LatchSample {
                    before_ns,
                    device_ns: device_ns(latched_ns, ppm),
                    after_ns: latched_ns + delay_ns(),
                }
            })
            .collect()
    }

    fn device_ns(host_ns: i64, ppm: f64) -> i64 {
        let since = host_ns - START_NS;
        EPOCH_NS + since + (since as f64 * ppm * 1e-6).round() as i64
    }

    #[test]
    fn a_drifting_clock_behind_a_bad_network_is_mapped_within_what_it_says() {
        for seed in 0..50 {
            let samples = exchanges(150, 0.2, 50.0, seed);
            let map = LatchMap::of(&samples).unwrap();
            assert!((map.drift_ppm - 50.0).abs() < 3.0, "seed {seed}: {}", map.drift_ppm);
            assert!(map.sigma_s < 1e-4 && map.contradiction_s == 0.0, "seed {seed}: {map:?}");
            for at_s in [0.0, 15.0, 30.0] {
                let truth_ns = START_NS + (at_s * 1e9) as i64;
                let error_s = (map.host_ns(device_ns(truth_ns, 50.0)) - truth_ns) as f64 * 1e-9;
                assert!(error_s.abs() < map.sigma_s, "seed {seed}, {at_s} s: {error_s}");
            }
        }
    }

    #[test]
    fn fewer_than_four_exchanges_say_nothing_and_a_short_span_says_no_rate() {
        let samples = exchanges(4, 0.001, 50.0, 1);
        assert_eq!(LatchMap::of(&samples[..3]), None);
        let map = LatchMap::of(&samples).unwrap();
        assert!(map.drift_ppm.abs() <= MOST_DRIFT_PPM);
        assert_eq!(LatchMap::of(&[samples[0]; 5]), None, "no time passed");
    }

    #[test]
    fn ticks_of_another_length_are_mapped_too() {
        let mut samples = exchanges(100, 0.1, 20.0, 2);
        let truth_ns = samples[50].before_ns;
        for sample in &mut samples {
            sample.device_ns /= 8;
        }
        let map = LatchMap::of(&samples).unwrap();
        let error_s = (map.host_ns(device_ns(truth_ns, 20.0) / 8) - truth_ns) as f64 * 1e-9;
        assert!(error_s.abs() < map.sigma_s, "{error_s}");
    }

    #[test]
    fn a_clock_that_was_set_contradicts_the_map() {
        let mut samples = exchanges(100, 0.1, 20.0, 3);
        for sample in &mut samples[70..] {
            sample.device_ns += 300_000_000;
        }
        assert!(LatchMap::of(&samples).unwrap().contradiction_s > 0.05);
    }
}
