//! Opens the camera and the estimate named by the arguments of `record` and `scan`, and reports their results.

use crate::args::CameraArgs;
use crate::failure::Failure;
use crate::planned_scan::read_text;
use crate::{interrupt, output};
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;
use trueline_camera::CameraError;
use trueline_cell::{
    CameraRecorder, Cell, CellError, FinishedRecording, LiveEstimate, LiveWelds, RecordingSettings,
};
use trueline_dataset::{SensorFile, sensor_toml};
use trueline_live::HostClock;
use trueline_report::terminal_text::shown;

/// Devices named by the arguments.
pub(crate) struct LiveCell {
    /// Camera and estimate.
    pub cell: Cell,
    sensor: Option<SensorFile>,
    sensor_toml: Option<String>,
}

impl LiveCell {
    /// Opens the camera, if one is named.
    /// `reconnect`: a camera that is unplugged is waited for, else it is an error.
    pub(crate) fn open(
        args: &CameraArgs,
        sensor: Option<&Path>,
        clock: HostClock,
        reconnect: bool,
    ) -> Result<Self, Failure> {
        let want = args.want;
        let sensor_toml = sensor.map(read_text).transpose()?;
        let sensor: Option<SensorFile> = match (sensor, &sensor_toml) {
            (Some(file), Some(text)) => Some(sensor_toml::parse_file(file, text)?),
            _ => None,
        };
        let give_up = || interrupt::times() > 0;
        let camera = args
            .settings(reconnect)
            .map(|settings| {
                CameraRecorder::open(&settings, sensor.as_ref().map(|file| &file.sensor), clock, &give_up)
            })
            .transpose()?;
        let estimate = match (&camera, sensor.clone()) {
            (Some(_), Some(sensor)) => Some(Arc::new(LiveEstimate::new(sensor, want))),
            _ if want.is_some() => {
                return Err(Failure::new(
                    "--want needs a camera and its sensor.toml",
                    "--camera IP or --replay DATASET, and --sensor FILE",
                ));
            }
            _ => None,
        };
        Ok(Self { cell: Cell::new(camera, estimate), sensor, sensor_toml })
    }

    /// Divides the recording into welds, if a camera gives seam points.
    pub(crate) fn cut_into_welds(&mut self, pause: Duration) -> Option<Arc<LiveWelds>> {
        self.cell.estimate()?;
        let welds = Arc::new(LiveWelds::new(self.sensor.clone()?, pause));
        self.cell = std::mem::take(&mut self.cell).with_welds(Arc::clone(&welds));
        Some(welds)
    }

    /// The sensor and the text of its file, if one is named.
    #[cfg(feature = "foxglove")]
    pub(crate) fn sensor(&self) -> Option<(&SensorFile, &str)> {
        self.sensor.as_ref().zip(self.sensor_toml.as_deref())
    }

    /// Purpose of a recording of it.
    pub(crate) fn recording<'a>(
        &self,
        folder: &'a Path,
        tool: &'a str,
        robot: &'a str,
    ) -> RecordingSettings<'a> {
        RecordingSettings {
            folder,
            sensor_toml: self.sensor_toml.clone(),
            tool,
            robot,
            command: output::command_line(),
            camera: self.cell.stamp_meaning(),
            estimate: self.cell.estimate(),
            welds: self.cell.welds(),
            listener: self.cell.listener(),
        }
    }

    /// Reports the results of camera and estimate; returns whether all is well.
    pub(crate) fn tell(
        &self,
        camera: &Result<(), CameraError>,
        estimate_panicked: bool,
        quiet: bool,
    ) -> bool {
        let state = self.cell.state();
        if estimate_panicked {
            output::words("warning: the estimate failed; the recording is not affected");
        }
        for loss in state.camera.iter().flat_map(|counts| counts.losses()) {
            output::words(&format!("warning: {loss}"));
        }
        if let Err(error) = camera {
            output::words(&format!(
                "warning: {error}; the recording so far is kept\n\nhint: {}",
                error.hint()
            ));
        }
        if !quiet {
            for line in state.lines() {
                output::words(&line);
            }
        }
        camera.is_ok() && !state.camera.is_some_and(|counts| counts.is_doubtful())
    }
}

/// Reports the losses of a recording, other events, and `report`. If the reader of our output is gone, only the exit code
/// reports the recording's result.
pub(crate) fn tell_recording(finished: &FinishedRecording, report: &str, quiet: bool) -> Result<(), Failure> {
    for loss in finished.losses() {
        output::words(&format!("warning: {loss}"));
    }
    if quiet {
        return Ok(());
    }
    for note in finished.notes() {
        output::words(&format!("note: {note}"));
    }
    match output::data(&shown(report)) {
        Ok(()) | Err(Failure::BrokenPipe) => {}
        Err(other) => return Err(other),
    }
    if !finished.is_removed {
        output::words(&format!("written to {}", finished.file.display()));
    }
    Ok(())
}

impl From<CellError> for Failure {
    fn from(error: CellError) -> Self {
        let hint = match &error {
            CellError::NoCameraClock { .. } => "--stamp first-packet needs nothing of the camera".to_owned(),
            CellError::NoGigE { .. } => format!("use --replay; {}", crate::args::left_out::how_to_build()),
            other => other.hint(),
        };
        Self::new(error.to_string(), hint)
    }
}
