//! The live view that `--foxglove` asks for.

use crate::args::FoxgloveArgs;
use crate::failure::Failure;

#[cfg(feature = "foxglove")]
pub(crate) use with_server::FoxgloveView;
#[cfg(not(feature = "foxglove"))]
pub(crate) use without_server::FoxgloveView;

#[cfg(feature = "foxglove")]
mod with_server {
    use super::{Failure, FoxgloveArgs};
    use crate::estimate_json;
    use crate::live_cell::LiveCell;
    use crate::{live_placing, output};
    use std::path::Path;
    use std::sync::Arc;
    use std::time::{SystemTime, UNIX_EPOCH};
    use trueline_cell::{CellState, LiveScene, RobotBrief};
    use trueline_mcap::live::{ESTIMATE_TOPIC, LiveView, LiveViewError, LogLevel, WELD_TOPIC};
    use trueline_watch::{WeldLine, weld_text};

    impl From<LiveViewError> for Failure {
        fn from(error: LiveViewError) -> Self {
            Self::new(format!("--foxglove: {error}"), error.hint())
        }
    }

    /// The view, while it runs; nothing if none is requested.
    pub(crate) struct FoxgloveView {
        view: Option<LiveView>,
    }

    impl FoxgloveView {
        /// Serves a view if that is requested, and prints its address.
        pub(crate) fn of(args: &FoxgloveArgs, title: &str) -> Result<Self, Failure> {
            let Some(address) = args.foxglove else { return Ok(Self { view: None }) };
            let view = LiveView::start(address, title)?;
            let who = if address.ip().is_loopback() {
                "this PC alone"
            } else {
                "everybody who reaches this address may look"
            };
            output::words(&format!("live view: ws://{} for Foxglove ({who})", view.address()));
            Ok(Self { view: Some(view) })
        }

        /// Shows all that a cell records; with a calibration its points in base as well.
        pub(crate) fn hear(&self, cell: &mut LiveCell, calibration: Option<&Path>) -> Result<(), Failure> {
            let Some(view) = &self.view else { return Ok(()) };
            let scene = LiveScene::new(view.channels());
            let scene = match calibration {
                Some(file) => placing(scene, cell, file)?,
                None => scene,
            };
            cell.cell = std::mem::take(&mut cell.cell).heard_by(Arc::new(scene));
            Ok(())
        }

        /// Shows how a recording is doing.
        pub(crate) fn show(&self, brief: &RobotBrief, state: &CellState) {
            if let Some(view) = &self.view {
                view.channels().json(ESTIMATE_TOPIC, now_ns(), &estimate_json::of(brief, state));
            }
        }

        /// Shows what a weld showed.
        pub(crate) fn weld(&self, line: &WeldLine) {
            let Some(view) = &self.view else { return };
            let channels = view.channels();
            channels.json(WELD_TOPIC, now_ns(), &line.to_json());
            let level = if line.is_alarm() { LogLevel::Error } else { LogLevel::Info };
            channels.log(now_ns(), level, &weld_text::of(line));
        }
    }

    fn now_ns() -> i64 {
        let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        i64::try_from(since.as_nanos()).unwrap_or(i64::MAX)
    }

    fn placing(scene: LiveScene, cell: &LiveCell, file: &Path) -> Result<LiveScene, Failure> {
        let Some((sensor, text)) = cell.sensor() else {
            return Err(Failure::new(
                "--foxglove shows points in base with the sensor of the calibration",
                "--sensor FILE, or leave --calibration out",
            ));
        };
        let (placer, tool_from_sensor) = live_placing::of(file, sensor, text)?;
        Ok(scene.with_placer(placer, tool_from_sensor))
    }
}

/// This program has no live view: what asks for one is refused.
#[cfg(not(feature = "foxglove"))]
mod without_server {
    use super::{Failure, FoxgloveArgs};
    use crate::live_cell::LiveCell;
    use std::path::Path;
    use trueline_cell::{CellState, RobotBrief};
    use trueline_watch::WeldLine;

    /// Nothing.
    pub(crate) struct FoxgloveView;

    impl FoxgloveView {
        /// Refuses to serve.
        pub(crate) fn of(args: &FoxgloveArgs, _: &str) -> Result<Self, Failure> {
            match args.foxglove {
                Some(_) => Err(Failure::new(
                    "--foxglove: this program was built without its live view",
                    crate::args::left_out::how_to_build(),
                )),
                None => Ok(Self),
            }
        }

        /// Hears nothing.
        pub(crate) fn hear(&self, _: &mut LiveCell, _: Option<&Path>) -> Result<(), Failure> {
            Ok(())
        }

        /// Shows nothing.
        pub(crate) fn show(&self, _: &RobotBrief, _: &CellState) {}

        /// Shows nothing.
        pub(crate) fn weld(&self, _: &WeldLine) {}
    }
}
