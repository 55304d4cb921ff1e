//! A sensor's own calibration as JSON.

pub use crate::camera_report::CameraReport;
use serde_json::{Value, json};
use trueline_dataset::unit::MM_PER_M;
use trueline_sensor::laser_plane::plate::PlateFit;
use trueline_sensor::laser_plane::{JointFit, PlaneFit};
use trueline_sensor::verdict::Remark;

/// The head that every result has.
fn head(reasons: &[Remark], warnings: &[Remark]) -> Value {
    let remarks = |list: &[Remark]| -> Vec<Value> {
        list.iter().map(|r| json!({ "code": r.code(), "text": r.to_string() })).collect()
    };
    json!({
        "schema_version": 2,
        "tool": { "name": "trueline", "version": env!("CARGO_PKG_VERSION") },
        "status": if reasons.is_empty() { "accepted" } else { "not_accepted" },
        "reasons": remarks(reasons),
        "warnings": remarks(warnings),
    })
}

/// The result of `trueline sensor intrinsics`.
#[must_use]
pub fn camera(report: &CameraReport<'_>) -> Value {
    let fit = report.fit;
    let (camera, sigma) = (&fit.state.camera, fit.sigma());
    let mut value = head(report.reasons, report.warnings);
    value["rms_px"] = json!(fit.rms_px);
    value["pictures"] = json!(fit.pictures());
    value["corners"] = json!(fit.corners());
    value["left_out"] = json!({
        "pictures": fit.used.len() - fit.pictures(),
        "corners": fit.used.iter().flatten().count() - fit.corners(),
    });
    value["camera"] = json!({
        "width": camera.size[0], "height": camera.size[1],
        "fx": camera.focal.x, "fy": camera.focal.y, "cx": camera.centre.x, "cy": camera.centre.y,
        "distortion": camera.distortion.to_opencv(),
    });
    value["sigma"] = json!({
        "fx": sigma[0], "fy": sigma[1], "cx": sigma[2], "cy": sigma[3], "distortion": sigma[4..],
    });
    value["distortion_model"] = json!(fit.model.name());
    value["evidence"] = fit
        .evidence
        .iter()
        .map(|e| json!({ "model": e.model.name(), "rms_px": e.rms_px, "akaike": e.akaike }))
        .collect();
    value["corner_sigma_px"] = json!(fit.corner_sigma_px);
    value["sheet"] = json!({
        "estimated": fit.is_sheet_free,
        "rise_mm": fit.sheet_rise_m * MM_PER_M,
        "shape": fit.state.sheet.numbers(),
    });
    value["covariance"] = json!({
        "order": ["fx_px", "fy_px", "cx_px", "cy_px", "k1", "k2", "p1", "p2", "k3"],
        "matrix": rows(&fit.covariance),
    });
    let worst = report.uncertainty.values_px.iter().copied().fold(0.0, f64::max);
    value["uncertainty_px"] = json!({ "rms": report.uncertainty.rms_px(), "worst": worst });
    value["cross_validation"] = report.halves.map_or(Value::Null, |halves| {
        json!({
            "difference_px": halves.difference.rms_px(),
            "expected_px": halves.expected_px,
            "normalized": halves.normalized,
        })
    });
    value["next_picture"] = report.next.map_or(Value::Null, |next| {
        json!({
            "text": super::sensor_text::next_picture(next),
            "column": next.third.0, "row": next.third.1,
            "pitch_deg": next.pitch_rad.to_degrees(), "yaw_deg": next.yaw_rad.to_degrees(),
            "width_part": next.width, "uncertainty_now_px": next.now_px, "uncertainty_then_px": next.then_px,
        })
    });
    let skipped = report.not_used().into_iter();
    value["skipped"] = skipped.map(|(file, reason)| json!({ "file": file, "reason": reason })).collect();
    value["inputs"] = report.files.iter().map(|(file, sha256, _)| (file.clone(), json!(sha256))).collect();
    value
}

/// The result of `trueline sensor laser-plane` from points. `names` are the boards as the file numbers them.
#[must_use]
pub fn plane(
    fit: &PlaneFit,
    jackknife: Option<nalgebra::Vector3<f64>>,
    names: &[u64],
    (reasons, warnings): (&[Remark], &[Remark]),
) -> Value {
    let mut value = plane_head(&fit.plane, &fit.covariance, (reasons, warnings));
    value["boards"] = json!(fit.boards.len());
    value["rms_mm"] = json!(fit.rms_m * MM_PER_M);
    value["middle_mm"] = json!((fit.middle * MM_PER_M).as_slice());
    value["sigma_offset_at_middle_mm"] = json!(fit.middle_sigma_m * MM_PER_M);
    value["jackknife"] = jackknife.map_or(Value::Null, |s| {
        json!({
            "sigma_normal_deg": [s.x.to_degrees(), s.y.to_degrees()], "sigma_offset_mm": s.z * MM_PER_M,
        })
    });
    value["board_spread"] = json!({
        "offset_mm": fit.offset_spread_m * MM_PER_M, "slope_deg": fit.slope_spread_rad.to_degrees(),
    });
    value["per_board"] = fit.boards.iter().zip(names)
        .map(|(board, name)| {
            json!({
                "board": name, "offset_mm": board.offset_m * MM_PER_M, "slope_deg": board.slope_rad.to_degrees(),
                "z": board.z, "length_mm": board.length_m * MM_PER_M,
            })
        })
        .collect();
    value
}

/// The result of `trueline sensor laser-plane` from pictures. `None` without a plane.
#[must_use]
pub fn joint_plane(fit: &JointFit, (reasons, warnings): (&[Remark], &[Remark])) -> Option<Value> {
    let plane = fit.plane()?;
    let covariance = fit.covariance.fixed_view::<3, 3>(9, 9).into();
    let mut value = plane_head(&plane, &covariance, (reasons, warnings));
    let camera = &fit.state.camera;
    value["boards"] = json!(fit.points.len());
    value["boards_left_out"] = json!(fit.left_out);
    value["rms_mm"] = json!(fit.rms_m * MM_PER_M);
    value["stripe_pixels"] = json!(fit.points.iter().map(Vec::len).sum::<usize>());
    value["stripe_sigma_px"] = json!(fit.stripe_sigma_px);
    value["corner_sigma_px"] = json!(fit.corner_sigma_px);
    value["flatness_mm"] = json!(fit.flatness_m * MM_PER_M);
    value["sheet"] = json!({ "rise_mm": fit.sheet_rise_m * MM_PER_M, "shape": fit.state.sheet.numbers() });
    value["camera"] = json!({
        "width": camera.size[0], "height": camera.size[1],
        "fx": camera.focal.x, "fy": camera.focal.y, "cx": camera.centre.x, "cy": camera.centre.y,
        "distortion": camera.distortion.to_opencv(),
    });
    Some(value)
}

/// The result of `trueline sensor laser-plane --plate`. `names` are the stops' pictures.
#[must_use]
pub fn plate_plane(fit: &PlateFit, names: &[&str], remarks: (&[Remark], &[Remark])) -> Value {
    let mut value = plane_head(&fit.plane(), &fit.plane_covariance(), remarks);
    let (pose, sigma) = (&fit.state.tool_from_camera, fit.hand_eye_sigma());
    let q = pose.rotation.quaternion();
    value["stops"] = json!(fit.used());
    value["rms_mm"] = json!(fit.rms_m * MM_PER_M);
    value["middle_mm"] = json!((fit.middle * MM_PER_M).as_slice());
    value["sigma_offset_at_middle_mm"] = json!(fit.middle_sigma_m() * MM_PER_M);
    value["stop_spread_mm"] = json!(fit.spread_m.map(|m| m * MM_PER_M));
    value["tilts_deg"] = json!(fit.tilts_rad.map(f64::to_degrees));
    value["tool_from_camera"] = json!({
        "translation_mm": (pose.translation.vector * MM_PER_M).as_slice(),
        "rotation_wxyz": [q.w, q.i, q.j, q.k],
        "sigma_rotation_deg": (sigma[..3].iter().map(|s| s.to_degrees()).collect::<Vec<_>>()),
        "sigma_translation_mm": (sigma[3..].iter().map(|s| s * MM_PER_M).collect::<Vec<_>>()),
    });
    value["per_stop"] = fit
        .stops
        .iter()
        .zip(names)
        .map(|(stop, name)| json!({ "picture": name, "used": stop.used, "z": stop.z }))
        .collect();
    value
}

fn plane_head(
    plane: &trueline_geometry::Plane,
    covariance: &nalgebra::Matrix3<f64>,
    (reasons, warnings): (&[Remark], &[Remark]),
) -> Value {
    let sigma = covariance.diagonal().map(|v| v.max(0.0).sqrt());
    let mut value = head(reasons, warnings);
    value["normal"] = json!(plane.normal().as_slice());
    value["offset_mm"] = json!(plane.offset() * MM_PER_M);
    value["sigma_normal_deg"] = json!([sigma.x.to_degrees(), sigma.y.to_degrees()]);
    value["sigma_offset_mm"] = json!(sigma.z * MM_PER_M);
    let unit = nalgebra::Vector3::new(1.0, 1.0, MM_PER_M);
    let scaled = nalgebra::Matrix3::from_fn(|i, j| covariance[(i, j)] * unit[i] * unit[j]);
    value["covariance"] = json!({
        "order": ["normal_e1_rad", "normal_e2_rad", "offset_mm"], "matrix": rows(&scaled),
    });
    value
}

fn rows<const N: usize>(matrix: &nalgebra::SMatrix<f64, N, N>) -> Vec<Vec<f64>> {
    (0..N).map(|i| (0..N).map(|j| matrix[(i, j)]).collect()).collect()
}
