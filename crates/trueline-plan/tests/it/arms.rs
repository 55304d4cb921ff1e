//! Plans with an arm keep its limits, by code independent of the planner's. Joint angles go through published tables as
//! matrices and must lead the tool along the path; speeds and accelerations are differences of angles.

use nalgebra::{Matrix4, Vector3};
use std::f64::consts::{FRAC_PI_2, PI};
use std::path::Path;
use trueline_dataset::sensor_toml;
use trueline_plan::constraints::Constraint;
use trueline_plan::plan::PATH_PERIOD_S;
use trueline_plan::{Cell, Plan, PlanError, PlanRequest, Shape, cell_toml, plan};

/// The example's cell with more in its file.
fn cell(more: &str) -> Cell {
    let file = Path::new("cell.toml");
    let sensor = sensor_toml::parse(file, cell_toml::EXAMPLE_SENSOR).unwrap();
    cell_toml::parse(file, &format!("{}\n{more}", cell_toml::EXAMPLE), sensor).unwrap()
}

fn small() -> PlanRequest {
    PlanRequest {
        shapes: vec![Shape::TwoPasses],
        evaluations: 1200,
        duration_s: 14.0,
        ..PlanRequest::default()
    }
}

/// Offset of θ, d, a, α of an arm (degrees, mm), its ranges (degrees) and speeds (degrees/s): of the IRB 2600-12/1.65 after its
/// drawing, 445 + 150, 700, 115 and 795, 85 mm.
const IRB_2600: [[f64; 7]; 6] = [
    [0.0, 445.0, 150.0, -90.0, -180.0, 180.0, 175.0],
    [-90.0, 0.0, 700.0, 0.0, -155.0, 95.0, 175.0],
    [0.0, 0.0, 115.0, -90.0, -155.0, 75.0, 175.0],
    [0.0, 795.0, 0.0, 90.0, -400.0, 400.0, 360.0],
    [0.0, 0.0, 0.0, -90.0, -120.0, 120.0, 360.0],
    [180.0, 85.0, 0.0, 0.0, -400.0, 400.0, 500.0],
];

/// The UR10e after Universal Robots' table.
const UR10E: [[f64; 7]; 6] = [
    [0.0, 180.7, 0.0, 90.0, -360.0, 360.0, 120.0],
    [0.0, 0.0, -612.7, 0.0, -360.0, 360.0, 120.0],
    [0.0, 0.0, -571.55, 0.0, -180.0, 180.0, 180.0],
    [0.0, 174.15, 0.0, 90.0, -360.0, 360.0, 180.0],
    [0.0, 119.85, 0.0, -90.0, -360.0, 360.0, 180.0],
    [0.0, 116.55, 0.0, 0.0, -360.0, 360.0, 180.0],
];

fn flange(table: &[[f64; 7]; 6], angles: &[f64; 6]) -> Matrix4<f64> {
    let rows = table.iter().zip(angles);
    rows.fold(Matrix4::identity(), |at, ([offset, d, a, alpha, ..], angle)| {
        let ((s, c), (sa, ca)) = ((angle + offset.to_radians()).sin_cos(), alpha.to_radians().sin_cos());
        let (d, a) = (d * 1e-3, a * 1e-3);
        at * Matrix4::new(
            c,
            -s * ca,
            s * sa,
            a * c,
            s,
            c * ca,
            -c * sa,
            a * s,
            0.0,
            sa,
            ca,
            d,
            0.0,
            0.0,
            0.0,
            1.0,
        )
    })
}

fn check(
    plan: &Plan,
    table: &[[f64; 7]; 6],
    base_from_arm: &Matrix4<f64>,
    accelerations_deg_s2: Option<[f64; 6]>,
) {
    let (joints, path) = (plan.joints.as_ref().unwrap(), plan.path());
    assert_eq!(joints.angles.len(), path.len());
    for (angles, pose) in joints.angles.iter().zip(&path) {
        let off = (base_from_arm * flange(table, angles) - pose.to_homogeneous()).norm();
        // The inverse stops at 1e-10 m and rad.
        assert!(off < 1e-8, "{off}");
        for (row, angle) in table.iter().zip(angles) {
            assert!((row[4]..=row[5]).contains(&angle.to_degrees()), "{angle} of {row:?}");
        }
        // Ten degrees from where the fourth and the sixth axis are in line: the fifth angle is near no half turn.
        let fifth = (angles[4] / PI - (angles[4] / PI).round()).abs() * 180.0;
        assert!(fifth >= 10.0, "{fifth}");
    }
    for k in 0..6 {
        let speeds: Vec<f64> =
            joints.angles.windows(2).map(|p| (p[1][k] - p[0][k]).to_degrees() / PATH_PERIOD_S).collect();
        let fastest = speeds.iter().copied().map(f64::abs).fold(0.0, f64::max);
        assert!(fastest <= table[k][6], "joint {}: {fastest} of {}", k + 1, table[k][6]);
        let rest = [&[0.0][..], &speeds, &[0.0]].concat();
        let hardest = rest.windows(2).map(|p| ((p[1] - p[0]) / PATH_PERIOD_S).abs()).fold(0.0, f64::max);
        if let Some(most) = accelerations_deg_s2 {
            assert!(hardest <= most[k] * (1.0 + 1e-9), "joint {}: {hardest} of {}", k + 1, most[k]);
        }
    }
}

#[test]
fn a_plan_with_an_arm_keeps_its_joints_limits() {
    let cell =
        cell("[arm]\nname = \"abb-irb2600-12-1.65\"\nacceleration_deg_s2 = [40, 40, 50, 100, 100, 140]\n");
    let plan = plan(&cell, &small(), &|| ()).unwrap();
    check(&plan, &IRB_2600, &Matrix4::identity(), Some([40.0, 40.0, 50.0, 100.0, 100.0, 140.0]));
    assert!(plan.constraints.used(Constraint::JointAcceleration) > 0.2, "the limit is one that is felt");
}

#[test]
fn an_arm_without_a_spherical_wrist_that_stands_elsewhere_is_planned_for_too() {
    let at = "base_from_arm = { translation_mm = [600, 300, -100], rotation_wxyz = [0.7071067811865476, 0, 0, 0.7071067811865476] }";
    let cell = cell(&format!("[arm]\nname = \"ur10e\"\n{at}\n"));
    let plan = plan(&cell, &small(), &|| ()).unwrap();
    let turned = Matrix4::from_euler_angles(0.0, 0.0, FRAC_PI_2);
    let base_from_arm = Matrix4::new_translation(&Vector3::new(0.6, 0.3, -0.1)) * turned;
    check(&plan, &UR10E, &base_from_arm, None);
}

#[test]
fn tight_joints_bind_the_plan_and_a_table_is_the_same_as_its_name() {
    let rows: Vec<String> = IRB_2600
        .iter()
        .map(|[offset, d, a, alpha, low, high, _]| {
            format!(
                "[[arm.joints]]\noffset_deg = {offset:?}\nd_mm = {d:?}\na_mm = {a:?}\nalpha_deg = {alpha:?}\nrange_deg = [{low:?}, {high:?}]\n\
                 speed_deg_s = 10.0\n"
            )
        })
        .collect();
    let tight = IRB_2600.map(|row| [row[0], row[1], row[2], row[3], row[4], row[5], 10.0]);
    let plan = plan(&cell(&rows.concat()), &small(), &|| ()).unwrap();
    check(&plan, &tight, &Matrix4::identity(), None);
    assert!(plan.constraints.used(Constraint::JointSpeed) > 0.5, "{:?}", plan.constraints);
}

#[test]
fn an_arm_that_does_not_reach_is_said() {
    // The seam is a metre and more away; a UR5e reaches 0.85 m.
    let refused = plan(&cell("[arm]\nname = \"ur5e\"\n"), &small(), &|| ()).map(|plan| plan.score);
    assert_eq!(refused, Err(PlanError::OutOfReach { middle: true }));
}

#[test]
fn spheres_stay_off_the_plates() {
    let torch = Vector3::new(0.05, 0.0, 0.17);
    let spheres = "[[spheres]]\nname = \"torch\"\nat_mm = [50, 0, 170]\nradius_mm = 30\n\
                   [[plates]]\nnormal = [0, 0, 1]\n[[plates]]\nnormal = [0, 1, 0]\npoint_mm = [0, -200, 0]\n";
    let cell = cell(spheres);
    let plan = plan(&cell, &small(), &|| ()).unwrap();
    for pose in plan.path() {
        let at = pose * nalgebra::Point3::from(torch);
        // The seam's middle is at z = 120 mm; 20 mm is how far off the line may be.
        assert!(at.z - 0.030 - 0.020 >= 0.120 - 1e-12 && at.y - 0.030 - 0.020 >= -0.200 - 1e-12, "{at}");
    }
    // 300 mm below the tool there is no room above the plate at any stand-off.
    let deep = spheres.replace("at_mm = [50, 0, 170]", "at_mm = [50, 0, 600]");
    let refused = plan_of(&deep);
    assert!(
        matches!(refused, Err(PlanError::NoRoom { constraint: Constraint::Clearance, .. })),
        "{refused:?}"
    );
}

fn plan_of(more: &str) -> Result<f64, PlanError> {
    plan(&cell(more), &small(), &|| ()).map(|plan| plan.score)
}

#[test]
fn the_examples_own_lines_about_the_arm_are_right() {
    let (mut text, mut is_arm) = (String::new(), false);
    for line in cell_toml::EXAMPLE.lines() {
        is_arm |= line.starts_with("# [arm]");
        let is_form = [
            "# urdf",
            "# [[arm.joints]]",
            "# offset",
            "# d_mm",
            "# a_mm",
            "# alpha",
            "# range_deg",
            "# speed_deg",
        ];
        if is_arm && !is_form.iter().any(|form| line.starts_with(form)) {
            text.push_str(line.strip_prefix("# ").unwrap_or(line));
            text.push('\n');
        }
    }
    let cell = cell(&text);
    assert!(cell.arm.is_some() && !cell.surroundings.is_empty());
}
