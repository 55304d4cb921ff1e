//! The arm in a plan: range of its joints, and missing checks.

use serde_json::{Value, json};
use trueline_dataset::unit::MM_PER_M;
use trueline_plan::{Cell, JointPath, MountedArm, Plan};

/// Missing checks, in one sentence.
#[must_use]
pub(crate) fn not_checked(cell: &Cell) -> &'static str {
    match (cell.arm.is_some(), cell.surroundings.is_empty()) {
        (false, true) => {
            "the arm's reach, singularities and collisions: run the path in the manufacturer's simulation first"
        }
        (false, false) => {
            "the arm's reach and singularities, and collisions other than those of the stated spheres with the plates: run the path in the \
             manufacturer's simulation first"
        }
        (true, true) => "collisions: run the path in the manufacturer's simulation first",
        (true, false) => {
            "collisions other than those of the stated spheres with the plates: run the path in the manufacturer's simulation first"
        }
    }
}

/// The arm and its joints; empty without an arm.
pub(crate) fn fact(cell: &Cell, plan: &Plan) -> Option<(String, String)> {
    let (mounted, path) = cell.arm.as_ref().zip(plan.joints.as_ref())?;
    let joints: Vec<String> = (0..path.fastest()[0].len())
        .map(|k| {
            let [low, high] = extent(path, k).map(f64::to_degrees);
            format!("{low:.0} to {high:.0}")
        })
        .collect();
    let said = format!(
        "{}: joints 1 to 6 move through {}°; the wrist stays {:.0}° from its singularity; joint accelerations {}",
        mounted.name,
        joints.join(", "),
        least_wrist_rad(mounted, path).to_degrees(),
        if has_accelerations(mounted) {
            "stay within those stated"
        } else {
            "are not checked, since none are stated"
        },
    );
    Some(("arm".to_owned(), said))
}

fn has_accelerations(mounted: &MountedArm) -> bool {
    mounted.arm.joints.iter().any(|joint| joint.acceleration_rad_s2.is_some())
}

/// Smallest and largest angle of a joint, rad.
fn extent(path: &JointPath, k: usize) -> [f64; 2] {
    let all = path.angles.iter().map(|angles| angles[k]);
    all.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], a| [low.min(a), high.max(a)])
}

fn least_wrist_rad(mounted: &MountedArm, path: &JointPath) -> f64 {
    path.angles.iter().map(|angles| mounted.arm.state(angles).wrist_rad()).fold(f64::INFINITY, f64::min)
}

/// The same as JSON; null without an arm.
pub(crate) fn json(cell: &Cell, plan: &Plan) -> Value {
    let Some((mounted, path)) = cell.arm.as_ref().zip(plan.joints.as_ref()) else { return Value::Null };
    let [speeds, accelerations] = path.fastest();
    let degrees = |rad: f64| rad.to_degrees();
    let joints: Vec<Value> = (mounted.arm.joints.iter().enumerate())
        .map(|(k, joint)| {
            json!({
                "used_deg": extent(path, k).map(degrees),
                "range_deg": joint.range_rad.map(degrees),
                "speed_deg_s": degrees(speeds[k]),
                "speed_limit_deg_s": degrees(joint.speed_rad_s),
                "acceleration_deg_s2": degrees(accelerations[k]),
                "acceleration_limit_deg_s2": joint.acceleration_rad_s2.map(degrees),
            })
        })
        .collect();
    json!({
        "name": mounted.name,
        "joints": joints,
        "least_wrist_deg": degrees(least_wrist_rad(mounted, path)),
    })
}

/// Least distance between the robot's load and the plates, mm; null if nothing was stated.
pub(crate) fn least_clearance_mm(cell: &Cell, plan: &Plan) -> Value {
    if cell.surroundings.is_empty() {
        return Value::Null;
    }
    let distances = plan
        .path()
        .iter()
        .enumerate()
        .map(|(k, pose)| {
            let angles = plan.joints.as_ref().and_then(|joints| joints.angles.get(k));
            cell.surroundings.distance_m(pose, cell.arm.as_ref().zip(angles))
        })
        .fold(f64::INFINITY, f64::min);
    json!(distances * MM_PER_M)
}
