//! `trueline plan`.

use crate::args::PlanArgs;
use crate::failure::Failure;
use crate::planned_scan::{self, CELL, PATH};
use crate::{output, overlay, progress};
use std::fs;
use std::num::NonZeroUsize;
use std::path::Path;
use std::process::ExitCode;
use trueline_dataset::{RobotSample, calibration_file, robot_csv, sensor_toml};
use trueline_plan::plan::PATH_PERIOD_S;
use trueline_plan::shortest::shortest;
use trueline_plan::{Cell, Criterion, Goal, PlanRequest, cell_toml, plan, prediction};
use trueline_report::{plan_page, planned};

/// Points of the curve of sigma over time.
const TIMES: usize = 200;
/// Longest scan for what is wanted where the user says nothing, s.
const LONGEST_S: f64 = 60.0;

/// Runs the command.
pub fn run(args: &PlanArgs) -> Result<ExitCode, Failure> {
    let Inputs { cell_text, sensor_text, mut cell } = inputs(args)?;
    if let Some(file) = &args.calibration {
        cell.believe_calibration(&calibration_file::read(file)?)
            .map_err(|why| Failure::new(format!("{}: {why}", file.display()), why.hint()))?;
    }
    let (ask, fixed) = ask(args)?;
    overlay::prepare(&args.out)?;
    let bar = progress::bar((ask.evaluations * ask.shapes.len()) as u64, "paths tried", args.quiet);
    let tick = || bar.inc(1);
    let planned = if fixed { plan(&cell, &ask, &tick) } else { shortest(&cell, &ask, &tick) };
    bar.finish_and_clear();
    let planned = planned?;
    let source = planned::Source {
        cell: &cell,
        plan: &planned,
        asked: args.want.is_some().then_some(&ask.goal),
        wrong_guess: &prediction::wrong_guesses(&cell, &planned.motion),
        over_time: &prediction::over_time(&cell, &planned.motion, &planned.seen_by, TIMES),
        command: &output::command_line(),
    };
    output::file(&args.out.join("sensor.toml"), &sensor_text)?;
    let known = match args.calibration {
        Some(_) => cell_toml::with_guess(&args.out.join(CELL), &cell_text, &cell)?,
        None => cell_toml::with_usual_sensor(&args.out.join(CELL), &cell_text)?,
    };
    output::file(&args.out.join(CELL), &known)?;
    write(&args.out, &source, &ask.goal)?;
    if !args.quiet {
        let text = format!("{}\n  written to {}", planned::text(&source), args.out.display());
        output::data(&output::coloured(&text))?;
    }
    let asked = args.want.is_some();
    Ok(if !asked || planned.reaches(&ask.goal) { ExitCode::SUCCESS } else { ExitCode::from(1) })
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
    let beside = file.with_file_name(cell_toml::sensor_name(&file, &cell_text)?);
    let sensor = sensor_toml::parse(&beside, &sensor_text)?;
    Ok(Inputs { cell: cell_toml::parse(&file, &cell_text, sensor)?, cell_text, sensor_text })
}

/// What is asked, and whether the duration is fixed.
fn ask(args: &PlanArgs) -> Result<(PlanRequest, bool), Failure> {
    let (criterion, want) = (args.criterion, args.want);
    if want.is_some() && criterion != Criterion::Worst {
        return Err(Failure::new(
            "`--want` with `--criterion`: what is wanted is reached when the worst sigma is",
            "leave out --criterion, or --want",
        ));
    }
    let fixed = args.duration_s.is_some() || want.is_none();
    let cores = std::thread::available_parallelism().unwrap_or(NonZeroUsize::MIN);
    let ask = PlanRequest {
        duration_s: args.duration_s.unwrap_or(if fixed {
            PlanRequest::default().duration_s
        } else {
            args.longest_s.unwrap_or(LONGEST_S)
        }),
        goal: Goal { want: want.unwrap_or(Goal::default().want), criterion },
        shapes: args.shape.to_vec(),
        seed: args.seed,
        evaluations: args.tries,
        threads: args.threads.unwrap_or(cores).get(),
    };
    Ok((ask, fixed))
}

fn write(folder: &Path, source: &planned::Source<'_>, goal: &Goal) -> Result<(), Failure> {
    let samples: Vec<RobotSample> = (source.plan.path().into_iter().enumerate())
        .map(|(k, base_from_tool)| RobotSample {
            stamp_ns: (k as f64 * PATH_PERIOD_S * 1e9).round() as i64,
            device_ns: None,
            base_from_tool,
        })
        .collect();
    let mut path = Vec::new();
    let file = folder.join(PATH);
    robot_csv::write(&mut path, &samples).map_err(|error| Failure::cannot_write(&file, &error))?;
    fs::write(&file, path).map_err(|error| Failure::cannot_write(&file, &error))?;
    output::file(&folder.join("plan.json"), &format!("{:#}", planned::json(source, goal)))?;
    output::file(&folder.join("sigma_over_time.csv"), &planned::over_time_csv(source.over_time))?;
    output::file(&folder.join("report.html"), &plan_page::html(source))
}
