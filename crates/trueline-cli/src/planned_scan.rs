//! A plan's folder: written by `plan`, read by `simulate`.

use crate::failure::Failure;
use std::path::Path;
use trueline_dataset::unit::MM_PER_M;
use trueline_dataset::{AxisRecord, Problem, axes_folder, cad_file, robot_csv, source_file};
use trueline_experiments::planned;
use trueline_geometry::Axis;
use trueline_plan::cell_axis::disturbed;
use trueline_plan::{Cell, CellAxis, CellFiles, cell_toml};
use trueline_sim::noise::Noise;
use trueline_sim::{AxisCourse, FollowedPath, Scenario, SimulatedAxis};

/// The poses to follow.
pub(crate) const PATH: &str = "path.csv";
/// Prior knowledge of the cell.
pub(crate) const CELL: &str = "cell.toml";

/// Points of the curve that the scan follows instead of the cell's straight seam.
pub(crate) const CURVE: &str = "curve.csv";

/// Reads a cell and the files beside it.
///
/// # Errors
/// Files that are missing or cannot be used.
pub(crate) fn read_files(file: &Path) -> Result<CellFiles, Failure> {
    let text = read_text(file)?;
    let sensor_text = read_text(&file.with_file_name(cell_toml::sensor_name(file, &text)?))?;
    Ok(CellFiles::of(file, text, sensor_text)?)
}

/// Points of a curve, m, as a table in mm.
pub(crate) fn curve_csv(points: impl Iterator<Item = [f64; 3]>) -> String {
    let rows = points.map(|point| point.map(|metres| metres * MM_PER_M));
    let rows: String = rows.map(|[x, y, z]| format!("{x:.6},{y:.6},{z:.6}\n")).collect();
    format!("x_mm,y_mm,z_mm\n{rows}")
}

/// Replaces the seam of a cell by the curve in a file.
///
/// # Errors
/// A file that cannot be read, and curves that cannot be scanned.
pub(crate) fn follow_curve(cell: &mut Cell, file: &Path) -> Result<(), Failure> {
    let curve = cad_file::read(file)?;
    cell.follow(curve.points()).map_err(|why| Failure::new(format!("{}: {why}", file.display()), why.hint()))
}

/// The text of a file.
pub(crate) fn read_text(file: &Path) -> Result<String, Failure> {
    source_file::text(file).map_err(|error| {
        if matches!(error.problem, Problem::Missing) {
            return Failure::new(
                format!("{}: the file is missing", file.display()),
                "`trueline plan --example --out FOLDER` writes a cell.toml and a sensor.toml to begin with",
            );
        }
        error.into()
    })
}

/// A scan along a planned path.
pub(crate) struct PlannedScan {
    /// Input of the simulation; its own movement is not used.
    pub scenario: Scenario,
    /// The path.
    pub path: FollowedPath,
    /// The cell as it was guessed.
    pub cell: Cell,
    /// The external axes, off their rough places at random as well, with clocks of their own.
    pub axes: Vec<SimulatedAxis>,
}

/// Reads the plan in a folder as a scan to simulate. Hand-eye and line differ from the guess at random, by as much as
/// the plan allows for, unless the guess is to be exact.
///
/// # Errors
/// Files that are missing or cannot be used.
pub(crate) fn read(folder: &Path, exact_guess: bool, seed: u64) -> Result<PlannedScan, Failure> {
    let mut cell = read_files(&folder.join(CELL))?.cell;
    let curve = folder.join(CURVE);
    if curve.exists() {
        follow_curve(&mut cell, &curve)?;
    }
    let file = folder.join(PATH);
    let poses = robot_csv::read_file(&file)?;
    let times_s = poses.iter().map(|p| (p.stamp_ns - poses[0].stamp_ns) as f64 * 1e-9).collect();
    let poses: Vec<_> = poses.iter().map(|p| p.base_from_tool).collect();
    let path = FollowedPath::new(times_s, &poses)
        .map_err(|error| Failure::new(format!("{}: {error}", file.display()), "plan it again"))?;
    let scenario = planned::scenario(&cell, path.duration_s(), (!exact_guess).then_some(seed))
        .map_err(|error| Failure::new(error.to_string(), error.hint()))?;
    let axes = axes(folder, &cell, exact_guess, seed)?;
    Ok(PlannedScan { scenario, path, cell, axes })
}

/// Largest time offset of an axis, s.
const AXIS_OFFSET_S: f64 = 0.04;

/// The external axes of a plan, as they move in it.
fn axes(folder: &Path, cell: &Cell, exact_guess: bool, seed: u64) -> Result<Vec<SimulatedAxis>, Failure> {
    let records = axes_folder::of_plan(folder)?;
    let mut noise = Noise::new(seed, 42);
    let truth = disturbed(&cell.axes, seed);
    let axis = |((record, rough), truth): ((&AxisRecord, &CellAxis), &Axis)| {
        let placed = if exact_guess { rough.axis } else { *truth };
        let first_ns = record.values.first().map_or(0, |value| value.stamp_ns);
        let course = AxisCourse::Follows {
            times_s: record.values.iter().map(|value| (value.stamp_ns - first_ns) as f64 * 1e-9).collect(),
            values: record.values.iter().map(|value| value.value).collect(),
        };
        let time_offset_s = noise.uniform(-AXIS_OFFSET_S, AXIS_OFFSET_S);
        let axis = Axis { time_offset_s, ..placed };
        SimulatedAxis { name: record.name.clone(), carries: record.carries, axis, course }
    };
    Ok(records.iter().zip(&cell.axes).zip(&truth).map(axis).collect())
}
