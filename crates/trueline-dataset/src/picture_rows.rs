//! Which stripes and seam points belong to one picture.
//!
//! If every row has a frame number, the number decides: the two tables may be stamped by different programs. A counter that
//! starts again cannot name a picture. Then, as without a counter, rows of one stamp belong together.

use crate::recording::{Feature, PlateStripe, Recording};
use std::collections::{BTreeMap, BTreeSet};
use trueline_geometry::statistics::median;

/// How the rows of a recording's pictures are matched.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PicturesOfRows {
    /// By the number of their frame.
    Counted,
    /// By their stamp.
    Stamped,
}

/// Two tables with rows that cannot be matched by picture.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum PicturesDisagree {
    /// A frame is more than a picture later in one table than in the other: they count differently.
    #[error(
        "frame {frame} has the stamp {feature_s:.6} s in features.csv and {stripe_s:.6} s in stripes.csv: \
            more than a picture apart"
    )]
    Frames {
        /// The frame.
        frame: u64,
        /// Stamp of its seam point, s.
        feature_s: f64,
        /// Stamp of its stripes, s.
        stripe_s: f64,
    },
    /// The rows of one frame are stamped apart, by less than there is from one picture to the next.
    #[error(
        "frame {frame} has the stamps {first_s:.6} s and {second_s:.6} s in {file}: less than a picture \
            apart"
    )]
    FrameStampedTwice {
        /// The frame.
        frame: u64,
        /// The table.
        file: &'static str,
        /// Its first stamp, s.
        first_s: f64,
        /// Another, s.
        second_s: f64,
    },
    /// Pictures of one table are stamped beside those of the other, by far less than the time between pictures.
    #[error(
        "the stamps of {beside} of {pictures} pictures in stripes.csv differ from features.csv by up to \
            {by_ms:.3} ms"
    )]
    StampedBeside {
        /// How many are.
        beside: usize,
        /// Of how many.
        pictures: usize,
        /// By how much at most, ms.
        by_ms: f64,
    },
    /// Hardly a picture of one table has a stamp of the other.
    #[error("only {alike} of {pictures} pictures in stripes.csv have a stamp from features.csv")]
    Stamps {
        /// Number of pictures that agree.
        alike: usize,
        /// Of how many.
        pictures: usize,
    },
}

impl PicturesDisagree {
    /// Remedy for the user.
    #[must_use]
    pub fn hint(&self) -> &'static str {
        match self {
            Self::Frames { .. } => {
                "both tables must count the same pictures, or leave the column `frame` out of one of them"
            }
            Self::FrameStampedTwice { .. } => {
                "give all rows of one frame one stamp: the time at which the picture arrived"
            }
            Self::StampedBeside { .. } | Self::Stamps { .. } => {
                "give both tables the column `frame`, or write the same stamp with the same digits in both"
            }
        }
    }
}

/// If fewer pictures than this part have a stamp of the other table's, they are stamped by another clock, or rounded to
/// other digits.
const LEAST_ALIKE: f64 = 0.1;
/// Fewest pictures for this judgement.
const FEWEST_PICTURES: usize = 10;

impl PicturesOfRows {
    /// As the rows of a recording allow.
    ///
    /// # Errors
    /// [`PicturesDisagree`].
    pub fn of(recording: &Recording) -> Result<Self, PicturesDisagree> {
        if counted(recording)?.is_some() {
            return Ok(Self::Counted);
        }
        check_stamps(recording)?;
        Ok(Self::Stamped)
    }

    /// Name of a stripe's picture.
    #[must_use]
    pub fn of_stripe(self, stripe: &PlateStripe) -> i64 {
        self.name(stripe.frame, stripe.stamp_ns)
    }

    /// Name of a seam point's picture.
    #[must_use]
    pub fn of_feature(self, feature: &Feature) -> i64 {
        self.name(feature.frame, feature.stamp_ns)
    }

    fn name(self, frame: Option<u64>, stamp_ns: i64) -> i64 {
        match (self, frame) {
            (Self::Counted, Some(frame)) => frame.cast_signed(),
            _ => stamp_ns,
        }
    }
}

/// Gives the stripes of counted pictures the stamps of their seam points, so that they are paired without the count as well.
///
/// # Errors
/// [`PicturesDisagree`].
pub(crate) fn stamp_alike(recording: &mut Recording) -> Result<(), PicturesDisagree> {
    let Some(stamps) = counted(recording)? else { return Ok(()) };
    for stripe in &mut recording.stripes {
        if let Some(stamp_ns) = stripe.frame.and_then(|frame| stamps.get(&frame)) {
            stripe.stamp_ns = *stamp_ns;
        }
    }
    Ok(())
}

/// Whether the stripes' pictures match the seam points' by their stamps.
fn check_stamps(recording: &Recording) -> Result<(), PicturesDisagree> {
    let features: BTreeSet<i64> = recording.features.iter().map(|feature| feature.stamp_ns).collect();
    let stripes: BTreeSet<i64> = recording.stripes.iter().map(|stripe| stripe.stamp_ns).collect();
    let (alike, pictures) = (stripes.intersection(&features).count(), stripes.len());
    let fewer = pictures.min(features.len());
    if fewer >= FEWEST_PICTURES && (alike as f64) < LEAST_ALIKE * fewer as f64 {
        return Err(PicturesDisagree::Stamps { alike, pictures });
    }
    let beside = stamped_beside(&features, &stripes);
    match beside.iter().max() {
        Some(&by_ns) if beside.len() as f64 > MANY_BESIDE * pictures as f64 => {
            let by_ms = by_ns as f64 * 1e-6;
            Err(PicturesDisagree::StampedBeside { beside: beside.len(), pictures, by_ms })
        }
        _ => Ok(()),
    }
}

/// Of fewer pictures it may be chance: they arrive in bursts, one of them without a stripe and the next without a seam point.
const MANY_BESIDE: f64 = 0.02;

/// No two pictures are nearer to each other than this part of the usual time between them: stamps that are were meant for one.
const NEAREST: f64 = 0.05;

/// Difference of the stripes' stamps from the nearest seam point's, ns, for those that are too near to belong to another
/// picture.
fn stamped_beside(features: &BTreeSet<i64>, stripes: &BTreeSet<i64>) -> Vec<i64> {
    let all: BTreeSet<i64> = features.union(stripes).copied().collect();
    let period_ns = period_ns(stripes.iter().copied()).min(period_ns(features.iter().copied()));
    let too_near = |step_ns: i64| step_ns as f64 <= NEAREST * period_ns;
    let pairs = all.iter().zip(all.iter().skip(1)).map(|(a, b)| (*a, *b));
    let of_two_tables = |(a, b): &(i64, i64)| {
        let alone = |ns: &i64| features.contains(ns) != stripes.contains(ns);
        alone(a) && alone(b) && features.contains(a) != features.contains(b)
    };
    pairs.filter(of_two_tables).map(|(a, b)| b - a).filter(|step_ns| too_near(*step_ns)).collect()
}

/// Median time between rising stamps, ns; 0 without any.
fn period_ns(stamps_ns: impl Iterator<Item = i64> + Clone) -> f64 {
    let next = stamps_ns.clone().skip(1);
    median(stamps_ns.zip(next).map(|(a, b)| (b - a) as f64)).unwrap_or(0.0)
}

/// The stamps of the seam points' frames; `None` where pictures are not counted.
fn counted(recording: &Recording) -> Result<Option<BTreeMap<u64, i64>>, PicturesDisagree> {
    if recording.stripes.is_empty() {
        return Ok(None);
    }
    let features =
        stamps("features.csv", recording.features.iter().map(|feature| (feature.frame, feature.stamp_ns)))?;
    let stripes =
        stamps("stripes.csv", recording.stripes.iter().map(|stripe| (stripe.frame, stripe.stamp_ns)))?;
    let (Some(features), Some(stripes)) = (features, stripes) else { return Ok(None) };
    let times: BTreeSet<i64> = stripes.values().copied().collect();
    let period_ns = period_ns(times.iter().copied());
    for (&frame, &stripe_ns) in &stripes {
        let Some(&feature_ns) = features.get(&frame) else { continue };
        if (feature_ns - stripe_ns).abs() as f64 > period_ns {
            let [feature_s, stripe_s] = [feature_ns, stripe_ns].map(|ns| ns as f64 * 1e-9);
            return Err(PicturesDisagree::Frames { frame, feature_s, stripe_s });
        }
    }
    Ok(Some(features))
}

/// The stamp of each frame; `None` where a row has no number, or one number has two stamps since the counter started again.
///
/// # Errors
/// [`PicturesDisagree::FrameStampedTwice`].
fn stamps(
    file: &'static str,
    rows: impl Iterator<Item = (Option<u64>, i64)>,
) -> Result<Option<BTreeMap<u64, i64>>, PicturesDisagree> {
    let mut stamps = BTreeMap::new();
    let mut again: Option<(u64, i64, i64)> = None;
    for (frame, stamp_ns) in rows {
        let Some(frame) = frame else { return Ok(None) };
        let first_ns = *stamps.entry(frame).or_insert(stamp_ns);
        if first_ns != stamp_ns && again.is_none_or(|(_, a, b)| (stamp_ns - first_ns).abs() < (b - a).abs()) {
            again = Some((frame, first_ns, stamp_ns));
        }
    }
    let Some((frame, first_ns, second_ns)) = again else { return Ok(Some(stamps)) };
    // One stamp of each frame: the usual time between pictures is not that between the rows of one.
    let times: BTreeSet<i64> = stamps.values().copied().collect();
    if ((second_ns - first_ns).abs() as f64) < period_ns(times.iter().copied()) {
        let [first_s, second_s] = [first_ns, second_ns].map(|ns| ns as f64 * 1e-9);
        return Err(PicturesDisagree::FrameStampedTwice { frame, file, first_s, second_s });
    }
    Ok(None)
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;
    use crate::recording::{Measured, Sensor};
    use crate::sensor_setup::SensorSetup;

    const PERIOD_NS: i64 = 30_000_000;

    /// Thirty pictures; every second one has a seam point and all have a stripe.
    fn recording() -> Recording {
        let mut recording = Recording::new(Sensor::Profiler, SensorSetup::default(), Vec::new(), Vec::new());
        for frame in 0..30_u64 {
            let stamp_ns = 7 + PERIOD_NS * frame.cast_signed();
            let points = [Measured::Profile([0.0, 0.1]), Measured::Profile([0.01, 0.1])];
            let stripe = PlateStripe { stamp_ns, frame: Some(frame), plate: 0, points, sigma: 1e-5 };
            recording.stripes.push(stripe);
            if frame % 2 == 0 {
                recording.features.push(Feature {
                    stamp_ns,
                    line: 0,
                    frame: Some(frame),
                    device_ns: None,
                    measured: points[0],
                    sigma: None,
                    correlation: 0.0,
                });
            }
        }
        recording
    }

    fn uncounted(mut recording: Recording) -> Recording {
        recording.stripes.iter_mut().for_each(|stripe| stripe.frame = None);
        recording
    }

    #[test]
    fn pictures_are_told_by_their_frame_and_else_by_their_stamp() {
        assert_eq!(PicturesOfRows::of(&recording()), Ok(PicturesOfRows::Counted));
        assert_eq!(PicturesOfRows::of(&uncounted(recording())), Ok(PicturesOfRows::Stamped));
        // A counter that starts again names no picture.
        let mut again = recording();
        again.stripes[20].frame = Some(0);
        assert_eq!(PicturesOfRows::of(&again), Ok(PicturesOfRows::Stamped));
    }

    #[test]
    fn rows_of_a_frame_that_are_stamped_apart_are_refused() {
        let mut apart = recording();
        let late =
            PlateStripe { plate: 1, stamp_ns: apart.stripes[4].stamp_ns + 5_000_000, ..apart.stripes[4] };
        apart.stripes.insert(5, late);
        let refused = PicturesOfRows::of(&apart).unwrap_err();
        assert!(
            matches!(refused, PicturesDisagree::FrameStampedTwice { frame: 4, file: "stripes.csv", .. }),
            "{refused}"
        );
    }

    #[test]
    fn stamps_that_are_rounded_in_some_rows_are_refused() {
        let mut rounded = uncounted(recording());
        rounded.stripes.iter_mut().step_by(4).for_each(|stripe| stripe.stamp_ns += 50_000);
        let refused = PicturesOfRows::of(&rounded).unwrap_err();
        assert!(
            matches!(refused, PicturesDisagree::StampedBeside { beside: 8, pictures: 30, .. }),
            "{refused}"
        );
        // Pictures between those with a seam point are not a rounding of these.
        let mut between = uncounted(recording());
        between.stripes.iter_mut().step_by(4).for_each(|stripe| stripe.stamp_ns += PERIOD_NS / 3);
        assert_eq!(PicturesOfRows::of(&between), Ok(PicturesOfRows::Stamped));
    }
}
