//! The view of a camera or a profiler on a simulated robot, drawn from the robot's true pose at each
//! exposure.

use crate::drawing_time::late_pictures;
use crate::simulated_encoder::SimulatedEncoder;
use std::net::SocketAddr;
use std::thread;
use std::time::{Duration, Instant};
use trueline_camera::device::{DeviceSettings, Edge, OutputMode, Pictures, RangeFeatures};
use trueline_dataset::{GrayImage, Pixels};
use trueline_geometry::Pose;
use trueline_live::HostClock;
use trueline_live::controller::{TriggerReceiver, TriggerSender, TruthReceiver};
use trueline_sim::images::{Renderer, Studio};
use trueline_sim::{Joint, Look, Plates, ProfileCaster, ProfileLook, Scenario, SensorModel};

/// Longest wait for the robot's word about an exposure that has ended.
const PATIENCE: Duration = Duration::from_millis(50);
/// Pictures drawn to learn how long it takes.
const TRIED: u32 = 3;
/// The number that marks a column without a return.
const NO_RETURN: u16 = 0;
/// Numbers that mean a range: the whole depth of the view.
const RANGES: f64 = 65_534.0;
const MM_PER_M: f64 = 1e3;

/// The scene that the sensor views, wherever the robot is.
pub struct SimulatedScene {
    robot: TruthReceiver,
    tool_from_camera: Pose,
    view: View,
    output: Option<TriggerSender>,
    input: Option<Line1>,
}

/// The source wired to the input `Line1`.
enum Line1 {
    Encoder(SimulatedEncoder),
    Robot(TriggerReceiver),
}

/// How it is drawn.
enum View {
    Camera { studio: Box<Studio>, size: [u32; 2], drawn: u64 },
    Profiler { caster: Box<ProfileCaster>, range_m: [f64; 2] },
}

/// How a seam looks to a camera.
pub struct CameraLook {
    /// The joint.
    pub joint: Joint,
    /// How the plates look.
    pub look: Look,
}

/// The source wired to a simulated camera.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CameraWiring {
    /// The address that is sent every exposure.
    pub output_to: Option<SocketAddr>,
    /// The signal at the input `Line1`.
    pub input: Option<WiredInput>,
}

/// The source wired to the input of a simulated camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum WiredInput {
    /// An encoder on the robot's path: a signal at this travel of the tool, m.
    Encoder {
        /// Between two signals, m.
        step_m: f64,
    },
    /// A digital output of a simulated robot, which arrives at an address of this machine.
    Robot(SocketAddr),
}

impl SceneError {
    /// Hint for the user.
    #[must_use]
    pub fn hint(&self) -> &'static str {
        match self {
            Self::NothingSeen => "plan with a camera_laser or a profiler",
            Self::Robot { .. } => {
                "--robot-truth is the address that the robot's --truth-to has, on this machine"
            }
            Self::Wire { .. } => {
                "--trigger-to is the address that the robot's --input-from has, --trigger-from that of its --output-to, on this machine"
            }
        }
    }
}

/// Why there is nothing to see.
#[derive(Debug, thiserror::Error)]
pub enum SceneError {
    /// The sensor is neither a camera nor a profiler, or there is no line.
    #[error("this plan's sensor takes neither pictures nor profiles")]
    NothingSeen,
    /// The robot's pose cannot be received.
    #[error("{address}: {error}")]
    Robot {
        /// The address to report to.
        address: SocketAddr,
        /// Message of the operating system.
        error: std::io::Error,
    },
    /// The source wired to the camera is not possible.
    #[error("{address}: {error}")]
    Wire {
        /// Address of the other end.
        address: SocketAddr,
        /// Message of the operating system.
        error: std::io::Error,
    },
}

impl View {
    fn of(scenario: &Scenario, look: &CameraLook, plates: &Plates, seed: u64) -> Option<Self> {
        let (cell, noise_m) = (&scenario.cell, scenario.disturbance.feature_noise_m);
        match &cell.sensor {
            SensorModel::CameraLaser { camera, laser_plane_in_camera } => {
                let shown = (look.joint, *cell.lines.first()?, cell.approach.into_inner());
                let studio = Studio::new((*camera, *laser_plane_in_camera), shown, look.look.clone(), seed);
                Some(Self::Camera { studio: Box::new(studio), size: camera.size, drawn: 0 })
            }
            SensorModel::Profiler { range_m, .. } => {
                let look = ProfileLook { range_sigma_m: noise_m, ..ProfileLook::default() };
                let caster = Box::new(ProfileCaster::new(scenario, plates, &look, seed)?);
                Some(Self::Profiler { caster, range_m: *range_m })
            }
            SensorModel::Points { .. } => None,
        }
    }
}

impl SimulatedScene {
    /// The first line of a scenario, viewed by its sensor on the robot reported at `robot`, with times of a
    /// clock. A camera views a joint, a profiler two plates.
    ///
    /// # Errors
    /// [`SceneError`].
    pub fn new(
        scenario: &Scenario,
        look: &CameraLook,
        plates: &Plates,
        seed: u64,
        robot: SocketAddr,
        clock: HostClock,
    ) -> Result<Self, SceneError> {
        let view = View::of(scenario, look, plates, seed).ok_or(SceneError::NothingSeen)?;
        let receiver =
            TruthReceiver::bind(robot, clock).map_err(|error| SceneError::Robot { address: robot, error })?;
        Ok(Self {
            robot: receiver,
            tool_from_camera: scenario.cell.tool_from_camera,
            view,
            output: None,
            input: None,
        })
    }

    /// The same with the wiring of the camera; `clock` is that of the exposures.
    ///
    /// # Errors
    /// Message of the operating system.
    pub fn wired(self, wiring: &CameraWiring, clock: HostClock) -> Result<Self, SceneError> {
        let of_wire = |address| move |error| SceneError::Wire { address, error };
        let output = wiring.output_to.map(|to| TriggerSender::new(to, clock).map_err(of_wire(to)));
        let input = match wiring.input {
            None => None,
            Some(WiredInput::Encoder { step_m }) => {
                Some(Line1::Encoder(SimulatedEncoder::new(step_m, clock)))
            }
            Some(WiredInput::Robot(at)) => {
                Some(Line1::Robot(TriggerReceiver::bind(at, 0, clock).map_err(of_wire(at))?))
            }
        };
        Ok(Self { output: output.transpose()?, input, ..self })
    }

    /// A device with its sensor's size. A profiler sends a stated number of profiles per frame, at the frame rate of
    /// the settings.
    #[must_use]
    pub fn device(&self, settings: DeviceSettings, profiles_per_frame: u32) -> DeviceSettings {
        match &self.view {
            View::Camera { size: [width, height], .. } => {
                DeviceSettings { width: *width, height: *height, ..settings }
            }
            View::Profiler { caster, range_m } => {
                let scale_mm = (range_m[1] - range_m[0]) * MM_PER_M / RANGES;
                let first_mm = caster.x_m(0) * MM_PER_M;
                let range = RangeFeatures {
                    along_mm: [caster.x_m(1) * MM_PER_M - first_mm, first_mm],
                    // The first number after that for no return is the nearest range.
                    range_mm: [scale_mm, range_m[0] * MM_PER_M - scale_mm],
                    invalid: NO_RETURN,
                    lines_hz: f64::from(profiles_per_frame) / settings.period_s,
                    output_mode: OutputMode::RectifiedC,
                };
                let width = caster.columns() as u32;
                DeviceSettings { width, height: profiles_per_frame, range: Some(range), ..settings }
            }
        }
    }

    /// Advice if drawing takes too long on this machine, measured with the robot at a pose. A picture must be
    /// drawn before its first packet is due, and before the next one.
    #[must_use]
    pub fn slow_drawing(&mut self, base_from_tool: &Pose, settings: &DeviceSettings) -> Option<String> {
        late_pictures(self.drawing_time(base_from_tool), settings)
    }

    fn drawing_time(&mut self, base_from_tool: &Pose) -> Duration {
        let base_from_camera = base_from_tool * self.tool_from_camera;
        let start = Instant::now();
        for number in 0..TRIED {
            match &mut self.view {
                View::Camera { studio, .. } => {
                    let _drawn = Renderer::new(studio).draw(u64::from(number), |_| base_from_camera);
                }
                View::Profiler { caster, .. } => drop(caster.cast(&base_from_camera)),
            }
        }
        start.elapsed() / TRIED
    }

    /// Waits until the robot has reported its poses up to then.
    fn hears_until(&mut self, steady_ns: i64) -> bool {
        let asked = Instant::now();
        while self.robot.pose_at(steady_ns).is_none() {
            if asked.elapsed() > PATIENCE {
                return false;
            }
            thread::sleep(Duration::from_millis(1));
        }
        true
    }
}

impl Pictures for SimulatedScene {
    fn exposes(&mut self, start_steady_ns: i64, exposure_s: f64) {
        if let Some(output) = &self.output {
            output.send([start_steady_ns, start_steady_ns + (exposure_s * 1e9) as i64]);
        }
    }

    fn edge_after(&mut self, steady_ns: i64) -> Option<Edge> {
        match self.input.as_mut()? {
            Line1::Encoder(encoder) => {
                encoder.follow(|at_ns| self.robot.pose_at(at_ns));
                encoder.edge_after(steady_ns)
            }
            Line1::Robot(wire) => wire.change_after(steady_ns).map(|(at_ns, rises)| Edge { at_ns, rises }),
        }
    }

    fn encoder(&mut self, steady_ns: i64) -> Option<i64> {
        let Some(Line1::Encoder(encoder)) = &mut self.input else { return None };
        encoder.follow(|at_ns| self.robot.pose_at(at_ns));
        Some(encoder.state(steady_ns).0)
    }

    fn line(&mut self, steady_ns: i64) -> bool {
        match &mut self.input {
            None => false,
            Some(Line1::Encoder(encoder)) => encoder.state(steady_ns).1,
            Some(Line1::Robot(wire)) => wire.is_on(steady_ns),
        }
    }

    fn picture(&mut self, exposure_start_steady_ns: i64, exposure_s: f64) -> Option<GrayImage> {
        let length_ns = (exposure_s * 1e9) as i64;
        if !self.hears_until(exposure_start_steady_ns + length_ns) {
            return None;
        }
        let middle_ns = exposure_start_steady_ns + length_ns / 2;
        let first = self.robot.pose_at(exposure_start_steady_ns)?;
        match &mut self.view {
            View::Camera { studio, drawn, .. } => {
                *drawn += 1;
                let picture = Renderer::new(studio).draw(*drawn, |from_middle_s| {
                    let at_ns = middle_ns + (from_middle_s * 1e9) as i64;
                    self.robot.pose_at(at_ns).unwrap_or(first) * self.tool_from_camera
                });
                Some(picture.image)
            }
            View::Profiler { caster, range_m } => {
                let base_from_camera = self.robot.pose_at(middle_ns)? * self.tool_from_camera;
                Some(row(&caster.cast(&base_from_camera), *range_m))
            }
        }
    }
}

/// Ranges as numbers: the nearest is 1, the furthest the largest.
fn row(ranges_m: &[Option<f64>], [near_m, far_m]: [f64; 2]) -> GrayImage {
    let number = |range_m: &Option<f64>| {
        range_m.map_or(NO_RETURN, |range_m| {
            (1.0 + RANGES * (range_m - near_m) / (far_m - near_m)).round() as u16
        })
    };
    let counts: Vec<u16> = ranges_m.iter().map(number).collect();
    GrayImage { width: counts.len(), height: 1, pixels: Pixels::Sixteen(counts) }
}
