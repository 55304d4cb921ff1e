//! The text formats of the paper's authors (repository RoboticsPolyu/LVS_ST_CALIB).
//!
//! Simulation: `egm.txt` with rows `t w1 w2 w3 r1 r2 r3`: t in ms, (w, r) the se(3) **logarithm** of base_from_tool
//! in rad and mm, so r is not the translation. `cam.txt` with rows `t x1 y1 z1 [x2 y2 z2 …]`: t in ms, one point in
//! the camera frame, mm, for each line.
//!
//! Real recordings: robot rows `sec nsec x y z ex ey ez qw qx qy qz ts_us` (mm, degrees), image rows `sec nsec index
//! ts_ns`, pixel rows `u v` or `u v` of the left, centre and right corner. Times are the receive stamps (`sec nsec`),
//! because the paper's time offset refers to them. The devices' own stamps (`ts_us`, `ts_ns`) are kept as well.

use super::rows::{Row, Rows, check_order};
use crate::error::{Error, Problem};
use crate::recording::{Feature, Measured, Recording, RobotSample, Sensor};
use crate::robot_csv::unit_quaternion;
use crate::sensor_setup::SensorSetup;
use crate::sensor_toml::SensorFile;
use crate::stamp::{is_in_range, parse_nanoseconds, problem_of};
use crate::unit::MM_PER_M;
use nalgebra::Vector3;
use std::path::Path;
use trueline_geometry::se3;

const SIMULATED_ROBOT: &str = "the simulated robot stream (t w1 w2 w3 r1 r2 r3)";
const SIMULATED_SENSOR: &str = "the simulated sensor stream (t x y z for each line)";
const REAL_ROBOT: &str = "the robot stream (sec nsec x y z ex ey ez qw qx qy qz ts_us)";
const REAL_IMAGES: &str = "the image list (sec nsec index ts_ns)";
const REAL_PIXELS: &str = "the pixel list (u v, or left, centre and right u v)";

/// Milliseconds to nanoseconds: six digits.
const MS_DIGITS: usize = 6;
/// Microseconds to nanoseconds: three digits.
const US_DIGITS: usize = 3;

/// Reads the authors' simulation from a folder with `egm.txt` and `cam.txt`.
///
/// # Errors
/// The first file and line that cannot be used.
pub fn read_simulation(folder: &Path) -> Result<Recording, Error> {
    if !folder.is_dir() {
        return Err(Error::in_file(&folder.join("egm.txt"), Problem::NoFolder { folder: folder.to_owned() }));
    }
    let sensor = Sensor::Points { laser_plane_in_camera: None };
    let robot = simulated_robot(&folder.join("egm.txt"))?;
    Ok(Recording::new(sensor, SensorSetup::default(), robot, simulated_features(&folder.join("cam.txt"))?))
}

fn simulated_robot(file: &Path) -> Result<Vec<RobotSample>, Error> {
    let rows = Rows::open(file)?;
    let mut samples: Vec<RobotSample> = Vec::new();
    for row in rows.iter() {
        rows.expect_fields(&row, SIMULATED_ROBOT, &[7])?;
        let stamp_ns = stamp_ms(&rows, &row)?;
        check_order(&rows, &row, samples.last().map(|s| s.stamp_ns), stamp_ns)?;
        let [w1, w2, w3, r1, r2, r3] = rows.numbers::<6>(&row, 1)?;
        let rho = Vector3::new(r1, r2, r3) / MM_PER_M;
        let base_from_tool = se3::exp(&Vector3::new(w1, w2, w3), &rho);
        samples.push(RobotSample { stamp_ns, device_ns: None, base_from_tool });
    }
    not_empty(&rows, samples)
}

fn simulated_features(file: &Path) -> Result<Vec<Feature>, Error> {
    let rows = Rows::open(file)?;
    let mut features: Vec<Feature> = Vec::new();
    for row in rows.iter() {
        rows.expect_fields(&row, SIMULATED_SENSOR, &[4, 7, 10, 13])?;
        let stamp_ns = stamp_ms(&rows, &row)?;
        check_order(&rows, &row, features.last().map(|f| f.stamp_ns), stamp_ns)?;
        for line in 0..(row.fields.len() - 1) / 3 {
            let point = rows.numbers::<3>(&row, 1 + 3 * line)?.map(|mm| mm / MM_PER_M);
            features.push(Feature {
                stamp_ns,
                line: line as u32,
                frame: None,
                device_ns: None,
                measured: Measured::Point(point),
                sigma: None,
                correlation: 0.0,
            });
        }
    }
    not_empty(&rows, features)
}

/// Reads one of the authors' real recordings: robot, image list and pixel list.
///
/// # Errors
/// The first file and line that cannot be used, or lists of different length.
pub fn read_recording(
    robot: &Path,
    images: &Path,
    pixels: &Path,
    sensor: SensorFile,
) -> Result<Recording, Error> {
    let stamps = real_images(images)?;
    let centres = real_pixels(pixels)?;
    if stamps.len() != centres.len() {
        let problem = Problem::RowsDiffer {
            other: images.display().to_string(),
            expected: stamps.len(),
            found: centres.len(),
        };
        return Err(Error::in_file(pixels, problem));
    }
    let features = stamps
        .iter()
        .zip(centres)
        .map(|(image, pixel)| Feature {
            stamp_ns: image.stamp_ns,
            line: 0,
            frame: Some(image.index),
            device_ns: Some(image.device_ns),
            measured: Measured::Pixel(pixel),
            sigma: None,
            correlation: 0.0,
        })
        .collect();
    let robot = real_robot(robot)?;
    let SensorFile { sensor, setup } = sensor;
    Ok(Recording::new(sensor, setup, robot, features))
}

fn real_robot(file: &Path) -> Result<Vec<RobotSample>, Error> {
    let rows = Rows::open(file)?;
    let mut samples: Vec<RobotSample> = Vec::new();
    for row in rows.iter() {
        rows.expect_fields(&row, REAL_ROBOT, &[13])?;
        let stamp_ns = stamp_sec_nsec(&rows, &row)?;
        check_order(&rows, &row, samples.last().map(|s| s.stamp_ns), stamp_ns)?;
        let position = Vector3::from(rows.numbers::<3>(&row, 2)?) / MM_PER_M;
        // The Euler angles (fields 5 to 7) say the same as the quaternion, with less precision.
        let rotation = unit_quaternion(rows.numbers::<4>(&row, 8)?).map_err(|p| rows.error(&row, p))?;
        let device_ns = Some(whole_nanoseconds(&rows, &row, 12, US_DIGITS)?);
        samples.push(RobotSample {
            stamp_ns,
            device_ns,
            base_from_tool: se3::from_parts(rotation, position),
        });
    }
    not_empty(&rows, samples)
}

/// One row of the image list.
struct Image {
    stamp_ns: i64,
    index: u64,
    device_ns: i64,
}

fn real_images(file: &Path) -> Result<Vec<Image>, Error> {
    let rows = Rows::open(file)?;
    let mut stamps: Vec<Image> = Vec::new();
    for row in rows.iter() {
        rows.expect_fields(&row, REAL_IMAGES, &[4])?;
        let stamp_ns = stamp_sec_nsec(&rows, &row)?;
        check_order(&rows, &row, stamps.last().map(|s| s.stamp_ns), stamp_ns)?;
        let text = row.fields[2];
        let index =
            text.parse().map_err(|_| rows.error(&row, Problem::NotACount { text: text.to_owned() }))?;
        stamps.push(Image { stamp_ns, index, device_ns: whole_nanoseconds(&rows, &row, 3, 0)? });
    }
    not_empty(&rows, stamps)
}

fn real_pixels(file: &Path) -> Result<Vec<[f64; 2]>, Error> {
    let rows = Rows::open(file)?;
    let mut centres = Vec::new();
    for row in rows.iter() {
        rows.expect_fields(&row, REAL_PIXELS, &[2, 6])?;
        // Of left, centre and right corner the seam is the centre.
        let first = if row.fields.len() == 6 { 2 } else { 0 };
        centres.push(rows.numbers::<2>(&row, first)?);
    }
    not_empty(&rows, centres)
}

fn stamp_ms(rows: &Rows, row: &Row<'_>) -> Result<i64, Error> {
    whole_nanoseconds(rows, row, 0, MS_DIGITS)
}

fn whole_nanoseconds(rows: &Rows, row: &Row<'_>, field: usize, digits: usize) -> Result<i64, Error> {
    let text = row.fields[field];
    parse_nanoseconds(text, digits).ok_or_else(|| rows.error(row, problem_of(text)))
}

fn stamp_sec_nsec(rows: &Rows, row: &Row<'_>) -> Result<i64, Error> {
    let parse = |text: &str| {
        text.parse::<i64>().map_err(|_| rows.error(row, Problem::NotANumber { text: text.to_owned() }))
    };
    let (seconds, nanoseconds) = (parse(row.fields[0])?, parse(row.fields[1])?);
    seconds
        .checked_mul(1_000_000_000)
        .and_then(|ns| ns.checked_add(nanoseconds))
        .filter(|ns| is_in_range(*ns))
        .ok_or_else(|| rows.error(row, problem_of(row.fields[0])))
}

fn not_empty<T>(rows: &Rows, items: Vec<T>) -> Result<Vec<T>, Error> {
    if items.is_empty() { Err(rows.file_error(Problem::NoRows)) } else { Ok(items) }
}
