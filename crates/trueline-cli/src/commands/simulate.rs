//! `trueline simulate`.

use super::{
    simulate_boards, simulate_curve, simulate_images, simulate_plates, simulate_production, simulate_shop,
    simulate_sightings,
};
use crate::args::SimulateArgs;
use crate::failure::Failure;
use crate::output;
use crate::planned_scan::{self, PlannedScan};
use std::process::ExitCode;
use trueline_dataset::{Recording, folder};
use trueline_sim::{
    Scenario, on_the_wall, simulate_along, simulate_along_with_axes, simulate_sensors, simulate_with_axes,
    simulate_with_faults,
};

/// Runs the command.
pub(crate) fn run(args: &SimulateArgs) -> Result<ExitCode, Failure> {
    if let Some(board) = &args.boards.boards {
        return simulate_boards::run(args, board);
    }
    if let Some(shop) = args.shop.shop(args.seed, args.plates.plates) {
        return simulate_shop::run(args, &shop);
    }
    if let Some(scan) = args.sighting_scan() {
        return simulate_sightings::run(args, &scan);
    }
    if let Some(scan) = args.round_scan() {
        return simulate_sightings::run_round(args, &scan);
    }
    if let Some(scan) = args.curve_scan() {
        return simulate_curve::run(args, &scan);
    }
    if let Some(pieces) = args.production.production {
        return simulate_production::run(&args.production, pieces, args);
    }
    if let Some(folder) = &args.plan {
        let planned = planned_scan::read(folder, args.exact_guess, args.seed)?;
        check_options(args, &planned.scenario)?;
        return if args.plates.plates && !planned.axes.is_empty() {
            Err(Failure::new(
                "`--plates` cannot be combined with external axes: they are used with seam points only",
                "leave out --plates",
            ))
        } else if args.plates.plates {
            simulate_plates::follow(args, planned)
        } else {
            follow(args, planned)
        };
    }
    let scenario = args.scenario();
    check_options(args, &scenario)?;
    if args.images {
        return simulate_images::run(args, &scenario);
    }
    if args.plates.plates {
        return simulate_plates::run(args, &scenario);
    }
    if let Some(count) = args.sensors {
        return several(args, &scenario, count);
    }
    if !args.axes.axes.is_empty() {
        let axes = args.axes.somewhere(&scenario, args.seed);
        let recording = simulate_with_axes(&scenario, &axes, args.seed);
        return recording.map_or_else(
            || Err(Failure::new("this scan has no seam", "choose another --preset")),
            |recording| write(args, &recording),
        );
    }
    let recording = simulate_with_faults(&scenario, &args.faults, args.seed).ok_or_else(|| {
        Failure::new(
            "this sensor or path cannot have these faults",
            "`plane-…`, `focal`, `principal-point-…` and `distortion` are of cameras, `profile-…` of profilers; a robot arm \
             must reach the path",
        )
    })?;
    write(args, &if args.sightings.wall { on_the_wall(recording) } else { recording })
}

/// Several sensors on one tool.
fn several(args: &SimulateArgs, scenario: &Scenario, count: u32) -> Result<ExitCode, Failure> {
    let recordings = simulate_sensors(scenario, count, args.seed)
        .filter(|all| all.iter().all(|one| !one.features.is_empty()))
        .ok_or_else(|| Failure::new("a sensor never sees the line", "use another --seed"))?;
    let named: Vec<(String, Recording)> = ('a'..).map(String::from).zip(recordings).collect();
    output::former_folder(&args.out, folder::write_sensors(&args.out, &named, args.force)?);
    if !args.quiet {
        output::words(&format!("{}: {count} sensors, each in sensors/NAME", args.out.display()));
    }
    Ok(ExitCode::SUCCESS)
}

fn check_options(args: &SimulateArgs, scenario: &Scenario) -> Result<(), Failure> {
    let wrong = args.wrong_option(&scenario.cell.sensor);
    wrong.map_or(Ok(()), |(what, hint)| Err(Failure::new(what, hint)))
}

/// A scan along a plan.
fn follow(args: &SimulateArgs, planned: PlannedScan) -> Result<ExitCode, Failure> {
    let PlannedScan { mut scenario, path, cell, axes } = planned;
    args.adapt(&mut scenario);
    if !axes.is_empty() {
        let base_from_tool = |time_s: f64| path.base_from_tool(time_s);
        let mut recording = simulate_along_with_axes(&scenario, &base_from_tool, &axes, args.seed);
        for (record, rough) in recording.axes.iter_mut().zip(&cell.axes) {
            record.guess = rough.record.guess;
        }
        return write(args, &recording);
    }
    let recording = simulate_along(&scenario, &|time_s| path.base_from_tool(time_s), args.seed);
    match &scenario.cell.curve {
        Some(curve) if !recording.features.is_empty() => {
            simulate_curve::write(
                args,
                &recording,
                &planned_scan::curve_csv(curve.points().iter().map(|point| (*point).into())),
            )?;
            told(args, &recording);
            Ok(ExitCode::SUCCESS)
        }
        _ => write(args, &recording),
    }
}

fn write(args: &SimulateArgs, recording: &Recording) -> Result<ExitCode, Failure> {
    if recording.features.is_empty() {
        return Err(Failure::new("the sensor never sees the line", "scan longer, tilt less or drop less"));
    }
    output::former_folder(&args.out, folder::write_whole(&args.out, recording, args.force)?);
    told(args, recording);
    Ok(ExitCode::SUCCESS)
}

fn told(args: &SimulateArgs, recording: &Recording) {
    if args.quiet {
        return;
    }
    output::words(&format!(
        "{}: {} robot poses, {} features, time offset {} ms",
        args.out.display(),
        recording.robot.len(),
        recording.features.len(),
        recording.truth.as_ref().map_or(0.0, |truth| truth.parameters.time_offset_s) * 1e3,
    ));
}
