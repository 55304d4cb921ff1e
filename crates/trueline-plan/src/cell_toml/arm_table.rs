//! `[arm]`, `[[spheres]]` and `[[plates]]` of `cell.toml`.

use super::values::{PoseTable, between, finite, not_negative, point, positive, wrong};
use crate::mounted_arm::MountedArm;
use crate::seam::Seam;
use crate::surroundings::{Carrier, Plate, Sphere};
use nalgebra::{UnitVector3, Vector3};
use serde::Deserialize;
use trueline_dataset::Problem;
use trueline_dataset::unit::MM_PER_M;
use trueline_geometry::Pose;
use trueline_geometry::arm::dh::{self, Row};
use trueline_geometry::arm::urdf::Chain;
use trueline_geometry::arm::{AXES, Arm, named};
use trueline_method::stripe::start::LEAST_ANGLE_SINE;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ArmTable {
    name: Option<String>,
    pub(super) urdf: Option<String>,
    urdf_base: Option<String>,
    urdf_flange: Option<String>,
    joints: Option<Vec<JointTable>>,
    base_from_arm: Option<PoseTable>,
    flange_from_tool: Option<PoseTable>,
    near_deg: Option<[f64; AXES]>,
    wrist_deg: Option<f64>,
    acceleration_deg_s2: Option<[f64; AXES]>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct JointTable {
    #[serde(default)]
    offset_deg: f64,
    #[serde(default)]
    d_mm: f64,
    #[serde(default)]
    a_mm: f64,
    #[serde(default)]
    alpha_deg: f64,
    range_deg: [f64; 2],
    speed_deg_s: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SphereTable {
    #[serde(default)]
    name: String,
    at_mm: [f64; 3],
    radius_mm: f64,
    joint: Option<usize>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct PlateTable {
    normal: [f64; 3],
    point_mm: Option<[f64; 3]>,
    below_mm: Option<f64>,
    toward: Option<[f64; 3]>,
}

/// Default distance of the wrist from its singularity, degrees.
const WRIST_DEG: f64 = 10.0;
/// The wrist's axes are never more than square.
const WRIST_RANGE: ([f64; 2], &str) = ([0.0, 80.0], "degrees from 0 to 80");

/// The arm of a table; `urdf` is the text of the file that it names.
pub(super) fn mounted(wire: &ArmTable, urdf: Option<&str>) -> Result<MountedArm, Problem> {
    let (name, mut arm) = arm(wire, urdf)?;
    if let Some(accelerations) = wire.acceleration_deg_s2 {
        for (joint, most) in arm.joints.iter_mut().zip(accelerations) {
            let most = positive("arm.acceleration_deg_s2", Some(most), most)?;
            joint.acceleration_rad_s2 = Some(most.to_radians());
        }
    }
    let placed =
        |key, table: &Option<PoseTable>| table.as_ref().map_or(Ok(Pose::identity()), |t| t.pose(key));
    let near = wire.near_deg.map(|deg| finite("arm.near_deg", &deg).map(|()| deg.map(f64::to_radians)));
    Ok(MountedArm {
        name,
        arm,
        base_from_arm: placed("arm.base_from_arm.translation_mm", &wire.base_from_arm)?,
        flange_from_tool: placed("arm.flange_from_tool.translation_mm", &wire.flange_from_tool)?,
        near: near.transpose()?,
        least_wrist_rad: between("arm.wrist_deg", wire.wrist_deg, WRIST_DEG, WRIST_RANGE)?.to_radians(),
    })
}

fn arm(wire: &ArmTable, urdf: Option<&str>) -> Result<(String, Arm), Problem> {
    const ONE: &str = "one of `name`, `urdf` and `[[arm.joints]]`";
    if wire.urdf.is_none() && (wire.urdf_base.is_some() || wire.urdf_flange.is_some()) {
        return Err(wrong("arm", "`urdf` beside `urdf_base` and `urdf_flange`", "none"));
    }
    match (&wire.name, &wire.urdf, &wire.joints) {
        (Some(name), None, None) => {
            let known = named::find(name).ok_or_else(|| wrong("arm.name", NAMES, name))?;
            Ok((known.title.to_owned(), known.arm()))
        }
        (None, Some(file), None) => {
            let text = urdf.ok_or_else(|| wrong("arm.urdf", "a file beside this one", "none"))?;
            let arm = Chain::of(text, wire.urdf_base.as_deref(), wire.urdf_flange.as_deref())
                .and_then(|chain| chain.arm())
                .map_err(|error| {
                    wrong("arm.urdf", "an arm of six joints with their limits", &error.to_string())
                })?;
            Ok((file.clone(), arm))
        }
        (None, None, Some(rows)) => Ok(("the arm of [[arm.joints]]".to_owned(), table(rows)?)),
        (None, None, None) => Err(wrong("arm", ONE, "none")),
        _ => Err(wrong("arm", ONE, "several")),
    }
}

/// The names of [`named::ALL`]; a test compares them.
pub(super) const NAMES: &str = "ur5e, ur10e, abb-irb1200-5-0.9, abb-irb2600-12-1.65 or kuka-kr10-r1420";

fn table(rows: &[JointTable]) -> Result<Arm, Problem> {
    let rows: Vec<Row> = rows.iter().map(row).collect::<Result<_, _>>()?;
    let count = rows.len();
    let rows: [Row; AXES] = rows
        .try_into()
        .map_err(|_| wrong("arm.joints", "six tables `[[arm.joints]]`", &count.to_string()))?;
    Ok(dh::arm(&rows))
}

fn row(wire: &JointTable) -> Result<Row, Problem> {
    let JointTable { offset_deg, d_mm, a_mm, alpha_deg, range_deg, speed_deg_s } = wire;
    finite("arm.joints", &[*offset_deg, *d_mm, *a_mm, *alpha_deg])?;
    let [low, high] = range_deg;
    if !(low < high && low.is_finite() && high.is_finite()) {
        let found = format!("{range_deg:?}");
        return Err(wrong("arm.joints.range_deg", "a smaller and a larger angle", &found));
    }
    Ok(Row {
        offset_rad: offset_deg.to_radians(),
        d_m: d_mm / MM_PER_M,
        a_m: a_mm / MM_PER_M,
        alpha_rad: alpha_deg.to_radians(),
        range_rad: range_deg.map(f64::to_radians),
        speed_rad_s: positive("arm.joints.speed_deg_s", Some(*speed_deg_s), *speed_deg_s)?.to_radians(),
    })
}

/// Spheres; those on a joint need an arm.
pub(super) fn spheres(wire: &[SphereTable], has_arm: bool) -> Result<Vec<Sphere>, Problem> {
    let one = |(k, table): (usize, &SphereTable)| {
        let carrier = match table.joint {
            None => Carrier::Tool,
            Some(joint) if (1..=AXES).contains(&joint) && has_arm => Carrier::Joint(joint - 1),
            Some(joint) => {
                return Err(wrong(
                    "spheres.joint",
                    "1 to 6 with an `[arm]`; the tool without it",
                    &joint.to_string(),
                ));
            }
        };
        let name = if table.name.is_empty() { format!("sphere {}", k + 1) } else { table.name.clone() };
        let radius_m = positive("spheres.radius_mm", Some(table.radius_mm), table.radius_mm)? / MM_PER_M;
        Ok(Sphere { name, carrier, at_m: point("spheres.at_mm", table.at_mm)?, radius_m })
    };
    wire.iter().enumerate().map(one).collect()
}

/// Least sine of the angle between `toward` and a plate that runs along the seam: its side would be a guess.
const LEAST_SIDE: f64 = 0.1;

/// Plates, through the middle of the seam unless stated otherwise.
pub(super) fn plates(wire: &[PlateTable], seam: &Seam) -> Result<Vec<Plate>, Problem> {
    let plates = wire.iter().map(|table| plate(table, seam)).collect::<Result<Vec<_>, _>>()?;
    for (k, table) in wire.iter().enumerate().filter(|(_, table)| table.below_mm.is_some()) {
        let is_parallel = |other: usize| {
            other != k && plates[k].normal.cross(&plates[other].normal).norm() < LEAST_ANGLE_SINE
        };
        if !(0..plates.len()).any(is_parallel) {
            let found =
                format!("{} of a plate that no other is parallel to", table.below_mm.unwrap_or_default());
            return Err(wrong(
                "plates.below_mm",
                "the height of a step, of the lower one of two parallel plates",
                &found,
            ));
        }
    }
    Ok(plates)
}

fn plate(table: &PlateTable, seam: &Seam) -> Result<Plate, Problem> {
    let direction = |key: &'static str, expected: &'static str, value: [f64; 3]| {
        UnitVector3::try_new(Vector3::from(value), 1e-6)
            .filter(|u| u.iter().all(|x| x.is_finite()))
            .ok_or_else(|| wrong(key, expected, &format!("{value:?}")))
    };
    let normal = direction("plates.normal", "a direction into the free side", table.normal)?;
    let middle = 0.5 * (seam.from_m + seam.to_m);
    let point_m = match (table.point_mm, table.below_mm) {
        (Some(_), Some(_)) => return Err(wrong("plates.below_mm", "`point_mm` or `below_mm`", "both")),
        (Some(mm), None) => point("plates.point_mm", mm)?,
        (None, below_mm) => {
            middle - normal.as_ref() * (not_negative("plates.below_mm", below_mm, 0.0)? / MM_PER_M)
        }
    };
    const INTO: &str = "a direction from the seam into the plate";
    let toward = table.toward.map(|toward| direction("plates.toward", INTO, toward)).transpose()?;
    let outward = seam.direction().map(|along| along.cross(&normal));
    let sideways = |toward: &UnitVector3<f64>| outward.is_none_or(|o| o.dot(toward).abs() >= LEAST_SIDE);
    match toward.filter(|toward| !sideways(toward)) {
        Some(along) => {
            Err(wrong("plates.toward", INTO, &format!("{:?}, along the seam or out of it", along.as_slice())))
        }
        None => Ok(Plate { point_m, normal, toward }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_named_arm_is_in_the_refusal() {
        assert!(named::ALL.iter().all(|arm| NAMES.contains(arm.name)));
        assert_eq!(
            NAMES.split([',', ' ']).filter(|word| !word.is_empty() && *word != "or").count(),
            named::ALL.len()
        );
    }
}
