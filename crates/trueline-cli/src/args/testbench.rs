//! The command line of `trueline-testbench`.

#[cfg(feature = "gige")]
use crate::args::CameraSimArgs;
use crate::args::global::{self, GlobalArgs};
use crate::args::{RobotSimArgs, StreamSimArgs};
use clap::{Parser, Subcommand};
use std::ffi::OsString;

/// The command line.
#[derive(Parser)]
#[command(
    name = "trueline-testbench",
    version,
    about = "Simulated robots and cameras that speak the protocols of real ones, to try a cell without hardware",
    after_help = "Example, a whole cell on this machine (three terminals):
  trueline plan --example --out plan --duration-s 30
  trueline-testbench camera-sim plan --robot-truth 127.0.0.1:7001
  trueline-testbench robot-sim --pc 127.0.0.1:6510 --path plan --truth-to 127.0.0.1:7001
  trueline record --bind 127.0.0.1:6510 --camera 127.0.0.1 --sensor plan/sensor.toml --out cell

`trueline robot-sim` and the others are the same commands.

Exit code: 0 ran, 1 a guidance ended by an event, 2 could not run."
)]
pub(crate) struct Testbench {
    #[command(flatten)]
    pub(crate) global: GlobalArgs,
    #[command(subcommand)]
    pub(crate) device: Device,
}

#[derive(Subcommand)]
pub(crate) enum Device {
    /// Run a simulated robot controller with EGM
    #[command(name = "robot-sim")]
    Robot(RobotSimArgs),
    /// A simulated controller of another make that streams its poses: UR, FANUC, KUKA
    #[command(name = "stream-sim")]
    Stream(StreamSimArgs),
    /// A simulated GigE Vision camera that sees what a simulated robot's camera would see
    #[cfg(feature = "gige")]
    #[command(name = "camera-sim")]
    Camera(CameraSimArgs),
}

/// Whether a command line of `trueline` calls a simulated device.
pub(crate) fn is_called(words: &[OsString]) -> bool {
    global::first_word(words).is_some_and(|name| Device::has_subcommand(&name))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn devices_are_called_by_the_first_word_that_is_no_option() {
        let called = |words: &[&str]| is_called(&words.iter().map(OsString::from).collect::<Vec<_>>());
        assert!(
            called(&["trueline", "robot-sim", "--pc", "127.0.0.1:1"])
                && called(&["trueline", "-v", "stream-sim"])
                && called(&["trueline", "--log-file", "a.log", "--color=never", "stream-sim"])
        );
        assert!(
            !called(&["trueline", "calibrate", "robot-sim"])
                && !called(&["robot-sim"])
                && !called(&["trueline", "--log-file", "robot-sim", "doctor"])
                && !called(&["trueline"])
        );
    }
}
