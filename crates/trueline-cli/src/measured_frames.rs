//! Measurements of a scan, frame by frame: whole profiles, or seam points and the ends of stripes. In memory is one frame.

use crate::failure::Failure;
use crate::opening;
use std::ops::ControlFlow;
use trueline::open::Measurements;
use trueline_dataset::{Measured, Profile, ProfilesRead};

/// The readings of one stamp.
#[derive(Debug, Default)]
pub(crate) struct MeasuredFrame {
    pub stamp_ns: i64,
    pub number: Option<u64>,
    pub readings: Vec<Measured>,
    /// Brightness of each reading; empty if none was recorded.
    pub intensities: Vec<Option<f64>>,
}

/// Takes one frame after the other; [`ControlFlow::Break`] ends the reading.
type EachFrame<'a> = dyn FnMut(&MeasuredFrame) -> ControlFlow<()> + 'a;

/// Whether the points have a brightness: the first profile with a point shows it.
pub(crate) fn has_intensity(measured: &Measurements) -> Result<bool, Failure> {
    let mut has = false;
    opening::profiles(measured, false, &mut |profile| match profile.points.first() {
        Some(point) => {
            has = point.intensity.is_some();
            ControlFlow::Break(())
        }
        None => ControlFlow::Continue(()),
    })?;
    Ok(has)
}

/// All frames of a scan: those of its profiles, or of its seam points and then of its stripes.
pub(crate) fn each(
    measured: &Measurements,
    takes_out_origins: bool,
    each: &mut EachFrame<'_>,
) -> Result<ProfilesRead, Failure> {
    let mut frame = MeasuredFrame::default();
    if measured.has_profiles() {
        return opening::profiles(measured, takes_out_origins, &mut |profile| {
            frame.take(&profile);
            each(&frame)
        });
    }
    let features = &measured.recording.features;
    for image in features.chunk_by(|a, b| a.stamp_ns == b.stamp_ns) {
        let readings = image.iter().map(|feature| feature.measured);
        frame.set(image[0].stamp_ns, image[0].frame, readings);
        if each(&frame).is_break() {
            return Ok(ProfilesRead::default());
        }
    }
    let stripes = &measured.recording.stripes;
    for image in stripes.chunk_by(|a, b| a.stamp_ns == b.stamp_ns) {
        let readings = image.iter().flat_map(|stripe| stripe.points);
        frame.set(image[0].stamp_ns, image[0].frame, readings);
        if each(&frame).is_break() {
            break;
        }
    }
    Ok(ProfilesRead::default())
}

impl MeasuredFrame {
    fn set(&mut self, stamp_ns: i64, number: Option<u64>, readings: impl Iterator<Item = Measured>) {
        (self.stamp_ns, self.number) = (stamp_ns, number);
        self.readings.clear();
        self.readings.extend(readings);
    }

    fn take(&mut self, profile: &Profile) {
        let readings = profile.points.iter().map(|point| Measured::Profile([point.x_m, point.z_m]));
        self.set(profile.stamp_ns, profile.frame, readings);
        self.intensities.clear();
        if profile.points.iter().any(|point| point.intensity.is_some()) {
            self.intensities.extend(profile.points.iter().map(|point| point.intensity));
        }
    }
}
