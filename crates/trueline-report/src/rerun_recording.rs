//! The calibration as a recording for the Rerun viewer: path, camera, seam points and residuals over time.
//!
//! Behind the feature `rerun`, because its libraries take longer to build than all of trueline.

use crate::calibration_page::Source;
use nalgebra::Vector3;
use rerun::{
    Color, LineStrips3D, Points3D, Quaternion, RecordingStream, RecordingStreamBuilder, Scalars, Transform3D,
};
use std::path::Path;
use trueline_dataset::unit::MM_PER_M;
use trueline_geometry::Pose;
use trueline_method::assess::residuals::FeatureResidual;

/// Poses that are written.
const POSES: usize = 5000;

const GOOD: [u8; 3] = [31, 111, 178];
const BAD: [u8; 3] = [179, 38, 30];
const LINE: [u8; 3] = [17, 112, 58];

/// Writes the recording. Lengths are metres in base, times seconds since the first robot row.
///
/// # Errors
/// What Rerun says when the file cannot be written.
pub fn write(file: &Path, source: &Source<'_>) -> Result<(), Box<dyn std::error::Error>> {
    let out = RecordingStreamBuilder::new("trueline").save(file)?;
    seam(&out, source)?;
    path(&out, source)?;
    residuals(&out, source)?;
    out.flush_blocking()?;
    Ok(())
}

fn single(v: &Vector3<f64>) -> [f32; 3] {
    [v.x as f32, v.y as f32, v.z as f32]
}

fn transform(pose: &Pose) -> Transform3D {
    let q = pose.rotation.quaternion();
    let turned = Quaternion::from_xyzw([q.i as f32, q.j as f32, q.k as f32, q.w as f32]);
    Transform3D::from_translation_rotation(single(&pose.translation.vector), turned)
}

/// Points and lines that stand for the whole scan.
fn seam(out: &RecordingStream, source: &Source<'_>) -> Result<(), Box<dyn std::error::Error>> {
    let c = source.calibration;
    for (k, line) in c.best_fit().lines.iter().enumerate() {
        let along = |f: &FeatureResidual| line.direction().dot(&(f.point_in_base - line.anchor()));
        let own =
            || c.findings.fit.features.iter().filter(|f| f.line as usize == k && !f.is_outlier()).map(along);
        let ends = [own().fold(f64::INFINITY, f64::min), own().fold(f64::NEG_INFINITY, f64::max)];
        if ends[0] < ends[1] {
            let strip = ends.map(|a| single(&(line.anchor() + line.direction() * a)));
            let [r, g, b] = LINE;
            out.log_static(
                format!("base/line_{k}"),
                &LineStrips3D::new([strip]).with_colors([Color::from_rgb(r, g, b)]),
            )?;
        }
    }
    for (name, wild, [r, g, b]) in [("base/seam_points", false, GOOD), ("base/outliers", true, BAD)] {
        let points: Vec<[f32; 3]> = c
            .findings
            .fit
            .features
            .iter()
            .filter(|f| f.is_outlier() == wild)
            .map(|f| single(&f.point_in_base))
            .collect();
        let drawn = Points3D::new(points).with_colors([Color::from_rgb(r, g, b)]).with_radii([0.0004_f32]);
        out.log_static(name, &drawn)?;
    }
    Ok(())
}

/// The tool over time, and the camera on it.
fn path(out: &RecordingStream, source: &Source<'_>) -> Result<(), Box<dyn std::error::Error>> {
    let c = source.calibration;
    let robot = &source.recording.robot;
    for sample in robot.iter().step_by(robot.len().div_ceil(POSES).max(1)) {
        out.set_duration_secs("time", (sample.stamp_ns - c.findings.streams.origin_ns) as f64 * 1e-9);
        out.log("base/tool", &transform(&sample.base_from_tool))?;
    }
    let strip: Vec<[f32; 3]> = robot
        .iter()
        .step_by(robot.len().div_ceil(POSES).max(1))
        .map(|sample| single(&sample.base_from_tool.translation.vector))
        .collect();
    out.log_static("base/path", &LineStrips3D::new([strip]))?;
    if c.rotation_is_known() {
        out.log_static("base/tool/camera", &transform(&c.best_fit().tool_from_camera))?;
    }
    Ok(())
}

/// What is left over, as curves.
fn residuals(out: &RecordingStream, source: &Source<'_>) -> Result<(), Box<dyn std::error::Error>> {
    for f in &source.calibration.findings.fit.features {
        out.set_duration_secs("time", f.stamp_s);
        out.log("residual_mm/across", &Scalars::single(f.offset_m.x * MM_PER_M))?;
        out.log("residual_mm/square_to_it", &Scalars::single(f.offset_m.y * MM_PER_M))?;
        out.log("residual_sigmas", &Scalars::single(f.normalised))?;
    }
    Ok(())
}
