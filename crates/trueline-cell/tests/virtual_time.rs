//! A whole cell in virtual time. The gate leads a controller over a network that loses, doubles and disorders datagrams, and
//! a camera on its flange draws its view and loses pictures. The recording gives back the truth. No clock is waited for, so
//! a busy machine does not show.
#![allow(
    clippy::print_stdout,
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a test fails by panicking; figures are shown by --nocapture"
)]

use nalgebra::{UnitVector3, Vector2, Vector3};
use std::net::SocketAddr;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;
use trueline_camera::{CameraError, CameraFrame, FrameSource, FrameStatus, SourceAbout};

use trueline_cell::{
    ARRIVAL, CameraRecorder, Cell, CellRecording, CellState, RecordingSettings, StampChoice,
};
use trueline_dataset::{FrameSignals, RobotSample, sensor_toml};
use trueline_geometry::Pose;
use trueline_live::controller::settings::Convergence;
use trueline_live::controller::{
    Controller, ControllerSettings, GuidanceEnd, Network, NetworkSettings, Task, VirtualTime,
};
use trueline_live::egm::Message;
use trueline_live::guide::{self, Answer};
use trueline_live::host_clock::Reading;
use trueline_live::motion::{
    CheckedPath, EndReason, Gate, GateState, Input, MotionLimits, OperatorCommand, Phase, ReceivedFrame,
};
use trueline_live::stamped_socket::{Arrival, Datagram};
use trueline_live::{FrameFilter, HostClock, Received, RobotPacket, SequenceStatus};
use trueline_mcap::{Choice, import};
use trueline_method::problem::parameters::{ROTATION, TRANSLATION};
use trueline_method::{Config, Status};
use trueline_model::Camera;
use trueline_sim::images::{Renderer, Studio};
use trueline_sim::{Disturbance, Look, Preset, Scenario, SensorModel, Timing, simulate};
use trueline_vision::scan::find_seams;
use trueline_vision::{Detector, Joint};

const SCAN_S: f64 = 12.0;
/// The scan's own pace; a guided robot gets this part of it, so that the tool's load stays below 0.25 m/s.
const PACE: f64 = 0.75;
/// Between pictures, exposure, and from its end until the first packet is there.
const FRAME_NS: i64 = 40_000_000;
const EXPOSURE_NS: i64 = 3_000_000;
const LATENCY_NS: i64 = 61_300_000;
/// Of so many pictures one is lost.
const LOST_OF: u64 = 9;
/// The shortest time of a datagram, s.
const LEAST_S: f64 = 2e-4;

fn robot() -> SocketAddr {
    "192.0.2.1:6510".parse().unwrap()
}

/// A quick scan of a camera with a quarter of the pixels each way.
fn scenario() -> Scenario {
    let mut scenario = Preset::Quick.scenario();
    scenario.timing = Timing { duration_s: SCAN_S, robot_period_s: 0.01, ..scenario.timing };
    scenario.disturbance = Disturbance::default();
    if let SensorModel::CameraLaser { camera, .. } = &mut scenario.cell.sensor {
        *camera = Camera {
            size: camera.size.map(|px| px / 4),
            focal: camera.focal / 4.0,
            // (0, 0) is the centre of the first pixel.
            centre: (camera.centre + Vector2::repeat(0.5)) / 4.0 - Vector2::repeat(0.5),
            ..*camera
        };
    }
    scenario
}

/// Limits about a path: half a decimetre beside it, and the speeds of a scan.
fn limits(path: &[RobotSample]) -> MotionLimits {
    let places = || path.iter().map(|sample| sample.base_from_tool.translation.vector);
    let first = &path[0].base_from_tool;
    let corner = |pick: fn(f64, f64) -> f64| places().reduce(|a, b| a.zip_map(&b, pick)).unwrap();
    MotionLimits {
        box_m: [corner(f64::min).add_scalar(-0.05), corner(f64::max).add_scalar(0.05)],
        tool_axis: UnitVector3::new_normalize(first.rotation * Vector3::z()),
        cone_rad: 1.2,
        reach_m: 0.3,
        speed_m_s: 0.25,
        acceleration_m_s2: 1.5,
        jerk_m_s3: 20.0,
        turn_rad_s: 1.5,
        turn_acceleration_rad_s2: 10.0,
        deviation_m: 0.03,
        deviation_rad: 0.2,
        start_m: 0.01,
        start_rad: 0.05,
    }
}

/// This program's side of the stream, which records what comes and what it answers.
struct Pc {
    filter: FrameFilter,
    gate: Gate,
    state: GateState,
    recording: CellRecording,
    answers: u32,
}

impl Pc {
    fn receive(&mut self, arrival_ns: i64, bytes: &[u8]) -> Option<Vec<u8>> {
        let judged = self.filter.judge(bytes, robot(), arrival_ns);
        let read = Reading { steady_ns: arrival_ns, wall_ns: arrival_ns };
        let arrival = Arrival { steady_ns: arrival_ns, is_of_reading: false, kernel_wall_ns: None, read };
        let datagram = Datagram { bytes, from: robot(), arrival, dropped_by_kernel: 0 };
        self.recording.packet(&RobotPacket::from(&Received { datagram, judged }));
        let (frame, status) = judged.ok()?;
        if status == SequenceStatus::Late {
            return None;
        }
        let is_first = status == SequenceStatus::First;
        let received = Some(ReceivedFrame { frame, arrival_ns, is_first });
        let command = OperatorCommand::Go;
        let (state, reference) = self.gate.step(self.state, &Input { received, now_ns: arrival_ns, command });
        self.state = state;
        let reference = reference?;
        self.answers += 1;
        let bytes = guide::message(self.answers, arrival_ns, &reference).encode_to_vec();
        let (to, sequence) = (robot(), self.answers);
        let answer = Answer {
            bytes: bytes.clone(),
            to,
            steady_ns: arrival_ns,
            since_frame_ns: Some(0),
            sequence,
            reference,
        };
        self.recording.answer(&answer);
        Some(bytes)
    }
}

/// The camera on the flange.
struct Flange<'a> {
    renderer: Renderer<'a>,
    tool_from_camera: Pose,
    taken: u64,
    frames: Vec<CameraFrame>,
}

impl Flange<'_> {
    /// Takes the pictures whose exposure is over.
    fn look(&mut self, controller: &Controller) {
        loop {
            let start_ns = self.taken as i64 * FRAME_NS + FRAME_NS / 3;
            let middle_ns = start_ns + EXPOSURE_NS / 2;
            if start_ns + EXPOSURE_NS >= controller.next_cycle_ns() - 20_000_000 {
                return;
            }
            let pose = |from_middle_s: f64| {
                let at_ns = middle_ns + (from_middle_s * 1e9) as i64;
                controller.true_pose(at_ns).expect("the robot's last half second is known")
                    * self.tool_from_camera
            };
            let image = self.renderer.draw(self.taken, pose).image;
            let first_packet_ns = start_ns + EXPOSURE_NS + LATENCY_NS;
            self.frames.push(CameraFrame {
                image: Some(image),
                profiles: Vec::new(),
                frame: self.taken,
                device_ns: None,
                first_packet_ns: Some(first_packet_ns),
                complete_ns: first_packet_ns + 2_000_000,
                exposure_us: Some(EXPOSURE_NS as f64 * 1e-3),
                signals: FrameSignals::default(),
                status: FrameStatus::Complete,
            });
            self.taken += 1;
        }
    }
}

/// Gives pictures one by one, and tells when there are no more.
struct Frames {
    left: std::vec::IntoIter<CameraFrame>,
    about: SourceAbout,
    none_left: Arc<AtomicBool>,
}

impl FrameSource for Frames {
    fn next(&mut self, _: Duration) -> Result<Option<CameraFrame>, CameraError> {
        let frame = self.left.next();
        self.none_left.store(frame.is_none(), Ordering::SeqCst);
        Ok(frame)
    }

    fn about(&self) -> &SourceAbout {
        &self.about
    }

    fn has_ended(&self) -> bool {
        self.none_left.load(Ordering::SeqCst)
    }
}

/// Records pictures beside a robot that waits for them.
fn record_pictures(frames: Vec<CameraFrame>, size: [u32; 2], recording: &CellRecording) -> CellState {
    let [width, height] = size.map(|px| px as usize);
    let (name, stamp_meaning) = ("a camera in virtual time".to_owned(), "none".to_owned());
    let about = SourceAbout { name, width, height, tick_hz: None, stamp_meaning, trigger: None };
    let none_left = Arc::new(AtomicBool::new(false));
    let source = Frames { left: frames.into_iter(), about, none_left: Arc::clone(&none_left) };
    let camera =
        CameraRecorder::with_source(Box::new(source), StampChoice::FirstPacket, Joint::Fillet, None).unwrap();
    let mut cell = Cell::new(Some(camera), None);
    let wait = |_: &AtomicBool| {
        while !none_left.load(Ordering::SeqCst) {
            std::thread::sleep(Duration::from_millis(1));
        }
    };
    let outcome = cell.run(&recording.handle(), wait, |_| {});
    assert!(outcome.camera.is_ok());
    cell.state()
}

/// The scan, guided and recorded; the pictures that were lost.
fn scan(scenario: &Scenario, network: NetworkSettings, folder: &Path) -> u64 {
    let SensorModel::CameraLaser { camera, laser_plane_in_camera } = scenario.cell.sensor else { panic!() };
    let simulated = simulate(scenario, 1).unwrap();
    let limits = limits(&simulated.robot);
    let path = CheckedPath::new(&simulated.robot, PACE, &limits).unwrap();
    let settings = RecordingSettings {
        folder,
        sensor_toml: Some(sensor_toml::format(&simulated.sensor)),
        tool: "tool0",
        robot: ARRIVAL,
        command: String::new(),
        camera: Some("arrival of the first packet".to_owned()),
        estimate: None,
        welds: None,
        listener: None,
    };
    let mut pc = Pc {
        filter: FrameFilter::new(Some(robot().ip())),
        gate: Gate::new(limits, path, 0.2),
        state: GateState::default(),
        recording: CellRecording::create(settings, HostClock::start()).unwrap(),
        answers: 0,
    };
    let start = simulated.robot[0].base_from_tool;
    let mut controller = ControllerSettings::new(Task::Guidance { start });
    // The output of `trueline robot-program abb`.
    controller.convergence = Convergence { distance_m: 5e-5, angle_rad: 0.05_f64.to_radians(), for_s: 3.0 };
    let mut world = VirtualTime {
        controller: Controller::new(controller),
        to_pc: Network::new(network, 21),
        to_robot: Network::new(network, 22),
    };
    let shown = (trueline_sim::Joint::fillet(), scenario.cell.lines[0], scenario.cell.approach.into_inner());
    let studio = Studio::new((camera, laser_plane_in_camera), shown, Look::speckled(), 3);
    let tool_from_camera = scenario.cell.tool_from_camera;
    let mut flange =
        Flange { renderer: Renderer::new(&studio), tool_from_camera, taken: 0, frames: Vec::new() };
    for step in 1..=((SCAN_S / PACE + 8.0) / 0.1) as u32 {
        world.run(f64::from(step) * 0.1, |at_ns, datagram| pc.receive(at_ns, datagram));
        flange.look(&world.controller);
    }
    let travelled = matches!(pc.state.phase, Phase::Holding { why, .. } | Phase::Silent { why } if why == EndReason::Travelled);
    assert!(travelled, "{:?}", pc.state.phase);
    assert_eq!(world.controller.ended(), Some(GuidanceEnd::Converged));
    assert!(world.to_pc.lost() > 20, "{} datagrams were lost", world.to_pc.lost());

    let taken = flange.taken;
    let is_lost = |number: u64| number % LOST_OF == 4;
    let frames = flange.frames.into_iter().filter(|frame| !is_lost(frame.frame)).collect();
    let counts = record_pictures(frames, camera.size, &pc.recording).camera.unwrap();
    let lost = (0..taken).filter(|number| is_lost(*number)).count() as u64;
    assert_eq!((counts.taken(), counts.lost()), (taken, lost));
    let finished = pc.recording.finish();
    assert!(finished.is_complete(), "{:?}", finished.losses());
    lost
}

#[test]
fn a_guided_scan_over_a_lossy_network_with_lost_pictures_calibrates_to_what_was_put_in() {
    let folder = tempfile::tempdir().unwrap();
    let scenario = scenario();
    let network = NetworkSettings {
        least_s: LEAST_S,
        loss: 0.01,
        duplicate: 0.01,
        reorder: 0.01,
        ..NetworkSettings::typical()
    };
    let lost = scan(&scenario, network, folder.path());
    assert!(lost > 20, "{lost} pictures were lost");

    let imported = import(&folder.path().join("recording.mcap"), &Choice::default()).unwrap();
    let (mut recording, pictures) = (imported.recording, imported.pictures.unwrap());
    let detector = Detector::for_sensor(&recording.sensor).unwrap();
    let seams = find_seams(&pictures, &detector, Some(Joint::Fillet), &()).unwrap();
    recording.features = seams.features();
    let calibration = trueline_method::calibrate(&recording, None, &Config::default()).unwrap();
    assert_eq!(calibration.status(), Status::Accepted);
    let found = calibration.best_fit();

    // The pose of a datagram is that of its cycle; the quickest datagrams tell when that was.
    let offset_s = 1e-9 * (0.5 * EXPOSURE_NS as f64 + LATENCY_NS as f64) - LEAST_S;
    let error_s = found.time_offset_s - offset_s;
    let sigma_s = calibration.noise_sigma(0).unwrap();
    println!("offset {:.3} ms off, ± {:.3} ms", 1e3 * error_s, 1e3 * sigma_s);
    let truth = scenario.cell.tool_from_camera;
    let error_m = found.tool_from_camera.translation.vector - truth.translation.vector;
    let turned = found.tool_from_camera.rotation * truth.rotation.inverse();
    let error_rad = turned.scaled_axis();
    for axis in 0..3 {
        let sigma_m = calibration.sigma(TRANSLATION + axis).unwrap();
        let sigma_rad = calibration.sigma(ROTATION + axis).unwrap();
        println!(
            "axis {axis}: {:.4} ± {:.4} mm, {:.4} ± {:.4}°",
            1e3 * error_m[axis],
            1e3 * sigma_m,
            error_rad[axis].to_degrees(),
            sigma_rad.to_degrees()
        );
        assert!(error_m[axis].abs() < 4.0 * sigma_m, "axis {axis}: {} ± {sigma_m} m", error_m[axis]);
        assert!(
            error_rad[axis].abs() < 4.0 * sigma_rad,
            "axis {axis}: {} ± {sigma_rad} rad",
            error_rad[axis]
        );
    }
    assert!(error_s.abs() < 4.0 * sigma_s + 5e-5, "{error_s} ± {sigma_s} s");
}
