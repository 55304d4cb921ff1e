//! A scan with axes: a start without a guess, then repeated calibrations until the axes converge.

use crate::axes::finding::{AxisFinding, AxisPart, are_parallel};
use crate::axes::scan::{AxisScan, most_read, runs_evenly};
use crate::axes::start;
use crate::calibration::Calibration;
use crate::config::{Config, Measurements, ResidualKind};
use crate::error::{AxisMistake, Error};
use crate::input::axis_chain::AxisChain;
use nalgebra::{UnitVector3, Vector3};
use trueline_dataset::{AxisRecord, Carries, Recording};
use trueline_geometry::{Axis, AxisKind, Line, Pose};

/// Maximum number of calibrations.
const ROUNDS: usize = 8;
/// A step of less than this part of the standard deviations counts as zero.
const SMALL: f64 = 0.1;
/// Mean loss at a scale of 1 mm above which the start explains too few readings.
const UNEXPLAINED: f64 = 0.75;
/// Mean loss at a scale of 1 mm below which nearly all readings are explained.
const EXPLAINED: f64 = 0.2;
/// A larger mean loss may come from a mistake: a third of outliers gives less.
const DOUBTFUL: f64 = 0.4;

/// Calibrates a recording with axes by the calibration of one with known axes.
///
/// # Errors
/// As `calibrate`; a scan with axes that no place of them explains; unsupported options.
pub(crate) fn calibrated(
    recording: &Recording,
    config: &Config,
    calibrate: &dyn Fn(&Recording, &Config) -> Result<Calibration, Error>,
) -> Result<Calibration, Error> {
    check_options(config)?;
    // External axes support seam points only, not whole stripes.
    let seam_points = Config { measurements: Measurements::Seam, ..config.clone() };
    let calibrate = &|placed: &Recording| calibrate(placed, &seam_points);
    let placed = Recording { axes: started(recording, config)?, ..recording.clone() };
    let best = converged(placed, calibrate)?;
    let Some(other) = mirrored(recording, &best) else { return Ok(best) };
    let other = converged(other, calibrate)?;
    Ok(if other.findings.fit.noise_factor < best.findings.fit.noise_factor { other } else { best })
}

/// The calibration with converged axes.
fn converged(
    mut placed: Recording,
    calibrate: &dyn Fn(&Recording) -> Result<Calibration, Error>,
) -> Result<Calibration, Error> {
    let mut best = calibrate(&placed)?;
    for _ in 1..ROUNDS {
        let axes = &best.findings.axes;
        if axes.iter().all(|axis| axis.step_sigmas < SMALL) {
            break;
        }
        let at = &best.findings.unknowns.parameters;
        let places =
            Places { seam: at.lines.first().map(|line| *line.anchor()), camera: at.tool_from_camera };
        for (record, found) in placed.axes.iter_mut().zip(axes).filter(|(_, found)| found.moves) {
            record.known = Some(places.nearest(&found.axis, record.carries));
        }
        best = calibrate(&placed)?;
    }
    // A hidden time offset is set to zero, here as wherever the result is used: the lines' places depend on it.
    let hidden = |(record, found): (&AxisRecord, &AxisFinding)| {
        let is_asked = found.moves && found.has(AxisPart::TimeOffset) && !record.holds_time_offset;
        is_asked && found.sigma(AxisPart::TimeOffset).is_none()
    };
    let hidden: Vec<bool> = placed.axes.iter().zip(&best.findings.axes).map(hidden).collect();
    if !hidden.contains(&true) {
        return Ok(best);
    }
    let all = placed.axes.iter_mut().zip(&best.findings.axes).zip(hidden);
    for ((record, found), _) in all.filter(|(_, is_hidden)| *is_hidden) {
        record.known = Some(Axis { time_offset_s: 0.0, ..found.axis });
        record.holds_time_offset = true;
    }
    calibrate(&placed)
}

/// A linear axis that goes the other way along the first seam moves no point of it otherwise. If a scan has seams in other
/// directions, these decide. The start uses one of them, and does not decide.
fn mirrored(recording: &Recording, best: &Calibration) -> Option<Recording> {
    let lines = &best.findings.unknowns.parameters.lines;
    let along = mirror(recording, lines)?;
    if best.reasons().is_empty() {
        return None;
    }
    let mut other = recording.clone();
    let mut is_other = false;
    for (record, found) in other.axes.iter_mut().zip(&best.findings.axes) {
        if !found.moves {
            continue;
        }
        let mut axis = found.axis;
        if axis.kind == AxisKind::Linear && record.carries != Carries::Sensor {
            axis.direction = other_way(&axis.direction, &along);
            is_other = true;
        }
        record.known = Some(axis);
    }
    is_other.then_some(other)
}

/// The direction along which a start may have found a linear axis the wrong way: that of the seam which it used. `None` of seams in one direction,
/// which decide nothing.
fn mirror(recording: &Recording, lines: &[Line]) -> Option<Vector3<f64>> {
    let used = lines.get(most_read(recording)? as usize)?;
    (!are_parallel(lines)).then(|| used.direction())
}

/// The direction of a linear axis mirrored along a seam. Points move across the seam as before.
fn other_way(direction: &UnitVector3<f64>, along: &Vector3<f64>) -> UnitVector3<f64> {
    let d = direction.as_ref();
    UnitVector3::new_normalize(d - along * (2.0 * along.dot(d)))
}

/// Best known place of an axis.
struct Places {
    /// A point of the seam, in base.
    seam: Option<Vector3<f64>>,
    /// The sensor, in the tool.
    camera: Pose,
}

impl Places {
    /// The same axis by its point nearest to its load.
    fn nearest(&self, axis: &Axis, carries: Carries) -> Axis {
        let place = match carries {
            Carries::Sensor => Some(self.camera.translation.vector),
            Carries::Part | Carries::Robot => self.seam,
        };
        let along =
            |place: Vector3<f64>| axis.direction.as_ref() * axis.direction.dot(&(place - axis.point_m));
        let point_m = match axis.kind {
            AxisKind::Rotary => axis.point_m + place.map_or_else(Vector3::zeros, along),
            AxisKind::Linear => Vector3::zeros(),
        };
        Axis { point_m, ..*axis }
    }
}

fn check_options(config: &Config) -> Result<(), Error> {
    let why = if config.residual == ResidualKind::PointToLine {
        "by the point-to-line residual; use `--residual sheet`"
    } else if config.measurements != Measurements::Auto && config.measurements != Measurements::Seam {
        "by whole stripes; use `--use seam`"
    } else if config.asks_for_curve() {
        "beside a curve; scan a straight seam on it"
    } else {
        return Ok(());
    };
    Err(Error::AxesNotThere { why })
}

/// The axes, found without a guess.
fn started(recording: &Recording, config: &Config) -> Result<Vec<AxisRecord>, Error> {
    let mut axes = recording.axes.clone();
    let moves = recording.axes_that_move();
    // An axis that stands during the whole scan is not determined, and left out.
    for (axis, moves) in axes.iter_mut().zip(&moves) {
        axis.holds_time_offset |= recording.at_stops || runs_evenly(axis, recording);
        axis.known = axis.known.or_else(|| Some(stated(axis))).filter(|_| *moves);
    }
    let is_placed = |axis: &AxisRecord| {
        axis.guess.is_some_and(|guess| guess.point_m.is_some() || axis.kind == AxisKind::Linear)
    };
    let open: Vec<usize> = (0..axes.len()).filter(|k| moves[*k] && !is_placed(&axes[*k])).collect();
    let sought = match open[..] {
        [] => (0..axes.len()).find(|k| moves[*k]),
        [sought] => Some(sought),
        _ => {
            let names = open.iter().map(|k| axes[*k].name.clone()).collect::<Vec<_>>().join(", ");
            return Err(Error::AxesNeedGuess { names });
        }
    };
    let Some(sought) = sought else { return Ok(axes) };
    let of_known = Recording { axes: axes.clone(), ..recording.clone() };
    let Some(chain) = AxisChain::of(&of_known)? else { return Ok(axes) };
    let scan = AxisScan::of(recording, chain, config)?;
    let found = start::from_nothing(&scan, sought, config.offset_search_s, config.threads);
    let name = || axes[sought].name.clone();
    let Some(found) = found.filter(|found| found.loss < UNEXPLAINED) else {
        return Err(Error::AxisNotFound { name: name(), instead: mistaken(&scan, sought, config) });
    };
    if found.loss > DOUBTFUL
        && let Some(instead) = mistaken(&scan, sought, config)
    {
        return Err(Error::AxisNotFound { name: name(), instead: Some(instead) });
    }
    let places = Places { seam: Some(*found.state.line.anchor()), camera: found.state.tool_from_camera };
    for ((axis, link), _) in
        axes.iter_mut().zip(&found.state.chain.links).zip(&moves).filter(|(_, moves)| **moves)
    {
        axis.known = Some(places.nearest(&link.axis, axis.carries));
    }
    Ok(axes)
}

/// The mistake that explains the scan: another body that the axis carries, or another unit.
fn mistaken(scan: &AxisScan, sought: usize, config: &Config) -> Option<AxisMistake> {
    let carries = [Carries::Part, Carries::Robot, Carries::Sensor].map(AxisMistake::Carries);
    let mistakes = carries.into_iter().chain([AxisMistake::ValuesInRadians, AxisMistake::ValuesInDegrees]);
    let own = scan.chain.links[sought].carries;
    mistakes.filter(|mistake| *mistake != AxisMistake::Carries(own)).find(|mistake| {
        let mut scan = scan.with_chain(scan.chain.clone());
        let link = &mut scan.chain.links[sought];
        match mistake {
            AxisMistake::Carries(other) => link.carries = *other,
            AxisMistake::ValuesInRadians => link.axis.scale *= 1f64.to_degrees(),
            AxisMistake::ValuesInDegrees => link.axis.scale *= 1f64.to_radians(),
        }
        let found = start::from_nothing(&scan, sought, config.offset_search_s, config.threads);
        found.is_some_and(|found| found.loss < EXPLAINED)
    })
}

/// Stated place of an axis, or anywhere.
fn stated(axis: &AxisRecord) -> Axis {
    let direction = axis.guess.map_or(UnitVector3::new_unchecked(Vector3::z()), |guess| guess.direction);
    let point_m = axis.guess.and_then(|guess| guess.point_m).unwrap_or_else(Vector3::zeros);
    Axis::new(axis.kind, direction, point_m)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;
    use trueline_sim::{Preset, simulate};

    /// The start uses the seam with the most readings: about another one the mirror image of a track is no solution.
    #[test]
    fn a_track_is_mirrored_about_the_seam_that_the_start_used() {
        let mut recording = simulate(&Preset::Quick.scenario(), 1).unwrap();
        let line =
            |direction: Vector3<f64>| Line::new(Vector3::zeros(), &UnitVector3::new_normalize(direction));
        let lines = [line(Vector3::x()), line(Vector3::y()), line(Vector3::new(1.0, 1.0, 0.0))];
        for used in 0..3 {
            for (k, feature) in recording.features.iter_mut().enumerate() {
                // Half of the readings are of one seam, a quarter of each other one.
                feature.line = (if k % 2 == 0 { used } else { used + 1 + (k as u32 / 2) % 2 }) % 3;
            }
            let along = mirror(&recording, &lines).unwrap();
            assert!((along - lines[used as usize].direction()).norm() < 1e-12, "{used}: {along}");
        }
        assert!(mirror(&recording, &[lines[0]; 3]).is_none());
    }

    /// Across the seam it moves as before, and along it the other way: a wrong sign here leaves a track on its wrong side.
    #[test]
    fn the_other_way_along_a_seam_is_the_same_across_it() {
        let along = Vector3::new(0.6, 0.0, 0.8);
        let direction = UnitVector3::new_normalize(Vector3::new(0.3, -0.7, 0.5));
        let other = other_way(&direction, &along);
        assert!((other.dot(&along) + direction.dot(&along)).abs() < 1e-15);
        assert!((other.cross(&along) - direction.cross(&along)).norm() < 1e-15);
        assert!((other_way(&other, &along).into_inner() - direction.into_inner()).norm() < 1e-15);
    }
}
