//! Places the seam in base with a known calibration.

use crate::assess::residuals::why_not_placed;
use crate::config::Config;
use crate::error::Error;
use crate::input::observations::{self, observe_anywhere};
use crate::input::skip::Skip;
use crate::input::timestamps::Sampling;
use crate::problem::parameters::Parameters;
use crate::problem::placement::placement;
use nalgebra::Vector3;
use std::collections::BTreeMap;
use trueline_dataset::{Guess, Recording};

/// One measured point of a seam.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SeamPoint {
    /// Row of the feature in the recording, from 0.
    pub row: u32,
    /// Its seam.
    pub line: u32,
    /// Stamp of its image since the first robot sample, s.
    pub stamp_s: f64,
    /// The point in base, m.
    pub point_in_base: Vector3<f64>,
}

/// All points of a recording, and the features without a point, by reason.
#[derive(Clone, Debug, Default)]
pub struct SeamPoints {
    /// By rising stamp.
    pub list: Vec<SeamPoint>,
    /// Missing points by reason.
    pub skipped: BTreeMap<Skip, usize>,
}

/// Places every feature of a recording in base. Stamps are used as recorded, as by a robot that follows the seam.
///
/// # Errors
/// A recording that cannot be lifted onto the sheet: see `observe_anywhere`.
pub fn place(recording: &Recording, by: &Guess, config: &Config) -> Result<SeamPoints, Error> {
    let sampling = Sampling::of(recording, observations::origin_ns(recording));
    let observations = observe_anywhere(recording, &sampling, config)?;
    let at = Parameters::straight(by, Vec::new());
    let mut points = SeamPoints { list: Vec::new(), skipped: observations.skipped.clone() };
    for o in &observations.list {
        let Some(placement) = placement(&observations, o, &at) else {
            let reason = why_not_placed(&observations, o.stamp_s - at.time_offset_s);
            *points.skipped.entry(reason).or_insert(0) += 1;
            continue;
        };
        points.list.push(SeamPoint {
            row: o.row,
            line: o.line,
            stamp_s: o.stamp_s,
            point_in_base: placement.point_in_base(&o.point_in_camera),
        });
    }
    Ok(points)
}
