//! Where the plates' problem begins: planes through the support points as they fall with a seam's answer. A joint whose plates
//! are not seen is any two planes that meet in its seam: how they lie about it is held, and says nothing.

use crate::input::observations::Observations;
use crate::problem::parameters::Parameters;
use crate::stripe::frames::{Sight, StripeFrames};
use crate::stripe::no_plates::NoPlates;
use crate::stripe::problem::placement;
use crate::stripe::state::StripeState;
use nalgebra::{Unit, Vector3};
use trueline_geometry::fit;
use trueline_model::{Plate, SheetShape};

/// Plates whose normals differ by less (sine) do not meet in a line: 6°.
const LEAST_ANGLE_SINE: f64 = 0.1;

/// Fewest points of a plane.
const LEAST_POINTS: usize = 3;

/// The state that follows from a seam's answer; the shape is that of the answer.
///
/// # Errors
/// [`NoPlates`].
pub fn start(
    observations: &Observations,
    frames: &StripeFrames,
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
    for frame in &frames.list {
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
        let along = line.direction();
        let plates = if frames.bare.contains(&joint) {
            let across = |axis: usize| Unit::new_normalize(line.axes().column(axis).into_owned());
            let meeting = |axis: usize| Plate::flat(centre, &across(axis), &along).ok_or(NoPlates::NoPlane);
            [meeting(1)?, meeting(2)?]
        } else if of_joint.iter().any(|points| points.len() < LEAST_POINTS) {
            return Err(NoPlates::Missing { line: joint });
        } else {
            [plate(&of_joint[0], &centre, &along)?, plate(&of_joint[1], &centre, &along)?]
        };
        if plates[0].normal.cross(&plates[1].normal).norm() < LEAST_ANGLE_SINE {
            return Err(NoPlates::Parallel);
        }
        state.joints.push(plates);
    }
    Ok(state)
}

/// The unknowns that are held because nothing shows them: how the planes of a joint without plates lie about its seam.
#[must_use]
pub fn held(state: &StripeState, bare: &[usize]) -> Vec<usize> {
    let unknowns = state.unknowns();
    bare.iter().flat_map(|&joint| [0, 1].map(|plate| unknowns.plane(joint, plate).start)).collect()
}

/// The plate through points; its outward direction points to them.
fn plate(points: &[Vector3<f64>], centre: &Vector3<f64>, along: &Vector3<f64>) -> Result<Plate, NoPlates> {
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
