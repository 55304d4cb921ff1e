//! At which distances a sensor sees the seam.

use crate::cell::Cell;
use crate::sensor_pose::Station;
use nalgebra::Vector3;

/// Distances that are tried, m: from contact to further than any sensor measures, each 2 % further than the one before.
const RANGE_M: [f64; 2] = [0.005, 10.0];
const STEP: f64 = 1.02;

/// Nearest and furthest stand-off at which the untilted sensor has a seam in the middle of its stripe, m; `None` without
/// one. The lines of sight of a camera meet its sheet in one stretch, so all between them will do.
#[must_use]
pub(crate) fn stand_offs_in_view(cell: &Cell) -> Option<[f64; 2]> {
    let sees = |stand_off_m: &f64| {
        let station = Station {
            seam_point: Vector3::zeros(),
            stripe_m: 0.0,
            stand_off_m: *stand_off_m,
            tilt_rad: [0.0; 3],
        };
        cell.view.room(&cell.sensor_pose.point_in_camera(&station)) >= 0.0
    };
    let all = || std::iter::successors(Some(RANGE_M[0]), |m| Some(m * STEP)).take_while(|m| *m < RANGE_M[1]);
    Some([all().find(sees)?, all().filter(sees).last()?])
}
