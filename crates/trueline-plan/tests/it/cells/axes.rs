//! Cells with an external axis, their plans, and scans along what was planned.

use super::{exact, example_with, scenario};
use trueline_dataset::Recording;
use trueline_geometry::Axis;
use trueline_plan::{Cell, CellAxis, Plan, PlanError, PlanRequest, Shape, plan};
use trueline_sim::{AxisCourse, SimulatedAxis, simulate_along_with_axes};

/// A table 250 mm beside the example's seam, about an axis that leans a little.
pub(crate) const TABLE: &str = "name = \"table\"\nkind = \"rotary\"\ncarries = \"part\"\ndirection = [0.05, -0.03, 1.0]\n\
    point_mm = [1150.0, 330.0, 0.0]\n";
/// A track under the robot, across the seam.
pub(crate) const TRACK: &str =
    "name = \"track\"\nkind = \"linear\"\ncarries = \"robot\"\ndirection = [0.1, 1.0, 0.0]\n";
/// An axis at the tool.
pub(crate) const WRIST: &str = "name = \"wrist\"\nkind = \"rotary\"\ncarries = \"sensor\"\ndirection = [0.1, 0.2, 1.0]\n\
    point_mm = [20.0, 0.0, 60.0]\n";

/// The example with an axis, without an error of the guess.
pub(crate) fn cell(axis: &str, limits: &str) -> Cell {
    let cell = exact(example_with(&format!("[[axis]]\n{axis}[axis.limits]\n{limits}")).unwrap());
    let axes = cell.axes.into_iter().map(|axis| CellAxis { error: [0.0; 2], ..axis }).collect();
    Cell { axes, ..cell }
}

pub(crate) fn planned(cell: &Cell) -> Result<Plan, PlanError> {
    let ask = PlanRequest { shapes: vec![Shape::TwoPasses], evaluations: 700, ..PlanRequest::default() };
    plan(cell, &ask, &|| ())
}

/// A scan of a plan at the guess, with a clock of its own for each axis.
pub(crate) fn scanned(cell: &Cell, plan: &Plan, seed: u64) -> Recording {
    let scenario = scenario(cell, (cell.tool_from_camera, cell.seam), plan.motion.design().duration_s);
    let axes: Vec<SimulatedAxis> = (plan.motion.axis_records(cell, 4e-3, 0.0).into_iter())
        .map(|record| SimulatedAxis {
            name: record.name,
            carries: record.carries,
            axis: Axis { time_offset_s: 0.02, ..record.known.unwrap() },
            course: AxisCourse::Follows {
                times_s: record.values.iter().map(|value| value.stamp_ns as f64 * 1e-9).collect(),
                values: record.values.iter().map(|value| value.value).collect(),
            },
        })
        .collect();
    let robot = |time_s: f64| plan.motion.base_from_tool(time_s);
    let mut recording = simulate_along_with_axes(&scenario, &robot, &axes, seed);
    recording.axes.iter_mut().for_each(|axis| axis.known = None);
    recording
}
