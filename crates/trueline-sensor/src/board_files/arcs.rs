//! The arcs of a round target in the profiles, or the points, of a recording.

use crate::error::Error;
use crate::round::cut::share_noise;
use crate::round::problem::FEWEST;
use crate::round::sheet_frame::SheetFrame;
use crate::round::{Cut, RoundTarget, arc};
use nalgebra::{Vector2, Vector3};
use trueline_dataset::{Measured, Profile, Recording, Sensor};
use trueline_geometry::fit;
use trueline_model::{LaserSheet, SheetShape};

/// Profiles with an arc.
pub(super) struct Arcs {
    pub(super) stamps_ns: Vec<i64>,
    pub(super) cuts: Vec<Cut>,
    pub(super) sheet: SheetFrame,
    /// Profiles in all.
    pub(super) profiles: usize,
}

impl Arcs {
    /// Of whole profiles, or else of the points of a recording.
    pub(super) fn of(
        recording: &Recording,
        profiles: &[Profile],
        target: RoundTarget,
        radius_m: Option<f64>,
    ) -> Result<Self, Error> {
        let (sheet, stamped) = if profiles.is_empty() {
            points_of_features(recording, target)?
        } else {
            let of = |profile: &Profile| {
                (profile.stamp_ns, profile.points.iter().map(|p| Vector2::new(p.x_m, p.z_m)).collect())
            };
            (LaserSheet::of_profiler(), profiles.iter().map(of).collect())
        };
        let corrected = |point: &Vector2<f64>| match &recording.setup.shape {
            Some(shape) => shape.corrected(point).0,
            None => *point,
        };
        let arcs: Vec<(i64, Vec<Vector2<f64>>)> = stamped
            .iter()
            .filter_map(|(stamp_ns, points)| {
                let points: Vec<Vector2<f64>> = points.iter().map(corrected).collect();
                Some((*stamp_ns, arc::arc(&points, target, radius_m)?))
            })
            .collect();
        if arcs.len() < FEWEST {
            let (found, profiles) = (arcs.len(), stamped.len());
            return Err(Error::TooFewArcs { target: target.row().name, found, profiles, needed: FEWEST });
        }
        let all = || arcs.iter().flat_map(|(_, points)| points);
        let middle = all().sum::<Vector2<f64>>() / all().count() as f64;
        let shape = SheetShape::exact_about(&middle);
        let cuts =
            arcs.iter().filter_map(|(stamp_ns, points)| Some((*stamp_ns, Cut::of(target, points, &shape)?)));
        let (stamps_ns, mut cuts): (Vec<i64>, Vec<Cut>) = cuts.unzip();
        share_noise(&mut cuts);
        Ok(Self { stamps_ns, cuts, sheet: SheetFrame::of(&sheet), profiles: stamped.len() })
    }
}

/// Points of one stamp each, in the sheet's coordinates, m.
type Stamped = Vec<(i64, Vec<Vector2<f64>>)>;

/// The sheet and the points of a recording whose readings are points of a target, several of each stamp.
fn points_of_features(recording: &Recording, target: RoundTarget) -> Result<(LaserSheet, Stamped), Error> {
    let points: Vec<(i64, Vector3<f64>)> = recording
        .features
        .iter()
        .filter_map(|feature| match feature.measured {
            Measured::Point(point) => Some((feature.stamp_ns, Vector3::from(point))),
            _ => None,
        })
        .collect();
    let stated = match &recording.sensor {
        Sensor::Points { laser_plane_in_camera } => *laser_plane_in_camera,
        _ => None,
    };
    let all: Vec<Vector3<f64>> = points.iter().map(|(_, point)| *point).collect();
    let plane = stated.or_else(|| Some(fit::plane(&all)?.plane));
    let no_points =
        Error::TooFewArcs { target: target.row().name, found: 0, profiles: points.len(), needed: FEWEST };
    let sheet = LaserSheet::from_plane(plane.ok_or(no_points)?);
    let mut stamped: Stamped = Vec::new();
    for (stamp_ns, point) in points {
        let at = sheet.coordinates(&point);
        match stamped.last_mut() {
            Some((last, points)) if *last == stamp_ns => points.push(at),
            _ => stamped.push((stamp_ns, vec![at])),
        }
    }
    Ok((sheet, stamped))
}
