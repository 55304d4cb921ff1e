//! `trueline-testbench camera-sim`.

use crate::args::CameraSimArgs;
use crate::failure::Failure;
use crate::{interrupt, output, path_file, planned_scan};
use std::process::ExitCode;
use std::thread;
use std::time::{Duration, Instant};
use trueline_camera::device::{Device, DeviceHandle};
use trueline_cell::{CameraLook, SceneError, SimulatedScene};
use trueline_dataset::{Guess, Sensor, known_toml};
use trueline_experiments::planned;
use trueline_live::HostClock;

/// Between looks at whether it is time to end.
const LOOK: Duration = Duration::from_millis(50);

/// Runs the command.
pub(crate) fn run(args: &CameraSimArgs) -> Result<ExitCode, Failure> {
    if args.exposure_ms * 1e-3 > args.longest_exposure_s() {
        return Err(Failure::new(
            format!(
                "--exposure-ms: expected less than the time between pictures or profiles, found {}",
                args.exposure_ms
            ),
            "`trueline-testbench camera-sim --help` explains it",
        ));
    }
    interrupt::watch()?;
    let mut planned = planned_scan::read(&args.plan, args.exact_guess, args.seed)?;
    let is_profiler = planned.cell.sensor == Sensor::Profiler;
    if args.profiles_per_frame != 1 && !is_profiler {
        return Err(Failure::new(
            format!("--profiles-per-frame {}: the plan's sensor is a camera", args.profiles_per_frame),
            "a plan of a profiler sends profiles: `trueline plan --example profiler`",
        ));
    }
    let plates = is_profiler.then(|| planned::plates(&planned.cell, &mut planned.scenario).ok()).flatten();
    let look = CameraLook { joint: (args.joint)(), look: args.look() };
    let clock = HostClock::start();
    let mut scene = SimulatedScene::new(
        &planned.scenario,
        &look,
        &plates.unwrap_or_default(),
        args.seed,
        args.robot_truth,
        clock,
    )?
    .wired(&args.wiring(), clock)?;
    tell_drawing_time(&mut scene, args)?;
    let (cell, settings) = (planned.scenario.cell, scene.device(args.device(), args.profiles_per_frame));
    if let Some(file) = &args.truth {
        let parameters =
            Guess { time_offset_s: args.time_offset_s(), tool_from_camera: cell.tool_from_camera };
        output::file(file, &known_toml::format(&parameters, &cell.lines))?;
    }
    let device = Device::start(settings, clock, scene).map_err(|error| {
        Failure::new(
            format!("{}: no camera can be there: {error}", args.address),
            "is another camera (or this command) running at that address? 127.0.0.2 is another one",
        )
    })?;
    if !args.quiet {
        output::words(&format!("a camera at {}; Ctrl-C switches it off", args.address));
    }
    serve(&device, args);
    if !args.quiet {
        output::words(&device.counts().to_string());
    }
    device.stop();
    Ok(ExitCode::SUCCESS)
}

fn tell_drawing_time(scene: &mut SimulatedScene, args: &CameraSimArgs) -> Result<(), Failure> {
    let path = path_file::read(&args.plan)?;
    let slow = path.first().and_then(|first| scene.slow_drawing(&first.base_from_tool, &args.device()));
    slow.iter().for_each(|slow| output::words(&format!("warning: {slow}")));
    Ok(())
}

fn serve(device: &DeviceHandle, args: &CameraSimArgs) {
    let start = Instant::now();
    let passed = |limit: Option<f64>| limit.is_some_and(|s| start.elapsed().as_secs_f64() >= s);
    let mut plugged = true;
    while interrupt::times() == 0 && !passed(args.for_s) {
        if plugged && passed(args.unplug_at_s) {
            device.unplug();
            plugged = false;
        }
        thread::sleep(LOOK);
    }
}

impl From<SceneError> for Failure {
    fn from(error: SceneError) -> Self {
        Self::new(error.to_string(), error.hint())
    }
}
