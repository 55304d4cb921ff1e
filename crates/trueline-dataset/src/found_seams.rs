//! Seams found in the pictures or profiles of a scan.

use crate::recording::{Feature, PlateStripe};

/// Seam points, and the stripes on the plates that meet there.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FoundSeams {
    /// Seam points by rising stamp.
    pub features: Vec<Feature>,
    /// Stripes by rising stamp; empty for a joint that has no such plates.
    pub stripes: Vec<PlateStripe>,
}
