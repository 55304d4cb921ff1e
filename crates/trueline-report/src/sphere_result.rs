//! The part of a calibration's result that is of a sphere.

use crate::number::with_sigma;
use std::fmt::Write;
use trueline_dataset::result_file::{CrossValidation, SensorEntry, SphereEntry};
use trueline_dataset::unit::MM_PER_M;
use trueline_method::SensorMode;
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

/// The part of a calibration that a sphere shares with other targets.
pub(crate) struct Shared {
    /// Standard deviation of the centre's coordinates, m; `None` if it is not determined.
    pub center_sigma_m: Option<[f64; 3]>,
    /// Whether the robot carries the sphere: the centre is in the tool, not in base.
    pub in_tool: bool,
    /// Number of profiles in use.
    pub used: usize,
    /// Noise of a recorded position of the robot, per axis, m.
    pub robot_noise_m: f64,
}

impl SphereReport<'_> {
    /// The sphere in the file of a result.
    pub(crate) fn entry(&self, shared: &Shared) -> SphereEntry {
        let center = &self.sphere.pose.unknowns.base_from_target.translation.vector;
        let sigma_m = |k: usize| shared.center_sigma_m.map(|sigma_m| sigma_m[k]);
        SphereEntry {
            center_mm: [0, 1, 2].map(|k| sigma_m(k).map(|_| center[k] * MM_PER_M)),
            sigma_center_mm: [0, 1, 2].map(|k| sigma_m(k).map(|m| m * MM_PER_M)),
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
    pub(crate) fn write(&self, out: &mut String, shared: &Shared) {
        let entry = self.entry(shared);
        let frame = if shared.in_tool { "the tool" } else { "base" };
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
            shared.used,
            entry.arcs,
            entry.profiles,
            "noise",
            shared.robot_noise_m * MM_PER_M,
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
