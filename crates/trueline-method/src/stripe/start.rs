//! Start of the plates' problem: planes through the support points, placed by a seam's answer. Two planes that meet form the joint. Parallel plates
//! and a single plate have an edge at the seam points. A joint without visible plates gets two arbitrary planes through its seam. Their rotation
//! about it is held and has no information.

use crate::error::no_plates::NoPlates;
use crate::input::observations::Observations;
use crate::problem::parameters::Parameters;
use crate::stripe::frame_residual::placement;
use crate::stripe::frames::{Sight, StripeFrame, StripeFrames};
use crate::stripe::state::StripeState;
use crate::stripe::target::{Bearing, EDGE, Edge, Target};
use nalgebra::{Unit, Vector3};
use trueline_geometry::fit;
use trueline_model::{Plate, SheetShape};

/// Minimum sine of the angle between the normals of plates that meet in a line: that of 6°.
pub const LEAST_ANGLE_SINE: f64 = 0.1;

/// Maximum distance of an edge's middle from its plate, m.
const ON_PLATE_M: f64 = 1e-3;

/// Minimum step of a lap that is detected, m. With a smaller step the first answer cannot locate the seam between the planes.
const ONE_PLANE_M: f64 = 0.2e-3;

/// Minimum points of a plane, and of an edge.
const LEAST_POINTS: usize = 3;

/// The start from a seam's answer, with the shape of that answer.
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
    for frame in &frames.list {
        let Sight::Stripes(stripes) = &frame.sight else { continue };
        let (Some(placement), Some(of_joint)) =
            (placement(observations, frame.stamp_s, &state), points.get_mut(frame.joint))
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
        let target = if frames.without_plates.contains(&joint) {
            let across = |axis: usize| Unit::new_normalize(line.axes().column(axis).into_owned());
            let meeting = |axis: usize| Plate::flat(centre, &across(axis), &along).ok_or(NoPlates::NoPlane);
            Target::meeting([meeting(1)?, meeting(2)?])
        } else {
            let of_frame = |frame: &&StripeFrame| frame.joint == joint && frame.edge.is_some();
            let has_edge = frames.list.iter().filter(of_frame).count() >= LEAST_POINTS;
            SeenJoint { number: joint, points: of_joint, has_edge, centre, along }.target()?
        };
        state.joints.push(target);
    }
    Ok(state)
}

/// The visible parts of a joint.
struct SeenJoint<'a> {
    number: usize,
    points: &'a [Vec<Vector3<f64>>; 2],
    has_edge: bool,
    /// The middle of its seam.
    centre: Vector3<f64>,
    along: Vector3<f64>,
}

impl SeenJoint<'_> {
    fn target(&self) -> Result<Target, NoPlates> {
        let seen = [0, 1].map(|number| self.points[number].len() >= LEAST_POINTS);
        let of = |number: usize| plate(&self.points[number], &self.centre, &self.along);
        let plates = match seen {
            [true, true] => [of(0)?, of(1)?],
            [true, false] => [of(0)?; 2],
            [false, true] => [of(1)?; 2],
            [false, false] => return Err(NoPlates::Missing { line: self.number, unusable: 0 }),
        };
        if seen == [true; 2] && plates[0].normal.cross(&plates[1].normal).norm() >= LEAST_ANGLE_SINE {
            return Ok(Target::meeting(plates));
        }
        if !self.has_edge {
            let missing = NoPlates::Missing { line: self.number, unusable: 0 };
            return Err(if seen == [true; 2] { NoPlates::Parallel } else { missing });
        }
        // Offsets are measured from the seam.
        let beside_m = |number: usize| plates[number].offset_m.abs();
        let nearer = usize::from(if seen == [true; 2] { beside_m(1) < beside_m(0) } else { seen[1] });
        if beside_m(nearer) > ON_PLATE_M {
            return Err(NoPlates::EdgeElsewhere { line: self.number });
        }
        let on = if seen == [true; 2] && are_beside_a_gap(&plates) {
            Bearing::Both
        } else {
            Bearing::Plate(nearer)
        };
        let outward = Unit::new_normalize(plates[nearer].chart.outward);
        let surface = Plate::flat(self.centre, &outward, &self.along).ok_or(NoPlates::NoPlane)?;
        Ok(Target { plates, seen, edge: Some(Edge { surface, on }) })
    }
}

/// Whether the seam, the origin of the offsets, lies half-way between two plates on either side of it. The seam of a lap lies on one of them.
fn are_beside_a_gap([one, other]: &[Plate; 2]) -> bool {
    let on_either_side = one.chart.outward.dot(&other.chart.outward) < 0.0;
    let sign = one.normal.dot(&other.normal).signum();
    let apart_m = one.offset_m - sign * other.offset_m;
    let off_middle_m = one.offset_m - 0.5 * apart_m;
    on_either_side && (apart_m.abs() < ONE_PLANE_M || off_middle_m.abs() < 0.25 * apart_m.abs())
}

/// The held unknowns, which are unobservable: the rotation of the planes of a joint without plates, a plate that is not visible, the lean of an edge
/// about the seam, and the edge of plates that meet.
#[must_use]
pub fn held(state: &StripeState, without_plates: &[usize]) -> Vec<usize> {
    let unknowns = state.unknowns();
    let mut held: Vec<usize> = without_plates
        .iter()
        .flat_map(|&joint| [0, 1].map(|plate| unknowns.plane(joint, plate).start))
        .collect();
    for (joint, target) in state.joints.iter().enumerate() {
        let unseen = (0..2).filter(|&plate| !target.seen[plate]);
        held.extend(unseen.flat_map(|plate| unknowns.plane(joint, plate)));
        if unknowns.edged {
            let edge = unknowns.plane(joint, EDGE);
            let leaning = edge.start..edge.start + 1;
            held.extend(if target.edge.is_some() { leaning } else { edge });
        }
    }
    held
}

/// The plate through points. Its outward direction points towards them.
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
