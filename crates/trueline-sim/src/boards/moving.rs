//! A robot that moves the camera before a board that stands still.

use super::pictures::BoardPictures;
use crate::noise::Noise;
use nalgebra::Vector3;
use rayon::prelude::*;
use std::f64::consts::TAU;
use std::fs;
use std::path::Path;
use trueline_dataset::sensor_setup::SensorSetup;
use trueline_dataset::sensor_toml::{CameraFile, format_camera};
use trueline_dataset::{
    Error, FrameFile, Guess, Problem, RobotSample, gray_png, images, known_toml, robot_csv,
};
use trueline_geometry::{Pose, se3, so3};

/// How far the middle of the board is from the camera, and swings to every side, m.
const DISTANCE_M: f64 = 0.40;
const SWING_M: [f64; 3] = [0.015, 0.012, 0.030];

/// Between pictures and between poses, s; the robot is recorded before the first picture and after the last.
const PICTURE_PERIOD_S: f64 = 0.1;
const ROBOT_PERIOD_S: f64 = 0.004;
const BEFORE_S: f64 = 0.2;

/// Stamp of the first pose, ns.
const START_NS: i64 = 1_000_000_000;

/// Noise of the robot's recorded poses, per axis.
const ROBOT_NOISE_M: f64 = 0.03e-3;
const ROBOT_NOISE_RAD: f64 = 2e-5;

/// A scan of a board.
#[derive(Clone, Copy, Debug)]
pub struct BoardScan {
    /// Time offset: delay of pictures' stamps after their exposures, s.
    pub time_offset_s: f64,
    /// Pictures, ten a second.
    pub pictures: u32,
    /// Seed of the noise.
    pub seed: u64,
}

impl BoardScan {
    /// `tool_from_camera`.
    #[must_use]
    pub fn tool_from_camera() -> Pose {
        se3::from_parts(so3::exp(&Vector3::new(0.2, -0.3, 1.5)), Vector3::new(0.060, -0.020, 0.140))
    }

    /// Writes a dataset folder: `sensor.toml`, `robot.csv`, pictures and `truth.toml`. `drawn` is called after each picture.
    ///
    /// # Errors
    /// Files that cannot be written.
    pub(super) fn write(
        &self,
        folder: &Path,
        boards: &BoardPictures,
        drawn: &(dyn Fn() + Sync),
    ) -> Result<(), Error> {
        let pictures = folder.join("images");
        fs::create_dir_all(&pictures).map_err(|error| Error::in_file(&pictures, Problem::Io(error)))?;
        let frames = (0..self.pictures)
            .into_par_iter()
            .map(|number| {
                let exposed_s = BEFORE_S + PICTURE_PERIOD_S * f64::from(number);
                let path = pictures.join(format!("{number:06}.png"));
                let noise = self.seed.wrapping_mul(1_000_033).wrapping_add(u64::from(number));
                gray_png::write(&path, &boards.picture(camera_from_board(boards, exposed_s), false, noise))?;
                drawn();
                let stamp_ns = START_NS + ((exposed_s + self.time_offset_s) * 1e9).round() as i64;
                Ok(FrameFile { stamp_ns, device_ns: None, frame: u64::from(number), path })
            })
            .collect::<Result<Vec<FrameFile>, Error>>()?;
        images::write_index(folder, &frames)?;
        let write = |name: &str, text: &[u8]| {
            let file = folder.join(name);
            fs::write(&file, text).map_err(|error| Error::in_file(&file, Problem::Io(error)))
        };
        let mut table = Vec::new();
        robot_csv::write(&mut table, &self.robot(boards))
            .map_err(|error| Error::in_file(&folder.join("robot.csv"), Problem::Io(error)))?;
        write("robot.csv", &table)?;
        let sensor = CameraFile {
            camera: boards.camera,
            laser_plane_in_camera: Some(boards.laser_plane_in_camera),
            setup: SensorSetup::default(),
        };
        write("sensor.toml", format_camera(&sensor).as_bytes())?;
        let truth = Guess { time_offset_s: self.time_offset_s, tool_from_camera: Self::tool_from_camera() };
        write("truth.toml", known_toml::format(&truth, &[]).as_bytes())
    }

    /// The robot's recorded poses, including noise of the position and the attitude.
    fn robot(&self, boards: &BoardPictures) -> Vec<RobotSample> {
        let mut noise = Noise::new(self.seed, 1);
        let mut normal = |sigma: f64| Vector3::from_fn(|_, _| noise.normal(sigma));
        let duration_s = 2.0 * BEFORE_S + PICTURE_PERIOD_S * f64::from(self.pictures);
        let base_from_board =
            se3::from_parts(so3::exp(&Vector3::new(3.0, 0.1, 0.2)), Vector3::new(0.9, -0.2, 0.1));
        (0..(duration_s / ROBOT_PERIOD_S) as i64)
            .map(|k| {
                let time_s = ROBOT_PERIOD_S * k as f64;
                let base_from_tool = base_from_board
                    * camera_from_board(boards, time_s).inverse()
                    * Self::tool_from_camera().inverse();
                let wrong = se3::from_parts(so3::exp(&normal(ROBOT_NOISE_RAD)), normal(ROBOT_NOISE_M));
                RobotSample {
                    stamp_ns: START_NS + (time_s * 1e9).round() as i64,
                    device_ns: None,
                    base_from_tool: base_from_tool * wrong,
                }
            })
            .collect()
    }
}

/// Pose of the board at a time: swings to every side with frequencies without a small common multiple.
fn camera_from_board(boards: &BoardPictures, time_s: f64) -> Pose {
    let swing = |hertz: f64, phase: f64| (TAU * hertz * time_s + phase).sin();
    let turn = Vector3::new(0.35 * swing(0.41, 0.2), 0.35 * swing(0.33, 1.0), 0.3 * swing(0.27, 2.0));
    let [x, y, z] = SWING_M;
    let middle = Vector3::new(x * swing(0.40, 0.5), y * swing(0.37, 3.0), DISTANCE_M + z * swing(0.31, 1.5));
    let rotation = so3::exp(&turn);
    se3::from_parts(rotation, middle - rotation * boards.middle())
}
