//! A moved axis as the part on it shows it.

use crate::parameters::{CALIBRATION, UNITS};
use crate::reference::Part;
use nalgebra::Matrix6;
use trueline_geometry::{Pose, so3};

/// How a displacement of the axis in base, about the part's middle with the axis at zero, displaces the part on it: both as translation and
/// rotation, in [`UNITS`].
#[must_use]
pub fn part_from_axis(part: &Part, base_from_part: &Pose) -> Matrix6<f64> {
    let into_part = base_from_part.rotation.inverse().to_rotation_matrix().into_inner();
    let middle = part.middle();
    let lever = base_from_part.rotation * middle + base_from_part.translation.vector - middle;
    let mut map = Matrix6::zeros();
    map.fixed_view_mut::<3, 3>(0, 0).copy_from(&into_part);
    map.fixed_view_mut::<3, 3>(0, 3).copy_from(&-(into_part * so3::hat(&lever)));
    map.fixed_view_mut::<3, 3>(3, 3).copy_from(&into_part);
    let units = &UNITS[CALIBRATION..];
    Matrix6::from_fn(|i, j| map[(i, j)] * units[j] / units[i])
}
