//! What a camera sees that a simulated robot carries: drawn from where that robot truly is at each exposure.

use std::net::SocketAddr;
use std::thread;
use std::time::{Duration, Instant};
use trueline_camera::device::Pictures;
use trueline_dataset::GrayImage;
use trueline_geometry::Pose;
use trueline_live::controller::TruthReceiver;
use trueline_sim::images::{Renderer, Studio};
use trueline_sim::{Cell, Joint, Look, SensorModel};

/// Longest wait for the robot's word about an exposure that has ended.
const PATIENCE: Duration = Duration::from_millis(50);
/// Pictures drawn to learn how long it takes.
const TRIED: u32 = 3;

/// What the camera sees, wherever the robot is.
pub struct SimulatedScene {
    robot: TruthReceiver,
    studio: Studio,
    tool_from_camera: Pose,
    size: [u32; 2],
    drawn: u64,
}

/// Why there is nothing to see.
#[derive(Debug, thiserror::Error)]
pub enum SceneError {
    /// The sensor is no camera, or there is no line.
    #[error("this plan's sensor takes no pictures")]
    NoPictures,
    /// Where the robot is cannot be heard.
    #[error("{address}: {error}")]
    Robot {
        /// Where it is to be told.
        address: SocketAddr,
        /// What the operating system says.
        error: std::io::Error,
    },
}

impl SimulatedScene {
    /// The first line of a cell as a joint, seen by the cell's camera on the robot that is told about at `robot`.
    ///
    /// # Errors
    /// [`SceneError`].
    pub fn new(
        cell: &Cell,
        joint: Joint,
        look: Look,
        seed: u64,
        robot: SocketAddr,
    ) -> Result<Self, SceneError> {
        let (SensorModel::CameraLaser { camera, laser_plane_in_camera }, Some(seam)) =
            (&cell.sensor, cell.lines.first())
        else {
            return Err(SceneError::NoPictures);
        };
        let receiver =
            TruthReceiver::bind(robot).map_err(|error| SceneError::Robot { address: robot, error })?;
        let shown = (joint, *seam, cell.approach.into_inner());
        Ok(Self {
            robot: receiver,
            studio: Studio::new((*camera, *laser_plane_in_camera), shown, look, seed),
            tool_from_camera: cell.tool_from_camera,
            size: camera.size,
            drawn: 0,
        })
    }

    /// Columns and rows of a picture.
    #[must_use]
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// How long drawing takes on this machine with the robot at a pose, measured.
    #[must_use]
    pub fn drawing_time(&self, base_from_tool: &Pose) -> Duration {
        let base_from_camera = base_from_tool * self.tool_from_camera;
        let start = Instant::now();
        for number in 0..TRIED {
            let _drawn = Renderer::new(&self.studio).draw(u64::from(number), |_| base_from_camera);
        }
        start.elapsed() / TRIED
    }
}

impl Pictures for SimulatedScene {
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
