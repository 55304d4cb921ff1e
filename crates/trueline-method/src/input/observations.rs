//! Recording → observations: every feature lifted onto the laser sheet, with its covariance there.

use crate::config::Config;
use crate::error::Error;
use crate::input::plane_before_camera;
use crate::input::robot_motion::RobotMotion;
use crate::input::skip::Skip;
use crate::input::timestamps::{Dejittered, Sampling};
use crate::order_statistics::median;
use nalgebra::{Matrix2, Vector2, Vector3};
use std::collections::{BTreeMap, BTreeSet};
use trueline_dataset::{Feature, Measured, Recording, Sensor};
use trueline_geometry::{Plane, fit};
use trueline_model::{LaserSheet, SheetShape};

/// One seam point on the sheet.
#[derive(Clone, Copy, Debug)]
pub struct Observation {
    /// Stamp of its image since the start of the recording, s.
    pub stamp_s: f64,
    /// Index of its image among those with distinct stamps.
    pub frame: u32,
    /// Its line.
    pub line: u32,
    /// Row of the feature in the recording, from 0.
    pub row: u32,
    /// Size in the sheet of a pixel along the image's rows and of one across them, m: the upper triangle of the slopes. Single precision is
    /// sufficient.
    pub per_px: [f32; 3],
    /// The point in the camera frame, m.
    pub point_in_camera: Vector3<f64>,
    /// Covariance of the measurement in the sheet, m²: \[xx, xy, yy\].
    pub covariance: [f64; 3],
}

impl Observation {
    /// Size of a pixel in the sheet, m: along the image's rows and across them. The sheet's first axis is the camera's x in the sheet, so a step
    /// along a row moves along that axis alone. If the sheet is rotated about the view, this is off by that small angle. For sensors that report
    /// lengths it is [`Config::length_per_px_m`].
    #[must_use]
    pub fn sheet_per_px(&self) -> Matrix2<f64> {
        let [along, beside, depth] = self.per_px.map(f64::from);
        Matrix2::new(along, beside, 0.0, depth)
    }
}

/// The inputs of the problem.
#[derive(Clone, Debug)]
pub struct Observations {
    /// The robot.
    pub robot: RobotMotion,
    /// The laser sheet.
    pub sheet: LaserSheet,
    /// The observations by rising stamp.
    pub list: Vec<Observation>,
    /// Number of lines.
    pub line_count: usize,
    /// Frame interval if image times come from a frame counter, s.
    pub image_tick_s: Option<f64>,
    /// Whether features are pixels.
    pub are_pixels: bool,
    /// Origin of the sensor's shape, sheet coordinates, m: the middle of its measurements, or the origin of an earlier correction.
    pub shape_origin_m: [f64; 2],
    /// RMS of the points about the fitted sheet, m. `None` if the sheet was given.
    pub sheet_fit_rms_m: Option<f64>,
    /// Unused features, by reason.
    pub skipped: BTreeMap<Skip, usize>,
}

impl Observations {
    /// The same without the observations.
    #[must_use]
    pub(crate) fn without_list(&self) -> Self {
        Self { robot: self.robot.clone(), list: Vec::new(), skipped: self.skipped.clone(), ..*self }
    }

    /// The same with other stamps. The robot's path uses most of the memory of a long scan. It is built after the previous one is dropped.
    ///
    /// # Errors
    /// Those of [`RobotMotion::of`].
    pub(crate) fn restamped(
        mut self,
        recording: &Recording,
        sampling: &Sampling,
        config: &Config,
        [before, after]: [Dejittered; 2],
    ) -> Result<Self, Error> {
        if before.images != after.images {
            self.take_image_times(sampling, after);
        }
        if before.robot == after.robot {
            return Ok(self);
        }
        drop(self.robot);
        self.robot = RobotMotion::of(recording, sampling.robot_times_s(after), config)?;
        Ok(self)
    }

    /// Uses the stamps of the images as recorded, or those of the underlying clock.
    pub(crate) fn take_image_times(&mut self, sampling: &Sampling, dejittered: Dejittered) {
        let times_s = sampling.image_times_s(dejittered);
        self.image_tick_s = sampling.image_tick_s(dejittered);
        for o in &mut self.list {
            o.stamp_s = times_s[o.frame as usize];
        }
    }
}

/// Limit of the distance of points from a plane, m: RMS of all, or for a stated plane of the nearer half. Points beyond it were not measured in one
/// laser sheet.
const SHEET_RMS_LIMIT_M: f64 = 1e-3;

/// Origin of all stamps in seconds: the first robot sample, ns.
#[must_use]
pub fn origin_ns(recording: &Recording) -> i64 {
    recording.robot.first().map_or(0, |sample| sample.stamp_ns)
}

/// Lifts the features of a recording onto the sheet, with all stamps as recorded.
///
/// # Errors
/// A robot stream that is no trajectory, points without a sheet, lines without features.
pub fn observe(recording: &Recording, sampling: &Sampling, config: &Config) -> Result<Observations, Error> {
    observe_by(Dejittered::default(), recording, sampling, config)
}

/// The same with clock stamps for some streams.
///
/// # Errors
/// Those of [`observe`].
pub(crate) fn observe_by(
    dejittered: Dejittered,
    recording: &Recording,
    sampling: &Sampling,
    config: &Config,
) -> Result<Observations, Error> {
    let _stage = tracing::debug_span!("input", features = recording.features.len()).entered();
    let sheet = sheet_of(recording, config)?;
    observe_on(sheet, dejittered, recording, sampling, config)
}

/// The same as [`observe`] without a fitted sheet. Points are used as measured, in any sheet.
///
/// # Errors
/// Those of [`observe`], except a sheet that cannot be fitted.
pub(crate) fn observe_anywhere(
    recording: &Recording,
    sampling: &Sampling,
    config: &Config,
) -> Result<Observations, Error> {
    let sheet = match &recording.sensor {
        Sensor::Points { laser_plane_in_camera: None } => (LaserSheet::of_profiler(), None),
        _ => sheet_of(recording, config)?,
    };
    observe_on(sheet, Dejittered::default(), recording, sampling, config)
}

fn observe_on(
    (sheet, sheet_fit_rms_m): (LaserSheet, Option<f64>),
    dejittered: Dejittered,
    recording: &Recording,
    sampling: &Sampling,
    config: &Config,
) -> Result<Observations, Error> {
    if sampling.images.recorded_s.len() < MIN_IMAGES {
        let count = sampling.images.recorded_s.len();
        return Err(if config.at_stops {
            Error::TooFewStops { stops: count, needed: MIN_IMAGES }
        } else {
            Error::TooFewImages { images: count, needed: MIN_IMAGES }
        });
    }
    let robot = RobotMotion::of(recording, sampling.robot_times_s(dejittered), config)?;
    let image_times_s = sampling.image_times_s(dejittered);
    let mut skipped = BTreeMap::new();
    let mut list = Vec::with_capacity(recording.features.len());
    let mut frame = 0;
    let mut image = Image::default();
    let shape = recording.setup.shape.as_ref();
    let are_pixels = matches!(recording.sensor, Sensor::CameraLaser { .. });
    for (row, feature) in recording.features.iter().enumerate() {
        if image.repeats(feature) {
            *skipped.entry(Skip::Repeated).or_insert(0) += 1;
            continue;
        }
        frame += u32::from(row > 0 && recording.features[row - 1].stamp_ns != feature.stamp_ns);
        let lifted = lift(&recording.sensor, &sheet, feature, config)
            .map(|lifted| shape.map_or(lifted, |shape| corrected(&sheet, shape, lifted)));
        match lifted {
            Ok((point_in_camera, covariance)) => list.push(Observation {
                stamp_s: image_times_s[frame as usize],
                frame,
                line: feature.line,
                row: row as u32,
                per_px: per_px(feature, &covariance, are_pixels, config),
                point_in_camera,
                covariance: [covariance[(0, 0)], covariance[(0, 1)], covariance[(1, 1)]],
            }),
            Err(reason) => *skipped.entry(reason).or_insert(0) += 1,
        }
    }
    if are_pixels {
        plane_before_camera::check(list.iter().map(|o| o.point_in_camera.z), &skipped)?;
    }
    let line_count = count_lines(&list)?;
    let shape_origin_m = shape.map_or_else(|| middle(&sheet, &list), |shape| shape.origin_m);
    Ok(Observations {
        robot,
        sheet,
        list,
        line_count,
        image_tick_s: sampling.image_tick_s(dejittered),
        are_pixels,
        shape_origin_m,
        sheet_fit_rms_m,
        skipped,
    })
}

/// The rows of one image so far.
#[derive(Default)]
struct Image {
    stamp_ns: Option<i64>,
    said: BTreeSet<(u32, [u64; 3])>,
}

impl Image {
    /// Whether an earlier row of the same image is identical.
    fn repeats(&mut self, feature: &Feature) -> bool {
        if self.stamp_ns != Some(feature.stamp_ns) {
            self.said.clear();
            self.stamp_ns = Some(feature.stamp_ns);
        }
        let numbers = match feature.measured {
            Measured::Pixel([a, b]) | Measured::Profile([a, b]) => [a, b, 0.0],
            Measured::Point(numbers) => numbers,
        };
        !self.said.insert((feature.line, numbers.map(f64::to_bits)))
    }
}

fn sheet_of(recording: &Recording, config: &Config) -> Result<(LaserSheet, Option<f64>), Error> {
    match &recording.sensor {
        Sensor::CameraLaser { laser_plane_in_camera, .. } => {
            Ok((LaserSheet::from_plane(*laser_plane_in_camera), None))
        }
        Sensor::Profiler => Ok((LaserSheet::of_profiler(), None)),
        Sensor::Points { laser_plane_in_camera: Some(plane) } => stated_sheet(plane, recording, config),
        Sensor::Points { laser_plane_in_camera: None } => fitted_sheet(recording, config),
    }
}

/// The points as measured, camera frame, m.
fn points(recording: &Recording) -> impl Iterator<Item = Vector3<f64>> {
    recording.features.iter().filter_map(|f| match f.measured {
        Measured::Point(p) => Some(Vector3::from(p)),
        _ => None,
    })
}

/// The plane of the sensor's file, which must contain most of the points.
fn stated_sheet(
    plane: &Plane,
    recording: &Recording,
    config: &Config,
) -> Result<(LaserSheet, Option<f64>), Error> {
    let median_m = median(points(recording).map(|point| plane.signed_distance(&point).abs()));
    match median_m.filter(|m| *m > SHEET_RMS_LIMIT_M && config.residual == crate::ResidualKind::Sheet) {
        Some(median_m) => Err(Error::PointsOffStatedPlane { median_m }),
        None => Ok((LaserSheet::from_plane(*plane), None)),
    }
}

fn fitted_sheet(recording: &Recording, config: &Config) -> Result<(LaserSheet, Option<f64>), Error> {
    let points: Vec<Vector3<f64>> = points(recording).collect();
    let fit = fit::robust_plane(&points).ok_or(Error::SheetUndefined)?;
    if fit.extent < 10.0 * config.usual_feature_sigma_m() {
        return Err(Error::SheetUndefined);
    }
    if fit.rms > SHEET_RMS_LIMIT_M && config.residual == crate::ResidualKind::Sheet {
        return Err(Error::PointsNotInSheet { rms_m: fit.rms });
    }
    Ok((LaserSheet::from_plane(fit.plane), Some(fit.rms)))
}

/// The point in the camera frame (m) and its covariance in the sheet (m²), or the reason that there is none.
fn lift(
    sensor: &Sensor,
    sheet: &LaserSheet,
    feature: &Feature,
    config: &Config,
) -> Result<(Vector3<f64>, Matrix2<f64>), Skip> {
    let covariance_m2 = || feature.covariance([config.usual_feature_sigma_m(); 2]);
    match (feature.measured, sensor) {
        (Measured::Pixel(pixel), Sensor::CameraLaser { camera, .. }) => {
            let (ray, d_ray_d_pixel) = camera.ray(&Vector2::from(pixel)).map_err(|_| Skip::NoRay)?;
            let (point, d_point_d_ray) = sheet.intersect(&ray).ok_or(Skip::NoIntersection)?;
            let d_sheet_d_pixel = sheet.axes().transpose() * d_point_d_ray * d_ray_d_pixel;
            let covariance_px2 = feature.covariance([config.usual_feature_sigma_px(); 2]);
            Ok((point, d_sheet_d_pixel * covariance_px2 * d_sheet_d_pixel.transpose()))
        }
        (Measured::Profile([x, z]), _) => Ok((Vector3::new(x, 0.0, z), covariance_m2())),
        (Measured::Point(point), _) => Ok((Vector3::from(point), covariance_m2())),
        (Measured::Pixel(_), _) => Err(Skip::NoRay),
    }
}

/// The middle of the measured points, sheet coordinates, m.
fn middle(sheet: &LaserSheet, list: &[Observation]) -> [f64; 2] {
    [0, 1].map(|axis| median(list.iter().map(|o| sheet.coordinates(&o.point_in_camera)[axis])).unwrap_or(0.0))
}

/// A lifted point, corrected by a known shape of the sensor.
fn corrected(
    sheet: &LaserSheet,
    shape: &SheetShape,
    (point_in_camera, covariance): (Vector3<f64>, Matrix2<f64>),
) -> (Vector3<f64>, Matrix2<f64>) {
    let reported = sheet.coordinates(&point_in_camera);
    let (there, slope) = shape.corrected(&reported);
    // The distance from the sheet is unchanged.
    (point_in_camera + sheet.axes() * (there - reported), slope * covariance * slope.transpose())
}

/// The place of a feature in the camera frame, m, corrected by a known shape of the sensor.
///
/// # Errors
/// A pixel without a ray, a ray that does not meet the laser plane, a feature of another sensor.
pub fn point_in_camera(
    sensor: &Sensor,
    shape: Option<&SheetShape>,
    measured: Measured,
) -> Result<Vector3<f64>, Skip> {
    point_by_sheet(sensor, &sheet_of_sensor(sensor), shape, measured)
}

/// The sheet that a sensor measures in.
pub(crate) fn sheet_of_sensor(sensor: &Sensor) -> LaserSheet {
    match sensor {
        Sensor::CameraLaser { laser_plane_in_camera: plane, .. }
        | Sensor::Points { laser_plane_in_camera: Some(plane) } => LaserSheet::from_plane(*plane),
        Sensor::Profiler | Sensor::Points { laser_plane_in_camera: None } => LaserSheet::of_profiler(),
    }
}

/// The same as [`point_in_camera`] for many readings of a sensor with this sheet.
///
/// # Errors
/// As [`point_in_camera`].
pub(crate) fn point_by_sheet(
    sensor: &Sensor,
    sheet: &LaserSheet,
    shape: Option<&SheetShape>,
    measured: Measured,
) -> Result<Vector3<f64>, Skip> {
    let point = match (measured, sensor) {
        (Measured::Pixel(pixel), Sensor::CameraLaser { camera, .. }) => {
            let (ray, _) = camera.ray(&Vector2::from(pixel)).map_err(|_| Skip::NoRay)?;
            sheet.intersect(&ray).map(|(point, _)| point).ok_or(Skip::NoIntersection)?
        }
        (Measured::Profile([x, z]), Sensor::Profiler) => Vector3::new(x, 0.0, z),
        (Measured::Point(point), Sensor::Points { .. }) => Vector3::from(point),
        _ => return Err(Skip::NoRay),
    };
    Ok(shape.map_or(point, |shape| corrected(sheet, shape, (point, Matrix2::zeros())).0))
}

/// The triangular root of a feature's covariance in the sheet over its noise in pixels.
fn per_px(feature: &Feature, covariance_m2: &Matrix2<f64>, are_pixels: bool, config: &Config) -> [f32; 3] {
    if !are_pixels {
        let per_px_m = config.length_per_px_m() as f32;
        return [per_px_m, 0.0, per_px_m];
    }
    let [sigma_u, sigma_v] = feature.sigma.unwrap_or([config.usual_feature_sigma_px(); 2]);
    let depth = covariance_m2.m22.sqrt();
    let beside = if depth > 0.0 { covariance_m2.m12 / depth } else { 0.0 };
    let along = (covariance_m2.m11 - beside * beside).max(0.0).sqrt();
    [along / sigma_u, beside / sigma_v, depth / sigma_v].map(|per_px_m| per_px_m as f32)
}

fn count_lines(list: &[Observation]) -> Result<usize, Error> {
    let Some(highest) = list.iter().map(|o| o.line).max() else {
        return Err(Error::TooFewFeatures { line: 0, usable: 0, needed: MIN_FEATURES });
    };
    for line in 0..=highest {
        let usable = list.iter().filter(|o| o.line == line).count();
        if usable == 0 {
            return Err(Error::LineMissing { line, highest });
        }
        if usable < MIN_FEATURES {
            return Err(Error::TooFewFeatures { line, usable, needed: MIN_FEATURES });
        }
    }
    Ok(highest as usize + 1)
}

/// Minimum features of a line. Four have enough numbers for its own unknowns. Ten leave degrees of freedom for a check.
const MIN_FEATURES: usize = 10;
/// Minimum images of a scan. An image of several lines is still one instant.
pub(crate) const MIN_IMAGES: usize = 10;
