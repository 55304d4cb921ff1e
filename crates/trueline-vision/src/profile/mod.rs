//! Laser profiles: from the points of a stripe in the profiler's own frame to its seam.

pub mod corner;
mod scan;
mod shared_noise;
mod step;

pub use corner::{CornerFinder, FaceSupport, NoCorner, ProfileCorner};
pub use scan::{ProfileSeams, seams};
