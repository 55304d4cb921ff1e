//! Whether the stated laser plane lies before the camera, where the seam was seen.

use crate::error::Error;
use crate::input::skip::Skip;
use std::collections::BTreeMap;

/// No camera sees a seam nearer than this, m.
const NEAREST_M: f64 = 5e-3;

/// Refuses a plane that most pixels see behind the camera, or in its lens. `depths_m` are the distances of the seam points before the camera, m.
///
/// # Errors
/// A laser plane with the wrong sign, or an offset of zero or in another unit.
pub(super) fn check(
    depths_m: impl ExactSizeIterator<Item = f64>,
    skipped: &BTreeMap<Skip, usize>,
) -> Result<(), Error> {
    let (seen, behind) = (depths_m.len(), skipped.get(&Skip::NoIntersection).copied().unwrap_or(0));
    if behind > seen {
        return Err(Error::LaserPlaneBehind { pixels: behind, of: behind + seen });
    }
    let near = depths_m.filter(|depth_m| *depth_m < NEAREST_M).count();
    if 2 * near > seen { Err(Error::LaserPlaneInLens { nearest_m: NEAREST_M }) } else { Ok(()) }
}
