//! `trueline plan`.

use crate::args::{CriterionName, PlanArgs, ShapeName};
use crate::failure::Failure;
use crate::planned_scan::{self, CELL, PATH};
use crate::{output, progress, requirement};
use std::fs;
use std::num::NonZeroUsize;
use std::path::Path;
use std::process::ExitCode;
use trueline_dataset::{
    Error, KnownCalibration, Problem, RobotSample, calibration_file, robot_csv, sensor_toml,
};
use trueline_plan::shortest::shortest;
use trueline_plan::{Ask, Cell, Criterion, Goal, GuessError, Plan, Shape, cell_toml, plan, prediction};
use trueline_report::{plan_page, planned};

/// Points of the curve of sigma over time.
const TIMES: usize = 200;
/// How far a calibration that a plan begins from may be off, in its own sigmas.
const SIGMAS: f64 = 5.0;

/// Runs the command.
pub fn run(args: &PlanArgs) -> Result<ExitCode, Failure> {
    refuse_used(&args.out)?;
    let Inputs { cell_text, sensor_text, mut cell } = inputs(args)?;
    if let Some(file) = &args.calibration {
        cell = believing(cell, &calibration_file::read(file)?, file)?;
    }
    let (ask, fixed) = ask(args)?;
    let bar = progress::bar((ask.evaluations * ask.shapes.len()) as u64, "paths tried", args.quiet);
    let tick = || bar.inc(1);
    let planned = if fixed { plan(&cell, &ask, &tick) } else { shortest(&cell, &ask, &tick) };
    bar.finish_and_clear();
    let planned = planned?;
    write(args, &cell, &planned, &ask.goal)?;
    output::file(&args.out.join("sensor.toml"), &sensor_text)?;
    let known = match args.calibration {
        Some(_) => cell_toml::with_guess(&args.out.join(CELL), &cell_text, &cell)?,
        None => cell_text,
    };
    output::file(&args.out.join(CELL), &known)?;
    if !args.quiet {
        let asked = args.want.is_some().then_some(&ask.goal);
        let text = planned::text(&cell, &planned, asked);
        output::data(&format!("{text}\n  written to {}", args.out.display()))?;
    }
    let asked = args.want.is_some();
    Ok(if !asked || planned.reaches(&ask.goal) { ExitCode::SUCCESS } else { ExitCode::from(1) })
}

/// A plan that is there already is not overwritten.
fn refuse_used(folder: &Path) -> Result<(), Failure> {
    let used = folder.join(PATH);
    if used.exists() {
        return Err(Error::in_file(&used, Problem::AlreadyExists).into());
    }
    Ok(())
}

struct Inputs {
    cell_text: String,
    sensor_text: String,
    cell: Cell,
}

fn inputs(args: &PlanArgs) -> Result<Inputs, Failure> {
    let (file, cell_text, sensor_text) = match &args.cell {
        Some(file) => {
            let text = planned_scan::read_text(file)?;
            let beside = file.with_file_name(cell_toml::sensor_name(file, &text)?);
            (file.clone(), text, planned_scan::read_text(&beside)?)
        }
        None => (args.out.join(CELL), cell_toml::EXAMPLE.to_owned(), cell_toml::EXAMPLE_SENSOR.to_owned()),
    };
    let sensor = sensor_toml::parse(&file.with_file_name("sensor.toml"), &sensor_text)?;
    Ok(Inputs { cell: cell_toml::parse(&file, &cell_text, sensor)?, cell_text, sensor_text })
}

/// The cell with a calibration's hand-eye, and its line where the seam's ends are nearest to it.
fn believing(mut cell: Cell, known: &KnownCalibration, file: &Path) -> Result<Cell, Failure> {
    let Some([rotation_rad, translation_m]) = known.hand_eye_sigma else {
        return Err(Failure::new(
            format!("{}: says nothing about its uncertainty", file.display()),
            "give the JSON that `trueline calibrate --json` wrote",
        ));
    };
    cell.believe(&known.known).ok_or_else(|| {
        Failure::new(
            format!("{}: its line does not run along the cell's seam", file.display()),
            "is it the calibration of another cell?",
        )
    })?;
    cell.guess_error = GuessError {
        translation_m: SIGMAS * translation_m,
        rotation_rad: SIGMAS * rotation_rad,
        line_m: SIGMAS * translation_m,
    };
    Ok(cell)
}

/// What is asked, and whether the duration is fixed.
fn ask(args: &PlanArgs) -> Result<(Ask, bool), Failure> {
    let criterion = match args.criterion {
        CriterionName::Worst => Criterion::Worst,
        CriterionName::Mean => Criterion::Mean,
        CriterionName::Volume => Criterion::Volume,
    };
    let want = args.want.as_deref().map(|text| requirement::parse("--want", text)).transpose()?;
    let fixed = args.duration_s.is_some() || want.is_none();
    let cores = std::thread::available_parallelism().unwrap_or(NonZeroUsize::MIN);
    let ask = Ask {
        duration_s: args.duration_s.unwrap_or(if fixed { Ask::default().duration_s } else { args.longest_s }),
        goal: Goal { want: want.unwrap_or(Goal::default().want), criterion },
        shapes: match args.shape {
            ShapeName::Auto => Shape::ALL.to_vec(),
            ShapeName::S => vec![Shape::S],
            ShapeName::C => vec![Shape::C],
            ShapeName::TwoPasses => vec![Shape::TwoPasses],
            ShapeName::ThreePasses => vec![Shape::ThreePasses],
        },
        seed: args.seed,
        evaluations: args.tries,
        threads: args.threads.unwrap_or(cores).get(),
    };
    Ok((ask, fixed))
}

fn write(args: &PlanArgs, cell: &Cell, planned: &Plan, goal: &Goal) -> Result<(), Failure> {
    let folder = &args.out;
    fs::create_dir_all(folder).map_err(|error| Failure::cannot_write(folder, &error))?;
    let samples: Vec<RobotSample> = planned
        .path(cell)
        .into_iter()
        .enumerate()
        .map(|(k, base_from_tool)| RobotSample {
            stamp_ns: (k as f64 * cell.robot_period_s * 1e9).round() as i64,
            device_ns: None,
            base_from_tool,
        })
        .collect();
    let mut path = Vec::new();
    let file = folder.join(PATH);
    robot_csv::write(&mut path, &samples).map_err(|error| Failure::cannot_write(&file, &error))?;
    fs::write(&file, path).map_err(|error| Failure::cannot_write(&file, &error))?;
    output::file(&folder.join("plan.json"), &format!("{:#}", planned::json(cell, planned, goal)))?;
    let over_time = prediction::over_time(cell, &planned.motion, TIMES);
    output::file(&folder.join("sigma_over_time.csv"), &planned::over_time_csv(&over_time))?;
    let source = plan_page::Source {
        cell,
        plan: planned,
        asked: args.want.is_some().then_some(goal),
        over_time: &over_time,
        command: &output::command_line(),
    };
    output::file(&folder.join("report.html"), &plan_page::html(&source))
}
