//! Errors of a calibration on a scan, as words, JSON and a table of all points.

use serde_json::{Value, json};
use std::fmt::Write;
use trueline_dataset::Feature;
use trueline_dataset::stamp::{exposed_ns, format_seconds};
use trueline_dataset::unit::MM_PER_M;
use trueline_method::evaluate::evaluation::{
    Deviation, Evaluation, Figures, NEEDED_WITHIN, OUTLIER_MEDIANS, ToleranceCheck,
};
use trueline_method::evaluate::other_cell::OtherCell;
use trueline_method::evaluate::reference_curve::ReferenceCurve;
use trueline_method::evaluate::standstill::Stop;

/// Key of the figures without outliers.
const WITHOUT_OUTLIERS: &str = "without_outliers";

/// The rows of every evaluation.
fn rows(e: &Evaluation) -> [(&'static str, &'static str, Figures); 3] {
    let of = |list: &[Deviation]| Figures::of(list.iter().map(|d| d.error_m));
    [
        ("as calibrated", "calibrated", of(&e.calibrated)),
        ("  without outliers", WITHOUT_OUTLIERS, e.without_outliers()),
        ("without time offset", "without_time_offset", of(&e.without_offset)),
    ]
}

/// The rows for people: that without outliers only where there are some.
pub(crate) fn shown_rows(e: &Evaluation) -> impl Iterator<Item = (&'static str, Figures)> {
    let has_outliers = e.outliers() > 0;
    let is_shown = move |key: &str| key != WITHOUT_OUTLIERS || has_outliers;
    rows(e).into_iter().filter(move |(_, key, _)| is_shown(key)).map(|(name, _, f)| (name, f))
}

/// The outliers in words; `None` where there are none.
#[must_use]
pub fn outliers_text(e: &Evaluation) -> Option<String> {
    let (count, of) = (e.outliers(), e.calibrated.len());
    (count > 0).then(|| {
        format!(
            "{count} of {of} points ({:.1} %) are outliers: more than {:.3} mm off, {OUTLIER_MEDIANS} times the median distance. \
             The RMSE, mean and maximum of all points include them.",
            100.0 * count as f64 / of as f64,
            e.outlier_limit_m() * MM_PER_M
        )
    })
}

/// The evaluation in a few lines.
#[must_use]
pub fn text(e: &Evaluation) -> String {
    let mut out = String::new();
    // Writing to a String cannot fail.
    for (k, reference) in e.references.iter().enumerate() {
        let source = match (e.known, reference) {
            (true, _) => "the reference",
            (false, ReferenceCurve::Curve(_)) => "the seam of the calibration",
            (false, _) => "the best fit to the calibrated points",
        };
        let which = if e.references.len() > 1 { format!("seam {k}: ") } else { String::new() };
        let _ = writeln!(out, "{which}distance from {source}, a {}", described(reference));
    }
    let _ = writeln!(
        out,
        "\n  {:<22} {:>7} {:>10} {:>10} {:>10} {:>10}",
        "", "points", "RMSE mm", "mean mm", "median mm", "max mm"
    );
    for (name, f) in shown_rows(e) {
        let _ = writeln!(
            out,
            "  {name:<22} {:>7} {:>10.4} {:>10.4} {:>10.4} {:>10.4}",
            f.count,
            f.rmse_m * MM_PER_M,
            f.mae_m * MM_PER_M,
            f.median_m * MM_PER_M,
            f.max_m * MM_PER_M
        );
    }
    if let Some(outliers) = outliers_text(e) {
        let _ = writeln!(out, "\n  {outliers}");
    }
    if !e.known {
        let _ = writeln!(
            out,
            "\n  A fitted reference cannot show an offset of the whole seam: give --reference or --static for that."
        );
    }
    if e.beyond_ends > 0 {
        let _ = writeln!(out, "\n  {} points beyond the ends of the reference are left out.", e.beyond_ends);
    }
    for (reason, count) in &e.skipped {
        let _ = writeln!(out, "\n  {count} features left out: {reason}");
    }
    out
}

/// Predicted error of the calibration, compared with the points on a known seam; `None` without either. The share of the error along the seam
/// does not show, and the noise of the points does.
#[must_use]
pub fn said_text(e: &Evaluation, said_m: Option<f64>) -> Option<String> {
    let said_m = said_m.filter(|_| e.known)?;
    let found_m = e.without_outliers().rmse_m;
    Some(format!(
        "The calibration predicts ± {:.2} mm for a seam point (robot, edge, sensor and seam included). These \
        points are {:.2} mm off (RMSE without outliers), {:.1} times as much.",
        said_m * MM_PER_M,
        found_m * MM_PER_M,
        found_m / said_m
    ))
}

/// The verdict against a tolerance.
#[must_use]
pub fn tolerance_text(check: &ToleranceCheck) -> String {
    let (judged, percent) = (check.judged(), |part: f64| 100.0 * part);
    let mut said = format!(
        "{}: {} of {judged} points ({:.1} %) are within {} mm, {:.0} % are needed",
        if check.passed() { "Passed" } else { "NOT passed" },
        check.near,
        percent(check.within()),
        check.tolerance_m * MM_PER_M,
        percent(NEEDED_WITHIN),
    );
    // Writing to a String cannot fail.
    if check.lost > 0 {
        let _ = write!(said, "; {} of them could not be placed at all", check.lost);
    }
    if check.beyond_ends > 0 || !check.is_covered() {
        let (all, needed) = (judged + check.beyond_ends, percent(check.needed_coverage));
        let reached = percent(check.coverage());
        let _ = write!(
            said,
            "; the reference reaches {judged} of {all} points ({reached:.1} %), {needed} % are needed"
        );
    }
    if !check.is_covered() {
        said += " (--coverage-percent states another share)";
    }
    said
}

/// Meaning of a calibration that does not belong to a scan.
#[must_use]
pub fn other_cell_text(other: &OtherCell) -> String {
    let said = if other.is_other_cell {
        "This calibration does not belong to this scan"
    } else {
        "warning: this calibration does not match this scan: something has moved since, or one of the two is \
        wrong"
    };
    format!(
        "{said}: a calibration of this scan differs by {:.1} mm and {:.2}° in the hand-eye transform and by \
        {:+.1} ms in the time offset",
        other.shift_m * MM_PER_M,
        other.turn_rad.to_degrees(),
        other.offset_s * 1e3
    )
}

/// The stops of a static scan in a line for each seam.
#[must_use]
pub fn stops_text(stops: &[Stop]) -> String {
    let seams = stops.iter().map(|stop| stop.line + 1).max().unwrap_or(0);
    let of = |seam: u32| {
        let own = || stops.iter().filter(move |stop| stop.line == seam);
        let worst = own().map(|stop| stop.sigma_m).fold(0.0, f64::max) * MM_PER_M;
        format!(
            "seam {seam}: {} stops, each with ± {worst:.4} mm or less from its own scatter\n",
            own().count()
        )
    };
    (0..seams).map(of).collect()
}

/// The stops of a static scan.
#[must_use]
pub fn stops_json(stops: &[Stop]) -> Value {
    let of = |stop: &Stop| {
        let p = stop.point_in_base * MM_PER_M;
        json!({
            "seam": stop.line,
            "point_mm": [p.x, p.y, p.z],
            "images": stop.images,
            "sigma_mm": stop.sigma_m * MM_PER_M,
        })
    };
    stops.iter().map(of).collect()
}

/// A reference in words.
#[must_use]
pub fn described(reference: &ReferenceCurve) -> String {
    match reference {
        ReferenceCurve::Circle(circle) => format!("circle of radius {:.2} mm", circle.radius() * MM_PER_M),
        ReferenceCurve::Curve(curve) => format!("curve through {} points", curve.points().len()),
        other => other.name().to_owned(),
    }
}

/// The evaluation as JSON, with the verdict against a tolerance and the evidence that the calibration belongs to another cell.
#[must_use]
pub fn json(e: &Evaluation, check: Option<&ToleranceCheck>, other: Option<&OtherCell>) -> Value {
    let figures: serde_json::Map<String, Value> =
        rows(e).into_iter().map(|(_, key, f)| (key.to_owned(), figures(&f))).collect();
    json!({
        "tool": { "name": "trueline", "version": env!("CARGO_PKG_VERSION") },
        "reference": {
            "known": e.known,
            "seams": e.references.iter().map(reference).collect::<Vec<_>>(),
        },
        "figures": figures,
        "tolerance": check.map(|check| json!({
            "tolerance_mm": check.tolerance_m * MM_PER_M,
            "share_within": check.within(),
            "points": { "near": check.near, "far": check.far, "lost": check.lost, "beyond_ends": check.beyond_ends },
            "share_covered": check.coverage(),
            "share_covered_needed": check.needed_coverage,
            "passed": check.passed(),
        })),
        "differs": other.map(apart),
        "other_cell": other.filter(|other| other.is_other_cell).map(apart),
        "outliers": { "points": e.outliers(), "beyond_mm": e.outlier_limit_m() * MM_PER_M },
        "beyond_ends": e.beyond_ends,
        "skipped": e.skipped.iter().map(|(why, count)| (why.code().to_owned(), json!(count))).collect::<serde_json::Map<_, _>>(),
    })
}

/// Distance of this calibration from the scan's own.
fn apart(other: &OtherCell) -> Value {
    json!({
        "shift_mm": other.shift_m * MM_PER_M,
        "turn_deg": other.turn_rad.to_degrees(),
        "time_offset_s": other.offset_s,
    })
}

/// Figures as JSON, in mm.
#[must_use]
pub fn figures(f: &Figures) -> Value {
    json!({
        "points": f.count,
        "rmse_mm": f.rmse_m * MM_PER_M,
        "mae_mm": f.mae_m * MM_PER_M,
        "median_mm": f.median_m * MM_PER_M,
        "max_mm": f.max_m * MM_PER_M,
        "bias_mm": [f.bias_m.x * MM_PER_M, f.bias_m.y * MM_PER_M, f.bias_m.z * MM_PER_M],
    })
}

fn reference(curve: &ReferenceCurve) -> Value {
    let mm = |v: &nalgebra::Vector3<f64>| [v.x * MM_PER_M, v.y * MM_PER_M, v.z * MM_PER_M];
    let unit = |v: nalgebra::Vector3<f64>| [v.x, v.y, v.z];
    match curve {
        ReferenceCurve::Line(line) => {
            json!({ "form": "line", "point_mm": mm(line.anchor()), "direction": unit(line.direction()) })
        }
        ReferenceCurve::Circle(circle) => json!({
            "form": "circle",
            "centre_mm": mm(circle.centre()),
            "axis": unit(circle.axis().into_inner()),
            "radius_mm": circle.radius() * MM_PER_M,
        }),
        ReferenceCurve::Curve(curve) => json!({ "form": "curve", "points": curve.points().len() }),
        ReferenceCurve::Plane(plane) => json!({
            "form": "plane",
            "normal": unit(plane.normal().into_inner()),
            "offset_mm": plane.offset() * MM_PER_M,
        }),
    }
}

/// Every point with its error, as CSV; its time is that of its exposure by the robot's clock, as where a calibration is applied.
#[must_use]
pub fn points_csv(e: &Evaluation, features: &[Feature], time_offset_s: f64) -> String {
    let mut out =
        String::from("row,line,time_s,x_mm,y_mm,z_mm,error_x_mm,error_y_mm,error_z_mm,distance_mm\n");
    for d in &e.calibrated {
        let (p, error) = (d.measured.point_in_base * MM_PER_M, d.error_m * MM_PER_M);
        let _ = writeln!(
            out,
            "{},{},{},{},{},{},{},{},{},{}",
            d.measured.row,
            d.measured.line,
            format_seconds(exposed_ns(features[d.measured.row as usize].stamp_ns, time_offset_s)),
            p.x,
            p.y,
            p.z,
            error.x,
            error.y,
            error.z,
            error.norm()
        );
    }
    out
}
