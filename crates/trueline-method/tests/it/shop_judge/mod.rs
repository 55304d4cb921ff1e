//! Error of a calibration, from the cell's check pass.
//! Shared by the test and the study `shop_cells`.

use nalgebra::{Matrix3x6, Matrix6, Point3, Vector3, Vector6};
use trueline_dataset::{Guess, Recording};
use trueline_geometry::so3;
use trueline_method::evaluate::seam_points;
use trueline_method::problem::parameters::ROTATION;
use trueline_method::{Calibration, Config, Status};
use trueline_sim::shop::{ShopCell, ShopTruth};

/// True and intended place of the k-th point of a check pass.
type Place<'a> = &'a dyn Fn(usize, &Vector3<f64>) -> Option<Vector3<f64>>;

/// A cell and its outcome. Lengths are in mm.
pub(crate) struct Judged {
    pub(crate) truth: ShopTruth,
    pub(crate) accepted: bool,
    /// Codes of the reasons, or the message of an error.
    pub(crate) reasons: Vec<String>,
    /// The stated seam error.
    pub(crate) said_mm: Option<f64>,
    /// RMS error of check points against the true hand-eye transform.
    pub(crate) strict_mm: Option<f64>,
    /// RMS distance by which the same arm misses them with a torch.
    pub(crate) miss_mm: Option<f64>,
    /// Distance of the time offset from the true interval, in standard deviations.
    pub(crate) offset_z: Option<f64>,
    /// Errors of hand-eye rotation and translation over their standard deviations, against the transform that places the
    /// readings of the sensor as found best: errors of its file are not errors of the transform.
    pub(crate) hand_eye_z: Option<[f64; 6]>,
}

impl Judged {
    /// A cell without an answer.
    pub(crate) fn refused(cell: &ShopCell, reasons: Vec<String>) -> Self {
        let truth = cell.truth.clone();
        Self {
            truth,
            accepted: false,
            reasons,
            said_mm: None,
            strict_mm: None,
            miss_mm: None,
            offset_z: None,
            hand_eye_z: None,
        }
    }

    /// The error that counts: the smaller one.
    pub(crate) fn true_mm(&self) -> Option<f64> {
        Some(self.strict_mm?.min(self.miss_mm?))
    }

    /// A printable line.
    pub(crate) fn in_words(&self) -> String {
        let number = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), |value| format!("{value:.3}"));
        format!(
            "{} {} {} {} tilt {:.1} bound {:.3} true {} (strict {}, miss {}) said {} z {} {}",
            if self.truth.is_good_scan() { "good" } else { "poor" },
            if self.accepted { "accepted" } else { "refused" },
            self.truth.motion.name(),
            self.truth.sensor,
            self.truth.tilt_rad.to_degrees(),
            self.truth.bound_m * 1e3,
            number(self.true_mm()),
            number(self.strict_mm),
            number(self.miss_mm),
            number(self.said_mm),
            number(self.offset_z),
            self.reasons.join(" ")
        )
    }
}

/// Judges a calibration of a cell.
pub(crate) fn judged(cell: &ShopCell, calibration: &Calibration) -> Judged {
    let reasons = calibration.reasons().iter().map(|reason| reason.code().to_owned()).collect();
    let mut judged = Judged::refused(cell, reasons);
    judged.accepted = calibration.status() == Status::Accepted;
    let seam_error = calibration.findings.checks.seam_error.as_ref();
    judged.said_mm = seam_error.map(|error| error.rms_m * 1e3);
    let (Ok(offset), true) = (calibration.time_offset(), calibration.rotation().is_ok()) else {
        return judged;
    };
    let points = points_in_tool(&cell.check, calibration);
    let late_s = cell.truth.time_offset_s - offset.value_s;
    let errors = |of: Place<'_>| {
        let squares: Vec<f64> =
            points.iter().filter_map(|(k, at)| Some(of(*k, at)?.norm_squared())).collect();
        (!squares.is_empty()).then(|| (squares.iter().sum::<f64>() / squares.len() as f64).sqrt() * 1e3)
    };
    let at_speed = |k: usize, at: &Vector3<f64>| {
        at + cell.truth.points[k].velocity_in_tool * (cell.truth.speed_m_s * late_s)
    };
    judged.strict_mm = errors(&|k, at| Some(at_speed(k, at) - cell.truth.points[k].in_tool));
    judged.miss_mm = errors(&|k, at| {
        let point = &cell.truth.points[k];
        Some((point.reported * Point3::from(at_speed(k, at))).coords - point.torch_reference?)
    });
    let [low, high] = cell.truth.time_offset_interval_s;
    let outside_s = (low - offset.value_s).max(offset.value_s - high).max(0.0);
    judged.offset_z = offset.sigma_s.map(|sigma_s| outside_s / sigma_s);
    judged.hand_eye_z = hand_eye_z(cell, calibration, &points);
    judged
}

/// `points` are check points as placed in the tool, m.
fn hand_eye_z(
    cell: &ShopCell,
    calibration: &Calibration,
    points: &[(usize, Vector3<f64>)],
) -> Option<[f64; 6]> {
    // The motion that moves them to their true places: p + ω × p + τ, to first order.
    let (mut normal, mut right) = (Matrix6::zeros(), Vector6::zeros());
    for (k, at) in points {
        let mut by = Matrix3x6::zeros();
        by.fixed_columns_mut::<3>(0).copy_from(&-so3::hat(at));
        by.fixed_columns_mut::<3>(3).fill_with_identity();
        normal += by.tr_mul(&by);
        right += by.tr_mul(&(cell.truth.points[*k].in_tool - at));
    }
    let motion = normal.cholesky()?.solve(&right);
    let (turn, moved) = (motion.fixed_rows::<3>(0).into_owned(), motion.fixed_rows::<3>(3).into_owned());
    let shift = turn.cross(&calibration.best_fit().tool_from_camera.translation.vector) + moved;
    let error = [turn.x, turn.y, turn.z, shift.x, shift.y, shift.z];
    let mut z = [0.0; 6];
    for (k, z) in z.iter_mut().enumerate() {
        *z = error[k] / calibration.sigma(ROTATION + k)?;
    }
    Some(z)
}

/// The points of a check pass in the tool, each with its number, m: as placed in base, minus the motion of the tool, which does not rotate.
fn points_in_tool(check: &Recording, calibration: &Calibration) -> Vec<(usize, Vector3<f64>)> {
    let found = calibration.best_fit();
    let by = Guess {
        time_offset_s: calibration.recorded_time_offset_s(),
        tool_from_camera: found.tool_from_camera,
    };
    let mut corrected = check.clone();
    corrected.setup.shape = found.shape.or(corrected.setup.shape);
    let Ok(placed) = seam_points::place(&corrected, &by, &Config::default()) else { return Vec::new() };
    let first = check.robot[0];
    let last = check.robot[check.robot.len() - 1];
    let start = first.base_from_tool.translation.vector;
    let duration_s = (last.stamp_ns - first.stamp_ns) as f64 * 1e-9;
    let velocity = (last.base_from_tool.translation.vector - start) / duration_s;
    let in_tool =
        |stamp_s: f64, in_base: &Vector3<f64>| in_base - start - velocity * (stamp_s - by.time_offset_s);
    placed
        .list
        .iter()
        .map(|point| (point.row as usize, in_tool(point.stamp_s, &point.point_in_base)))
        .collect()
}
