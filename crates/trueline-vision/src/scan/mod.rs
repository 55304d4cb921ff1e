//! The pictures of a scan → its seam points, ready to be calibrated with.

mod error;
mod find_seams;
pub mod joint_choice;
pub mod neighbours;
mod observer;
pub(crate) mod picture_fault;
mod scan_seams;
mod summary;
pub mod two_places;

pub use error::ScanError;
pub use find_seams::find_seams;
pub use observer::{ExaminedPicture, ScanObserver, Stage};
pub use picture_fault::PictureFault;
pub use scan_seams::{JointSource, ScanFrame, ScanSeams, SkippedPictures};
