//! Scans of two plates that meet in a seam: whole stripes instead of the seam point, and whole profiles.
//!
//! Everything is cast forward: a place on a plate's surface, where the sheet cuts it, into the sensor. The only fit is
//! that of a sensor's own software, the straight line through a stripe.

mod measured_line;
mod profiles;
mod straight_line;
mod stripes;
mod surface;

pub(crate) use measured_line::{Crossing, MeasuredLine};
pub use profiles::{ProfileCaster, ProfileLook, scan_profiles, scan_profiles_along};
pub(crate) use stripes::SeamView;
pub use stripes::{scan_plates, scan_plates_along};
pub use surface::{PlateForm, PlatePair, Plates};
