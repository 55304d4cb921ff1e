//! A scan from wherever it is, with the seam found in it.
//!
//! ```text
//! path ─place─▶ dataset folder ──┬─ features.csv, stripes.csv ───────────────────────┐
//!           └─▶ MCAP, rosbag2 ───┼─ pictures ── detector ─▶ seam in every picture ────┼─▶ Opened
//!                                └─ whole profiles ───────▶ seam in every profile ────┘
//! ```
//!
//! Nothing is written and nothing is printed: an [`OpenObserver`] receives all messages.
//!
//! ```
//! use trueline::open::{How, open};
//! use trueline_sim::{Preset, simulate};
//!
//! let place = tempfile::tempdir()?;
//! let scan = simulate(&Preset::Quick.scenario(), 1).ok_or("no seam in view")?;
//! trueline_dataset::folder::write(place.path(), &scan)?;
//! let opened = open(place.path(), &How::default(), &())?; // a recording.mcap or a rosbag2 likewise
//! assert_eq!(opened.recording.features, scan.features);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod cloud;
pub mod detector;
pub mod error;
mod nearest;
mod observer;
mod opened;
mod outlier_pictures;
mod place;
mod profiles;
mod several;
mod trigger;

pub use cloud::{Measurements, open_measurements};
pub use error::OpenError;
pub use nearest::nearest;
pub use observer::{OpenObserver, Told, told_of_import};
pub use opened::{How, Opened, open};
pub use outlier_pictures::{OutlierPicture, outlier_pictures};
pub use profiles::seams_of_profiles;
pub use several::open_all;
pub use trigger::{MeasuredByInput, Trigger};
