//! A scan of a robot that carries its camera before a board: time offset, hand-eye transform and the board. At stops there is no time
//! offset.

use crate::board_files::error::BoardError;
use crate::board_files::striped::known;
use crate::board_hand_eye::joint::{BoardFit, SIZE};
use crate::board_hand_eye::{BoardSighting, ErrorModel, RobotPath, Sightings, moving};
use crate::laser_plane::KnownCamera;
use crate::{Board, Gray, View, chessboard};
use nalgebra::SMatrix;
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::path::Path;
use trueline_dataset::sensor_setup::{Mounted, SensorSetup};
use trueline_dataset::sensor_toml::{self, CameraFile};
use trueline_dataset::{
    Feature, Guess, Measured, PictureFolder, PictureSource, Recording, RobotSample, Sensor, folder, images,
};
use trueline_geometry::{Pose, smooth};
use trueline_method::assess::robot_field::RobotSigmas;
use trueline_method::config::ASSUMED_ROBOT_ACCURACY_M;
use trueline_method::input::observations::origin_ns;
use trueline_method::input::robot_motion::RobotMotion;
use trueline_method::input::stops::{self, Stops};
use trueline_method::input::timestamps::{Dejittered, Sampling};
use trueline_method::{Config, Hold};

/// A calibration before a moving board.
#[derive(Debug)]
pub struct BoardScan {
    /// Result of the fit.
    pub fit: BoardFit,
    /// Covariance of all included effects: noise, and the camera's uncertainty.
    pub covariance: SMatrix<f64, SIZE, SIZE>,
    /// Noise of a corner along each axis, px.
    pub corner_sigma_px: f64,
    /// Noise of a recorded position of the robot, per axis, m.
    pub robot_noise_m: f64,
    /// Pictures that show no whole, sharp board, by reason.
    pub skipped: BTreeMap<String, usize>,
    /// Whether the robot stood still at each picture, and the source of that.
    pub stops: Option<Stops>,
    /// Whether the time offset is a result. At stops there is none, and a held one is none.
    pub shows_time_offset: bool,
    /// The robot's file, and its SHA-256.
    pub robot_file: (&'static str, String),
}

/// Prior knowledge of a scan.
#[derive(Clone, Copy, Debug, Default)]
pub struct BoardOptions {
    /// Whether the robot stood at each picture.
    pub at_stops: bool,
    /// The start.
    pub guess: Option<Guess>,
    /// Whether the time offset is held there.
    pub holds_offset: bool,
    /// Absolute accuracy of the robot, m; poses at stops have a part of it. `None` is the value in the sensor's file, or
    /// [`ASSUMED_ROBOT_ACCURACY_M`].
    pub robot_accuracy_m: Option<f64>,
}

/// Calibrates from a dataset folder with pictures of a board, with the threads of the current rayon pool.
///
/// # Errors
/// Files that cannot be used, and scans that show too little.
pub fn calibrate(dataset: &Path, board: &Board, options: &BoardOptions) -> Result<BoardScan, BoardError> {
    let file = camera_of(dataset)?;
    let camera = known(&file);
    let robot = folder::read_robot(dataset)?;
    let seen = Seen::in_pictures(dataset, board, &camera)?;
    let scan = Recording { at_stops: robot.at_stops, ..stamped(robot.samples, &seen.stamps_ns) };
    let wanted = Config {
        at_stops: options.at_stops,
        hold: if options.holds_offset { vec![Hold::TimeOffset] } else { Vec::new() },
        ..Config::default()
    };
    let failed = |error| BoardError::Calibration { dataset: dataset.to_owned(), error, why: seen.why_not() };
    let guess = options.guess.map(|guess| (guess.time_offset_s, guess.tool_from_camera));
    let (fit, stops, robot_noise_m) = match stops::of(&scan, &wanted)? {
        Some((scan, stops)) => {
            let accuracy_m = options.robot_accuracy_m.or(file.setup.robot_accuracy_m);
            let stated = at_stops_noise(accuracy_m.unwrap_or(ASSUMED_ROBOT_ACCURACY_M));
            let poses = poses_at(&scan, &seen.stamps_ns);
            let fit = moving::calibrate_at_stops(board, &seen.sightings, &poses, &stated, guess);
            let (fit, noise) = fit.map_err(failed)?;
            (fit, Some(stops), noise.position_m)
        }
        None => {
            let moved = Moved::of(&scan, &seen.stamps_ns)?;
            let robot = moved.path(options.holds_offset);
            let fit = moving::calibrate_along(board, &seen.sightings, robot, &moved.noise, guess);
            (fit.map_err(failed)?, None, moved.motion.recorded_noise_m)
        }
    };
    Ok(BoardScan {
        covariance: fit.covariance_with(&camera.covariance),
        fit,
        corner_sigma_px: seen.corner_sigma_px,
        robot_noise_m,
        skipped: seen.skipped,
        stops,
        shows_time_offset: stops.is_none() && !options.holds_offset,
        robot_file: (robot.file_name, robot.sha256),
    })
}

/// Errors of a robot of this accuracy, m, from one stop to the next: stops are some decimetres apart, as a scan is long.
pub(crate) fn at_stops_noise(accuracy_m: f64) -> ErrorModel {
    let RobotSigmas { position_m, attitude_rad } = RobotSigmas::of_accuracy(accuracy_m);
    ErrorModel { position_m, rotation_rad: attitude_rad, stamp_s: 0.0, ..ErrorModel::default() }
}

/// The pose of each picture of a scan at stops, base_from_tool.
fn poses_at(scan: &Recording, stamps_ns: &[i64]) -> Vec<Pose> {
    let at = |stamp_ns: &i64| scan.robot.partition_point(|sample| sample.stamp_ns < *stamp_ns);
    stamps_ns.iter().filter_map(|stamp| Some(scan.robot.get(at(stamp))?.base_from_tool)).collect()
}

/// A robot that moved while pictures were taken.
struct Moved {
    motion: RobotMotion,
    stamps_s: Vec<f64>,
    noise: ErrorModel,
}

impl Moved {
    fn of(scan: &Recording, stamps_ns: &[i64]) -> Result<Self, BoardError> {
        let origin_ns = origin_ns(scan);
        let sampling = Sampling::of(scan, origin_ns);
        let (config, as_recorded) = (Config::default(), Dejittered::default());
        let times_s = sampling.robot_times_s(as_recorded);
        let motion = RobotMotion::of(scan, times_s, &config)?;
        let noise = ErrorModel {
            position_m: motion.noise_m,
            rotation_rad: rotation_noise_rad(scan, times_s, &motion),
            stamp_s: sampling.stamp_sigma_s(&config, as_recorded),
            ..ErrorModel::default()
        };
        let stamps_s = stamps_ns.iter().map(|ns| (ns - origin_ns) as f64 * 1e-9).collect();
        Ok(Self { motion, stamps_s, noise })
    }

    fn path(&self, offset_is_known: bool) -> RobotPath<'_> {
        let (trajectory, stamps_s) = (&self.motion.trajectory, &self.stamps_s[..]);
        if offset_is_known {
            RobotPath::MovingAtKnownOffset { trajectory, stamps_s }
        } else {
            RobotPath::Moving { trajectory, stamps_s }
        }
    }
}

fn camera_of(dataset: &Path) -> Result<CameraFile, BoardError> {
    let file = dataset.join("sensor.toml");
    let camera = sensor_toml::read_camera(&file)?;
    if camera.setup.mounted == Mounted::Fixed {
        return Err(BoardError::Fixed(file));
    }
    Ok(camera)
}

/// The boards in a folder's pictures.
struct Seen {
    stamps_ns: Vec<i64>,
    sightings: Vec<BoardSighting>,
    corner_sigma_px: f64,
    skipped: BTreeMap<String, usize>,
}

impl Seen {
    fn in_pictures(dataset: &Path, board: &Board, known: &KnownCamera) -> Result<Self, BoardError> {
        if !images::are_named_in(dataset)? {
            return Err(BoardError::NoIndex(dataset.to_owned()));
        }
        let pictures = PictureFolder::open(dataset)?;
        let looked: Vec<Result<View, String>> = (0..pictures.count())
            .into_par_iter()
            .map_init(Vec::new, |spare, number| look(&pictures, number, (board, known), spare))
            .collect::<Result<_, BoardError>>()?;
        let mut skipped = BTreeMap::new();
        let mut skip = |why: &str| *skipped.entry(why.to_owned()).or_insert(0) += 1;
        let (mut stamps_ns, mut views) = (Vec::new(), Vec::new());
        for (number, found) in looked.into_iter().enumerate() {
            match found {
                Ok(view) if view.complete => {
                    stamps_ns.push(pictures.stamp(number).stamp_ns);
                    views.push(view);
                }
                Ok(_) => skip("a part of the board is missing"),
                Err(why) => skip(&why),
            }
        }
        let Sightings { list, corner_sigma_px } = Sightings::of(&known.camera, board, &views);
        let mut kept = (Vec::new(), Vec::new());
        for (stamp_ns, seen) in stamps_ns.into_iter().zip(list) {
            match seen {
                Some(seen) => {
                    kept.0.push(stamp_ns);
                    kept.1.push(seen);
                }
                None => skip("the board is not sharp, or its pose cannot be found"),
            }
        }
        Ok(Self { stamps_ns: kept.0, sightings: kept.1, corner_sigma_px, skipped })
    }

    /// Why pictures show no board, one reason a line.
    fn why_not(&self) -> String {
        self.skipped.iter().map(|(why, count)| format!("\n  {count} pictures: {why}")).collect()
    }
}

fn look(
    pictures: &PictureFolder,
    number: usize,
    (board, known): (&Board, &KnownCamera),
    spare: &mut Vec<u8>,
) -> Result<Result<View, String>, BoardError> {
    let image = pictures.read(number, spare)?;
    let found = [image.width as u32, image.height as u32];
    if found != known.camera.size {
        return Err(BoardError::OtherCamera {
            name: pictures.name(number),
            found,
            camera: known.camera.size,
        });
    }
    let gray = Gray::new(image.width, image.height, image.levels_f32())
        .ok_or_else(|| BoardError::Empty(pictures.name(number)))?;
    Ok(chessboard::find(&gray, board).map_err(|why| why.to_string()))
}

/// The robot with one feature for each picture, to measure the streams' clocks.
pub(crate) fn stamped(robot: Vec<RobotSample>, stamps_ns: &[i64]) -> Recording {
    let feature = |stamp_ns: &i64| Feature {
        stamp_ns: *stamp_ns,
        line: 0,
        frame: None,
        device_ns: None,
        measured: Measured::Point([0.0, 0.0, 1.0]),
        sigma: None,
        correlation: 0.0,
    };
    let sensor = Sensor::Points { laser_plane_in_camera: None };
    Recording::new(sensor, SensorSetup::default(), robot, stamps_ns.iter().map(feature).collect())
}

/// Noise of the attitudes that is left in the path: as much of it as of the positions'.
fn rotation_noise_rad(scan: &Recording, times_s: &[f64], motion: &RobotMotion) -> f64 {
    let poses: Vec<Pose> = scan.robot.iter().map(|sample| sample.base_from_tool).collect();
    let gap_limit_s = motion.trajectory.gap_limit().max(4.0 * motion.period_s);
    let recorded = smooth::rotation_noise(times_s, &poses, motion.period_s, gap_limit_s);
    if motion.recorded_noise_m > 0.0 { recorded * motion.noise_m / motion.recorded_noise_m } else { recorded }
}
