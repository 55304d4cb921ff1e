//! The motion of an external axis in a scan.

use crate::sweep::Sweep;
use trueline_dataset::{AxisLimits, AxisMotion};

/// A motion from rest to rest.
#[derive(Clone, Debug, PartialEq)]
pub enum AxisCourse {
    /// It swings, rad or m.
    Swings(Sweep),
    /// It runs from one value to another.
    Runs([f64; 2]),
    /// It stands at one place after the other, for equal times.
    Stands {
        /// The places, rad or m.
        places: Vec<f64>,
        /// Time from one to the next, s.
        move_s: f64,
    },
}

/// Peak speed of the smooth step u³(10 − 15u + 6u²), over its mean.
const PEAK_SPEED: f64 = 1.875;
/// Its peak acceleration over way and squared time: 10/√3.
const PEAK_ACCELERATION: f64 = 5.7735;

impl AxisCourse {
    /// The motion within limits of a scan with this eased time in all, s; `sweep` makes a swing within a range.
    pub(crate) fn within(
        limits: &AxisLimits,
        eased_total_s: f64,
        sweep: impl FnOnce([f64; 2]) -> Sweep,
    ) -> Self {
        match &limits.motion {
            AxisMotion::Swings => Self::Swings(sweep(limits.range)),
            AxisMotion::Runs => {
                let [from, to] = limits.range;
                Self::Runs([from, to.min(from + limits.speed * eased_total_s)])
            }
            AxisMotion::Stands(places) => {
                let longest = places.windows(2).map(|pair| (pair[1] - pair[0]).abs()).fold(0.0, f64::max);
                let by_speed_s = PEAK_SPEED * longest / limits.speed;
                let by_acceleration_s = (PEAK_ACCELERATION * longest / limits.acceleration).sqrt();
                Self::Stands { places: places.clone(), move_s: by_speed_s.max(by_acceleration_s) }
            }
        }
    }

    /// Its value at an eased time of all of it, s.
    #[must_use]
    pub fn at(&self, eased_s: f64, eased_total_s: f64) -> f64 {
        match self {
            Self::Swings(sweep) => sweep.at(eased_s),
            Self::Runs([from, to]) => from + (to - from) * eased_s / eased_total_s,
            Self::Stands { places, move_s } => {
                let each_s = eased_total_s / places.len() as f64;
                let move_s = move_s.min(each_s);
                let step = |(k, pair): (usize, &[f64])| {
                    let begun_s = eased_s - ((k + 1) as f64 * each_s - 0.5 * move_s);
                    let u = (begun_s / move_s.max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
                    (pair[1] - pair[0]) * u * u * u * (10.0 - 15.0 * u + 6.0 * u * u)
                };
                places[0] + places.windows(2).enumerate().map(step).sum::<f64>()
            }
        }
    }

    /// The same more slowly by this factor: a run goes less far.
    #[must_use]
    pub(crate) fn slowed(self, times: f64) -> Self {
        match self {
            Self::Swings(sweep) => Self::Swings(sweep.slowed(times)),
            Self::Runs([from, to]) => Self::Runs([from, from + (to - from) / times]),
            Self::Stands { places, move_s } => Self::Stands { places, move_s: move_s * times },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_stands_at_each_place_for_its_part_of_the_time() {
        let course = AxisCourse::Stands { places: vec![0.0, 1.0, -1.0], move_s: 2.0 };
        for (time_s, value) in
            [(0.0, 0.0), (4.9, 0.0), (6.0, 0.5), (7.1, 1.0), (10.9, 1.0), (12.0, 0.0), (18.0, -1.0)]
        {
            assert!((course.at(time_s, 18.0) - value).abs() < 1e-12, "{time_s}");
        }
    }

    #[test]
    fn moves_between_stands_keep_speed_and_acceleration() {
        let limits = AxisLimits {
            range: [-1.0, 1.0],
            speed: 0.4,
            acceleration: 0.3,
            motion: AxisMotion::Stands(vec![0.0, 1.0]),
        };
        let course = AxisCourse::within(&limits, 20.0, |_| Sweep::default());
        let step_s = 1e-3;
        let at = |k: i32| course.at(f64::from(k) * step_s, 20.0);
        let (mut speed, mut acceleration) = (0.0_f64, 0.0_f64);
        for k in 1..19_999 {
            speed = speed.max((at(k + 1) - at(k)).abs() / step_s);
            acceleration = acceleration.max((at(k + 1) - 2.0 * at(k) + at(k - 1)).abs() / (step_s * step_s));
        }
        // One of the two is used up; differences over 1 ms see a millionth less.
        assert!(speed <= 0.4 * (1.0 + 1e-6) && acceleration <= 0.3 * (1.0 + 1e-4), "{speed} {acceleration}");
        assert!(speed > 0.399 || acceleration > 0.299, "{speed} {acceleration}");
    }
}
