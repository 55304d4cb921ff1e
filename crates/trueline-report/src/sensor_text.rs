//! A sensor's own calibration in words.

use crate::camera_report::CameraReport;
use crate::number::with_sigma;
use std::fmt::Write;
use trueline_dataset::unit::MM_PER_M;
use trueline_geometry::Plane;
use trueline_sensor::intrinsics::NextPicture;
use trueline_sensor::laser_plane::next_board::{self, NextBoard};
use trueline_sensor::laser_plane::plate::PlateFit;
use trueline_sensor::laser_plane::{JointFit, PlaneFit};
use trueline_sensor::verdict::Remark;

fn verdict(out: &mut String, reasons: &[Remark], warnings: &[Remark]) {
    // Writing to a String cannot fail.
    if reasons.is_empty() {
        let _ = writeln!(out, "Calibration accepted");
    } else {
        let _ = writeln!(out, "Calibration NOT accepted:");
        for reason in reasons {
            let _ = writeln!(out, "  - {reason}");
        }
    }
    for warning in warnings {
        let _ = writeln!(out, "  warning: {warning}");
    }
}

/// A camera's calibration in a few lines.
#[must_use]
pub fn camera(report: &CameraReport<'_>) -> String {
    let (fit, mut out) = (report.fit, String::new());
    let (camera, sigma) = (&fit.state.camera, fit.sigma());
    verdict(&mut out, report.reasons, report.warnings);
    let _ = writeln!(
        out,
        "\n  {:<18} {} x {} px\n  {:<18} fx {}   fy {}\n  {:<18} cx {}   cy {}",
        "picture",
        camera.size[0],
        camera.size[1],
        "focal length",
        with_sigma(camera.focal.x, Some(sigma[0]), "px"),
        with_sigma(camera.focal.y, Some(sigma[1]), "px"),
        "principal point",
        with_sigma(camera.centre.x, Some(sigma[2]), "px"),
        with_sigma(camera.centre.y, Some(sigma[3]), "px"),
    );
    let _ = writeln!(out, "  {:<18} {}", "distortion", distortion(report));
    let _ = writeln!(
        out,
        "  {:<18} {} of {} pictures, {} corners, {:.3} px rms",
        "used",
        fit.pictures(),
        report.files.len(),
        fit.corners(),
        fit.rms_px
    );
    if fit.is_sheet_free {
        let _ = writeln!(out, "  {:<18} {}", "sheet", sheet(fit.sheet_rise_m));
    }
    let worst = report.uncertainty.values_px.iter().copied().fold(0.0, f64::max);
    let _ = writeln!(
        out,
        "  {:<18} ± {:.3} px over the picture, ± {worst:.3} px at worst",
        "uncertainty",
        report.uncertainty.rms_px()
    );
    if let Some(halves) = report.halves {
        let _ = writeln!(
            out,
            "  {:<18} two halves of the pictures differ by {:.3} px; {:.3} px expected",
            "cross-validation",
            halves.difference.rms_px(),
            halves.expected_px
        );
    }
    if let Some(next) = report.next {
        let _ = writeln!(out, "  {:<18} {}", "next picture", next_picture(next));
    }
    for (file, reason) in report.not_used() {
        let _ = writeln!(out, "  {:<18} {file}: {reason}", "not used");
    }
    out
}

/// How a board's sheet is bent.
fn sheet(rise_m: f64) -> String {
    format!("bent by {:.2} mm from its middle to a corner of the squares", rise_m.abs() * MM_PER_M)
}

/// The coefficients, each with its uncertainty.
fn distortion(report: &CameraReport<'_>) -> String {
    let (k, sigma) = (report.fit.state.camera.distortion.to_opencv(), report.fit.sigma());
    let of = |(n, name): (usize, &str)| match sigma[4 + n] {
        s if s > 0.0 => format!("{name} {}", with_sigma(k[n], Some(s), "").trim_end()),
        _ => format!("{name} 0 (held)"),
    };
    let listed: Vec<String> = ["k1", "k2", "p1", "p2", "k3"].into_iter().enumerate().map(of).collect();
    listed.join("   ")
}

/// The next picture to take, in words.
#[must_use]
pub fn next_picture(next: &NextPicture) -> String {
    let place = match next.third {
        (0, 0) => "the middle",
        (-1, -1) => "the upper left",
        (0, -1) => "the upper middle",
        (1, -1) => "the upper right",
        (-1, 0) => "the left",
        (1, 0) => "the right",
        (-1, 1) => "the lower left",
        (0, 1) => "the lower middle",
        _ => "the lower right",
    };
    let degrees = next.pitch_rad.abs().max(next.yaw_rad.abs()).to_degrees();
    let tilt = match (next.pitch_rad, next.yaw_rad) {
        (p, _) if p > 0.0 => format!("tilted by {degrees:.0} degrees, upper edge nearer"),
        (p, _) if p < 0.0 => format!("tilted by {degrees:.0} degrees, lower edge nearer"),
        (_, y) if y > 0.0 => format!("tilted by {degrees:.0} degrees, left edge nearer"),
        (_, y) if y < 0.0 => format!("tilted by {degrees:.0} degrees, right edge nearer"),
        _ => "perpendicular to the view".to_owned(),
    };
    format!(
        "board in {place} of the picture, {:.0} % as wide as the picture, {tilt}: uncertainty {:.3} → {:.3} px",
        next.width * 100.0,
        next.now_px,
        next.then_px
    )
}

/// A laser plane from points in a few lines.
#[must_use]
pub fn points_plane(fit: &PlaneFit, remarks: (&[Remark], &[Remark])) -> String {
    let (m, middle_mm) = (fit.middle * MM_PER_M, fit.middle_sigma_m * MM_PER_M);
    let (offset_mm, slope_deg) = (fit.offset_spread_m * MM_PER_M, fit.slope_spread_rad.to_degrees());
    let facts = [
        (
            "offset, middle",
            format!(
                "± {middle_mm:.4} mm at [{:.1}, {:.1}, {:.1}] mm, the middle of the points",
                m.x, m.y, m.z
            ),
        ),
        ("boards", fit.boards.len().to_string()),
        ("boards differ by", format!("{offset_mm:.4} mm in offset, {slope_deg:.4} degrees in slope")),
        ("points", format!("{:.4} mm rms from the plane", fit.rms_m * MM_PER_M)),
    ];
    plane(&fit.plane, &fit.covariance, &facts, remarks)
}

/// A laser plane from pictures in a few lines; `None` without a plane.
#[must_use]
pub fn joint_plane(fit: &JointFit, remarks: (&[Remark], &[Remark])) -> Option<String> {
    let [rms_mm, flat_mm, middle_mm] =
        [fit.rms_m, fit.flatness_m, fit.middle_sigma_m()].map(|m| m * MM_PER_M);
    let mut facts = vec![
        ("boards", fit.points.len().to_string()),
        ("stripe", format!("{:.3} px across, corners {:.3} px", fit.stripe_sigma_px, fit.corner_sigma_px)),
        ("points", format!("{rms_mm:.4} mm rms from the plane")),
        ("sheet", sheet(fit.sheet_rise_m)),
        ("boards are flat to", format!("{flat_mm:.4} mm")),
        ("offset, middle", format!("± {middle_mm:.4} mm in the middle of the points")),
    ];
    facts.extend(next_board::best(fit).map(|next| ("board to add", next_board(&next))));
    Some(plane(&fit.plane()?, &fit.covariance.fixed_view::<3, 3>(9, 9).into(), &facts, remarks))
}

/// A laser plane from a plain plate in a few lines. `names` are the stops' pictures.
#[must_use]
pub fn plate_plane(fit: &PlateFit, names: &[&str], remarks: (&[Remark], &[Remark])) -> String {
    let [offset_mm, slope_mm] = fit.spread_m.map(|m| m * MM_PER_M);
    let sigma = fit.hand_eye_sigma();
    let largest = |first: usize| sigma[first..first + 3].iter().copied().fold(0.0, f64::max);
    let [first, second] = fit.tilts_rad.map(f64::to_degrees);
    let t = fit.state.tool_from_camera.translation.vector * MM_PER_M;
    let left_out = fit.stops.iter().zip(names).filter(|(stop, _)| !stop.used).map(|(_, name)| *name);
    let mut facts = vec![
        (
            "offset, middle",
            format!("± {:.4} mm in the middle of the points", fit.middle_sigma_m() * MM_PER_M),
        ),
        (
            "stops",
            format!(
                "{} of {}, tilted by ± {first:.0} and ± {second:.0} degrees",
                fit.used(),
                fit.stops.len()
            ),
        ),
        ("stops differ by", format!("{offset_mm:.4} mm in distance, {slope_mm:.4} mm along the stripe")),
        (
            "camera on the tool",
            format!(
                "[{:.2}, {:.2}, {:.2}] mm ± {:.2} mm and {:.3} degrees at most",
                t.x,
                t.y,
                t.z,
                largest(3) * MM_PER_M,
                largest(0).to_degrees()
            ),
        ),
    ];
    facts.extend(left_out.map(|name| ("left out", name.to_owned())));
    plane(&fit.plane(), &fit.plane_covariance(), &facts, remarks)
}

fn plane(
    plane: &Plane,
    covariance: &nalgebra::Matrix3<f64>,
    facts: &[(&str, String)],
    (reasons, warnings): (&[Remark], &[Remark]),
) -> String {
    let mut out = String::new();
    verdict(&mut out, reasons, warnings);
    let (n, sigma) = (plane.normal(), covariance.diagonal().map(|v| v.max(0.0).sqrt()));
    let _ = writeln!(
        out,
        "\n  {:<18} [{:.6}, {:.6}, {:.6}] ± {:.3} and {:.3} degrees\n  {:<18} {}",
        "normal",
        n.x,
        n.y,
        n.z,
        sigma.x.to_degrees(),
        sigma.y.to_degrees(),
        "offset",
        with_sigma(plane.offset() * MM_PER_M, Some(sigma.z * MM_PER_M), "mm"),
    );
    for (name, value) in facts {
        let _ = writeln!(out, "  {name:<18} {value}");
    }
    out
}

/// The next board for the laser plane.
#[must_use]
pub fn next_board(next: &NextBoard) -> String {
    let [near, far] = next.seen_m;
    let distance = if next.depth_m < near {
        format!("{:.0} mm nearer than the nearest so far", (near - next.depth_m) * MM_PER_M)
    } else if next.depth_m > far {
        format!("{:.0} mm farther than the farthest so far", (next.depth_m - far) * MM_PER_M)
    } else {
        format!("{:.0} mm away", next.depth_m * MM_PER_M)
    };
    let side = match next.side {
        0 => "",
        k if k < 0 => ", further to the left",
        _ => ", further to the right",
    };
    let turned = match next.turn_rad {
        0.0 => String::new(),
        turn => {
            let nearer = if turn > 0.0 { "left" } else { "right" };
            format!(", its {nearer} edge turned {:.0} degrees towards the camera", turn.abs().to_degrees())
        }
    };
    format!(
        "{distance}{side}{turned}: plane ± {:.4} → {:.4} mm where it was measured",
        next.now_m * MM_PER_M,
        next.then_m * MM_PER_M
    )
}
