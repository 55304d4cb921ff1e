//! External axes, for the result's file and for people.

use crate::number::with_sigma;
use trueline_dataset::result_file::{AxisEntry, AxisSigma};
use trueline_dataset::unit::MM_PER_M;
use trueline_method::Calibration;
use trueline_method::axes::finding::{AxisFinding, AxisPart};

/// The entry of the result's file.
#[must_use]
pub(crate) fn entry(found: &AxisFinding) -> AxisEntry {
    let sigma = |part| found.sigma(part);
    let shown = |part| sigma(part).is_some();
    AxisEntry {
        name: found.name.clone(),
        kind: found.axis.kind.name().to_owned(),
        carries: found.carries.name().to_owned(),
        direction: shown(AxisPart::Direction).then(|| found.axis.direction.into_inner().into()),
        point_mm: shown(AxisPart::Place).then(|| (found.axis.point_m * MM_PER_M).into()),
        scale: found.axis.scale,
        time_offset_s: shown(AxisPart::TimeOffset).then_some(found.axis.time_offset_s),
        sigma: AxisSigma {
            direction_deg: sigma(AxisPart::Direction).map(f64::to_degrees),
            point_mm: sigma(AxisPart::Place).map(|sigma_m| sigma_m * MM_PER_M),
            scale: found.scale_sigma(),
            time_offset_s: sigma(AxisPart::TimeOffset),
        },
    }
}

/// Names and values of the summary's rows.
#[must_use]
pub(crate) fn rows(c: &Calibration) -> Vec<(String, String)> {
    c.findings.axes.iter().map(|axis| (format!("axis {}", axis.name), text(axis))).collect()
}

fn text(found: &AxisFinding) -> String {
    if !found.moves {
        return "does not move in this scan".to_owned();
    }
    let mut parts = Vec::new();
    let d = found.axis.direction;
    if let Some(sigma) = found.sigma(AxisPart::Direction) {
        let sigma = with_sigma_alone(sigma.to_degrees(), "°");
        parts.push(format!("along ({:.5}, {:.5}, {:.5}) {sigma}", d.x, d.y, d.z));
    }
    if let Some(sigma) = found.sigma(AxisPart::Place) {
        let p = found.axis.point_m * MM_PER_M;
        let sigma = with_sigma_alone(sigma * MM_PER_M, " mm");
        parts.push(format!("through ({:.2}, {:.2}, {:.2}) mm {sigma}", p.x, p.y, p.z));
    }
    const MS_PER_S: f64 = 1e3;
    if let Some(sigma) = found.sigma(AxisPart::TimeOffset) {
        let offset = with_sigma(found.axis.time_offset_s * MS_PER_S, Some(sigma * MS_PER_S), "ms");
        parts.push(format!("stamps {offset} late"));
    }
    if parts.is_empty() { "cannot be determined from this scan".to_owned() } else { parts.join(", ") }
}

fn with_sigma_alone(sigma: f64, unit: &str) -> String {
    format!("± {sigma:.0$}{unit}", crate::number::digits_for(sigma))
}
