//! Several sensors on one robot, for the result's file and for people.

use crate::number::{digits_for, positive_w, with_sigma};
use trueline_dataset::result_file::{
    BetweenEntry, BetweenSigma, PoseEntry, SensorAmongEntry, SensorAmongSigma,
};
use trueline_dataset::unit::MM_PER_M;
use trueline_geometry::Pose;
use trueline_method::several_sensors::{Between, Tied, TiedSensor};

/// The entries of the result's file.
#[must_use]
pub fn entries(tied: &Tied) -> (Vec<SensorAmongEntry>, Vec<BetweenEntry>) {
    (tied.sensors.iter().map(sensor).collect(), tied.between.iter().map(between).collect())
}

fn pose(pose: &Pose) -> PoseEntry {
    PoseEntry {
        translation_mm: [0, 1, 2].map(|k| Some(pose.translation.vector[k] * MM_PER_M)),
        rotation_wxyz: Some(positive_w(&pose.rotation)),
    }
}

fn sensor(of: &TiedSensor) -> SensorAmongEntry {
    let [time_offset_s, a, b, c, x, y, z] = of.sigma;
    SensorAmongEntry {
        name: of.name.clone(),
        tool_from_camera: pose(&of.tool_from_camera),
        time_offset_s: of.time_offset_s,
        sigma: SensorAmongSigma {
            time_offset_s,
            rotation_rad: [a, b, c],
            translation_mm: [x, y, z].map(|sigma_m| sigma_m * MM_PER_M),
        },
    }
}

fn between(of: &Between) -> BetweenEntry {
    let [a, b, c, x, y, z] = of.sigma;
    BetweenEntry {
        from: of.from.clone(),
        to: of.to.clone(),
        transform: pose(&of.transform),
        sigma: BetweenSigma {
            rotation_rad: [a, b, c],
            translation_mm: [x, y, z].map(|sigma_m| sigma_m * MM_PER_M),
        },
    }
}

/// Report on them.
#[must_use]
pub fn text(tied: &Tied) -> String {
    const MS_PER_S: f64 = 1e3;
    let mut lines = vec!["All sensors, tied by their common seams".to_owned()];
    for sensor in &tied.sensors {
        let offset = with_sigma(sensor.time_offset_s * MS_PER_S, Some(sensor.sigma[0] * MS_PER_S), "ms");
        let moved = placed(&sensor.tool_from_camera, &sensor.sigma[1..]);
        lines.push(format!("  {}: time offset {offset}; in the tool {moved}", sensor.name));
    }
    for Between { from, to, transform, sigma } in &tied.between {
        lines.push(format!("  {to} in {from}: {}", placed(transform, sigma)));
    }
    lines.push(format!("  the seams agree to {:.1} of their ±", tied.apart_sigmas));
    lines.join("\n")
}

/// A pose, with its ± in translation and rotation.
fn placed(pose: &Pose, sigma: &[f64]) -> String {
    let place = pose.translation.vector * MM_PER_M;
    let largest = |of: &[f64]| of.iter().copied().fold(0.0, f64::max);
    let (turn_deg, shift_mm) = (largest(&sigma[..3]).to_degrees(), largest(&sigma[3..]) * MM_PER_M);
    format!(
        "at ({:.2}, {:.2}, {:.2}) mm ± {shift_mm:.3$} mm, ± {turn_deg:.4$}°",
        place.x,
        place.y,
        place.z,
        digits_for(shift_mm),
        digits_for(turn_deg)
    )
}
