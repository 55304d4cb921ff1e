//! Dual numbers and the measurement chain written with them in plain arithmetic: an oracle for Jacobians.
#![allow(dead_code, reason = "shared by several test files")]
#![allow(missing_docs, reason = "test support")]

use std::ops::{Add, Div, Mul, Neg, Sub};

/// value + slope·ε with ε² = 0.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Dual {
    pub value: f64,
    pub slope: f64,
}

impl Dual {
    pub(crate) fn constant(value: f64) -> Self {
        Self { value, slope: 0.0 }
    }
}

impl Add for Dual {
    type Output = Self;
    fn add(self, o: Self) -> Self {
        Self { value: self.value + o.value, slope: self.slope + o.slope }
    }
}
impl Sub for Dual {
    type Output = Self;
    fn sub(self, o: Self) -> Self {
        Self { value: self.value - o.value, slope: self.slope - o.slope }
    }
}
impl Mul for Dual {
    type Output = Self;
    fn mul(self, o: Self) -> Self {
        Self { value: self.value * o.value, slope: self.slope * o.value + self.value * o.slope }
    }
}
impl Div for Dual {
    type Output = Self;
    fn div(self, o: Self) -> Self {
        let value = self.value / o.value;
        Self { value, slope: (self.slope - value * o.slope) / o.value }
    }
}
impl Neg for Dual {
    type Output = Self;
    fn neg(self) -> Self {
        Self { value: -self.value, slope: -self.slope }
    }
}

pub(crate) type Vec3 = [Dual; 3];

pub(crate) fn constant(v: [f64; 3]) -> Vec3 {
    v.map(Dual::constant)
}
pub(crate) fn add(a: Vec3, b: Vec3) -> Vec3 {
    [0, 1, 2].map(|k| a[k] + b[k])
}
pub(crate) fn sub(a: Vec3, b: Vec3) -> Vec3 {
    [0, 1, 2].map(|k| a[k] - b[k])
}
pub(crate) fn dot(a: Vec3, b: Vec3) -> Dual {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
pub(crate) fn cross(a: Vec3, b: Vec3) -> Vec3 {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}
pub(crate) fn matrix(m: [[f64; 3]; 3], v: Vec3) -> Vec3 {
    m.map(|row| dot(constant(row), v))
}

/// Exp(w) v by its power series, 30 terms: exact to rounding for |w| < 3.
pub(crate) fn rotate_exp(w: Vec3, v: Vec3) -> Vec3 {
    let (mut sum, mut term) = (v, v);
    for k in 1..30 {
        term = cross(w, term).map(|x| x / Dual::constant(f64::from(k)));
        sum = add(sum, term);
    }
    sum
}

/// Numbers of one placement.
#[derive(Clone, Copy)]
pub(crate) struct Chain {
    pub robot_rotation: [[f64; 3]; 3],
    pub robot_position: [f64; 3],
    pub body_rate: [f64; 3],
    pub velocity: [f64; 3],
    pub elapsed: f64,
    pub hand_eye_rotation: [[f64; 3]; 3],
    pub hand_eye_translation: [f64; 3],
}

/// A point of the camera frame in base, the unknowns moved by `d`: 0 the time offset, 1–3 the hand-eye
/// rotation (left), 4–6 its translation.
pub(crate) fn base_from_camera(chain: Chain, point: Vec3, d: &dyn Fn(usize) -> Dual) -> Vec3 {
    let rotated = rotate_exp([d(1), d(2), d(3)], matrix(chain.hand_eye_rotation, point));
    let in_tool = add(add(rotated, constant(chain.hand_eye_translation)), [d(4), d(5), d(6)]);
    // The image was exposed at stamp − time offset.
    let elapsed = Dual::constant(chain.elapsed) - d(0);
    let turned = rotate_exp(constant(chain.body_rate).map(|w| w * elapsed), in_tool);
    let moved = add(constant(chain.robot_position), constant(chain.velocity).map(|v| v * elapsed));
    add(matrix(chain.robot_rotation, turned), moved)
}
