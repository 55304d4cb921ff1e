//! Scans over curved seams, cast forward: the curve is a formula, and each reading is its crossing with the laser
//! sheet.
//!
//! A profiler follows the seam with its sheet across it, tilts about a torch beside the sheet, sways across and in range. Nothing
//! here is a spline, and no measurement is inverted. The surfaces beside the seam are formulas too: the sheet cuts them in points, and a straight line through
//! these is the stripe of a plate.

mod cell;
mod kind;
mod scan;
mod sensor_error;
mod stripes;
mod surface;

pub use kind::CurveKind;
pub use scan::CurveScan;
pub use sensor_error::SensorError;
pub use surface::{BesideCurve, Side};

use crate::noise::Noise;
use cell::{Cell, off_place};
use nalgebra::Vector3;
use stripes::Stripes;
use trueline_dataset::{Feature, Measured, Recording, RobotSample, Sensor, SensorSetup, Truth};
use trueline_geometry::{se3, so3};

/// Time between poses, s.
const ROBOT_S: f64 = 0.004;
/// Time between readings, s.
const FRAME_S: f64 = 1.0 / 33.0;
/// The robot is recorded for so long before and after, s.
const MARGIN_S: f64 = 1.3;

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
        let late_ns = (late_s * 1e9).round() as i64;
        recording.features.iter_mut().for_each(|feature| feature.stamp_ns += late_ns);
        recording.stripes.iter_mut().for_each(|stripe| stripe.stamp_ns += late_ns);
        recording
    }
}

/// A scan of a curve with its truth, and points of the curve in base, m. With [`CurveScan::plates`] it has stripes.
#[must_use]
pub fn scan_curve(scan: &CurveScan, seed: u64) -> (Recording, Vec<Vector3<f64>>) {
    recorded(&Cell::drawn(*scan, seed), seed)
}

/// A time of the scan as a stamp.
fn ns(time_s: f64) -> i64 {
    ((time_s + 100.0) * 1e9).round() as i64
}

/// The recording of a cell with noise of a seed, and its curve.
fn recorded(cell: &Cell, seed: u64) -> (Recording, Vec<Vector3<f64>>) {
    let mut noise = Noise::new(seed, 33);
    let mut stripes = Stripes::of(cell, seed);
    let frames = (cell.scan.lasts_s / FRAME_S) as usize;
    let points = (0..=200).map(|k| cell.point(f64::from(k) / 200.0)).collect();
    let setup = SensorSetup { edge_radius_m: Some(0.0), waviness_m: Some(0.0), ..SensorSetup::default() };
    let truth = Some(Truth { parameters: cell.guess, lines: Vec::new() });
    let empty = Recording::new(Sensor::Profiler, setup, robot(cell, seed), Vec::new());
    let mut recording = Recording { truth, ..empty };
    for k in 0..frames {
        let time_s = k as f64 * FRAME_S;
        let stamp_ns = ns(time_s + cell.guess.time_offset_s);
        let view = cell.view(time_s);
        let Some(stripes) = &mut stripes else {
            recording.features.extend(seam_point(cell, view.reading(), &mut noise, stamp_ns));
            continue;
        };
        if let Some((feature, both)) = stripes.frame(&view, stamp_ns) {
            recording.features.push(feature);
            recording.stripes.extend(both);
        }
    }
    (recording, points)
}

/// The robot's poses with their noise.
fn robot(cell: &Cell, seed: u64) -> Vec<RobotSample> {
    let scan = &cell.scan;
    let mut noise = Noise::new(seed, 32);
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
    robot.collect()
}

/// A reading with its noise, or anywhere.
fn seam_point(cell: &Cell, reading: Option<[f64; 2]>, noise: &mut Noise, stamp_ns: i64) -> Option<Feature> {
    let [x, z] = reading?;
    let CurveScan { outliers, noise_m, .. } = cell.scan;
    let sigma_m = if noise.happens(outliers) { 8e-3 } else { noise_m };
    let measured = Measured::Profile([x + noise.normal(sigma_m), z + noise.normal(sigma_m)]);
    Some(Feature { stamp_ns, line: 0, frame: None, device_ns: None, measured, sigma: None, correlation: 0.0 })
}

#[cfg(test)]
mod tests;
