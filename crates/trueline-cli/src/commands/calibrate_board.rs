//! `trueline calibrate --target board`: the reference with a board that the moving robot looks at.

use super::sensor_plane_pictures::known;
use crate::args::{CalibrateArgs, TargetName};
use crate::failure::Failure;
use crate::output;
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::path::Path;
use std::process::ExitCode;
use trueline_dataset::sensor_setup::{Mounted, SensorSetup};
use trueline_dataset::{
    Feature, Measured, PictureFolder, PictureSource, Recording, RobotSample, Sensor, folder, images,
    sensor_toml,
};
use trueline_geometry::smooth;
use trueline_method::Config;
use trueline_method::input::observations::origin_ns;
use trueline_method::input::robot_motion::RobotMotion;
use trueline_method::input::timestamps::{Dejittered, Sampling};
use trueline_report::board_result::{self, BoardReport};
use trueline_sensor::board_hand_eye::{BoardSighting, ErrorModel, Sightings, moving};
use trueline_sensor::laser_plane::KnownCamera;
use trueline_sensor::{Board, Gray, View, chessboard, verdict};

/// Runs the command.
pub fn run(args: &CalibrateArgs, board: &Board) -> Result<ExitCode, Failure> {
    if args.target != TargetName::Board {
        return Err(Failure::new(
            "--board belongs to --target board",
            "add --target board, or leave --board out",
        ));
    }
    #[cfg(feature = "rerun")]
    if args.rerun.is_some() {
        return Err(Failure::new("--target board writes no recording for Rerun", "leave --rerun out"));
    }
    let [dataset] = args.datasets.as_slice() else {
        return Err(Failure::new(
            "--target board takes one dataset",
            "calibrate one scan of the board at a time",
        ));
    };
    let camera = known(&camera_of(dataset)?);
    let (robot, robot_sha) = folder::read_robot(dataset)?;
    let seen = Seen::in_pictures(dataset, board, &camera)?;
    let scan = stamped(robot, &seen.stamps_ns);
    let sampling = Sampling::of(&scan, origin_ns(&scan));
    let (config, as_recorded) = (Config::default(), Dejittered::default());
    let times_s = sampling.robot_times_s(as_recorded);
    let motion = RobotMotion::of(&scan, times_s, &config)?;
    let noise = ErrorModel {
        position_m: motion.noise_m,
        rotation_rad: rotation_noise_rad(&scan, times_s, &motion),
        stamp_s: sampling.stamp_sigma_s(&config, as_recorded),
    };
    let stamps_s: Vec<f64> = seen.stamps_ns.iter().map(|ns| (ns - origin_ns(&scan)) as f64 * 1e-9).collect();
    let fit = moving::calibrate(board, &seen.sightings, &stamps_s, &motion.trajectory, &noise).map_err(
        |error| Failure::new(format!("{}: {error}{}", dataset.display(), seen.why_not()), error.hint()),
    )?;
    let covariance = fit.covariance_with(&camera.covariance);
    let (reasons, warnings) = verdict::of_board(&fit, &covariance);
    let report = BoardReport {
        fit: &fit,
        covariance,
        reasons: &reasons,
        warnings: &warnings,
        corner_sigma_px: seen.corner_sigma_px,
        robot_noise_m: motion.recorded_noise_m,
        skipped: &seen.skipped,
        inputs: &BTreeMap::from([("robot.csv".to_owned(), robot_sha)]),
    };
    if let Some(file) = &args.json {
        output::result(file, &board_result::of(&report))?;
    }
    if !args.quiet {
        output::summary(args.json.as_deref(), &board_result::text(&report))?;
    }
    Ok(if reasons.is_empty() { ExitCode::SUCCESS } else { ExitCode::from(1) })
}

fn camera_of(dataset: &Path) -> Result<sensor_toml::CameraFile, Failure> {
    let file = dataset.join("sensor.toml");
    let camera = sensor_toml::read_camera(&file)?;
    if camera.setup.mounted == Mounted::Fixed {
        return Err(Failure::new(
            format!("{}: the sensor stands beside the robot", file.display()),
            "--target board is for a camera on the robot, before a board that stands still",
        ));
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
    fn in_pictures(dataset: &Path, board: &Board, known: &KnownCamera) -> Result<Self, Failure> {
        if !images::index_of(dataset).exists() {
            return Err(Failure::new(
                format!("{}: there are no pictures: no images/index.csv", dataset.display()),
                "record robot and camera while the sensor looks at the board, the laser off",
            ));
        }
        let pictures = PictureFolder::open(dataset)?;
        let looked: Vec<Result<View, String>> = (0..pictures.count())
            .into_par_iter()
            .map_init(Vec::new, |spare, number| look(&pictures, number, (board, known), spare))
            .collect::<Result<_, Failure>>()?;
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
) -> Result<Result<View, String>, Failure> {
    let image = pictures.read(number, spare)?;
    if [image.width as u32, image.height as u32] != known.camera.size {
        return Err(Failure::new(
            format!(
                "{}: {} x {} pixels, sensor.toml has {} x {}",
                pictures.name(number),
                image.width,
                image.height,
                known.camera.size[0],
                known.camera.size[1]
            ),
            "is this the camera of sensor.toml, at the same setting?",
        ));
    }
    let gray = Gray::new(image.width, image.height, image.levels_f32()).ok_or_else(|| {
        Failure::new(format!("{}: the picture is empty", pictures.name(number)), "is the file cut off?")
    })?;
    Ok(chessboard::find(&gray, board).map_err(|why| why.to_string()))
}

/// The robot with one feature for each picture: what the streams' clocks are measured on.
fn stamped(robot: Vec<RobotSample>, stamps_ns: &[i64]) -> Recording {
    let feature = |stamp_ns: &i64| Feature {
        stamp_ns: *stamp_ns,
        line: 0,
        frame: None,
        device_ns: None,
        measured: Measured::Point([0.0, 0.0, 1.0]),
        sigma: None,
    };
    Recording {
        sensor: Sensor::Points { laser_plane_in_camera: None },
        setup: SensorSetup::default(),
        robot,
        features: stamps_ns.iter().map(feature).collect(),
        stripes: Vec::new(),
        initial: None,
        truth: None,
        inputs: BTreeMap::new(),
    }
}

/// Noise of the attitudes that is left in the path: as much of it as of the positions'.
fn rotation_noise_rad(scan: &Recording, times_s: &[f64], motion: &RobotMotion) -> f64 {
    let poses: Vec<trueline_geometry::Pose> = scan.robot.iter().map(|sample| sample.base_from_tool).collect();
    let gap_limit_s = motion.trajectory.gap_limit().max(4.0 * motion.period_s);
    let recorded = smooth::rotation_noise(times_s, &poses, motion.period_s, gap_limit_s);
    if motion.recorded_noise_m > 0.0 { recorded * motion.noise_m / motion.recorded_noise_m } else { recorded }
}
