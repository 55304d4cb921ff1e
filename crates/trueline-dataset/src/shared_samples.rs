//! Whether two recordings are, whole or in part, one.

use crate::recording::{Measured, Recording};
use std::collections::HashSet;

/// Above this part of the smaller one it is not a coincidence. Readings of whole pixels, of clocks that begin at zero and of
/// programs that repeat to the digit may agree here and there.
const COINCIDENCE: f64 = 0.1;

/// A sample: its stamp, and the bits of its numbers.
type Sample = (i64, Vec<u64>);

/// Number of measurements in both recordings, and number in the smaller one, if these and the poses agree by more than
/// coincidence; else `None`. Measurements count whichever line they are of.
#[must_use]
pub(crate) fn shared_measurements(a: &Recording, b: &Recording) -> Option<[usize; 2]> {
    let ([a_first_ns, a_last_ns], [b_first_ns, b_last_ns]) = (span_ns(a)?, span_ns(b)?);
    // Scans one after the other, the usual case, have nothing to compare.
    if a_last_ns < b_first_ns || b_last_ns < a_first_ns {
        return None;
    }
    shared(&poses(a), &poses(b))?;
    shared(&measurements(a), &measurements(b))
}

/// First and last stamp of the robot, ns.
fn span_ns(recording: &Recording) -> Option<[i64; 2]> {
    Some([recording.robot.first()?.stamp_ns, recording.robot.last()?.stamp_ns])
}

fn shared(a: &HashSet<Sample>, b: &HashSet<Sample>) -> Option<[usize; 2]> {
    let (shared, of) = (a.intersection(b).count(), a.len().min(b.len()));
    (shared as f64 > COINCIDENCE * of as f64).then_some([shared, of])
}

fn poses(recording: &Recording) -> HashSet<Sample> {
    let of = |sample: &crate::RobotSample| {
        let pose = &sample.base_from_tool;
        let numbers = pose.translation.vector.iter().chain(pose.rotation.coords.iter());
        (sample.stamp_ns, numbers.map(|number| number.to_bits()).collect())
    };
    recording.robot.iter().map(of).collect()
}

fn measurements(recording: &Recording) -> HashSet<Sample> {
    let features = recording.features.iter().map(|feature| (feature.stamp_ns, bits(&feature.measured)));
    let stripes = recording.stripes.iter().map(|stripe| {
        let [first, second] = stripe.points.each_ref().map(bits);
        (stripe.stamp_ns, [first, second].concat())
    });
    features.chain(stripes).collect()
}

fn bits(measured: &Measured) -> Vec<u64> {
    let numbers = match measured {
        Measured::Pixel(two) | Measured::Profile(two) => two.as_slice(),
        Measured::Point(three) => three.as_slice(),
    };
    numbers.iter().map(|number| number.to_bits()).collect()
}
