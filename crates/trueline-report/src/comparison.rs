//! Two calibrations compared, as JSON and in words.

use crate::number::with_sigma;
use nalgebra::{SMatrix, Vector3};
use serde_json::{Value, json};
use trueline_dataset::Guess;
use trueline_dataset::KnownCalibration;
use trueline_dataset::result_file::ResultFile;
use trueline_dataset::unit::MM_PER_M;
use trueline_method::evaluate::difference::{ANSWERS, Difference, Estimate, Field, MOVED_Z};
use trueline_method::problem::parameters::{ROTATION, TIME_OFFSET, TRANSLATION};

/// Entries of a result's covariance, in the order of [`Estimate`], and how many of their units are one in SI.
const ENTRIES: [(&str, f64); ANSWERS] = [
    ("time_offset_s", 1.0),
    ("rotation_x_rad", 1.0),
    ("rotation_y_rad", 1.0),
    ("rotation_z_rad", 1.0),
    ("translation_x_mm", MM_PER_M),
    ("translation_y_mm", MM_PER_M),
    ("translation_z_mm", MM_PER_M),
];

/// The seven numbers of a result and their covariance in SI.
///
/// # Errors
/// The row and the column of an entry that the result does not have.
pub fn estimate(parameters: Guess, result: &ResultFile) -> Result<Estimate, [&'static str; 2]> {
    let mut covariance = SMatrix::<f64, ANSWERS, ANSWERS>::zeros();
    for (i, (row, per_row)) in ENTRIES.into_iter().enumerate() {
        for (j, (column, per_column)) in ENTRIES.into_iter().enumerate() {
            let entry = result.covariance.entry(row, column).ok_or([row, column])?;
            covariance[(i, j)] = entry / per_row / per_column;
        }
    }
    Ok(Estimate { parameters, covariance })
}

/// Remark if two results belong to different sensor files: the same bracket has another transform with another file.
#[must_use]
pub fn other_file([first, second]: [&KnownCalibration; 2]) -> Option<&'static str> {
    first.is_of_another_file(second).then_some(
        "warning: the two results belong to different sensor files, so the difference may come from the \
         files and not from the bracket. Calibrate both scans with one sensor file.",
    )
}

/// The difference; second minus first. With a tolerance, whether the seam has moved less than that.
#[must_use]
pub fn json(difference: &Difference, field: &Field, tolerance_m: Option<f64>) -> Value {
    let d = difference;
    let three = |vector: Vector3<f64>, scale: f64| [vector.x, vector.y, vector.z].map(|x| x * scale);
    let sigma = |first: usize, scale: f64| three(d.sigma.fixed_rows::<3>(first).into_owned(), scale);
    let degrees = 1f64.to_degrees();
    let parts = [("timing", d.timing_moved()), ("bracket", d.bracket_moved())];
    json!({
        "verdict": if d.moved() { "moved" } else { "same" },
        "moved": parts.iter().filter(|(_, moved)| *moved).map(|(name, _)| *name).collect::<Vec<_>>(),
        "seam_shift_rms_mm": d.seam_shift_rms_m * MM_PER_M,
        "seam_shift_largest_mm": d.seam_shift_largest_m * MM_PER_M,
        "seam_shift_sigma_mm": d.seam_shift_sigma_m * MM_PER_M,
        "tolerance_mm": tolerance_m.map(|m| m * MM_PER_M),
        "within_tolerance": tolerance_m.map(|m| d.seam_shift_rms_m <= m),
        "z": d.z,
        "z_limit": MOVED_Z,
        "chance": d.chance(),
        "time_offset_ms": { "change": d.time_offset_s * 1e3, "sigma": d.sigma[TIME_OFFSET] * 1e3, "z": d.z_time },
        "hand_eye": {
            "rotation_deg": { "change": three(d.rotation_rad, degrees), "sigma": sigma(ROTATION, degrees) },
            "translation_mm": { "change": three(d.translation_m, MM_PER_M), "sigma": sigma(TRANSLATION, MM_PER_M) },
            "z": d.z_hand_eye,
        },
        "field": {
            "width_mm": field.width_m * MM_PER_M,
            "depth_mm": field.depth_m * MM_PER_M,
            "stand_off_mm": field.stand_off_m * MM_PER_M,
        },
        "speed_mm_s": field.speed_m_s * MM_PER_M,
    })
}

/// Probability of a larger difference by chance alone, in words.
fn chance(difference: &Difference) -> String {
    match 100.0 * difference.chance() {
        percent if percent > 99.0 => "in more than 99 of 100 comparisons".to_owned(),
        percent if percent < 1.0 => "in less than 1 of 100 comparisons".to_owned(),
        percent => format!("in {percent:.0} of 100 comparisons"),
    }
}

/// The same in words.
#[must_use]
pub fn text(difference: &Difference, field: &Field) -> String {
    let d = difference;
    let mm = |m: f64| format!("{:.3} mm", m * MM_PER_M);
    let what = match (d.timing_moved(), d.bracket_moved()) {
        (true, true) => " (timing and bracket)",
        (true, false) => " (timing)",
        (false, true) => " (bracket)",
        (false, false) => "",
    };
    let verdict = if d.moved() {
        format!("Moved by {}{what}: {:.1} σ (threshold {MOVED_Z} σ, 1 in 1000)", mm(d.seam_shift_rms_m), d.z)
    } else {
        format!("The same: noise alone causes a larger difference {} (threshold 1 in 1000)", chance(d))
    };
    let axes = |change: &Vector3<f64>, first: usize, scale: f64, unit: &str| {
        let axis = |k: usize| with_sigma(change[k] * scale, Some(d.sigma[first + k] * scale), unit);
        format!("x {}, y {}, z {}", axis(0), axis(1), axis(2))
    };
    format!(
        "{verdict}\n\n  seam point   {} RMS, {} at most; by noise {} RMS\n  where        {:.0} × {:.0} mm \
         about {:.0} mm from the sensor, at {:.0} mm/s\n  time offset  {}\n  rotation     {}\n  translation  \
         {}",
        mm(d.seam_shift_rms_m),
        mm(d.seam_shift_largest_m),
        mm(d.seam_shift_sigma_m),
        field.width_m * MM_PER_M,
        field.depth_m * MM_PER_M,
        field.stand_off_m * MM_PER_M,
        field.speed_m_s * MM_PER_M,
        with_sigma(d.time_offset_s * 1e3, Some(d.sigma[TIME_OFFSET] * 1e3), "ms"),
        axes(&d.rotation_rad, ROTATION, 1f64.to_degrees(), "°"),
        axes(&d.translation_m, TRANSLATION, MM_PER_M, "mm"),
    )
}
