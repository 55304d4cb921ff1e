//! Inputs of a curve's estimate: seam points in the laser plane, and the robot's motion.

use crate::curve::motion::Motion;
use crate::curve::rows::{ROWS, Rows};
use crate::input::noise_levels::NoiseLevels;
use crate::input::observations::Observations;
use nalgebra::{Vector2, Vector3};
use trueline_model::{LaserSheet, SheetShape};

/// A measured seam point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Reading {
    /// Stamp of its image, s.
    pub stamp_s: f64,
    /// In the camera frame, m.
    pub point: Vector3<f64>,
    /// In the sheet, m.
    pub in_sheet: Vector2<f64>,
    /// Covariance in the sheet, m²: xx, xy, yy.
    pub covariance: [f64; 3],
    /// Row of the feature in the recording, from 0.
    pub row: u32,
    /// Label of the line.
    pub line: u32,
    /// Estimated errors that are taken out of each row, m.
    pub off_m: Rows,
    /// The part of its light that is used.
    pub light: Light,
}

/// The part of a reading's light that is used. The seam point comes from the same light as the support points.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Light {
    /// The seam point.
    Point,
    /// The support points of the stripes: two on the first plate, two on the second.
    Supports([SupportPoint; ROWS]),
    /// Nothing.
    Unused,
}

impl Reading {
    /// Its support points, if these are used.
    #[must_use]
    pub(crate) fn supports(&self) -> Option<&[SupportPoint; ROWS]> {
        match &self.light {
            Light::Supports(supports) => Some(supports),
            Light::Point | Light::Unused => None,
        }
    }

    /// The same, to change them.
    pub(crate) fn supports_mut(&mut self) -> &mut [SupportPoint] {
        match &mut self.light {
            Light::Supports(supports) => supports,
            Light::Point | Light::Unused => &mut [],
        }
    }
}

/// A support point of a stripe: its distance from the stripe, measured square to it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SupportPoint {
    /// In the camera frame, m.
    pub point: Vector3<f64>,
    /// In the sheet, m.
    pub in_sheet: Vector2<f64>,
    /// Variance square to the stripe, m².
    pub variance: f64,
}

/// All readings of a scan.
#[derive(Clone, Debug)]
pub(crate) struct Readings {
    /// By increasing stamp.
    pub list: Vec<Reading>,
    /// The robot.
    pub motion: Motion,
    /// The laser sheet.
    pub sheet: LaserSheet,
    /// Noise shared by all readings.
    pub noise: NoiseLevels,
}

impl Readings {
    /// Of the observations of a scan.
    #[must_use]
    pub(crate) fn of(observations: &Observations, noise: NoiseLevels) -> Self {
        let list = observations.list.iter().map(|o| Reading {
            stamp_s: o.stamp_s,
            point: o.point_in_camera,
            in_sheet: observations.sheet.coordinates(&o.point_in_camera),
            covariance: o.covariance,
            row: o.row,
            line: o.line,
            off_m: Rows::zeros(),
            light: Light::Point,
        });
        Self {
            list: list.collect(),
            motion: Motion::new(&observations.robot.trajectory),
            sheet: observations.sheet,
            noise: NoiseLevels { factor: 1.0, ..noise },
        }
    }

    /// Labels of the observed lines, in increasing order.
    #[must_use]
    pub(crate) fn labels(&self) -> Vec<u32> {
        let mut labels: Vec<u32> = self.list.iter().map(|reading| reading.line).collect();
        labels.sort_unstable();
        labels.dedup();
        labels
    }

    /// The readings of a line, by index.
    pub(crate) fn of_line(&self, label: u32) -> impl Iterator<Item = usize> {
        self.list.iter().enumerate().filter(move |(_, reading)| reading.line == label).map(|(k, _)| k)
    }

    /// The same for a sheet with a shape.
    #[must_use]
    pub(crate) fn corrected(&self, shape: &SheetShape) -> Self {
        let mut corrected = self.clone();
        let moved = |point: &mut Vector3<f64>, in_sheet: &mut Vector2<f64>| {
            let there = shape.corrected(in_sheet).0;
            *point += self.sheet.axes() * (there - *in_sheet);
            *in_sheet = there;
        };
        for reading in &mut corrected.list {
            moved(&mut reading.point, &mut reading.in_sheet);
            for support in reading.supports_mut() {
                moved(&mut support.point, &mut support.in_sheet);
            }
        }
        corrected
    }

    /// Duration of the scan, s.
    #[must_use]
    pub(crate) fn lasts_s(&self) -> f64 {
        match (self.list.first(), self.list.last()) {
            (Some(first), Some(last)) => last.stamp_s - first.stamp_s,
            _ => 0.0,
        }
    }
}
