//! A level and a seed in, a cell with its check pass and its truth out.

use super::bound::{IdealScan, NOTHING_SHOWN_M};
use super::check_pass::{self, CheckedCell};
use super::course::Motion;
use super::detector::{self, Detected, ShopDetector};
use super::drawn_errors::DrawnErrors;
use super::error_table::ShopError;
use super::joint_path::JointPath;
use super::layout::Layout;
use super::level::Level;
use super::plates::{Image, PlateView, ShopPlates};
use super::robot::ShopRobot;
use super::seam::{RoundedEdge, SeamForm};
use super::sensor::{AutomaticExposure, ShopSensor, TrueSeam, warmed};
use super::statements;
use super::streams::{Arrivals, ImageClock, Stream};
use super::truth::{CheckPoint, ShopTruth};
use crate::noise::Noise;
use crate::scenario::SensorModel;
use nalgebra::{Quaternion, UnitQuaternion, UnitVector3};
use trueline_dataset::{Feature, Guess, Measured, PlateStripe, Recording, RobotSample, Truth};
use trueline_geometry::{Line, Pose};

/// Layouts that are tried until an arm can follow its path.
const ATTEMPTS: u64 = 100;
/// Stream of random numbers of clocks and rates.
const TIMING_STREAM: u64 = 3930;
/// Stream of random numbers of stripes.
const STRIPES_STREAM: u64 = 3978;
/// Time offsets, s.
const OFFSETS_S: [f64; 2] = [-0.050, 0.150];
/// Rates of images, Hz, and times between poses, s.
const IMAGES_HZ: [f64; 8] = [20.0, 25.0, 30.0, 30.0, 33.0, 50.0, 60.0, 100.0];
const POSES_S: [f64; 6] = [0.004, 0.004, 0.004, 0.008, 0.012, 0.020];
/// The log begins and ends this long before and after the images, s.
const LOG_BEYOND_S: f64 = 0.8;
/// Reading of the clock at the start of the scan, s.
const START_S: f64 = 100.0;
/// Speed at which check points are placed, m/s.
const CHECK_SPEED_M_S: f64 = 0.050;

/// A cell to cast.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Shop {
    /// How rough the shop is.
    pub level: Level,
    /// Seed of all that is random. At every level it gives the same arm, sensor, mounting and motion.
    pub seed: u64,
    /// The only errors that are left; `None` leaves all.
    pub only: Option<Vec<ShopError>>,
    /// Whether the sensor measures whole stripes on two plates. Then its seam point is their crossing, and there is no edge.
    /// One that gives points has none.
    pub plates: bool,
}

/// A cell.
#[derive(Clone, Debug)]
pub struct ShopCell {
    /// The scan.
    pub recording: Recording,
    /// The check pass, as a dataset.
    pub check: Recording,
    /// The truth.
    pub truth: ShopTruth,
}

/// Times of the records.
struct Times {
    offset_s: f64,
    pose_s: f64,
    image_s: f64,
    /// How long before an even reading of the clock the first pose is sent, s.
    phase_s: f64,
    counts_images: bool,
}

impl Shop {
    /// A cell with all the errors of its shop.
    #[must_use]
    pub fn new(level: Level, seed: u64) -> Self {
        Self { level, seed, only: None, plates: false }
    }

    /// The errors of the cell.
    #[must_use]
    pub fn errors(&self) -> DrawnErrors {
        match &self.only {
            Some(kinds) => DrawnErrors::only(self.level, self.seed, kinds),
            None => DrawnErrors::draw(self.level, self.seed),
        }
    }

    /// Casts the cell. The same shop gives the same cell, bit for bit. `None` if no arm can follow any of the paths that are tried, or
    /// nothing is seen.
    #[must_use]
    pub fn cast(&self) -> Option<ShopCell> {
        let (layout, joints) = (0..ATTEMPTS).find_map(|attempt| Layout::drawn(self.seed, attempt))?;
        Casting::new(self, layout, joints).cell()
    }
}

/// A cell while it is cast.
struct Casting<'a> {
    shop: &'a Shop,
    errors: DrawnErrors,
    layout: Layout,
    robot: ShopRobot,
    sensor: ShopSensor,
    form: SeamForm,
    times: Times,
    start_ns: i64,
}

/// The images of a scan.
#[derive(Default)]
struct Images {
    features: Vec<Feature>,
    stripes: Vec<PlateStripe>,
    /// When the seam was in view, s.
    seen_s: Vec<f64>,
    outliers: usize,
    count: usize,
    /// How much stamps are ahead of the time offset, s, but for the rows' delay.
    ahead_s: Vec<f64>,
    row_delays_s: Vec<f64>,
}

impl<'a> Casting<'a> {
    fn new(shop: &'a Shop, layout: Layout, joints: JointPath) -> Self {
        let errors = shop.errors();
        let mut noise = Noise::new(shop.seed, TIMING_STREAM);
        let mut one_of = |choices: &[f64]| {
            choices[(noise.uniform(0.0, choices.len() as f64) as usize).min(choices.len() - 1)]
        };
        let (image_s, pose_s) = (1.0 / one_of(&IMAGES_HZ), one_of(&POSES_S));
        let offset_s = noise.uniform(OFFSETS_S[0], OFFSETS_S[1]);
        let times = Times {
            offset_s,
            pose_s,
            image_s,
            phase_s: noise.uniform(0.0, pose_s),
            counts_images: noise.happens(0.5),
        };
        Self {
            robot: ShopRobot::new(layout.arm.arm(), joints, &errors),
            sensor: ShopSensor::new(&layout.sensor, &errors),
            form: SeamForm::new(&errors, &layout.line.direction(), &layout.height(), layout.course.length_m),
            start_ns: (START_S * 1e9) as i64,
            shop,
            errors,
            layout,
            times,
        }
    }

    fn cell(&self) -> Option<ShopCell> {
        let duration_s = self.layout.course.duration_s;
        let span_s = [-LOG_BEYOND_S - 0.5, duration_s + LOG_BEYOND_S + 0.5];
        let arrivals = Arrivals::new(&self.errors, span_s, self.start_ns, self.shop.seed);
        let robot = self.log(&arrivals);
        let images = self.images(&arrivals);
        if images.features.is_empty() {
            return None;
        }
        let cell =
            CheckedCell { layout: &self.layout, robot: &self.robot, sensor: &self.sensor, form: &self.form };
        let (readings, points): (Vec<_>, Vec<_>) = cell.points().into_iter().unzip();
        let truth = self.truth(&images, &arrivals, points);
        let stated = self.sensor.stated(&self.layout.sensor)?;
        let (setup, initial) =
            statements::drawn(self.shop.seed, self.shop.level, &self.layout.sensor, &truth.tool_from_camera);
        let of_check = check_pass::features(self.start_ns, readings.iter());
        let check = Recording::new(stated.clone(), setup.clone(), check_pass::poses(self.start_ns), of_check);
        let parameters =
            Guess { time_offset_s: truth.time_offset_s, tool_from_camera: truth.tool_from_camera };
        let known = Truth { parameters, lines: vec![self.layout.line] };
        let recording = Recording {
            initial,
            truth: Some(known),
            stripes: images.stripes,
            ..Recording::new(stated, setup, robot, images.features)
        };
        Some(ShopCell { recording, check, truth })
    }

    /// The poses that are logged.
    fn log(&self, arrivals: &Arrivals<'_>) -> Vec<RobotSample> {
        let begin_s = -LOG_BEYOND_S + self.times.offset_s.min(0.0) - self.times.phase_s;
        let end_s = self.layout.course.duration_s + LOG_BEYOND_S + self.times.offset_s.max(0.0);
        let count = ((end_s - begin_s) / self.times.pose_s).floor() as usize;
        let sent_s: Vec<f64> = (0..=count).map(|k| begin_s + k as f64 * self.times.pose_s).collect();
        let stamps = arrivals.stamps_ns(&sent_s, Stream::Robot);
        let rows = sent_s.iter().zip(stamps).filter_map(|(sent_s, stamp_ns)| {
            Some(RobotSample {
                stamp_ns: stamp_ns?,
                device_ns: None,
                base_from_tool: self.robot.reported(*sent_s),
            })
        });
        rows.collect()
    }

    /// `base_from_camera` at a time since the start, s.
    fn base_from_camera(&self, time_s: f64) -> Pose {
        let after_middle_s = time_s - 0.5 * self.layout.course.duration_s;
        self.robot.actual(time_s) * warmed(self.layout.tool_from_camera, &self.errors, after_middle_s)
    }

    fn images(&self, arrivals: &Arrivals<'_>) -> Images {
        let (duration_s, times) = (self.layout.course.duration_s, &self.times);
        let clock = ImageClock::of(&self.errors, duration_s);
        let exposure = AutomaticExposure::of(&self.errors);
        let mut detector = ShopDetector::new(&self.errors, duration_s, self.shop.seed);
        let count = (duration_s / times.image_s).floor() as usize;
        let middle_s: Vec<f64> = (0..count).map(|k| (k as f64 + 0.5) * times.image_s).collect();
        let sent_s: Vec<f64> =
            middle_s.iter().map(|time_s| time_s + times.offset_s + clock.ahead_s(*time_s)).collect();
        let stamps = arrivals.stamps_ns(&sent_s, Stream::Images);
        let mut images = Images { count, ..Images::default() };
        let plates = self.plates();
        let mut noise = Noise::new(self.shop.seed, STRIPES_STREAM);
        for (k, time_s) in middle_s.iter().enumerate() {
            let work_rad = self.layout.course.at(*time_s).tilt_rad[0];
            let later_s = exposure.as_ref().map_or(0.0, |exposure| exposure.later_s(work_rad));
            let Some(seen) = self.seen(detector.aside_m(*time_s), time_s + later_s) else { continue };
            images.seen_s.push(*time_s);
            images.ahead_s.push(clock.ahead_s(*time_s) - later_s);
            images.row_delays_s.push(self.sensor.row_delay_s(&seen));
            let found = detector.detect(seen, *time_s, &self.sensor.model, &self.sensor.axes);
            let (Some(Detected { measured, is_outlier }), Some(stamp_ns)) = (found, stamps[k]) else {
                continue;
            };
            let frame = times.counts_images.then_some(k as u64);
            images.outliers += usize::from(is_outlier);
            let image = Image { exposed_s: time_s + later_s, stamp_ns, frame };
            let stripes = plates.as_ref().map(|plates| self.stripes(plates, image, &mut noise));
            images.stripes.extend(stripes.into_iter().flatten().flatten());
            images.features.push(Feature {
                stamp_ns,
                line: 0,
                frame,
                device_ns: None,
                measured,
                sigma: None,
                correlation: 0.0,
            });
        }
        images
    }

    /// The plates, where whole stripes are measured.
    fn plates(&self) -> Option<ShopPlates> {
        let Layout { line, course, sensor, .. } = &self.layout;
        let is_length = !matches!(sensor, SensorModel::CameraLaser { .. });
        let sigma = detector::sigma(&self.errors, is_length);
        let has_stripes = self.shop.plates && !matches!(sensor, SensorModel::Points { .. });
        has_stripes
            .then(|| ShopPlates::new(line, &self.layout.height(), course.length_m, sigma, self.shop.seed))
    }

    fn stripes(&self, plates: &ShopPlates, image: Image, noise: &mut Noise) -> [Option<PlateStripe>; 2] {
        let view = PlateView {
            sensor: &self.sensor,
            line: &self.layout.line,
            displacement: &|along_m| self.form.displacement_beside(along_m),
            base_from_camera: &|time_s| self.base_from_camera(time_s),
        };
        plates.stripes(&view, image, noise)
    }

    /// The seam, or a line aside of it, in an image with its middle row exposed at a time, s.
    fn seen(&self, aside_m: f64, exposed_s: f64) -> Option<Measured> {
        let line = self.line_aside(aside_m);
        // The crossing of two fitted stripes has no edge, and no tack.
        let displacement = |along_m: f64| {
            if self.shop.plates {
                self.form.displacement_beside(along_m)
            } else {
                self.form.displacement(along_m)
            }
        };
        let rounded = RoundedEdge::of(&self.errors).filter(|_| !self.shop.plates);
        let seam = TrueSeam { line: &line, displacement: &displacement, rounded };
        Some(self.sensor.see(&seam, &|time_s| self.base_from_camera(time_s), exposed_s)?.measured)
    }

    /// The line so far aside of the seam, m.
    fn line_aside(&self, aside_m: f64) -> Line {
        let direction = self.layout.line.direction();
        let across = self.layout.height().cross(&direction);
        Line::new(self.layout.line.anchor() + across * aside_m, &UnitVector3::new_normalize(direction))
    }

    fn truth(&self, images: &Images, arrivals: &Arrivals<'_>, points: Vec<CheckPoint>) -> ShopTruth {
        let (layout, shop) = (&self.layout, self.shop);
        let scan = IdealScan {
            sensor: &layout.sensor,
            base_from_tool: &|time_s| self.robot.wanted(time_s),
            tool_from_camera: layout.tool_from_camera,
            line: layout.line,
        };
        let is_length = !matches!(layout.sensor, SensorModel::CameraLaser { .. });
        // A scan without noise is as good as its motion is with that of an ordinary shop.
        let noise = DrawnErrors::only(shop.level, shop.seed, &[ShopError::FeatureNoise]);
        let bound_m =
            scan.bound_m(&images.seen_s, detector::sigma(&noise, is_length), &points, CHECK_SPEED_M_S);
        let sensor = match layout.sensor {
            SensorModel::CameraLaser { .. } => "camera",
            SensorModel::Profiler { .. } => "profiler",
            SensorModel::Points { .. } => "points",
        };
        let features = images.features.len() as f64;
        let outlier_share = images.outliers as f64 / features;
        let (time_offset_s, time_offset_interval_s) = self.time_offset_s(images, arrivals);
        ShopTruth {
            level: shop.level,
            seed: shop.seed,
            only: shop.only.as_ref().map(|kinds| kinds.iter().map(|kind| kind.row().name).collect()),
            motion: layout.course.motion,
            sensor,
            arm: layout.arm.name,
            duration_s: layout.course.duration_s,
            tilt_rad: match layout.course.motion {
                Motion::Plan => rms_tilt_rad(&images.seen_s, &|time_s| self.robot.wanted(time_s)),
                _ => layout.course.tilt_rad,
            },
            seen_share: images.seen_s.len() as f64 / images.count.max(1) as f64,
            outlier_share,
            // Outliers, and images that are lost, show nothing.
            bound_m: (bound_m * (images.seen_s.len() as f64 / (features * (1.0 - outlier_share))).sqrt())
                .min(NOTHING_SHOWN_M),
            time_offset_s,
            time_offset_interval_s,
            tool_from_camera: layout.tool_from_camera,
            start_s: START_S,
            speed_m_s: CHECK_SPEED_M_S,
            points,
            errors: self.errors.list().filter(|(row, _)| row.error.is_of(sensor)).collect(),
        }
    }

    /// The time offset, and the interval that it may be found in, s.
    fn time_offset_s(&self, images: &Images, arrivals: &Arrivals<'_>) -> (f64, [f64; 2]) {
        let [soonest, mean, latest] = self.robot.behind_log_s();
        let count = images.row_delays_s.len() as f64;
        let row_s = images.row_delays_s.iter().sum::<f64>() / count;
        let row_spread_s =
            (images.row_delays_s.iter().map(|s| (s - row_s).powi(2)).sum::<f64>() / count).sqrt();
        let offset_s = self.times.offset_s + mean - row_s;
        let [lower, upper] = arrivals.of_the_offset_s();
        let least = images.ahead_s.iter().copied().fold(f64::INFINITY, f64::min);
        let most = images.ahead_s.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let interval = [
            offset_s + (soonest - mean) + least + lower - row_spread_s,
            offset_s + (latest - mean) + most + upper + row_spread_s,
        ];
        (offset_s, interval)
    }
}

/// RMS rotation from the mean attitude, rad.
fn rms_tilt_rad(times_s: &[f64], base_from_tool: &dyn Fn(f64) -> Pose) -> f64 {
    let attitudes: Vec<UnitQuaternion<f64>> = times_s
        .iter()
        .step_by(times_s.len().div_ceil(500).max(1))
        .map(|time_s| base_from_tool(*time_s).rotation)
        .collect();
    let Some(first) = attitudes.first() else { return 0.0 };
    let sum =
        attitudes.iter().fold(Quaternion::from_parts(0.0, nalgebra::Vector3::zeros()), |sum, attitude| {
            let sign = if attitude.coords.dot(&first.coords) < 0.0 { -1.0 } else { 1.0 };
            sum + attitude.into_inner() * sign
        });
    let mean = UnitQuaternion::new_normalize(sum);
    let squares: f64 = attitudes.iter().map(|attitude| mean.angle_to(attitude).powi(2)).sum();
    (squares / attitudes.len() as f64).sqrt()
}
