//! Where the plates' problem begins: planes through the support points as they fall with a seam's answer.

use crate::input::observations::Observations;
use crate::problem::parameters::Parameters;
use crate::stripe::frames::{Sight, StripeFrame};
use crate::stripe::no_plates::NoPlates;
use crate::stripe::problem::placement;
use crate::stripe::state::StripeState;
use nalgebra::{Unit, Vector3};
use trueline_geometry::fit;
use trueline_model::{Plate, SheetShape};

/// Plates whose normals differ by less (sine) do not meet in a line: 6°.
const LEAST_ANGLE_SINE: f64 = 0.1;

/// The state that follows from a seam's answer; the shape is that of the answer.
///
/// # Errors
/// [`NoPlates`].
pub fn start(
    observations: &Observations,
    frames: &[StripeFrame],
    seam: &Parameters,
    shape: Option<SheetShape>,
) -> Result<StripeState, NoPlates> {
    let mut points: Vec<[Vec<Vector3<f64>>; 2]> = vec![Default::default(); seam.lines.len()];
    let mut state = StripeState {
        time_offset_s: seam.time_offset_s,
        tool_from_camera: seam.tool_from_camera,
        joints: Vec::new(),
        shape,
    };
    let mut hint = 0;
    for frame in frames {
        let Sight::Stripes(stripes) = &frame.sight else { continue };
        let (Some(placement), Some(of_joint)) =
            (placement(observations, frame, &state, &mut hint), points.get_mut(frame.joint))
        else {
            continue;
        };
        for (plate, supports) in stripes.iter().enumerate() {
            for support in supports.iter().flatten() {
                let there = shape.map_or(support.reported, |shape| shape.corrected(&support.reported).0);
                of_joint[plate].push(placement.point_in_base(&observations.sheet.point(&there)));
            }
        }
    }
    for (joint, of_joint) in points.iter().enumerate() {
        let line = &seam.lines[joint];
        let middle_m = seam.curvatures.get(joint).map_or(0.0, |bow| bow.middle_m);
        let centre = line.anchor() + line.direction() * middle_m;
        let plates = [
            plate(&of_joint[0], &centre, &line.direction())?,
            plate(&of_joint[1], &centre, &line.direction())?,
        ];
        if plates[0].normal.cross(&plates[1].normal).norm() < LEAST_ANGLE_SINE {
            return Err(NoPlates::Parallel);
        }
        state.joints.push(plates);
    }
    Ok(state)
}

/// The plate through points; its outward direction points to them.
fn plate(points: &[Vector3<f64>], centre: &Vector3<f64>, along: &Vector3<f64>) -> Result<Plate, NoPlates> {
    if points.len() < 3 {
        return Err(NoPlates::Missing);
    }
    let plane = fit::robust_plane(points).ok_or(NoPlates::NoPlane)?.plane;
    let flat = |normal: Vector3<f64>| Plate::flat(*centre, &Unit::new_normalize(normal), along);
    let mean = points.iter().sum::<Vector3<f64>>() / points.len() as f64;
    let normal = plane.normal().into_inner();
    let mut plate = flat(normal).ok_or(NoPlates::NoPlane)?;
    if plate.chart.outward.dot(&(mean - centre)) < 0.0 {
        plate = flat(-normal).ok_or(NoPlates::NoPlane)?;
    }
    let sign = plate.normal.dot(&normal);
    plate.offset_m = sign * (plane.offset() - normal.dot(centre));
    Ok(plate)
}
