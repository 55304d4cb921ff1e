//! Places points with a calibration while it runs.

use crate::failure::Failure;
use std::path::Path;
use trueline::RunTime;
use trueline::rt::Carrier;
use trueline_cell::LivePlacer;
use trueline_dataset::SensorFile;
use trueline_dataset::folder::sha256;
use trueline_dataset::result_file::ResultFile;
use trueline_geometry::Pose;

/// The placer of a sensor, whose file has this text, and its pose on the tool; `None` for a sensor beside the robot.
pub(crate) fn of(
    calibration: &Path,
    sensor: &SensorFile,
    sensor_text: &str,
) -> Result<(LivePlacer, Option<Pose>), Failure> {
    let result = ResultFile::read(calibration)?;
    let hash = sha256(sensor_text.as_bytes());
    let run_time =
        RunTime { sensor, sensor_sha256: Some(&hash), reading_sigma_m: None, standing: &[], in_pose: &[] };
    let unusable = |why: String, hint: String| {
        Failure::new(format!("{}: cannot place points while it runs: {why}", calibration.display()), hint)
    };
    let setup = run_time.placer(&result).map_err(|error| unusable(error.to_string(), error.hint()))?;
    if let Some(axis) = setup.axes.first() {
        return Err(unusable(
            format!("the values of the external axis {axis} do not come with the poses"),
            "`trueline cloud` places a recording that has them".to_owned(),
        ));
    }
    let placer = LivePlacer::new(&setup.calibration, &setup.settings).map_err(|error| {
        unusable(error.to_string(), "take the JSON of `trueline calibrate --json`".to_owned())
    })?;
    let carried = setup.calibration.carrier == Carrier::Tool;
    Ok((placer, carried.then_some(setup.calibration.tool_from_camera)))
}
