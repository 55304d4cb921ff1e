#![doc = include_str!("../README.md")]

pub mod contact_sheet;
pub mod detection;
pub mod detector;
pub mod evidence;
mod fastest;
pub mod frame;
pub mod joint;
pub mod lens;
pub mod line;
pub mod locate;
pub mod measure;
mod not_found;
pub mod overlay;
pub mod overlay_folder;
pub mod picture;
pub mod picture_light;
pub mod pieces;
pub mod profile;
pub mod rare_joint;
pub mod region;
pub mod scan;
pub mod seam;
mod stripe_choice;

pub use detection::{Detection, StripeSupport};
pub use detector::{Detector, SeamLevel};
pub use lens::Lens;
pub use not_found::NotFound;
pub use picture::{Level, Picture};
pub use region::PictureRegion;
pub use scan::find_seams;
pub use seam::{Joint, Seam};
pub use stripe_choice::StripeChoice;
