//! The noise of a face, and the losses at its end, from the profiles about it.
//!
//! One face has a few hundred points, so its variance is known to about 15 %. Weights by such variances favour faces with
//! accidentally small ones. With a relative variance c² of the stated variance, the mean of many has the variance (1 + c²)
//! σ²/n but states σ²/n / (1 + c²). It is too small by about c². So the noise is that of the neighbouring profiles together.
//! The shared quantity is Lᵀ C L, with the covariance C of the line and its information A = L Lᵀ for points of unit noise.
//! It is the variance of a point, and its change along the face, independent of the number and places of points.

use super::face_end::lost_part;
use super::seen_joint::SeenJoint;
use crate::measure::regression::{OWN_NOISE, Regression};
use nalgebra::Matrix2;

/// Profiles before and after one that share its noise: 33 faces leave 3 % of 15 %.
const NEIGHBOURS: usize = 16;

/// Gives each face and each tip the noise of the profiles about it, left and right ones separately, and each end the lost
/// columns at theirs.
pub(super) fn share_noise(profiles: &mut [&mut SeenJoint]) {
    for side in 0..2 {
        share(profiles, |profile| Some(&mut profile.faces[side].as_mut()?.regression));
        share(profiles, |profile| Some(&mut profile.end_of_face_mut(side)?.tip.regression));
    }
    let lost: Vec<Vec<[usize; 2]>> =
        profiles.iter_mut().map(|profile| profile.ends_mut().map(|end| end.lost_of()).collect()).collect();
    for (k, profile) in profiles.iter_mut().enumerate() {
        let about = &lost[neighbours(k, lost.len())];
        for (number, end) in profile.ends_mut().enumerate() {
            let beside = about.iter().filter_map(|ends| ends.get(number));
            end.lost_part = lost_part(beside.fold([0; 2], |sum, [lost, of]| [sum[0] + lost, sum[1] + of]));
        }
    }
}

/// Gives one line of each profile the noise of the same line in the profiles about it.
fn share(
    profiles: &mut [&mut SeenJoint],
    line: impl for<'a> Fn(&'a mut SeenJoint) -> Option<&'a mut Regression>,
) {
    let own: Vec<Matrix2<f64>> = profiles
        .iter_mut()
        .map(|profile| line(profile).and_then(|line| line.noise()).unwrap_or_else(Matrix2::zeros))
        .collect();
    for (k, profile) in profiles.iter_mut().enumerate() {
        let about = &own[neighbours(k, own.len())];
        // A face with more scatter keeps its own noise, and does not share it.
        let limit = OWN_NOISE * median_trace(about);
        let Some(line) = line(profile) else { continue };
        if own[k].trace() > limit {
            continue;
        }
        let alike = about.iter().filter(|noise| noise.trace() <= limit);
        let mean = alike.clone().sum::<Matrix2<f64>>() / alike.count().max(1) as f64;
        *line = line.with_noise(&mean);
    }
}

fn neighbours(k: usize, count: usize) -> std::ops::Range<usize> {
    k.saturating_sub(NEIGHBOURS)..(k + NEIGHBOURS + 1).min(count)
}

fn median_trace(noises: &[Matrix2<f64>]) -> f64 {
    let mut traces: Vec<f64> = noises.iter().map(Matrix2::trace).collect();
    crate::measure::regression::median(&mut traces)
}
