//! `trueline simulate`.

use super::{simulate_images, simulate_plates, simulate_production};
use crate::failure::Failure;
use crate::output;
use crate::planned_scan::{self, PlannedScan};
use std::process::ExitCode;
use trueline_args::{PathArgs, SimulateArgs};
use trueline_dataset::{Recording, folder};
use trueline_sim::{
    Between, Disturbance, Scan, Scenario, Timing, random_cell, simulate_along, simulate_with_faults,
};

/// Offsets of random cells lie within this, s.
const RANDOM_OFFSET_S: f64 = 1.0;

/// Runs the command.
pub fn run(args: &SimulateArgs) -> Result<ExitCode, Failure> {
    if let Some(pieces) = args.production.production {
        return simulate_production::run(&args.production, pieces, args);
    }
    if let Some(folder) = &args.plan {
        return follow(args, planned_scan::read(folder, args.exact_guess, args.seed)?);
    }
    let scenario = scenario(args)?;
    if args.images {
        return simulate_images::run(args, &scenario);
    }
    if args.plates.plates {
        return simulate_plates::run(args, &scenario);
    }
    let recording = simulate_with_faults(&scenario, &args.faults, args.seed).ok_or_else(|| {
        Failure::new(
            "this sensor or path cannot have these faults",
            "`plane-…`, `focal`, `principal-point-…` and `distortion` are of cameras, `profile-…` of profilers; a robot arm \
             must reach the path",
        )
    })?;
    write(args, &recording)
}

/// A scan along a plan.
fn follow(args: &SimulateArgs, planned: PlannedScan) -> Result<ExitCode, Failure> {
    let PlannedScan { mut scenario, path } = planned;
    override_timing(&mut scenario.timing, args);
    override_disturbance(&mut scenario.disturbance, args);
    if args.noise_free {
        scenario.disturbance = Disturbance::default();
    }
    write(args, &simulate_along(&scenario, &|time_s| path.base_from_tool(time_s), args.seed))
}

fn write(args: &SimulateArgs, recording: &Recording) -> Result<ExitCode, Failure> {
    if recording.features.is_empty() {
        return Err(Failure::new("the sensor never sees the line", "a longer duration or less tilt helps"));
    }
    folder::write_whole(&args.out, recording, args.force)?;
    if !args.quiet {
        output::words(&format!(
            "{}: {} robot poses, {} features, time offset {} ms",
            args.out.display(),
            recording.robot.len(),
            recording.features.len(),
            recording.truth.as_ref().map_or(0.0, |truth| truth.parameters.time_offset_s) * 1e3,
        ));
    }
    Ok(ExitCode::SUCCESS)
}

fn scenario(args: &SimulateArgs) -> Result<Scenario, Failure> {
    let mut scenario = args.preset.scenario();
    if args.random_cell {
        scenario = random_cell(&scenario, args.seed, RANDOM_OFFSET_S);
    }
    if args.noise_free {
        scenario.disturbance = Disturbance::default();
        scenario.timing.between = Between::Straight;
    }
    override_timing(&mut scenario.timing, args);
    override_path(&mut scenario.scan, &args.path)?;
    override_disturbance(&mut scenario.disturbance, args);
    Ok(scenario)
}

/// Fields, what the user says instead, and its unit in SI.
type Overrides<'a, const N: usize> = [(&'a mut f64, Option<f64>, f64); N];

fn apply<const N: usize>(overrides: Overrides<'_, N>) {
    for (field, option, unit) in overrides {
        *field = option.map_or(*field, |value| value * unit);
    }
}

fn override_path(scan: &mut Scan, args: &PathArgs) -> Result<(), Failure> {
    let degree = 1f64.to_radians();
    scan.tracked_in = args.weave_frame.unwrap_or(scan.tracked_in);
    scan.progress = args.progress.unwrap_or(scan.progress);
    scan.passes = args.passes.unwrap_or(scan.passes);
    apply([
        (&mut scan.lateral.amplitude, args.lateral_mm, 1e-3),
        (&mut scan.lateral.frequency_hz, args.lateral_hz, 1.0),
        (&mut scan.range.amplitude, args.range_mm, 1e-3),
        (&mut scan.range.frequency_hz, args.range_hz, 1.0),
        (&mut scan.length_m, args.length_mm, 1e-3),
        (&mut scan.spin_by_pass_rad, args.spin_by_pass_deg, degree),
    ]);
    for (axis, tilt) in scan.tilts.iter_mut().enumerate() {
        let own = args.tilt_hz.get(axis).or(args.tilt_hz.first()).copied();
        apply([(&mut tilt.amplitude, args.tilt_deg, degree), (&mut tilt.frequency_hz, own, 1.0)]);
    }
    if args.tilt_hz.len() == 2 {
        return Err(Failure::new(
            "`--tilt-hz`: expected one frequency or three, found 2",
            "give one for each tilt",
        ));
    }
    Ok(())
}

fn override_timing(timing: &mut Timing, args: &SimulateArgs) {
    apply([
        (&mut timing.time_offset_s, args.time_offset_ms, 1e-3),
        (&mut timing.duration_s, args.duration_s, 1.0),
        (&mut timing.robot_period_s, args.robot_period_ms, 1e-3),
        (&mut timing.frame_period_s, args.frame_period_ms, 1e-3),
    ]);
}

fn override_disturbance(d: &mut Disturbance, args: &SimulateArgs) {
    apply([
        (&mut d.outlier_fraction, args.outliers, 1.0),
        (&mut d.drop_fraction, args.drops, 1.0),
        (&mut d.feature_noise_px, args.feature_noise_px, 1.0),
        (&mut d.feature_noise_m, args.feature_noise_mm, 1e-3),
        (&mut d.robot_position_noise_m, args.robot_noise_mm, 1e-3),
        (&mut d.frame_jitter_s, args.stamp_jitter_ms, 1e-3),
        (&mut d.clock_drift_ppm, args.clock_drift_ppm, 1.0),
    ]);
}
