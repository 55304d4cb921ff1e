//! The detector for a dataset's sensor, with the region of interest of its file.

use trueline_dataset::SensorFile;
use trueline_dataset::sensor_setup::RegionOfInterest;
use trueline_vision::{Detector, PictureRegion, StripeChoice};

/// The reason of a missing detector for a sensor.
#[derive(Debug, thiserror::Error)]
pub enum DetectorError {
    /// The sensor takes no pictures.
    #[error("features are found in the pictures of a camera_laser, and the sensor is of kind {0}")]
    NoCamera(&'static str),
    /// No picture has the region in it.
    #[error("the region of interest lies outside of the pictures, which are {} x {} px", .0[0], .0[1])]
    Region([u32; 2]),
}

/// The detector for a sensor. `region`, in px, is searched instead of the one in the sensor's file.
///
/// # Errors
/// A sensor without pictures, and a region outside of them.
pub fn of(
    file: &SensorFile,
    region: Option<&PictureRegion>,
    stripe: StripeChoice,
) -> Result<Detector, DetectorError> {
    let SensorFile { sensor, setup } = file;
    let detector = Detector::for_sensor(sensor).ok_or(DetectorError::NoCamera(sensor.kind()))?;
    let stated = match setup.region_of_interest {
        Some(RegionOfInterest::Pixels { u_px, v_px }) => PictureRegion::rectangle(u_px, v_px),
        _ => None,
    };
    let region = region.cloned().or(stated);
    let size_px = detector.lens().camera().size;
    if !region.as_ref().is_none_or(|region| region.overlaps(size_px)) {
        return Err(DetectorError::Region(size_px));
    }
    Ok(detector.within(region).choosing(stripe))
}

impl DetectorError {
    /// The remedy.
    #[must_use]
    pub fn hint(&self) -> &'static str {
        match self {
            Self::NoCamera(_) => {
                "profilers bring whole profiles along in profiles.csv or profiles.parquet, or features.csv as point sensors do"
            }
            Self::Region(_) => "a region is U0,V0,U1,V1 in px, (0, 0) is the top-left pixel",
        }
    }
}
