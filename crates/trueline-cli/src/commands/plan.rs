//! `trueline plan`.

use crate::args::PlanArgs;
use crate::failure::Failure;
use crate::planned_scan::{self, CELL, CURVE, PATH};
use crate::{output, progress};
use std::path::Path;
use std::process::ExitCode;
use trueline_dataset::unit::MM_PER_M;
use trueline_dataset::{SensorSetup, WholeFolder, axes_csv, axes_folder, calibration_file, robot_csv};
use trueline_geometry::AxisKind;
use trueline_method::Measurements;
use trueline_plan::plan::PATH_PERIOD_S;
use trueline_plan::rehearsed_plan::{
    RehearsedPlan, least_seam_error, shortest_that_reaches, with_better_robots, without_alias,
};
use trueline_plan::robot_program::{PathAxis, ProgramFile, Waypoints};
use trueline_plan::shortest::shortest;
use trueline_plan::{
    Cell, CellAxis, CellFiles, Criterion, Goal, Plan, PlanRequest, SeamGoal, Target, cell_toml,
    expected_accuracy, expected_axes, plan,
};
use trueline_report::verdict_colours::coloured;
use trueline_report::{plan_page, plan_source, plan_summary};

/// Angles of the arm's joints along the path.
const JOINTS: &str = "joints.csv";
/// Points of the curve of sigma over time.
const TIMES: usize = 200;
/// Runs the command.
pub(crate) fn run(args: &PlanArgs) -> Result<ExitCode, Failure> {
    let CellFiles { cell_text, sensor_text, urdf, setup, mut cell } = inputs(args)?;
    if let Some(file) = &args.calibration {
        cell.believe_calibration(&calibration_file::read(file)?)
            .map_err(|why| Failure::new(format!("{}: {why}", file.display()), why.hint()))?;
    }
    if args.want.is_some() && args.criterion != Criterion::Worst {
        return Err(Failure::new(
            "`--want` cannot be combined with `--criterion`: it always uses the worst sigma",
            "leave out --criterion, or --want",
        ));
    }
    follow_curve(args, &mut cell)?;
    let (mut ask, fixed) = (args.request(), args.has_fixed_duration());
    ask.seam = args.want.and_then(|want| want.seam_m).and_then(|m| SeamGoal::of(&cell, &setup, m));
    check_axes(args, &cell)?;
    check_plates(args, &cell)?;
    let whole = WholeFolder::begin_new(&args.out)?;
    let made = searched(args, (&cell, &setup), &ask, fixed)?;
    let is_missed = ask.seam.as_ref().is_some_and(|goal| made.seam_error_m() > goal.wanted_m);
    let better_robots = if is_missed { with_better_robots((&cell, &setup), &ask, &made) } else { Vec::new() };
    let seam_m = args.want.and_then(|want| want.seam_m);
    let asked = plan_source::Asked { goal: args.want.is_some().then_some(&ask.goal), seam_m };
    let source = plan_source::Source {
        cell: &cell,
        plan: &made.plan,
        rehearsal: made.rehearsal.as_ref(),
        asked,
        wrong_guess: &expected_accuracy::wrong_guesses(&cell, &made.plan),
        axes: &expected_axes::expected_axes(&cell, &made.plan.motion, &made.plan.prediction),
        over_time: &expected_accuracy::over_time(&cell, &made.plan, TIMES),
        longer: &made.longer,
        better_robots: &better_robots,
        command: &output::command_line(),
    };
    let at = |name: &str| whole.path().join(name);
    output::file(&at("sensor.toml"), &sensor_text)?;
    let known = match args.calibration {
        Some(_) => cell_toml::with_guess(&args.out.join(CELL), &cell_text, &cell)?,
        None => cell_toml::with_usual_sensor(&args.out.join(CELL), &cell_text)?,
    };
    output::file(&at(CELL), &known)?;
    if let Some([name, text]) = &urdf {
        output::file(&at(name), text)?;
    }
    write(whole.path(), &source, &ask.goal)?;
    let programs = programs(args, &cell, &made.plan)?;
    for file in &programs {
        output::file(&at(&file.name), &file.text)?;
    }
    whole.finish()?;
    for file in programs.iter().filter(|_| !args.quiet) {
        output::words(&format!("{}: for {}", args.out.join(&file.name).display(), file.goes_to));
    }
    if !args.quiet {
        let text = format!("{}\n  written to {}", plan_summary::text(&source), args.out.display());
        output::data(&coloured(&text))?;
    }
    let reached = args.want.is_none() || plan_summary::missed(&source, &ask.goal).is_empty();
    Ok(if reached { ExitCode::SUCCESS } else { ExitCode::from(1) })
}

/// Replaces the straight seam by the requested curve.
fn follow_curve(args: &PlanArgs, cell: &mut Cell) -> Result<(), Failure> {
    let Some(file) = &args.seam_cad else { return Ok(()) };
    if args.measurements != Measurements::Seam {
        return Err(Failure::new(
            "`--use stripe` cannot be combined with `--seam-cad`: a plan with whole stripes supports straight seams only",
            "leave out --use",
        ));
    }
    if args.want.is_some_and(|want| want.seam_m.is_some()) {
        return Err(Failure::new(
            "`--want seam=…` cannot be combined with `--seam-cad`: the seam error of a curve is that of the rehearsal",
            "ask for translation, rotation and time",
        ));
    }
    planned_scan::follow_curve(cell, file)
}

/// Plans, with a progress bar.
fn searched(
    args: &PlanArgs,
    (cell, setup): (&Cell, &SensorSetup),
    ask: &PlanRequest,
    fixed: bool,
) -> Result<RehearsedPlan, Failure> {
    let seam_m = args.want.and_then(|want| want.seam_m);
    let bar = progress::bar((ask.evaluations * ask.shapes.len()) as u64, "paths tried", args.quiet);
    let tick = || bar.inc(1);
    let made = match (fixed, seam_m) {
        (true, Some(_)) => least_seam_error(cell, setup, ask, &tick),
        (true, None) => without_alias(cell, setup, ask, |ask| plan(cell, ask, &tick)),
        (false, None) => without_alias(cell, setup, ask, |ask| shortest(cell, ask, &tick)),
        (false, Some(_)) => shortest_that_reaches(cell, setup, ask, &tick),
    };
    bar.finish_and_clear();
    Ok(made?)
}

/// External axes are calibrated with the points of straight seams.
fn check_axes(args: &PlanArgs, cell: &Cell) -> Result<(), Failure> {
    let what = if cell.axes.is_empty() {
        return Ok(());
    } else if args.measurements != Measurements::Seam {
        "--use stripe"
    } else if cell.course.is_some() {
        "--seam-cad"
    } else if args.want.is_some_and(|want| want.seam_m.is_some()) {
        "--want seam=…"
    } else if args.calibration.is_some() {
        "--calibration"
    } else {
        return Ok(());
    };
    Err(Failure::new(
        format!("`{what}` cannot be combined with an external axis in the cell's file"),
        "plan a scan of a straight seam with translation, rotation and time as requirements, or remove [[axis]]",
    ))
}

/// Stripes can be rehearsed if the cell's file describes their plates.
fn check_plates(args: &PlanArgs, cell: &Cell) -> Result<(), Failure> {
    Target::of(cell, args.measurements)
        .map(drop)
        .map_err(|why| Failure::new(format!("--use stripe: {why}"), why.hint()))
}

/// The path in the requested languages.
fn programs(args: &PlanArgs, cell: &Cell, plan: &Plan) -> Result<Vec<ProgramFile>, Failure> {
    if args.program.is_empty() {
        return Ok(Vec::new());
    }
    let waypoints = Waypoints::of(&plan.samples()).ok_or_else(|| {
        Failure::new("the path moves too little for a robot's program", "a longer scan, or wider limits")
    })?;
    let axes = path_axes(cell, plan, &waypoints);
    let waypoints = waypoints.with_reach(plan.joints.is_some()).with_axes(axes);
    Ok(args.program.iter().map(|language| ProgramFile::of(*language, &waypoints)).collect())
}

/// The external axes at the waypoints.
fn path_axes(cell: &Cell, plan: &Plan, waypoints: &Waypoints) -> Vec<PathAxis> {
    let rows: Vec<Vec<f64>> = waypoints.list.iter().map(|at| plan.motion.axis_values(at.time_s)).collect();
    let axis = |(k, axis): (usize, &CellAxis)| {
        let (unit, factor) = match axis.record.kind {
            AxisKind::Rotary => ("deg", 1.0_f64.to_degrees()),
            AxisKind::Linear => ("mm", MM_PER_M),
        };
        let values = rows.iter().map(|row| row[k] * factor).collect();
        PathAxis { name: axis.record.name.clone(), unit, values }
    };
    cell.axes.iter().enumerate().map(axis).collect()
}

fn inputs(args: &PlanArgs) -> Result<CellFiles, Failure> {
    if let Some(file) = &args.cell {
        return planned_scan::read_files(file);
    }
    let (cell, sensor) = args.example.unwrap_or((cell_toml::EXAMPLE, cell_toml::EXAMPLE_SENSOR));
    let cell = match args.measurements {
        Measurements::Seam => cell.to_owned(),
        _ => cell_toml::with_plates(cell),
    };
    Ok(CellFiles::of(&args.out.join(CELL), cell, sensor.to_owned())?)
}

fn write(folder: &Path, source: &plan_source::Source<'_>, goal: &Goal) -> Result<(), Failure> {
    let mut path = Vec::new();
    let file = folder.join(PATH);
    robot_csv::write(&mut path, &source.plan.samples())
        .map_err(|error| Failure::cannot_write(&file, &error))?;
    output::file(&file, &path)?;
    if let Some(course) = &source.cell.course {
        output::file(
            &folder.join(CURVE),
            &planned_scan::curve_csv(course.drawn().points().iter().map(|point| (*point).into())),
        )?;
    }
    if !source.cell.axes.is_empty() {
        let mut values = Vec::new();
        let file = folder.join(axes_folder::VALUES_FILE);
        let records = source.plan.motion.axis_records(source.cell, PATH_PERIOD_S, 0.0);
        axes_csv::write(&mut values, &records).map_err(|error| Failure::cannot_write(&file, &error))?;
        output::file(&file, &values)?;
    }
    if let Some(joints) = &source.plan.joints {
        output::file(&folder.join(JOINTS), &joints.csv())?;
    }
    output::file(&folder.join("plan.json"), &format!("{:#}", plan_summary::json(source, goal)))?;
    output::file(&folder.join("sigma_over_time.csv"), &plan_summary::over_time_csv(source.over_time))?;
    output::file(&folder.join("report.html"), &plan_page::html(source))
}
