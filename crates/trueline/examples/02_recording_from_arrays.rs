//! Build a recording from arrays in memory: no path, no file, no truth.

use std::error::Error;
use trueline::{Feature, Measured, Recording, RobotSample, Sensor};
use trueline_sim::{Preset, simulate};

fn main() -> Result<(), Box<dyn Error>> {
    // Where your program has poses and pixels, this one simulates them.
    let source = simulate(&Preset::Quick.scenario(), 2).ok_or("no seam in view")?;
    let Sensor::CameraLaser { camera, laser_plane_in_camera } = source.sensor else {
        return Err("pixels are what this example is about".into());
    };
    let poses: Vec<_> = source.robot.iter().map(|s| (s.stamp_ns, s.base_from_tool)).collect();
    let pixels: Vec<_> = source.features.iter().map(|f| (f.stamp_ns, f.measured)).collect();

    let recording = Recording::new(
        Sensor::CameraLaser { camera, laser_plane_in_camera },
        poses
            .into_iter()
            .map(|(stamp_ns, base_from_tool)| RobotSample { stamp_ns, device_ns: None, base_from_tool })
            .collect(),
        pixels
            .into_iter()
            .map(|(stamp_ns, measured): (i64, Measured)| Feature {
                stamp_ns,
                line: 0,
                frame: None,
                device_ns: None,
                measured,
                sigma: None,
                correlation: 0.0,
            })
            .collect(),
    );
    let offset = recording.calibrate()?.time_offset()?;

    let truth_s = source.truth.ok_or("a simulation has a truth")?.parameters.time_offset_s;
    let sigma_s = offset.sigma_s.ok_or("it was not held")?;
    // Beyond 5 σ once in two million.
    assert!((offset.value_s - truth_s).abs() < 5.0 * sigma_s, "{offset:?} {truth_s}");
    Ok(())
}
