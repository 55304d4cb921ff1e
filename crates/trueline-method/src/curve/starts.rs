//! Starts of an estimate from nothing: time offsets times attitudes, followed by windows and sifted.

use crate::curve::readings::Readings;
use crate::curve::windows::Windows;
use crate::parallel;
use nalgebra::{UnitQuaternion, Vector3};
use trueline_dataset::Guess;
use trueline_geometry::{se3, so3};

/// Step of the tested time offsets, s.
const OFFSET_STEP_S: f64 = 0.1;
/// Scales of the loss, m: first …
const FIRST_M: [f64; 4] = [60e-3, 30e-3, 30e-3, 10e-3];
/// … then for the better half …
const SECOND_M: [f64; 4] = [10e-3, 10e-3, 5e-3, 5e-3];
/// … and for the best of all readings.
const LAST_M: [f64; 7] = [5e-3, 3e-3, 2e-3, 1e-3, 1e-3, 0.5e-3, 0.5e-3];
/// Starts that are followed to the end.
const FOLLOWED: usize = 60;
/// Rate of the readings until then, 1/s.
const RATE_HZ: f64 = 10.0;
/// … and after it.
const LAST_RATE_HZ: f64 = 40.0;
/// Number of different answers that are returned.
const DIFFERENT: usize = 8;
/// Two answers nearer than this in t_d (s) and attitude (rad) are the same.
const SAME: (f64, f64) = (0.02, 0.05);

/// An answer of the windows.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Candidate {
    /// Clock and hand-eye transform.
    pub at: Guess,
    /// Mean loss at half a millimetre, 0 to 1.
    pub cost: f64,
}

/// Settings of a search.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Breadth {
    /// Duration of a window, s.
    pub window_s: f64,
    /// Index of the set of attitudes.
    pub attitudes: usize,
}

/// Searches, in this order until an answer is good.
pub(crate) const SEARCHES: [Breadth; 5] = [
    Breadth { window_s: 2.0, attitudes: 0 },
    Breadth { window_s: 4.0, attitudes: 0 },
    Breadth { window_s: 2.0, attitudes: 1 },
    Breadth { window_s: 1.0, attitudes: 0 },
    Breadth { window_s: 2.0, attitudes: 2 },
];

/// Time offsets within plus and minus a window, s.
#[must_use]
pub(crate) fn offsets_s(within_s: f64) -> Vec<f64> {
    let steps = (within_s / OFFSET_STEP_S).round().max(0.0) as i32;
    (-steps..=steps).map(|k| f64::from(k) * OFFSET_STEP_S).collect()
}

/// All time offsets with the attitudes of a set; the sensor is at the tool's origin.
#[must_use]
pub(crate) fn everywhere(within_s: f64, set: usize) -> Vec<Guess> {
    let turn = so3::exp(&(Vector3::new(0.31, -0.72, 0.53) * (0.9 + 1.7 * set as f64)));
    let attitudes: Vec<UnitQuaternion<f64>> =
        so3::cube_rotations().into_iter().map(|rotation| turn * rotation).collect();
    let guess = |time_offset_s: f64| {
        attitudes.iter().map(move |rotation| Guess {
            time_offset_s,
            tool_from_camera: se3::from_parts(*rotation, Vector3::zeros()),
        })
    };
    offsets_s(within_s).into_iter().flat_map(guess).collect()
}

/// The best different answers from the starts, the best first.
#[must_use]
pub(crate) fn sifted(readings: &Readings, starts: &[Guess], window_s: f64, threads: usize) -> Vec<Candidate> {
    sifted_by(readings, starts, window_s, (false, threads))
}

/// The same; the hand-eye transform of the starts may be held.
#[must_use]
pub(crate) fn sifted_by(
    readings: &Readings,
    starts: &[Guess],
    window_s: f64,
    (only_time, threads): (bool, usize),
) -> Vec<Candidate> {
    let [thin, dense] = [RATE_HZ, LAST_RATE_HZ].map(|rate_hz| Windows::of(readings, window_s, rate_hz));
    if thin.is_empty() || dense.is_empty() {
        return Vec::new();
    }
    let follow = |windows: &Windows, starts: &[Guess], scales_m: &[f64], first: usize| {
        let mut found = parallel::filter_map(threads, starts, |start| {
            let (at, cost) = windows.followed(readings, start, scales_m, (first, only_time))?;
            cost.is_finite().then_some(Candidate { at, cost })
        });
        found.sort_by(|a, b| a.cost.total_cmp(&b.cost));
        found
    };
    let states = |found: &[Candidate], most: usize| -> Vec<Guess> {
        found.iter().take(most).map(|candidate| candidate.at).collect()
    };
    let first = follow(&thin, starts, &FIRST_M, 0);
    let second = follow(&thin, &states(&first, first.len().div_ceil(2)), &SECOND_M, FIRST_M.len());
    let last = follow(&dense, &states(&second, FOLLOWED), &LAST_M, FIRST_M.len());
    different(last, DIFFERENT)
}

/// The first of each.
#[must_use]
pub(crate) fn different(found: Vec<Candidate>, most: usize) -> Vec<Candidate> {
    let mut kept: Vec<Candidate> = Vec::new();
    for candidate in found {
        if kept.len() < most && !kept.iter().any(|other| same(&other.at, &candidate.at)) {
            kept.push(candidate);
        }
    }
    kept
}

/// Whether two answers are the same.
#[must_use]
pub(crate) fn same(one: &Guess, other: &Guess) -> bool {
    let turn_rad = one.tool_from_camera.rotation.angle_to(&other.tool_from_camera.rotation);
    (one.time_offset_s - other.time_offset_s).abs() < SAME.0 && turn_rad < SAME.1
}
