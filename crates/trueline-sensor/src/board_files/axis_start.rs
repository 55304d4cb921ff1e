//! Where the fit of a cylinder starts: its axis is a straight seam, which the method for seams finds from nothing.
//!
//! The seam's points are where the axis pierces the sheet, taken as one radius below the middle of the arc. Where the sheet cuts the cylinder
//! askew that is a few millimetres off; the fit to the arcs has no such error.

use super::arcs::Arcs;
use super::pose_scan::SightingOptions;
use crate::board_hand_eye::unknowns::Unknowns;
use crate::round::{Cut, RoundState};
use nalgebra::{SVector, UnitQuaternion, Vector2, Vector3};
use std::f64::consts::PI;
use trueline_dataset::{Feature, Measured, Recording, Sensor};
use trueline_geometry::statistics::median;
use trueline_geometry::{Line, Plane, se3};
use trueline_method::input::noise_levels::NoiseLevels;
use trueline_method::input::observations::{observe, origin_ns};
use trueline_method::input::timestamps::Sampling;
use trueline_method::solve::start::{self, Breadth};
use trueline_method::{Config, Error, Hold, Parameters, Stamps};

/// A point of the seam is off by about this, m.
const OFF_M: f64 = 1e-3;

/// Starts, the likeliest first: that of the seam, and the one in which the sheet leans to the other side.
pub(super) fn starts(
    scan: &Recording,
    arcs: &Arcs,
    radius_m: Option<f64>,
    options: &SightingOptions,
    at_stops: bool,
) -> Result<Vec<RoundState>, Error> {
    let circles = median(arcs.cuts.iter().map(|cut| cut.circle.radius_m));
    let radius_m = radius_m.or(circles).unwrap_or_default();
    let seam = seam(scan, arcs, radius_m);
    let usual = Config { feature_sigma_m: Some(OFF_M), ..Config::default() };
    let config = if at_stops {
        Config { at_stops, hold: vec![Hold::TimeOffset], stamps: Stamps::Raw, offset_search_s: 0.0, ..usual }
    } else {
        let offset_search_s = options.offset_within_s.unwrap_or(usual.offset_search_s);
        Config { offset_search_s, ..usual }
    };
    let sampling = Sampling::of(&seam, origin_ns(&seam));
    let observations = observe(&seam, &sampling, &config)?;
    let found = match &options.guess {
        Some(guess) => start::from_guess(&observations, guess)?,
        None => {
            let breadth = if at_stops { Breadth::STOPS } else { Breadth::WIDE };
            let noise = NoiseLevels { robot_sigma_m: 0.0, stamp_sigma_s: 0.0, factor: 1.0 };
            start::from_nothing(&observations, &config, &noise, breadth)?
        }
    };
    let is_free = options.guess.is_none();
    let other = start::mirrored(&observations, &observations.list, &found).filter(|_| is_free);
    Ok([Some(found), other].into_iter().flatten().filter_map(|at| state(&at, radius_m)).collect())
}

/// The recording of the axis as a seam.
fn seam(scan: &Recording, arcs: &Arcs, radius_m: f64) -> Recording {
    let sheet = &arcs.sheet;
    let normal = sheet.axes().column(2).into_owned();
    let plane = Plane::new(normal, normal.dot(sheet.origin_m()));
    let feature = |(stamp_ns, cut): (&i64, &Cut)| Feature {
        stamp_ns: *stamp_ns,
        line: 0,
        frame: None,
        device_ns: None,
        measured: Measured::Point(in_camera(arcs, &pierced(cut, radius_m)).into()),
        sigma: None,
        correlation: 0.0,
    };
    let mut seam = scan.clone();
    seam.sensor = Sensor::Points { laser_plane_in_camera: plane };
    seam.setup.shape = None;
    seam.features = arcs.stamps_ns.iter().zip(&arcs.cuts).map(feature).collect();
    seam
}

/// Where the axis pierces the sheet, m: a radius below the middle of the arc.
fn pierced(cut: &Cut, radius_m: f64) -> Vector2<f64> {
    let center = cut.circle.center_m;
    center + (cut.middle_m() - center).normalize() * (cut.circle.radius_m - radius_m)
}

fn in_camera(arcs: &Arcs, point: &Vector2<f64>) -> Vector3<f64> {
    arcs.sheet.origin_m() + arcs.sheet.axes() * Vector3::new(point.x, point.y, 0.0)
}

/// A start from time offset, hand-eye transform and axis.
fn state(at: &Parameters, radius_m: f64) -> Option<RoundState> {
    let line: &Line = at.lines.first()?;
    let direction = line.direction();
    let upright = UnitQuaternion::rotation_between(&Vector3::y(), &direction);
    let rotation = upright.unwrap_or_else(|| UnitQuaternion::from_axis_angle(&Vector3::x_axis(), PI));
    Some(RoundState {
        unknowns: Unknowns {
            time_offset_s: at.time_offset_s,
            tool_from_camera: at.tool_from_camera,
            base_from_target: se3::from_parts(rotation, *line.anchor()),
        },
        radius_m,
        shape: SVector::zeros(),
    })
}
