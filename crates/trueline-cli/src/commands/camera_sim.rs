//! `trueline camera-sim`.

use super::simulate_images::{joint, look};
use crate::args::CameraSimArgs;
use crate::failure::Failure;
use crate::{interrupt, output, path_file, planned_scan};
use std::process::ExitCode;
use std::thread;
use std::time::{Duration, Instant};
use trueline_camera::device::{Device, DeviceClock, DeviceHandle, DeviceSettings, Pictures};
use trueline_dataset::{GrayImage, Guess, known_toml};
use trueline_geometry::Pose;
use trueline_live::HostClock;
use trueline_live::controller::TruthReceiver;
use trueline_sim::images::{Renderer, Studio};
use trueline_sim::{Cell, Joint, SensorModel};

/// Longest wait for the robot's word about an exposure that has ended.
const PATIENCE: Duration = Duration::from_millis(50);
/// Between looks at whether it is time to end.
const LOOK: Duration = Duration::from_millis(50);

/// Runs the command.
pub fn run(args: &CameraSimArgs) -> Result<ExitCode, Failure> {
    check(args)?;
    interrupt::watch()?;
    let scenario = planned_scan::read(&args.plan, args.exact_guess, args.seed)?.scenario;
    let scene = scene(args, &scenario.cell)?;
    tell_drawing_time(&scene, args)?;
    let settings = settings(args, scene.size);
    if let Some(file) = &args.truth {
        let parameters = Guess {
            time_offset_s: 1e-3 * (0.5 * args.exposure_ms + args.readout_ms + args.latency_ms),
            tool_from_camera: scenario.cell.tool_from_camera,
        };
        output::file(file, &known_toml::format(&parameters, &scenario.cell.lines))?;
    }
    let device = Device::start(settings, HostClock::start(), scene).map_err(|error| {
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
        output::words(&summary(&device));
    }
    device.stop();
    Ok(ExitCode::SUCCESS)
}

/// Pictures drawn to learn how long it takes.
const TRIED: u32 = 3;

/// A picture has to be drawn before its first packet is due, and before the next one.
fn tell_drawing_time(scene: &Scene, args: &CameraSimArgs) -> Result<(), Failure> {
    let path = path_file::read(&args.plan)?;
    let Some(first) = path.first() else { return Ok(()) };
    let base_from_camera = first.base_from_tool * scene.tool_from_camera;
    let start = Instant::now();
    for number in 0..TRIED {
        let _drawn = Renderer::new(&scene.studio).draw(u64::from(number), |_| base_from_camera);
    }
    let takes_ms = start.elapsed().as_secs_f64() * 1e3 / f64::from(TRIED);
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

fn summary(device: &DeviceHandle) -> String {
    let counts = device.counts();
    format!(
        "{} exposures, {} pictures sent, {} dropped (on purpose, or because nobody told where the robot was), {} not drawn in time, {} for want of network; {} packets, {} \
         lost on purpose, {} sent again",
        counts.exposed,
        counts.sent,
        counts.dropped,
        counts.late,
        counts.link_busy,
        counts.packets,
        counts.lost_packets,
        counts.resent_packets
    )
}

fn check(args: &CameraSimArgs) -> Result<(), Failure> {
    let bad = |name: &str, expected: &str, found: f64| {
        Failure::new(
            format!("{name}: expected {expected}, found {found}"),
            "`trueline camera-sim --help` explains it",
        )
    };
    let positive = [
        ("--fps", args.fps),
        ("--exposure-ms", args.exposure_ms),
        ("--for-s", args.for_s.unwrap_or(1.0)),
        ("--unplug-at-s", args.unplug_at_s.unwrap_or(1.0)),
    ];
    let not_negative = [
        ("--readout-ms", args.readout_ms),
        ("--latency-ms", args.latency_ms),
        ("--mbit-s", args.mbit_s),
        ("--epoch-s", args.epoch_s),
    ];
    for (name, value) in positive {
        if !(value > 0.0 && value.is_finite()) {
            return Err(bad(name, "a number above 0", value));
        }
    }
    for (name, value) in not_negative {
        if !(0.0..1e9).contains(&value) {
            return Err(bad(name, "0 or more", value));
        }
    }
    for (name, value) in [("--loss", args.loss), ("--frame-drop", args.frame_drop)] {
        if !(0.0..1.0).contains(&value) {
            return Err(bad(name, "a share from 0 to less than 1", value));
        }
    }
    if args.exposure_ms * 1e-3 > 1.0 / args.fps {
        return Err(bad("--exposure-ms", "less than the time between pictures", args.exposure_ms));
    }
    if !(100..=9200).contains(&args.packet_bytes) {
        return Err(bad("--packet-bytes", "100 to 9200", args.packet_bytes.into()));
    }
    if !args.drift_ppm.is_finite() || args.drift_ppm.abs() > 1e4 {
        return Err(bad("--drift-ppm", "a number up to 10 000", args.drift_ppm));
    }
    Ok(())
}

fn settings(args: &CameraSimArgs, [width, height]: [u32; 2]) -> DeviceSettings {
    DeviceSettings {
        address: args.address,
        width,
        height,
        period_s: 1.0 / args.fps,
        exposure_us: args.exposure_ms * 1e3,
        readout_s: args.readout_ms * 1e-3,
        latency_s: args.latency_ms * 1e-3,
        clock: DeviceClock {
            epoch_ns: (args.epoch_s * 1e9) as i64,
            drift_ppm: args.drift_ppm,
            ..DeviceClock::default()
        },
        packet_bytes: args.packet_bytes,
        pace_bits_per_s: args.mbit_s * 1e6,
        loss: args.loss,
        frame_drop: args.frame_drop,
        seed: args.seed,
        serial: format!("SIM-{}", args.seed),
    }
}

/// What the camera sees, wherever the robot is.
struct Scene {
    robot: TruthReceiver,
    studio: Studio,
    tool_from_camera: Pose,
    size: [u32; 2],
    drawn: u64,
}

fn scene(args: &CameraSimArgs, cell: &Cell) -> Result<Scene, Failure> {
    let (SensorModel::CameraLaser { camera, laser_plane_in_camera }, Some(seam)) =
        (&cell.sensor, cell.lines.first())
    else {
        return Err(Failure::new("this plan's sensor takes no pictures", "plan with a camera_laser"));
    };
    let robot = TruthReceiver::bind(args.robot_truth).map_err(|error| {
        Failure::new(
            format!("--robot-truth {}: {error}", args.robot_truth),
            "the address that `robot-sim --truth-to` has, on this machine",
        )
    })?;
    let mut look = look(args.look);
    look.exposure_s = args.exposure_ms * 1e-3;
    let shown = (joint(args.joint, Joint::fillet()), *seam, cell.approach.into_inner());
    Ok(Scene {
        robot,
        studio: Studio::new((*camera, *laser_plane_in_camera), shown, look, args.seed),
        tool_from_camera: cell.tool_from_camera,
        size: camera.size,
        drawn: 0,
    })
}

impl Pictures for Scene {
    fn picture(&mut self, exposure_start_steady_ns: i64, exposure_s: f64) -> Option<GrayImage> {
        let length_ns = (exposure_s * 1e9) as i64;
        let asked = Instant::now();
        while self.robot.pose_at(exposure_start_steady_ns + length_ns).is_none() {
            if asked.elapsed() > PATIENCE {
                return None;
            }
            thread::sleep(Duration::from_millis(1));
        }
        let middle_ns = exposure_start_steady_ns + length_ns / 2;
        let first = self.robot.pose_at(exposure_start_steady_ns)?;
        self.drawn += 1;
        let picture = Renderer::new(&self.studio).draw(self.drawn, |from_middle_s| {
            let at_ns = middle_ns + (from_middle_s * 1e9) as i64;
            self.robot.pose_at(at_ns).unwrap_or(first) * self.tool_from_camera
        });
        Some(picture.image)
    }
}
