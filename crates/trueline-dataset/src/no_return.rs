//! Codes for no return: sensors write 0, -9999 or their largest number.
//!
//! Such a number is the same to the last digit in every column that has it, and occurs often, without measurements near it.
//! The ranges of a surface scatter.

use crate::error::Problem;
use crate::profile::{Profile, ProfilePoint};
use crate::unit::MM_PER_M;

/// Fewest points with the same range, ...
const FEWEST: usize = 20;
/// ... and the smallest part of all points that they are.
const LEAST_PART: f64 = 0.005;
/// Nothing was measured nearer to it than this, m.
const FAR_M: f64 = 1e-2;

/// A range is the stated one if it is this near to it, m: less than the last digit that any sensor writes.
const SAME_M: f64 = 1e-9;

/// Removes the points with the user's code for no return; returns their number.
pub fn take_out(profiles: &mut [Profile], range_m: f64) -> usize {
    let mut taken = 0;
    for profile in profiles {
        let before = profile.points.len();
        profile.points.retain(|point| (point.z_m - range_m).abs() > SAME_M);
        taken += before - profile.points.len();
    }
    taken
}

/// Fewest points in the origin that mean no return.
const FEWEST_ORIGINS: usize = 3;

/// Whether a point is at exactly (0, 0).
fn is_origin(point: &ProfilePoint) -> bool {
    point.x_m == 0.0 && point.z_m == 0.0
}

/// The smallest of some numbers, how often it comes, and the next larger one.
#[derive(Clone, Copy, Debug)]
struct Least {
    value: f64,
    alike: usize,
    next: f64,
}

impl Least {
    fn add(&mut self, value: f64) {
        if value > self.value {
            self.next = self.next.min(value);
        } else if value == self.value {
            self.alike += 1;
        } else if value < self.value {
            *self = Self { value, alike: 1, next: self.value };
        }
    }
}

/// Findings about codes for no return, point by point.
#[derive(Clone, Copy, Debug)]
pub struct NoReturns {
    origins: usize,
    others: usize,
    is_any_near: bool,
    ranges: usize,
    /// Of the ranges, and of the ranges with the other sign.
    ends: [Least; 2],
}

impl Default for NoReturns {
    fn default() -> Self {
        let none = Least { value: f64::INFINITY, alike: 0, next: f64::INFINITY };
        Self { origins: 0, others: 0, is_any_near: false, ranges: 0, ends: [none; 2] }
    }
}

impl NoReturns {
    /// Notes all points of profiles.
    fn of(profiles: &[Profile]) -> Self {
        let mut seen = Self::default();
        for point in profiles.iter().flat_map(|profile| &profile.points) {
            seen.note(point);
            seen.note_range(point);
        }
        seen
    }

    /// Notes the points of a profile. Those in the origin are taken out of it if they are to be.
    pub fn look(&mut self, profile: &mut Profile, takes_out_origins: bool) {
        let origins = self.origins;
        for point in &profile.points {
            self.note(point);
            if !(takes_out_origins && is_origin(point)) {
                self.note_range(point);
            }
        }
        if takes_out_origins && self.origins > origins {
            profile.points.retain(|point| !is_origin(point));
        }
    }

    fn note(&mut self, point: &ProfilePoint) {
        if is_origin(point) {
            self.origins += 1;
        } else {
            self.others += 1;
            self.is_any_near |= point.x_m * point.x_m + point.z_m * point.z_m <= FAR_M * FAR_M;
        }
    }

    fn note_range(&mut self, point: &ProfilePoint) {
        self.ranges += 1;
        self.ends[0].add(point.z_m);
        self.ends[1].add(-point.z_m);
    }

    /// Whether there are points in the origin, and these are measurements.
    #[must_use]
    pub fn origins_are_measured(&self) -> bool {
        self.origins > 0 && (self.origins < FEWEST_ORIGINS || self.others == 0 || self.is_any_near)
    }

    /// Remark on the points in the origin that mean no return; `None` if there are none.
    #[must_use]
    pub fn origins(&self) -> Option<String> {
        if self.origins == 0 || self.origins_are_measured() {
            return None;
        }
        let of = self.origins + self.others;
        Some(format!(
            "{} of {of} points are exactly (0, 0), far from all others: no return, left out",
            self.origins
        ))
    }

    /// Reports a smallest or largest range that means no return.
    ///
    /// # Errors
    /// [`Problem::NoReturn`].
    pub fn check(&self) -> Result<(), Problem> {
        for (end, sign) in self.ends.iter().zip([1.0, -1.0]) {
            // Infinite if nothing else was measured: a level plate without noise.
            let apart_m = end.next - end.value;
            let is_common = end.alike >= FEWEST && end.alike as f64 >= LEAST_PART * self.ranges as f64;
            if is_common && apart_m.is_finite() && apart_m > FAR_M {
                let range_mm = sign * end.value * MM_PER_M;
                return Err(Problem::NoReturn { range_mm, points: end.alike, of: self.ranges });
            }
        }
        Ok(())
    }
}

/// Removes points at exactly (0, 0) without other measurements near them, and reports their number: sensors write them for
/// no return.
pub fn take_out_origins(profiles: &mut [Profile]) -> Option<String> {
    let said = NoReturns::of(profiles).origins()?;
    profiles.iter_mut().for_each(|profile| profile.points.retain(|point| !is_origin(point)));
    Some(said)
}

/// Reports profiles in which the smallest or the largest range means no return.
///
/// # Errors
/// [`Problem::NoReturn`].
pub fn check(profiles: &[Profile]) -> Result<(), Problem> {
    NoReturns::of(profiles).check()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;

    /// A profile of a lap: 100 columns at 0.1 m and 100 of them 3 mm lower, and in this many columns one range.
    fn profiles(others: usize, range_m: f64) -> Vec<Profile> {
        let column = |k: usize, z_m: f64| ProfilePoint { x_m: k as f64 * 1e-4, z_m, intensity: None };
        let plates = (0..200).map(|k| column(k, 0.1 + if k < 100 { 0.0 } else { 3e-3 }));
        let points = plates.chain((200..200 + others).map(|k| column(k, range_m))).collect();
        vec![Profile { stamp_ns: 0, frame: None, points }]
    }

    #[test]
    fn a_range_that_stands_for_no_return_is_refused() {
        for range_m in [0.0, -9.999, 32.767] {
            let problem = check(&profiles(20, range_m)).unwrap_err();
            let said = format!("20 of 220 points have a range of exactly {} mm", range_m * MM_PER_M);
            assert!(problem.to_string().starts_with(&said), "{problem}");
        }
    }

    /// A scan with ranges that span more than their distance from 0.
    #[test]
    fn it_is_refused_however_far_the_ranges_span() {
        let wide =
            (0..100).map(|k| ProfilePoint { x_m: 0.0, z_m: 0.08 + 1e-3 * f64::from(k), intensity: None });
        let mut profiles = profiles(20, 0.0);
        profiles[0].points.extend(wide);
        assert!(check(&profiles).is_err());
    }

    #[test]
    fn points_in_the_origin_are_left_out_where_all_others_are_far() {
        let origin = ProfilePoint { x_m: 0.0, z_m: 0.0, intensity: None };
        let with = |origins: usize, lower_m: f64| {
            let mut profiles = profiles(0, 0.0);
            profiles[0].points.iter_mut().for_each(|point| point.z_m -= lower_m);
            profiles[0].points.extend(vec![origin; origins]);
            profiles
        };
        let mut seen = with(3, 0.0);
        let said = take_out_origins(&mut seen).unwrap();
        assert!(said.starts_with("3 of 203 points are exactly (0, 0)"), "{said}");
        assert_eq!(seen[0].points.len(), 200);
        // Too few; a surface near the zero of its ranges; nothing else.
        let mut alone = with(3, 0.0);
        alone[0].points.drain(..200);
        for mut left in [with(2, 0.0), with(3, 0.1), alone] {
            let count = left[0].points.len();
            assert_eq!((take_out_origins(&mut left), left[0].points.len()), (None, count));
        }
    }

    /// A stream that leaves origins out knows at its end whether it should have.
    #[test]
    fn a_stream_says_what_all_profiles_together_say() {
        for (origins, lower_m) in [(3, 0.0), (2, 0.0), (3, 0.1), (0, 0.0)] {
            let mut all = profiles(0, 0.0);
            all[0].points.iter_mut().for_each(|point| point.z_m -= lower_m);
            all[0].points.extend(vec![ProfilePoint { x_m: 0.0, z_m: 0.0, intensity: None }; origins]);
            let (mut streamed, mut seen) = (all.clone(), NoReturns::default());
            streamed.iter_mut().for_each(|profile| seen.look(profile, true));
            let said = take_out_origins(&mut all);
            assert_eq!(
                (seen.origins(), seen.origins_are_measured()),
                (said.clone(), said.is_none() && origins > 0)
            );
            assert!(said.is_none() || streamed == all);
            assert_eq!(seen.check().is_ok(), check(&streamed).is_ok());
        }
    }

    #[test]
    fn what_the_user_names_is_taken_out() {
        let mut profiles = profiles(20, -9.999);
        assert_eq!((take_out(&mut profiles, 0.0), take_out(&mut profiles, -9.999)), (0, 20));
        assert!(check(&profiles).is_ok());
    }

    #[test]
    fn plates_and_a_few_stray_points_are_none() {
        assert!(check(&profiles(0, 0.0)).is_ok());
        // Too few; and another plate, 9 mm lower.
        assert!(check(&profiles(19, 0.0)).is_ok());
        assert!(check(&profiles(100, 0.112)).is_ok());
        // One plate, square to the sight, without noise.
        let mut level = profiles(0, 0.0);
        level[0].points.truncate(100);
        assert!(check(&level).is_ok());
        assert!(check(&[]).is_ok());
    }
}
