//! Measurements of a scan, frame by frame: whole profiles, or seam points and the ends of stripes.

use trueline::open::Measurements;
use trueline_dataset::{Measured, ProfilePoint};

/// One reading.
pub(crate) struct MeasuredPoint {
    pub measured: Measured,
    pub intensity: Option<f64>,
}

/// The readings of a frame, one after the other.
type Points<'a> = Box<dyn Iterator<Item = MeasuredPoint> + 'a>;

/// The readings of one stamp.
pub(crate) struct MeasuredFrame<'a> {
    pub stamp_ns: i64,
    pub number: Option<u64>,
    pub points: Points<'a>,
}

/// Whether any point has a brightness.
pub(crate) fn has_intensity(measured: &Measurements) -> bool {
    let points = || measured.profiles.iter().flat_map(|profile| &profile.points);
    points().any(|point| point.intensity.is_some())
}

/// All frames of a scan: those of its profiles, or of its seam points and then of its stripes.
pub(crate) fn of(measured: &Measurements) -> Box<dyn Iterator<Item = MeasuredFrame<'_>> + '_> {
    if !measured.profiles.is_empty() {
        return Box::new(measured.profiles.iter().map(|profile| MeasuredFrame {
            stamp_ns: profile.stamp_ns,
            number: profile.frame,
            points: Box::new(profile.points.iter().map(of_profile)),
        }));
    }
    let bare = |measured| MeasuredPoint { measured, intensity: None };
    let features = &measured.recording.features;
    let features = features.chunk_by(|a, b| a.stamp_ns == b.stamp_ns).map(move |image| MeasuredFrame {
        stamp_ns: image[0].stamp_ns,
        number: image[0].frame,
        points: Box::new(image.iter().map(move |feature| bare(feature.measured))) as Points<'_>,
    });
    let stripes = &measured.recording.stripes;
    let stripes = stripes.chunk_by(|a, b| a.stamp_ns == b.stamp_ns).map(move |image| MeasuredFrame {
        stamp_ns: image[0].stamp_ns,
        number: image[0].frame,
        points: Box::new(image.iter().flat_map(|stripe| stripe.points).map(bare)) as Points<'_>,
    });
    Box::new(features.chain(stripes))
}

fn of_profile(point: &ProfilePoint) -> MeasuredPoint {
    MeasuredPoint { measured: Measured::Profile([point.x_m, point.z_m]), intensity: point.intensity }
}
