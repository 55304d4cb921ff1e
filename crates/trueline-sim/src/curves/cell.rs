//! A cell with a profiler that follows a curve.

use super::scan::CurveScan;
use crate::noise::Noise;
use nalgebra::{Matrix3, Point3, Rotation3, UnitQuaternion, Vector3};
use std::f64::consts::{PI, TAU};
use trueline_dataset::Guess;
use trueline_geometry::{Pose, se3, so3};

/// How far a weave goes to either side, m.
const WEAVE_M: f64 = 3e-3;

/// A part that is shifted, and turned about its own origin, by these standard deviations, m and rad.
pub(super) fn off_place(base_from_part: &Pose, random: &mut Noise, [shift_m, turn_rad]: [f64; 2]) -> Pose {
    let mut three = |sigma: f64| Vector3::from_fn(|_, _| random.normal(sigma));
    let (shift, turn) = (three(shift_m), so3::exp(&three(turn_rad)));
    let about = base_from_part.translation.vector;
    se3::from_parts(turn, about - turn * about + shift)
}

/// Quantities drawn once for a cell.
pub(super) struct Cell {
    pub scan: CurveScan,
    pub base_from_part: Pose,
    /// How far the part lies off the place that the robot was taught, in base, in each pass.
    pub off_place: Vec<Pose>,
    pub guess: Guess,
    stand_off_m: f64,
    phases: [f64; 5],
    rates_hz: [f64; 5],
}

impl Cell {
    pub(super) fn drawn(scan: CurveScan, seed: u64) -> Self {
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

    pub(super) fn point(&self, s: f64) -> Vector3<f64> {
        self.in_base(&self.scan.kind.point(s))
    }

    /// A point of the part in base where the robot was taught.
    fn in_base(&self, in_part: &Vector3<f64>) -> Vector3<f64> {
        self.base_from_part.rotation * in_part + self.base_from_part.translation.vector
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
    pub(super) fn base_from_camera(&self, time_s: f64) -> Pose {
        const STEP: f64 = 1e-4;
        /// The torch is beside the sheet, m: along the seam and above it.
        const TORCH_M: [f64; 2] = [0.015, 0.01];
        // The sensor turns smoothly round corners: its direction is that of a stretch of the seam.
        let s = self.place(time_s);
        let reach = if self.scan.kind.is_closed() { STEP } else { 0.04 };
        let (seam, along) = (self.point(s), self.point(s + reach) - self.point(s - reach));
        let y = along.normalize();
        let up = self.base_from_part.rotation * Vector3::z();
        let z = self
            .scan
            .plates
            .map_or_else(|| -(up - y * y.dot(&up)).normalize(), |plates| plates.view(&y, &up));
        let x = y.cross(&z);
        let nominal = Matrix3::from_columns(&[x, y, z]);
        let [a, b, c, lateral, range] = self.sways(time_s);
        let tilt = so3::exp(&(Vector3::new(a, b, c) * self.scan.tilt_rad));
        let torch = seam + y * TORCH_M[0] - z * TORCH_M[1];
        let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(nominal));
        let weave_m = WEAVE_M * (TAU * self.scan.weave_hz * time_s).sin();
        let (lateral_m, range_m) = (8e-3 * lateral + weave_m, 12e-3 * range);
        let place = seam - z * (self.stand_off_m + range_m) + x * lateral_m;
        let turned = rotation * tilt;
        let off = rotation.inverse() * (place - torch);
        se3::from_parts(turned, torch + turned * off)
    }

    pub(super) fn base_from_tool(&self, time_s: f64) -> Pose {
        self.base_from_camera(time_s) * self.guess.tool_from_camera.inverse()
    }

    /// What the sensor sees of the part at a time, s.
    pub(super) fn view(&self, time_s: f64) -> View<'_> {
        let pass = (self.scan.passes * time_s / self.scan.lasts_s) as usize;
        View {
            cell: self,
            camera_from_base: self.base_from_camera(time_s).inverse(),
            off_place: self.off_place[pass.min(self.off_place.len() - 1)],
            middle: self.place(time_s),
        }
    }
}

/// The part as the sensor sees it at a time.
pub(super) struct View<'a> {
    cell: &'a Cell,
    camera_from_base: Pose,
    off_place: Pose,
    /// Place on the curve that the sensor follows.
    middle: f64,
}

impl View<'_> {
    /// A point of the part in the camera frame, both m.
    pub(super) fn seen(&self, in_part: &Vector3<f64>) -> Vector3<f64> {
        let there = self.off_place * Point3::from(self.cell.in_base(in_part));
        (self.camera_from_base * there).coords
    }

    /// How far a point of the part is out of the laser sheet, m.
    pub(super) fn out_of_sheet(&self, in_part: &Vector3<f64>) -> f64 {
        let there = self.seen(in_part);
        there.y - self.cell.scan.sensor.out_of_plane_m(there.x)
    }

    /// The place on the curve, 0 to 1, or a turn beside it, where it crosses the sheet nearest to where the sensor is; `None` of a
    /// part of the curve without readings.
    pub(super) fn seam_place(&self) -> Option<f64> {
        const STEPS: i32 = 160;
        const REACH: f64 = 0.3;
        let CurveScan { kind, unseen, .. } = self.cell.scan;
        if (self.middle - 0.5).abs() < 0.5 * unseen {
            return None;
        }
        let out = |s: f64| {
            let s = if kind.is_closed() { s.rem_euclid(1.0) } else { s };
            self.out_of_sheet(&kind.point(s))
        };
        let at = |k: i32| self.middle + REACH * f64::from(k) / f64::from(STEPS);
        let inside = |s: f64| kind.is_closed() || (0.0..=1.0).contains(&s);
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
        Some(0.5 * (from + to))
    }

    /// The reading, profiler's x and z, m: the point of the curve in the sheet.
    pub(super) fn reading(&self) -> Option<[f64; 2]> {
        let kind = self.cell.scan.kind;
        let s = self.seam_place()?;
        let s = if kind.is_closed() { s.rem_euclid(1.0) } else { s };
        self.reported(&kind.point(s))
    }

    /// What the sensor reports of a point of the part; `None` behind it.
    pub(super) fn reported(&self, in_part: &Vector3<f64>) -> Option<[f64; 2]> {
        let point = self.seen(in_part);
        (point.z > 0.0).then(|| self.cell.scan.sensor.reported([point.x, point.z]))
    }
}
