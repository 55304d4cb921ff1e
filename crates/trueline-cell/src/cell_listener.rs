//! Whoever wants to see a cell while it is recorded.

use trueline_dataset::Feature;
use trueline_mcap::Listener;

/// Hears of every entry of a recording, and of the seam points that are found in its pictures and profiles. Nobody who records waits for it.
pub trait CellListener: Listener {
    /// A seam point, in the camera's thread.
    fn seam(&self, feature: &Feature);
}
