//! Distance of a held time offset or hand-eye transform from that of a fit in which it is free.

use crate::config::{HeldSigma, Hold};
use crate::problem::parameters::{LINES, Parameters, ROTATION, TIME_OFFSET, TRANSLATION};
use nalgebra::{DMatrix, DVector};
use std::ops::Range;

/// Squared distance by the covariance that one number passes as rarely as five standard deviations …
const LIMIT_OF_ONE: f64 = 25.0;
/// … and that six numbers pass as rarely.
const LIMIT_OF_SIX: f64 = 41.0;

/// A held quantity that the scan contradicts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum HeldOff {
    /// The time offset.
    TimeOffset {
        /// Where it is held, s.
        held_s: f64,
        /// Estimate of the scan, s.
        found_s: f64,
        /// Standard deviation of the difference, s.
        sigma_s: f64,
    },
    /// The hand-eye transform.
    HandEye {
        /// Angle between both, rad.
        turned_rad: f64,
        /// Distance between both translations, m.
        shifted_m: f64,
        /// Distance between both in standard deviations.
        sigmas: f64,
    },
}

impl HeldOff {
    /// Compares the quantities held at `held` with the free fit at `found`, whose covariance by components is `covariance`. `None` where the two
    /// agree within the uncertainty of both.
    pub(crate) fn of(
        hold: Hold,
        [held, found]: [&Parameters; 2],
        known: &HeldSigma,
        covariance: impl Fn(usize, usize) -> f64,
    ) -> Option<Self> {
        let step = found.minus(&held.guess());
        let (components, limit): (Range<usize>, f64) = match hold {
            Hold::TimeOffset => (TIME_OFFSET..TIME_OFFSET + 1, LIMIT_OF_ONE),
            Hold::HandEye => (ROTATION..LINES, LIMIT_OF_SIX),
        };
        let (first, size) = (components.start, components.len());
        let apart = DVector::from_fn(size, |i, _| step[first + i]);
        let of_both = DMatrix::from_fn(size, size, |i, j| {
            covariance(first + i, first + j) + if i == j { variance(known, first + i) } else { 0.0 }
        });
        let squared = apart.dot(&of_both.clone().cholesky()?.solve(&apart));
        let off = match hold {
            Hold::TimeOffset => Self::TimeOffset {
                held_s: held.time_offset_s,
                found_s: found.time_offset_s,
                sigma_s: of_both[(0, 0)].sqrt(),
            },
            Hold::HandEye => Self::HandEye {
                turned_rad: apart.rows(0, 3).norm(),
                shifted_m: apart.rows(3, 3).norm(),
                sigmas: squared.sqrt(),
            },
        };
        (squared > limit).then_some(off)
    }
}

/// Variance that the user states of a held component.
fn variance(known: &HeldSigma, component: usize) -> f64 {
    let sigma = match component {
        TIME_OFFSET => known.time_s,
        ROTATION..TRANSLATION => known.rotation_rad,
        _ => known.translation_m,
    };
    sigma.map_or(0.0, |sigma| sigma * sigma)
}
