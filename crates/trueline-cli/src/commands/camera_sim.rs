//! `trueline camera-sim`.

use crate::failure::Failure;
use crate::{interrupt, output, path_file, planned_scan};
use std::process::ExitCode;
use std::thread;
use std::time::{Duration, Instant};
use trueline_args::CameraSimArgs;
use trueline_camera::device::{Device, DeviceHandle};
use trueline_cell::{SceneError, SimulatedScene};
use trueline_dataset::{Guess, known_toml};
use trueline_live::HostClock;

/// Between looks at whether it is time to end.
const LOOK: Duration = Duration::from_millis(50);

/// Runs the command.
pub(crate) fn run(args: &CameraSimArgs) -> Result<ExitCode, Failure> {
    if args.exposure_ms * 1e-3 > 1.0 / args.fps {
        return Err(Failure::new(
            format!(
                "--exposure-ms: expected less than the time between pictures, found {}",
                args.exposure_ms
            ),
            "`trueline camera-sim --help` explains it",
        ));
    }
    interrupt::watch()?;
    let cell = planned_scan::read(&args.plan, args.exact_guess, args.seed)?.scenario.cell;
    let scene = SimulatedScene::new(&cell, (args.joint)(), args.look(), args.seed, args.robot_truth)?;
    tell_drawing_time(&scene, args)?;
    if let Some(file) = &args.truth {
        let parameters =
            Guess { time_offset_s: args.time_offset_s(), tool_from_camera: cell.tool_from_camera };
        output::file(file, &known_toml::format(&parameters, &cell.lines))?;
    }
    let device = Device::start(args.device(scene.size()), HostClock::start(), scene).map_err(|error| {
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

/// A picture has to be drawn before its first packet is due, and before the next one.
fn tell_drawing_time(scene: &SimulatedScene, args: &CameraSimArgs) -> Result<(), Failure> {
    let path = path_file::read(&args.plan)?;
    let Some(first) = path.first() else { return Ok(()) };
    let takes_ms = scene.drawing_time(&first.base_from_tool).as_secs_f64() * 1e3;
    let allowed_ms = args.readout_ms + args.latency_ms;
    if takes_ms > 0.7 * allowed_ms || takes_ms > 700.0 / args.fps {
        output::words(&format!(
            "warning: a picture takes {takes_ms:.0} ms to draw on this machine, and has {allowed_ms:.0} ms (--readout-ms and \
             --latency-ms) and {:.0} ms between pictures (--fps); those that are late are dropped. --latency-ms {:.0} and --fps \
             {:.1} leave room; a smaller picture in sensor.toml is drawn faster",
            1e3 / args.fps,
            (2.0 * takes_ms).max(args.latency_ms),
            (500.0 / takes_ms).min(args.fps),
        ));
    }
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
        match &error {
            SceneError::NoPictures => Self::new(error.to_string(), "plan with a camera_laser"),
            SceneError::Robot { .. } => Self::new(
                format!("--robot-truth {error}"),
                "the address that `robot-sim --truth-to` has, on this machine",
            ),
        }
    }
}
