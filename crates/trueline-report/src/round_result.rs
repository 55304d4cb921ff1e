//! The part of a calibration's result that is of a sphere or a cylinder.

use crate::number::with_sigma;
use nalgebra::{Matrix2, Matrix6, Vector3};
use std::fmt::Write;
use trueline_dataset::result_file::{CrossValidation, CylinderEntry, SensorEntry, SphereEntry};
use trueline_dataset::unit::MM_PER_M;
use trueline_method::SensorMode;
use trueline_sensor::round::{RoundFit, RoundTarget};

/// What of a cylinder's pose is held.
const HELD: [&str; 2] = ["turn about its axis", "place along its axis"];

/// A sphere or a cylinder as a calibration's target.
pub struct RoundReport<'a> {
    /// What was found.
    pub round: &'a RoundFit,
    /// Profiles that were read.
    pub profiles: usize,
    /// How the sensor's own calibration was treated.
    pub mode: SensorMode,
}

/// The part of a calibration that a round target shares with other targets.
pub(crate) struct Shared {
    /// Covariance of the target's turn and place in its own axes, rad and m.
    pub covariance: Matrix6<f64>,
    /// Whether its attitude is determined, but for what is held.
    pub is_turn_known: bool,
    /// The same of its place.
    pub is_place_known: bool,
    /// Whether the robot carries the target: its place is in the tool, not in base.
    pub in_tool: bool,
    /// Number of profiles in use.
    pub used: usize,
    /// Noise of a recorded position of the robot, per axis, m.
    pub robot_noise_m: f64,
}

impl Shared {
    /// Largest standard deviation across the y axis, of turn or place.
    fn across(&self, first: usize) -> f64 {
        let of = |i: usize, j: usize| self.covariance[(first + i, first + j)];
        let block = Matrix2::new(of(0, 0), of(0, 2), of(2, 0), of(2, 2));
        block.symmetric_eigenvalues().max().max(0.0).sqrt()
    }
}

impl RoundReport<'_> {
    /// The target's name.
    pub(crate) fn name(&self) -> &'static str {
        self.round.target.row().name
    }

    /// The sphere in the file of a result; `None` of another target.
    pub(crate) fn sphere(&self, shared: &Shared) -> Option<SphereEntry> {
        let center = &self.round.pose.unknowns.base_from_target.translation.vector;
        let known = |value: f64| shared.is_place_known.then_some(value * MM_PER_M);
        let sigma_m = |k: usize| shared.covariance[(3 + k, 3 + k)].max(0.0).sqrt();
        (self.round.target == RoundTarget::Sphere).then(|| SphereEntry {
            center_mm: [0, 1, 2].map(|k| known(center[k])),
            sigma_center_mm: [0, 1, 2].map(|k| known(sigma_m(k))),
            radius_mm: self.round.radius_m * MM_PER_M,
            sigma_radius_mm: self.round.radius_sigma_m.map(|m| m * MM_PER_M),
            sigma_circle_mm: [3, 4, 5].map(|k| self.round.pose.sigma[k] * MM_PER_M),
            profiles: self.profiles,
            arcs: self.round.pose.used.len(),
        })
    }

    /// The cylinder in the file of a result; `None` of another target.
    pub(crate) fn cylinder(&self, shared: &Shared) -> Option<CylinderEntry> {
        let pose = &self.round.pose.unknowns.base_from_target;
        let direction: [f64; 3] = (pose.rotation * Vector3::y()).into();
        let point: [f64; 3] = (pose.translation.vector * MM_PER_M).into();
        let (turns, shifts) = (shared.is_turn_known, shared.is_place_known);
        (self.round.target == RoundTarget::Cylinder).then(|| CylinderEntry {
            direction: turns.then_some(direction),
            point_mm: shifts.then_some(point),
            sigma_direction_deg: turns.then(|| shared.across(0).to_degrees()),
            sigma_point_mm: shifts.then(|| shared.across(3) * MM_PER_M),
            radius_mm: self.round.radius_m * MM_PER_M,
            sigma_radius_mm: self.round.radius_sigma_m.map(|m| m * MM_PER_M),
            sigma_arc_mm: [3, 4].map(|k| self.round.pose.sigma[k] * MM_PER_M),
            profiles: self.profiles,
            arcs: self.round.pose.used.len(),
            held: HELD.map(str::to_owned).to_vec(),
        })
    }

    /// Each profile held out in turn.
    pub(crate) fn held_out(&self) -> Option<CrossValidation> {
        let held_out = self.round.held_out?;
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
            shape: self.round.shape.as_ref().map(|[h, _]| per_mm(h)),
            shape_sigma: self.round.shape.as_ref().map(|[_, sigma]| per_mm(sigma)),
            ..SensorEntry::default()
        }
    }

    /// The target in a few lines.
    pub(crate) fn write(&self, out: &mut String, shared: &Shared) {
        let frame = if shared.in_tool { "the tool" } else { "base" };
        // Writing to a String cannot fail.
        let _ = writeln!(out, "\n  {} in {frame}:", self.name());
        let noise = match (self.sphere(shared), self.cylinder(shared)) {
            (Some(sphere), _) => write_sphere(out, &sphere),
            (_, Some(cylinder)) => write_cylinder(out, &cylinder),
            (None, None) => String::new(),
        };
        let radius_mm = self.round.radius_m * MM_PER_M;
        let radius = match self.round.radius_sigma_m {
            Some(sigma_m) => with_sigma(radius_mm, Some(sigma_m * MM_PER_M), "mm"),
            None => format!("{radius_mm:.3} mm (stated)"),
        };
        let _ = writeln!(
            out,
            "  {:<18} {radius}\n  {:<18} {} of {} profiles with an arc, {} in all\n  {:<18} {noise}; robot {:.4} mm",
            "radius",
            "used",
            shared.used,
            self.round.pose.used.len(),
            self.profiles,
            "noise",
            shared.robot_noise_m * MM_PER_M,
        );
        if let Some(held_out) = self.round.held_out {
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

/// Writes the centre; the noise of a circle in words.
fn write_sphere(out: &mut String, sphere: &SphereEntry) -> String {
    for (k, axis) in ["x", "y", "z"].into_iter().enumerate() {
        let value = match sphere.center_mm[k] {
            Some(center) => with_sigma(center, sphere.sigma_center_mm[k], "mm"),
            None => "cannot be determined".to_owned(),
        };
        let _ = writeln!(out, "  {:<18} {value}", format!("centre {axis}"));
    }
    let [along, depth, of_radius] = sphere.sigma_circle_mm;
    format!(
        "a circle's centre {along:.3} mm along the stripe and {depth:.3} mm in depth, its radius {of_radius:.3} mm"
    )
}

/// Writes the axis and what is held; the noise of an arc in words.
fn write_cylinder(out: &mut String, cylinder: &CylinderEntry) -> String {
    let hidden = || "cannot be determined".to_owned();
    let direction = match (cylinder.direction, cylinder.sigma_direction_deg) {
        (Some([x, y, z]), Some(sigma)) => format!("[{x:.5}, {y:.5}, {z:.5}] ± {sigma:.4} deg"),
        _ => hidden(),
    };
    let point = match (cylinder.point_mm, cylinder.sigma_point_mm) {
        (Some([x, y, z]), Some(sigma)) => format!("[{x:.3}, {y:.3}, {z:.3}] ± {sigma:.3} mm"),
        _ => hidden(),
    };
    let _ = writeln!(
        out,
        "  {:<18} {direction}\n  {:<18} {point}\n  {:<18} {}: a cylinder looks the same under both",
        "axis direction",
        "point of the axis",
        "held",
        cylinder.held.join(" and "),
    );
    let [ends, middle] = cylinder.sigma_arc_mm;
    format!("an arc {ends:.3} mm at its ends and {middle:.3} mm in its middle")
}
