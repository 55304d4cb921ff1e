//! Scans over curved seams, cast forward: the curve is a formula, and each reading is its crossing with the laser
//! sheet.
//!
//! A profiler follows the seam with its sheet across it, tilts about a torch beside the sheet, sways across and in range. Nothing
//! here is a spline, and no measurement is inverted.

use crate::noise::Noise;
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};
use std::f64::consts::{PI, TAU};
use trueline_dataset::{Feature, Guess, Measured, Recording, RobotSample, Sensor, SensorSetup, Truth};
use trueline_geometry::{Pose, se3, so3};

/// A form of a seam.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CurveKind {
    /// A straight line, 220 mm long.
    Straight,
    /// An arc of 60°, radius 280 mm.
    Arc,
    /// A whole pipe, radius 50 mm.
    Pipe,
    /// A pipe on a pipe: a closed saddle, radius 45 mm.
    Saddle,
    /// Two lines with a corner of radius 12 mm.
    Corner,
    /// A line with waves of 6 mm.
    Wavy,
    /// A curve in space.
    Free,
    /// A closed figure eight, 140 mm long, that crosses itself at 90°.
    Eight,
}

impl CurveKind {
    /// All of them.
    pub const ALL: [Self; 8] = [
        Self::Straight,
        Self::Arc,
        Self::Pipe,
        Self::Saddle,
        Self::Corner,
        Self::Wavy,
        Self::Free,
        Self::Eight,
    ];

    /// The name.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Straight => "straight",
            Self::Arc => "arc",
            Self::Pipe => "pipe",
            Self::Saddle => "saddle",
            Self::Corner => "corner",
            Self::Wavy => "wavy",
            Self::Free => "free",
            Self::Eight => "eight",
        }
    }

    /// Whether its end is its beginning.
    #[must_use]
    pub fn is_closed(self) -> bool {
        matches!(self, Self::Pipe | Self::Saddle | Self::Eight)
    }

    /// The point at a place s, 0 to 1, m, in the part's own frame.
    #[must_use]
    pub fn point(self, s: f64) -> Vector3<f64> {
        let (m, turn) = (s - 0.5, TAU * s);
        match self {
            Self::Straight => Vector3::new(0.22 * m, 0.0, 0.0),
            Self::Arc => {
                let a = PI / 3.0 * m;
                Vector3::new(a.sin(), 1.0 - a.cos(), 0.0) * 0.28
            }
            Self::Pipe => Vector3::new(turn.cos(), turn.sin(), 0.0) * 0.05,
            Self::Saddle => {
                let (r, other) = (0.045, 0.08_f64);
                let height = (other.powi(2) - (r * turn.cos()).powi(2)).sqrt() - other;
                Vector3::new(r * turn.cos(), r * turn.sin(), height)
            }
            Self::Corner => corner(m),
            Self::Wavy => {
                Vector3::new(0.24 * m, 0.006 * (TAU * 2.5 * m).sin(), 0.004 * (TAU * 1.7 * m).cos())
            }
            Self::Free => {
                let a = 2.2 * m;
                Vector3::new(0.11 * a, 0.05 * a * a - 0.02 * a.powi(3), 0.025 * (1.9 * a).sin())
            }
            Self::Eight => Vector3::new(turn.sin(), turn.sin() * turn.cos(), 0.0) * 0.07,
        }
    }
}

/// Two lines of 90 mm at 80° with an arc between them.
fn corner(m: f64) -> Vector3<f64> {
    let (radius, angle, arm) = (0.012, 80.0 * PI / 180.0, 0.09);
    let arc = radius * angle;
    let along = m * (2.0 * arm + arc);
    let half = 0.5 * angle;
    let at = |a: f64| Vector3::new(radius * a.sin(), radius * (1.0 - a.cos()), 0.0);
    if along.abs() <= 0.5 * arc {
        return at(along / radius);
    }
    let (end, sign) = (at(half * along.signum()), along.signum());
    end + Vector3::new(half.cos(), sign * half.sin(), 0.0) * (along - sign * 0.5 * arc)
}

/// How a curve is scanned.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CurveScan {
    /// The curve.
    pub kind: CurveKind,
    /// How long, s.
    pub lasts_s: f64,
    /// How often over it.
    pub passes: f64,
    /// How far it tilts about three axes, rad.
    pub tilt_rad: f64,
    /// How often it weaves by ±3 mm across the seam, Hz; 0 is not at all.
    pub weave_hz: f64,
    /// Noise of a reading, m per axis.
    pub noise_m: f64,
    /// Noise of a robot's position, m per axis.
    pub robot_noise_m: f64,
    /// Part of the readings that are anywhere within 8 mm.
    pub outliers: f64,
    /// Part of the curve, in its middle, of which there are no readings.
    pub unseen: f64,
    /// Errors of the sensor.
    pub sensor: SensorError,
    /// How far the part moves between passes: standard deviations of shift, m, and turn, rad, about each axis.
    pub part_moves: [f64; 2],
}

/// A profiler that reports something else than what is there.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SensorError {
    /// Too wide by this part.
    pub width: f64,
    /// Too deep by this part.
    pub depth: f64,
    /// Shifted along x by this part of the depth.
    pub shear: f64,
    /// Larger by this part for each metre of x and of depth.
    pub keystone_per_m: [f64; 2],
    /// How far the laser sheet bends out of its plane at ±30 mm, m.
    pub bow_m: f64,
}

/// Depth about which a sensor is off, m.
const MIDDLE_M: f64 = 0.16;

impl SensorError {
    /// Reported coordinates of a point, x and z in m.
    #[must_use]
    pub fn reported(&self, [x, z]: [f64; 2]) -> [f64; 2] {
        let deep = z - MIDDLE_M;
        let larger = 1.0 + self.keystone_per_m[0] * x + self.keystone_per_m[1] * deep;
        [(x * (1.0 + self.width) + self.shear * deep) * larger, MIDDLE_M + deep * (1.0 + self.depth) * larger]
    }

    /// How far the sheet is out of its plane at a place x, both m.
    #[must_use]
    pub fn out_of_plane_m(&self, x: f64) -> f64 {
        const REACH_M: f64 = 0.03;
        self.bow_m * (x / REACH_M).powi(2)
    }
}

impl CurveScan {
    /// A good scan of a curve: 20 s, ±18°, three passes, of a closed curve two.
    #[must_use]
    pub fn good(kind: CurveKind) -> Self {
        let passes = if kind.is_closed() { 2.0 } else { 3.0 };
        Self {
            kind,
            lasts_s: 20.0,
            passes,
            tilt_rad: 18.0 * PI / 180.0,
            weave_hz: 0.0,
            noise_m: 0.04e-3,
            robot_noise_m: 0.02e-3,
            outliers: 0.02,
            unseen: 0.0,
            sensor: SensorError::default(),
            part_moves: [0.0; 2],
        }
    }

    /// The same without noise and outliers.
    #[must_use]
    pub fn exact(self) -> Self {
        Self { noise_m: 0.0, robot_noise_m: 0.0, outliers: 0.0, ..self }
    }
}

/// Time between poses, s.
const ROBOT_S: f64 = 0.004;
/// Time between readings, s.
const FRAME_S: f64 = 1.0 / 33.0;
/// How far a weave goes to either side, m.
const WEAVE_M: f64 = 3e-3;
/// The robot is recorded for so long before and after, s.
const MARGIN_S: f64 = 1.3;

/// A part that is shifted, and turned about its own origin, by these standard deviations, m and rad.
fn off_place(base_from_part: &Pose, random: &mut Noise, [shift_m, turn_rad]: [f64; 2]) -> Pose {
    let mut three = |sigma: f64| Vector3::from_fn(|_, _| random.normal(sigma));
    let (shift, turn) = (three(shift_m), so3::exp(&three(turn_rad)));
    let about = base_from_part.translation.vector;
    se3::from_parts(turn, about - turn * about + shift)
}

/// Quantities drawn once for a cell.
struct Cell {
    scan: CurveScan,
    base_from_part: Pose,
    /// How far the part lies off the place that the robot was taught, in base, in each pass.
    off_place: Vec<Pose>,
    guess: Guess,
    stand_off_m: f64,
    phases: [f64; 5],
    rates_hz: [f64; 5],
}

impl Cell {
    fn drawn(scan: CurveScan, seed: u64) -> Self {
        let mut random = Noise::new(seed, 31);
        let mut turn = |most: f64| {
            let axis = Vector3::from_fn(|_, _| random.normal(1.0)).normalize();
            so3::exp(&(axis * random.uniform(0.0, most)))
        };
        let (part, hand_eye) = (turn(0.6), turn(PI));
        let shift = Vector3::from_fn(|_, _| random.uniform(-0.09, 0.09)) + Vector3::new(0.0, 0.0, 0.06);
        let guess = Guess {
            time_offset_s: random.uniform(-0.5, 0.5),
            tool_from_camera: se3::from_parts(hand_eye, shift),
        };
        let base_from_part = se3::from_parts(part, Vector3::new(0.7, 0.05, 0.3));
        let mut of_part = Noise::new(seed, 35);
        // The first pass is where the robot was taught.
        let passes = 1..scan.passes.ceil() as usize;
        let off_place = std::iter::once(Pose::identity())
            .chain(passes.map(|_| off_place(&base_from_part, &mut of_part, scan.part_moves)))
            .collect();
        Self {
            scan,
            base_from_part,
            off_place,
            guess,
            stand_off_m: random.uniform(0.12, 0.2),
            phases: std::array::from_fn(|_| random.uniform(0.0, TAU)),
            rates_hz: [0.13, 0.21, 0.31, 0.26, 0.17].map(|hz| hz * random.uniform(0.9, 1.1)),
        }
    }

    fn point(&self, s: f64) -> Vector3<f64> {
        self.base_from_part.rotation * self.scan.kind.point(s) + self.base_from_part.translation.vector
    }

    /// Place of the sensor on the curve, 0 to 1.
    fn place(&self, time_s: f64) -> f64 {
        let done = self.scan.passes * time_s / self.scan.lasts_s;
        if self.scan.kind.is_closed() {
            return done.rem_euclid(1.0);
        }
        // There and back, and so that the sheet stays on the curve.
        let folded = 1.0 - (done.rem_euclid(2.0) - 1.0).abs();
        0.04 + 0.92 * folded
    }

    fn sways(&self, time_s: f64) -> [f64; 5] {
        std::array::from_fn(|k| (TAU * self.rates_hz[k] * time_s + self.phases[k]).sin())
    }

    /// The sensor in base.
    fn base_from_camera(&self, time_s: f64) -> Pose {
        const STEP: f64 = 1e-4;
        /// The torch is beside the sheet, m: along the seam and above it.
        const TORCH_M: [f64; 2] = [0.015, 0.01];
        // The sensor turns smoothly round corners: its direction is that of a stretch of the seam.
        let s = self.place(time_s);
        let reach = if self.scan.kind.is_closed() { STEP } else { 0.04 };
        let (seam, along) = (self.point(s), self.point(s + reach) - self.point(s - reach));
        let y = along.normalize();
        let up = self.base_from_part.rotation * Vector3::z();
        let z = -(up - y * y.dot(&up)).normalize();
        let nominal = Matrix3::from_columns(&[y.cross(&z), y, z]);
        let [a, b, c, lateral, range] = self.sways(time_s);
        let tilt = so3::exp(&(Vector3::new(a, b, c) * self.scan.tilt_rad));
        let torch = seam + y * TORCH_M[0] - z * TORCH_M[1];
        let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(nominal));
        let weave_m = WEAVE_M * (TAU * self.scan.weave_hz * time_s).sin();
        let (lateral_m, range_m) = (8e-3 * lateral + weave_m, 12e-3 * range);
        let place = seam - z * (self.stand_off_m + range_m) + y.cross(&z) * lateral_m;
        let turned = rotation * tilt;
        let off = rotation.inverse() * (place - torch);
        se3::from_parts(turned, torch + turned * off)
    }

    fn base_from_tool(&self, time_s: f64) -> Pose {
        self.base_from_camera(time_s) * self.guess.tool_from_camera.inverse()
    }

    /// The reading at a time, profiler's x and z, m: where the curve crosses y = 0 nearest to where the sensor is.
    fn reading(&self, time_s: f64) -> Option<[f64; 2]> {
        const STEPS: i32 = 160;
        const REACH: f64 = 0.3;
        let camera_from_base = self.base_from_camera(time_s).inverse();
        let pass = (self.scan.passes * time_s / self.scan.lasts_s) as usize;
        let pass = pass.min(self.off_place.len() - 1);
        let seen = |s: f64| {
            let s = if self.scan.kind.is_closed() { s.rem_euclid(1.0) } else { s };
            let there = self.off_place[pass] * nalgebra::Point3::from(self.point(s));
            (camera_from_base * there).coords
        };
        let middle = self.place(time_s);
        if (middle - 0.5).abs() < 0.5 * self.scan.unseen {
            return None;
        }
        let out = |s: f64| {
            let there = seen(s);
            there.y - self.scan.sensor.out_of_plane_m(there.x)
        };
        let at = |k: i32| middle + REACH * f64::from(k) / f64::from(STEPS);
        let inside = |s: f64| self.scan.kind.is_closed() || (0.0..=1.0).contains(&s);
        let crosses = |k: &i32| {
            let (from, to) = (at(*k), at(*k + 1));
            inside(from) && inside(to) && out(from) * out(to) <= 0.0
        };
        let nearest = (-STEPS..STEPS).filter(crosses).min_by_key(|k| k.abs())?;
        let (mut from, mut to) = (at(nearest), at(nearest + 1));
        for _ in 0..60 {
            let half = 0.5 * (from + to);
            if out(from) * out(half) <= 0.0 { to = half } else { from = half }
        }
        let point = seen(0.5 * (from + to));
        (point.z > 0.0).then(|| self.scan.sensor.reported([point.x, point.z]))
    }
}

/// A production over a curved seam: one program, and parts that lie a little elsewhere each time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CurveProduction {
    /// Scan of each part.
    pub scan: CurveScan,
    /// How far the parts lie off their place, standard deviation of each axis, m …
    pub off_m: f64,
    /// … and rad.
    pub turned_rad: f64,
    /// Which cell: program, hand-eye transform and clocks.
    pub seed: u64,
}

impl CurveProduction {
    /// The recording of a part, with images stamped late by `late_s`.
    #[must_use]
    pub fn piece(&self, number: u64, late_s: f64) -> Recording {
        let mut cell = Cell::drawn(self.scan, self.seed);
        let seed = self.seed.wrapping_mul(1_000_003).wrapping_add(number);
        let mut random = Noise::new(seed, 34);
        let own = off_place(&cell.base_from_part, &mut random, [self.off_m, self.turned_rad]);
        cell.off_place.iter_mut().for_each(|off| *off = own * *off);
        let mut recording = recorded(&cell, seed).0;
        for feature in &mut recording.features {
            feature.stamp_ns += (late_s * 1e9).round() as i64;
        }
        recording
    }
}

/// A scan of a curve with its truth, and points of the curve in base, m.
#[must_use]
pub fn scan_curve(scan: &CurveScan, seed: u64) -> (Recording, Vec<Vector3<f64>>) {
    recorded(&Cell::drawn(*scan, seed), seed)
}

/// The recording of a cell with noise of a seed, and its curve.
fn recorded(cell: &Cell, seed: u64) -> (Recording, Vec<Vector3<f64>>) {
    let scan = &cell.scan;
    let mut noise = Noise::new(seed, 32);
    let ns = |time_s: f64| ((time_s + 100.0) * 1e9).round() as i64;
    let mut three = |sigma: f64| Vector3::from_fn(|_, _| noise.normal(sigma));
    let samples = ((scan.lasts_s + 2.0 * MARGIN_S) / ROBOT_S) as usize;
    let robot = (0..samples).map(|k| {
        let time_s = k as f64 * ROBOT_S - MARGIN_S;
        let truth = cell.base_from_tool(time_s);
        // An encoder's white noise: 0.001° for 0.02 mm.
        let turn = so3::exp(&three(scan.robot_noise_m * 0.87));
        let base_from_tool =
            se3::from_parts(truth.rotation * turn, truth.translation.vector + three(scan.robot_noise_m));
        RobotSample { stamp_ns: ns(time_s), device_ns: None, base_from_tool }
    });
    let robot: Vec<RobotSample> = robot.collect();
    let mut noise = Noise::new(seed, 33);
    let frames = (scan.lasts_s / FRAME_S) as usize;
    let mut features = Vec::new();
    for k in 0..frames {
        let time_s = k as f64 * FRAME_S;
        let Some([x, z]) = cell.reading(time_s) else { continue };
        let sigma_m = if noise.happens(scan.outliers) { 8e-3 } else { scan.noise_m };
        let measured = Measured::Profile([x + noise.normal(sigma_m), z + noise.normal(sigma_m)]);
        features.push(Feature {
            stamp_ns: ns(time_s + cell.guess.time_offset_s),
            line: 0,
            frame: None,
            device_ns: None,
            measured,
            sigma: None,
            correlation: 0.0,
        });
    }
    let points = (0..=200).map(|k| cell.point(f64::from(k) / 200.0)).collect();
    let setup = SensorSetup { edge_radius_m: Some(0.0), waviness_m: Some(0.0), ..SensorSetup::default() };
    let truth = Some(Truth { parameters: cell.guess, lines: Vec::new() });
    (Recording { truth, ..Recording::new(Sensor::Profiler, setup, robot, features) }, points)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Most of each curve is seen, and the same seed gives the same scan.
    #[test]
    fn every_curve_is_seen() {
        for kind in CurveKind::ALL {
            let (scan, _) = scan_curve(&CurveScan::good(kind), 1);
            assert!(scan.features.len() > 560, "{}: {}", kind.name(), scan.features.len());
            let again = scan_curve(&CurveScan::good(kind), 1).0;
            assert_eq!(scan.features, again.features);
        }
    }
}
