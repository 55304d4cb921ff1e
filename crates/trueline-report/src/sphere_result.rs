//! The part of a calibration's result that is of a sphere.

use crate::number::with_sigma;
use crate::pose_result::PoseReport;
use std::fmt::Write;
use trueline_dataset::result_file::{CrossValidation, SensorEntry, SphereEntry};
use trueline_dataset::unit::MM_PER_M;
use trueline_method::SensorMode;
use trueline_sensor::board_hand_eye::hidden;
use trueline_sensor::board_hand_eye::joint::TARGET;
use trueline_sensor::sphere::SphereFit;

/// A sphere as a calibration's target.
pub struct SphereReport<'a> {
    /// What was found.
    pub sphere: &'a SphereFit,
    /// Profiles that were read.
    pub profiles: usize,
    /// How the sensor's own calibration was treated.
    pub mode: SensorMode,
}

impl SphereReport<'_> {
    /// The sphere in the file of a result.
    pub(crate) fn entry(&self, report: &PoseReport<'_>) -> SphereEntry {
        let center = &self.sphere.pose.unknowns.base_from_target.translation.vector;
        let known = report.is_target_known(TARGET + 3, hidden::MOST_SHIFT_M);
        let sigma = |k: usize| report.covariance[(TARGET + 3 + k, TARGET + 3 + k)].max(0.0).sqrt();
        SphereEntry {
            center_mm: [0, 1, 2].map(|k| known.then(|| center[k] * MM_PER_M)),
            sigma_center_mm: [0, 1, 2].map(|k| known.then(|| sigma(k) * MM_PER_M)),
            radius_mm: self.sphere.radius_m * MM_PER_M,
            sigma_radius_mm: self.sphere.radius_sigma_m.map(|m| m * MM_PER_M),
            sigma_circle_mm: [3, 4, 5].map(|k| self.sphere.pose.sigma[k] * MM_PER_M),
            profiles: self.profiles,
            arcs: self.sphere.pose.used.len(),
        }
    }

    /// Each profile held out in turn.
    pub(crate) fn held_out(&self) -> Option<CrossValidation> {
        let held_out = self.sphere.held_out?;
        Some(CrossValidation {
            parts: "profiles".to_owned(),
            rms_mm: held_out.rms_m * MM_PER_M,
            expected_rms_mm: held_out.expected_rms_m * MM_PER_M,
            fitted_rms_mm: held_out.fitted_rms_m * MM_PER_M,
            left_out: Vec::new(),
        })
    }

    /// The sensor's shape, per mm.
    pub(crate) fn sensor(&self) -> SensorEntry {
        let per_mm = |h: &nalgebra::SVector<f64, 5>| [h[0], h[1], h[2], h[3] / MM_PER_M, h[4] / MM_PER_M];
        SensorEntry {
            mode: self.mode.name().to_owned(),
            shape: self.sphere.shape.as_ref().map(|[h, _]| per_mm(h)),
            shape_sigma: self.sphere.shape.as_ref().map(|[_, sigma]| per_mm(sigma)),
            ..SensorEntry::default()
        }
    }

    /// The sphere in a few lines.
    pub(crate) fn write(&self, out: &mut String, report: &PoseReport<'_>) {
        let entry = self.entry(report);
        let frame = if report.beside_robot { "the tool" } else { "base" };
        // Writing to a String cannot fail.
        let _ = writeln!(out, "\n  sphere in {frame}:");
        for (k, axis) in ["x", "y", "z"].into_iter().enumerate() {
            let value = match entry.center_mm[k] {
                Some(center) => with_sigma(center, entry.sigma_center_mm[k], "mm"),
                None => "cannot be determined".to_owned(),
            };
            let _ = writeln!(out, "  {:<18} {value}", format!("centre {axis}"));
        }
        let radius = match entry.sigma_radius_mm {
            Some(sigma) => with_sigma(entry.radius_mm, Some(sigma), "mm"),
            None => format!("{:.3} mm (stated)", entry.radius_mm),
        };
        let [along, depth, of_radius] = entry.sigma_circle_mm;
        let _ = writeln!(
            out,
            "  {:<18} {radius}\n  {:<18} {} of {} profiles with an arc, {} in all\n  {:<18} a circle's centre {along:.3} mm along the stripe \
             and {depth:.3} mm in depth, its radius {of_radius:.3} mm; robot {:.4} mm",
            "radius",
            "used",
            report.used(),
            entry.arcs,
            entry.profiles,
            "noise",
            report.robot_noise_m * MM_PER_M,
        );
        if let Some(held_out) = self.sphere.held_out {
            let _ = writeln!(
                out,
                "  {:<18} {:.3} mm rms; each profile held out {:.3} mm, expected {:.3} mm",
                "residuals",
                held_out.fitted_rms_m * MM_PER_M,
                held_out.rms_m * MM_PER_M,
                held_out.expected_rms_m * MM_PER_M,
            );
        }
    }
}
