//! Which stripes and seam points belong to one picture.
//!
//! Where every row counts its frames, the number says it: the two tables may be stamped by programs of their own. A counter that
//! starts again is no name of a picture, and then, as where nothing is counted, rows of one stamp belong together.

use crate::recording::{Feature, PlateStripe, Recording};
use std::collections::{BTreeMap, BTreeSet};
use trueline_geometry::statistics::median;

/// How the pictures of a recording are told apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PicturesOfRows {
    /// By the number of their frame.
    Counted,
    /// By their stamp.
    Stamped,
}

/// Two tables of which the rows of one picture cannot be told.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum PicturesDisagree {
    /// A frame is more than a picture later in one table than in the other: they count differently.
    #[error(
        "frame {frame} is stamped {feature_s:.6} s in features.csv and {stripe_s:.6} s in stripes.csv, more than a picture apart"
    )]
    Frames {
        /// Which frame.
        frame: u64,
        /// Stamp of its seam point, s.
        feature_s: f64,
        /// Stamp of its stripes, s.
        stripe_s: f64,
    },
    /// Hardly a picture of one table has a stamp of the other.
    #[error("{alike} of {pictures} pictures of stripes.csv have the stamp of one in features.csv")]
    Stamps {
        /// Those that do.
        alike: usize,
        /// Of how many.
        pictures: usize,
    },
}

impl PicturesDisagree {
    /// What the user can do about it.
    #[must_use]
    pub fn hint(&self) -> &'static str {
        match self {
            Self::Frames { .. } => {
                "both tables must count the same pictures, or leave the column `frame` out of one of them"
            }
            Self::Stamps { .. } => {
                "give both tables the column `frame`, or write the same stamp with the same digits in both"
            }
        }
    }
}

/// Pictures of which fewer than this part have a stamp of the other table's are stamped by another clock, or rounded to other digits.
const LEAST_ALIKE: f64 = 0.1;
/// Fewest pictures of which that is told.
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

    /// What names the picture of a stripe.
    #[must_use]
    pub fn of_stripe(self, stripe: &PlateStripe) -> i64 {
        self.name(stripe.frame, stripe.stamp_ns)
    }

    /// What names the picture of a seam point.
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

/// Whether the pictures of stripes are those of seam points by their stamps.
fn check_stamps(recording: &Recording) -> Result<(), PicturesDisagree> {
    let features: BTreeSet<i64> = recording.features.iter().map(|feature| feature.stamp_ns).collect();
    let stripes: BTreeSet<i64> = recording.stripes.iter().map(|stripe| stripe.stamp_ns).collect();
    let (alike, pictures) = (stripes.intersection(&features).count(), stripes.len());
    let fewer = pictures.min(features.len());
    if fewer >= FEWEST_PICTURES && (alike as f64) < LEAST_ALIKE * fewer as f64 {
        return Err(PicturesDisagree::Stamps { alike, pictures });
    }
    Ok(())
}

/// The stamps of the seam points' frames; `None` where pictures are not counted.
fn counted(recording: &Recording) -> Result<Option<BTreeMap<u64, i64>>, PicturesDisagree> {
    let features = stamps(recording.features.iter().map(|feature| (feature.frame, feature.stamp_ns)));
    let stripes = stamps(recording.stripes.iter().map(|stripe| (stripe.frame, stripe.stamp_ns)));
    let (Some(features), Some(stripes)) = (features, stripes) else { return Ok(None) };
    let mut times: Vec<i64> = stripes.values().copied().collect();
    times.sort_unstable();
    let period_ns = median(times.windows(2).map(|pair| (pair[1] - pair[0]) as f64)).unwrap_or(0.0);
    for (&frame, &stripe_ns) in &stripes {
        let Some(&feature_ns) = features.get(&frame) else { continue };
        if (feature_ns - stripe_ns).abs() as f64 > period_ns {
            let [feature_s, stripe_s] = [feature_ns, stripe_ns].map(|ns| ns as f64 * 1e-9);
            return Err(PicturesDisagree::Frames { frame, feature_s, stripe_s });
        }
    }
    Ok(Some(features))
}

/// The stamp of each frame; `None` where a row has no number, or one number has two stamps.
fn stamps(rows: impl Iterator<Item = (Option<u64>, i64)>) -> Option<BTreeMap<u64, i64>> {
    let mut stamps = BTreeMap::new();
    for (frame, stamp_ns) in rows {
        if *stamps.entry(frame?).or_insert(stamp_ns) != stamp_ns {
            return None;
        }
    }
    Some(stamps)
}
