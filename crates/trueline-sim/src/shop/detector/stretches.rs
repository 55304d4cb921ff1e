//! Stretches of a scan in which something is the case.

use crate::noise::Noise;

/// Stretches that make up a share of a duration, s, each of a length between two, s; at least one.
pub(super) fn drawn(noise: &mut Noise, share: f64, duration_s: f64, length_s: [f64; 2]) -> Vec<[f64; 2]> {
    let wanted_s = share * duration_s;
    let count = (wanted_s / (0.5 * (length_s[0] + length_s[1]))).round().max(1.0) as usize;
    let lengths: Vec<f64> = (0..count).map(|_| noise.uniform(length_s[0], length_s[1])).collect();
    let scale = wanted_s / lengths.iter().sum::<f64>();
    let stretch = |length_s: f64| {
        let begin_s = noise.uniform(0.0, duration_s - length_s);
        [begin_s, begin_s + length_s]
    };
    lengths.into_iter().map(|length_s| length_s * scale).map(stretch).collect()
}

/// The number of the stretch that a time is in, s.
pub(super) fn at(stretches: &[[f64; 2]], time_s: f64) -> Option<usize> {
    stretches.iter().position(|[begin, end]| (*begin..*end).contains(&time_s))
}
