//! A seam, a sensor that moves over it, and what it measures there as a function of all unknowns.

use nalgebra::{Isometry3, Matrix3, Rotation3, UnitQuaternion, Vector2, Vector3, Vector4};
use std::f64::consts::{PI, TAU};
use trueline_geometry::so3;
use trueline_sim::curves::CurveKind;

/// Distance of the knots, m.
const KNOT_M: f64 = 10e-3;
/// Samples of a curve from which its arc length is summed.
const SAMPLES: usize = 4000;
/// Step of derivatives along the curve, m.
const ALONG_M: f64 = 1e-5;

/// A seam with plates beside it.
#[derive(Clone)]
pub(super) struct Seam {
    kind: CurveKind,
    larger: f64,
    base_from_seam: Isometry3<f64>,
    /// Arc length at each sample, m.
    lengths_m: Vec<f64>,
}

impl Seam {
    /// A curve, larger by a factor, at a pose.
    pub(super) fn new(kind: CurveKind, larger: f64, base_from_seam: Isometry3<f64>) -> Self {
        let at = |k: usize| kind.point(k as f64 / SAMPLES as f64) * larger;
        let length_m = |sum_m: &mut f64, k: usize| {
            *sum_m += (at(k) - at(k - 1)).norm();
            Some(*sum_m)
        };
        let lengths_m = std::iter::once(0.0).chain((1..=SAMPLES).scan(0.0, length_m)).collect();
        Self { kind, larger, base_from_seam, lengths_m }
    }

    pub(super) fn length_m(&self) -> f64 {
        self.lengths_m[SAMPLES]
    }

    /// The point at an arc length, in base, m.
    pub(super) fn point(&self, u_m: f64) -> Vector3<f64> {
        let length_m = self.length_m();
        let (turns, own_m) = if self.kind.is_closed() {
            ((u_m / length_m).floor(), u_m.rem_euclid(length_m))
        } else {
            (0.0, u_m.clamp(0.0, length_m))
        };
        let k = self.lengths_m.partition_point(|l| *l <= own_m).clamp(1, SAMPLES) - 1;
        let part = (own_m - self.lengths_m[k]) / (self.lengths_m[k + 1] - self.lengths_m[k]);
        let s = turns + (k as f64 + part) / SAMPLES as f64;
        // Beyond its ends an open curve goes straight on.
        let beyond_m = if self.kind.is_closed() { 0.0 } else { u_m - own_m };
        let end = (self.kind.point(s + 1e-6) - self.kind.point(s - 1e-6)).normalize() * beyond_m;
        (self.base_from_seam * nalgebra::Point3::from(self.kind.point(s) * self.larger + end)).coords
    }

    /// Its direction, the up direction square to it, and the third one.
    fn frame(&self, u_m: f64) -> [Vector3<f64>; 3] {
        // A corner is followed by its chord over 40 mm.
        let along = (self.point(u_m + ALONG_M) - self.point(u_m - ALONG_M)).normalize();
        let up = self.base_from_seam * Vector3::z();
        let up = (up - along * along.dot(&up)).normalize();
        [along, up, along.cross(&up)]
    }

    /// Number of control points.
    pub(super) fn knots(&self) -> usize {
        self.spans() + if self.kind.is_closed() { 0 } else { 3 }
    }

    fn spans(&self) -> usize {
        (self.length_m() / KNOT_M).round() as usize
    }

    /// Weights of four control points at an arc length.
    pub(super) fn basis(&self, u_m: f64) -> [(usize, f64); 4] {
        let spans = self.spans();
        let at = u_m / self.length_m() * spans as f64;
        let (span, count) = if self.kind.is_closed() {
            (at.floor(), self.knots() as i64)
        } else {
            (at.floor().clamp(0.0, spans as f64 - 1.0), i64::MAX)
        };
        let f = at - span;
        let weights = [
            (1.0 - f).powi(3),
            3.0 * f.powi(3) - 6.0 * f * f + 4.0,
            -3.0 * f.powi(3) + 3.0 * f * f + 3.0 * f + 1.0,
            f.powi(3),
        ];
        std::array::from_fn(|m| (((span as i64 + m as i64).rem_euclid(count)) as usize, weights[m] / 6.0))
    }

    /// Normals of a control point.
    fn normals(&self, knot: usize) -> [Vector3<f64>; 2] {
        let spacing_m = self.length_m() / self.spans() as f64;
        let [_, up, aside] = self.frame((knot as f64 - 1.0) * spacing_m);
        [up, aside]
    }
}

/// How a sensor moves over a seam.
#[derive(Clone)]
pub(super) struct Motion {
    pub(super) seam: Seam,
    pub(super) lasts_s: f64,
    pub(super) passes: f64,
    pub(super) tilt_rad: f64,
    /// Sways across the seam and in range, m.
    pub(super) sways_m: [f64; 2],
    pub(super) weave_m: f64,
    /// Phase of tilts and sways.
    pub(super) phase_rad: f64,
    /// A constant turn against the seam.
    pub(super) attitude: UnitQuaternion<f64>,
}

/// Frequencies of three tilts and two sways, Hz: no common multiple.
const RATES_HZ: [f64; 5] = [0.13, 0.21, 0.31, 0.26, 0.17];
const WEAVE_HZ: f64 = 2.0;
/// Time between frames, s.
const FRAME_S: f64 = 1.0 / 33.0;
const STAND_OFF_M: f64 = 0.16;
/// The torch: this far along the seam and above it, m.
const TORCH_M: [f64; 2] = [0.015, 0.01];

fn hand_eye() -> Isometry3<f64> {
    Isometry3::new(Vector3::new(0.05, -0.04, 0.14), Vector3::new(0.4, -1.1, 0.8))
}

/// A vector of the sensor in the tool.
pub(super) fn in_tool(vector: &Vector3<f64>) -> Vector3<f64> {
    hand_eye().rotation * vector
}

/// A small change of unknowns.
#[derive(Clone, Copy, Default)]
pub(super) struct Off {
    /// Time offset, s; rotation, rad; translation, m.
    pub(super) shared: [f64; 7],
    /// Shift, m, and turn about the middle, rad, of the part.
    pub(super) place: [f64; 6],
    /// A control point, one of its normals, and its change, m.
    pub(super) curve: Option<(usize, usize, f64)>,
    /// Change of the angle of a plate at a control point, or of all if there is none, rad.
    pub(super) plate: Option<(Option<usize>, usize, f64)>,
}

impl Motion {
    pub(super) fn times_s(&self) -> impl Iterator<Item = f64> {
        (0..(self.lasts_s / FRAME_S) as usize).map(|k| k as f64 * FRAME_S)
    }

    /// Place of the sensor on the seam, m.
    pub(super) fn along_m(&self, time_s: f64) -> f64 {
        let done = self.passes * time_s / self.lasts_s;
        if self.seam.kind.is_closed() {
            return done * self.seam.length_m();
        }
        (0.04 + 0.92 * (1.0 - (done.rem_euclid(2.0) - 1.0).abs())) * self.seam.length_m()
    }

    fn base_from_sensor(&self, time_s: f64) -> Isometry3<f64> {
        let [a, b, c, lateral, range] =
            std::array::from_fn(|k| (TAU * RATES_HZ[k] * time_s + 1.3 * k as f64 + self.phase_rad).sin());
        let u_m = self.along_m(time_s);
        let reach_m = if self.seam.kind.is_closed() { 1e-4 } else { 0.01 };
        let seam = self.seam.point(u_m);
        let y = (self.seam.point(u_m + reach_m) - self.seam.point(u_m - reach_m)).normalize();
        let up = self.seam.base_from_seam * Vector3::z();
        let z = -(up - y * y.dot(&up)).normalize();
        let nominal = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[y.cross(&z), y, z]));
        let nominal = UnitQuaternion::from_rotation_matrix(&nominal);
        let turn = self.attitude * so3::exp(&(Vector3::new(a, b, c) * self.tilt_rad));
        let aside_m = self.sways_m[0] * lateral + self.weave_m * (TAU * WEAVE_HZ * time_s).sin();
        let place = seam - z * (STAND_OFF_M + self.sways_m[1] * range) + y.cross(&z) * aside_m;
        let torch = seam + y * TORCH_M[0] - z * TORCH_M[1];
        let turned = nominal * turn;
        Isometry3::from_parts((torch + turned * (nominal.inverse() * (place - torch))).into(), turned)
    }

    /// Directions of the two plates' lines in the sheet, away from the seam.
    pub(super) fn outward(&self, time_s: f64, middle: &Vector3<f64>) -> [Vector2<f64>; 2] {
        let seen = self.seen(time_s, middle, &Off::default());
        let sensor_from_base = (self.base_from_sensor(time_s)).inverse();
        let [_, up, aside] = self.seam.frame(self.along_m(time_s)).map(|axis| sensor_from_base * axis);
        [(seen[2], aside), (seen[3], up)].map(|(angle, plate): (f64, Vector3<f64>)| {
            let along = Vector2::new(angle.cos(), angle.sin());
            along * along.dot(&plate.xz()).signum()
        })
    }

    /// Seam point in the sheet, m, and the angles of the two plates' lines in it, rad.
    pub(super) fn seen(&self, time_s: f64, middle: &Vector3<f64>, off: &Off) -> Vector4<f64> {
        let hand_eye = hand_eye();
        let three = |v: &[f64]| Vector3::new(v[0], v[1], v[2]);
        let base_from_tool = self.base_from_sensor(time_s - off.shared[0]) * hand_eye.inverse();
        let moved = Isometry3::from_parts(
            (hand_eye.translation.vector + three(&off.shared[4..7])).into(),
            so3::exp(&three(&off.shared[1..4])) * hand_eye.rotation,
        );
        let sensor_from_base = (base_from_tool * moved).inverse();
        let turn = so3::exp(&three(&off.place[3..6]));
        let point = |u_m: f64| {
            let mut own = self.seam.point(u_m);
            if let Some((knot, side, size)) = off.curve {
                let weight = self.seam.basis(u_m).iter().find(|(k, _)| *k == knot).map_or(0.0, |(_, w)| *w);
                own += self.seam.normals(knot)[side] * (weight * size);
            }
            let there = middle + turn * (own - middle) + three(&off.place[0..3]);
            (sensor_from_base * nalgebra::Point3::from(there)).coords
        };
        let tangent = |u_m: f64| (point(u_m + ALONG_M) - point(u_m - ALONG_M)) / (2.0 * ALONG_M);
        let mut u_m = self.along_m(time_s);
        for _ in 0..5 {
            u_m -= point(u_m).y / tangent(u_m).y;
        }
        let [seen, along] = [point(u_m), tangent(u_m)];
        let [_, up, aside] = self.seam.frame(u_m).map(|axis| sensor_from_base * (turn * axis));
        let angle = |plate: usize| {
            let weight = |knot: Option<usize>| {
                let of =
                    |knot| self.seam.basis(u_m).iter().find(|(k, _)| *k == knot).map_or(0.0, |(_, w)| *w);
                knot.map_or(1.0, of)
            };
            let change =
                off.plate.filter(|(_, own, _)| *own == plate).map_or(0.0, |(k, _, size)| weight(k) * size);
            // A fillet: one plate lies, the other stands.
            let own = plate as f64 * PI / 2.0 + change;
            let line = along.cross(&(aside * own.cos() + up * own.sin())).cross(&Vector3::y());
            line.z.atan2(line.x)
        };
        Vector4::new(seen.x, seen.z, angle(0), angle(1))
    }
}
