//! Whole stripes beside the seam points: each is the straight line that a sensor's software fits on a plate, given by two support points.
//!
//! A support point is where the stripe crosses a line that lies on the plate beside the seam. So it contains all errors of
//! robot, clocks, sensor and of the seam's form as a seam point does. It does not contain the rounding of an edge.

use super::sensor::{ShopSensor, TrueSeam};
use crate::noise::Noise;
use nalgebra::{UnitVector3, Vector3};
use trueline_dataset::{Measured, PlateStripe};
use trueline_geometry::{Line, Pose};

/// Places of a stripe's supports, m from the seam along the plate.
const SUPPORTS_M: [f64; 2] = [4e-3, 16e-3];
/// The part of each plate's stripe that a line is fitted through makes a support point this many times as exact as a seam point is.
const FINER: f64 = 2.0;
/// Each plate is bowed along the seam by this at its ends beyond the form of the seam, one standard deviation, m …
const OWN_BOW_M: f64 = 0.1e-3;
/// … and tilted outward against the other at the tack, rad: 0.5°. This is not an error, but the pose of the plates.
const TACKED_RAD: f64 = 0.009;
/// Stream of random numbers of the plates.
const PLATES_STREAM: u64 = 3977;

/// The plates of a fillet.
pub(crate) struct ShopPlates {
    /// Of each plate: along it and away from the seam, of length 1, base.
    outward: [Vector3<f64>; 2],
    /// How far it is bowed at the ends of the seam, square to it, m.
    bows: [Vector3<f64>; 2],
    half_length_m: f64,
    sigma: f64,
}

impl ShopPlates {
    /// Two plates at 90° about a seam, open towards the sensor, with the noise of a seam point.
    pub(crate) fn new(line: &Line, height: &Vector3<f64>, length_m: f64, sigma: f64, seed: u64) -> Self {
        let mut noise = Noise::new(seed, PLATES_STREAM);
        let across = height.cross(&line.direction());
        let sides = [1.0, -1.0].map(|side| {
            let angle = std::f64::consts::FRAC_PI_4 + noise.normal(TACKED_RAD);
            let outward = height * angle.cos() + across * (side * angle.sin());
            let normal = outward.cross(&line.direction());
            (outward, normal * noise.normal(OWN_BOW_M))
        });
        Self {
            outward: sides.map(|(outward, _)| outward),
            bows: sides.map(|(_, bow)| bow),
            half_length_m: 0.5 * length_m,
            sigma: sigma / FINER,
        }
    }

    /// The stripe on each plate in an image; `None` of one that is out of view.
    pub(crate) fn stripes(
        &self,
        view: &PlateView<'_>,
        image: Image,
        noise: &mut Noise,
    ) -> [Option<PlateStripe>; 2] {
        [0, 1].map(|plate| {
            let ends = SUPPORTS_M.map(|from_seam_m| self.support(view, image, plate, from_seam_m));
            let [Some(near), Some(far)] = ends else { return None };
            let points = moved_square([near, far], [(); 2].map(|()| noise.normal(self.sigma)));
            let (stamp_ns, frame) = (image.stamp_ns, image.frame);
            Some(PlateStripe { stamp_ns, frame, plate: plate as u32, points, sigma: self.sigma })
        })
    }

    fn support(
        &self,
        view: &PlateView<'_>,
        image: Image,
        plate: usize,
        from_seam_m: f64,
    ) -> Option<Measured> {
        let direction = view.line.direction();
        let line = Line::new(
            view.line.anchor() + self.outward[plate] * from_seam_m,
            &UnitVector3::new_normalize(direction),
        );
        let part = |along_m: f64| along_m / self.half_length_m;
        let displacement =
            |along_m: f64| (view.displacement)(along_m) + self.bows[plate] * part(along_m).powi(2);
        let edge = TrueSeam { line: &line, displacement: &displacement, rounded: None };
        Some(view.sensor.see(&edge, view.base_from_camera, image.exposed_s)?.measured)
    }
}

/// The sensor that views the plates, and their places relative to its seam.
pub(crate) struct PlateView<'a> {
    pub(crate) sensor: &'a ShopSensor,
    pub(crate) line: &'a Line,
    pub(crate) displacement: &'a dyn Fn(f64) -> Vector3<f64>,
    pub(crate) base_from_camera: &'a dyn Fn(f64) -> Pose,
}

/// An image.
#[derive(Clone, Copy)]
pub(crate) struct Image {
    pub(crate) exposed_s: f64,
    pub(crate) stamp_ns: i64,
    pub(crate) frame: Option<u64>,
}

/// Both ends of a stripe, each moved square to it.
fn moved_square(ends: [Measured; 2], by: [f64; 2]) -> [Measured; 2] {
    let flat = |of: &Measured| match of {
        Measured::Pixel(at) | Measured::Profile(at) => *at,
        Measured::Point([x, _, z]) => [*x, *z],
    };
    let [a, b] = ends.each_ref().map(flat);
    let (dx, dz) = (b[0] - a[0], b[1] - a[1]);
    let length = dx.hypot(dz);
    let mut by = by.into_iter();
    ends.map(|end| {
        let by = by.next().unwrap_or_default() / length;
        match end {
            Measured::Pixel([u, v]) => Measured::Pixel([u - dz * by, v + dx * by]),
            Measured::Profile([x, z]) => Measured::Profile([x - dz * by, z + dx * by]),
            Measured::Point([x, y, z]) => Measured::Point([x - dz * by, y, z + dx * by]),
        }
    })
}
