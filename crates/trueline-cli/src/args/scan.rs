//! `trueline scan` and `trueline record`.

use crate::args::camera_address::CameraAddress;
use crate::args::choice::{Choice, one_of};
use crate::args::features::{JOINTS, JointChoice};
use crate::args::foxglove::FoxgloveArgs;
use crate::args::number;
use crate::args::protocol::LinkArgs;
use crate::args::requirement;
use crate::args::serve::ServeArgs;
use clap::{ArgGroup, Args};
use std::net::{IpAddr, SocketAddr};
use std::path::PathBuf;
use std::time::Duration;
use trueline_cell::{CameraChoice, CameraSettings, CameraSetup, PixelFormat, StampChoice, Trigger};
use trueline_dataset::Channel;
use trueline_method::Requirement;

/// The camera beside the robot.
#[derive(Args)]
pub(crate) struct CameraArgs {
    /// GigE Vision camera to record as well, by its address; or a USB3 Vision camera, by its serial number, or without one the only one
    /// that is plugged in (a program that was built with the feature u3v)
    #[arg(long, value_name = "IP|usb[:SERIAL]", conflicts_with = "replay", groups = ["live_camera", "any_camera"])]
    pub(crate) camera: Option<CameraAddress>,
    /// Device of Video4Linux to record instead: a UVC camera, /dev/video0
    #[cfg(all(feature = "v4l2", target_os = "linux"))]
    #[arg(long, value_name = "DEVICE", conflicts_with = "replay", groups = ["live_camera", "any_camera"])]
    pub(crate) v4l2: Option<PathBuf>,
    /// Take the pictures of a dataset folder instead, at the pace they were recorded
    #[arg(long, value_name = "DATASET", group = "any_camera")]
    pub(crate) replay: Option<PathBuf>,
    /// Exposure time to set on the camera, µs [default: unchanged]
    #[arg(long, requires = "live_camera", value_parser = number::above_zero)]
    pub(crate) exposure_us: Option<f64>,
    /// Frame rate to set on the camera, Hz [default: unchanged]
    #[arg(long, requires = "live_camera", value_parser = number::above_zero)]
    pub(crate) fps: Option<f64>,
    /// Trigger of an exposure: off, the camera's own clock; as-set, the camera's present setting; or an input with a
    /// signal for each picture, by the camera's name for it, and its edge: Line1, Line1:rising, Line1:falling, Line1:any
    /// [default: off]
    #[arg(long, value_name = "off|as-set|INPUT", requires = "camera")]
    pub(crate) trigger: Option<Trigger>,
    /// Pixel format to set on the camera: Mono8, Mono12p, BayerRG8, … [default: unchanged; Mono8 if that cannot be used]
    #[arg(long, value_name = "FORMAT", requires = "live_camera", value_parser = pixel_format)]
    pub(crate) pixel_format: Option<PixelFormat>,
    /// Colour of the laser: the channel of a colour camera to use; without it the pictures are taken as Mono8
    #[arg(long, requires = "live_camera", value_parser = one_of(&LASERS))]
    pub(crate) laser: Option<Channel>,
    /// Time stamp of a picture; all other stamps are stored too
    #[arg(long, requires = "any_camera", value_parser = one_of(&STAMPS), default_value = "first-packet")]
    pub(crate) stamp: StampChoice,
    /// Joint type, for the live estimate alone [default: fillet; with profiles it is detected]
    #[arg(long, requires = "any_camera", value_parser = one_of(&JOINTS[1..]))]
    pub(crate) joint: Option<JointChoice>,
    /// Report when these are reached: time=0.1ms,translation=0.1mm,rotation=0.05deg (any of them)
    #[arg(long, value_name = "WHAT=SIGMA,…", value_parser = requirement::parse)]
    pub(crate) want: Option<Requirement>,
}

impl CameraArgs {
    /// The camera, if one is named; `reconnect`: it is waited for when it is unplugged.
    pub(crate) fn settings(&self, reconnect: bool) -> Option<CameraSettings> {
        let choice = self.choice()?;
        // `auto`, the one word that names no joint, is not among those of a live cell.
        Some(CameraSettings { choice, stamp: self.stamp, joint: self.joint.flatten(), reconnect })
    }

    fn choice(&self) -> Option<CameraChoice> {
        #[cfg(all(feature = "v4l2", target_os = "linux"))]
        if let Some(path) = &self.v4l2 {
            return Some(CameraChoice::V4l2(trueline_cell::V4l2Settings {
                path: path.clone(),
                size: None,
                pixel: self.pixel_format,
                channel: self.laser,
                exposure_us: self.exposure_us,
                fps: self.fps,
            }));
        }
        if let Some(folder) = &self.replay {
            return Some(CameraChoice::Replay(folder.clone()));
        }
        let setup = CameraSetup {
            exposure_us: self.exposure_us,
            fps: self.fps,
            trigger: self.trigger.clone().unwrap_or_default(),
            pixel: self.pixel_format,
            channel: self.laser,
            ..CameraSetup::default()
        };
        Some(self.camera.as_ref()?.choice(setup))
    }
}

fn pixel_format(text: &str) -> Result<PixelFormat, String> {
    let known = PixelFormat::of_name(text).filter(|format| format.samples().is_some());
    known.ok_or_else(|| {
        let names: Vec<&str> = PixelFormat::pictures().map(PixelFormat::name).collect();
        format!("expected one of {}", names.join(", "))
    })
}

static LASERS: [Choice<Channel>; 4] = [
    ("red", "Red pixels, interpolated between them", Channel::Red),
    ("green", "Green pixels, interpolated between them", Channel::Green),
    ("blue", "Blue pixels, interpolated between them", Channel::Blue),
    ("gray", "All three together", Channel::Gray),
];

static STAMPS: [Choice<StampChoice>; 3] = [
    ("first-packet", "Arrival of the first packet, by the kernel", StampChoice::FirstPacket),
    ("complete", "Arrival of the last packet", StampChoice::Complete),
    (
        "exposure",
        "Start of the exposure by the camera's own clock, which is asked for the time again and again (latch)",
        StampChoice::Exposure,
    ),
];

#[derive(Args)]
#[command(group(ArgGroup::new("uses_calibration").multiple(true)))]
#[command(after_help = "Examples:
  trueline record --bind 192.168.125.10:6510 --sensor sensor.toml --out scan --for-s 60
  trueline robot-sim --pc 127.0.0.1:6510 --path plan &
  trueline record --bind 127.0.0.1:6510 --out scan
  trueline record --protocol ur-rtde --robot 192.168.0.10 --tool weld_tcp --out scan
  trueline record --bind 192.168.125.10:6510 --camera 192.168.1.64 --exposure-us 2000 --sensor sensor.toml --out scan \\
      --want time=0.1ms,translation=0.1mm,rotation=0.05deg --serve 8080
  trueline record --bind 192.168.125.10:6510 --camera 192.168.1.64 --sensor sensor.toml --out monday \\
      --watch cell.sqlite --calibration result.json        # every weld of the day as it ends

Written: OUT/recording.mcap, flushed four times a second; what was flushed survives whatever happens. Foxglove and Rerun open \
it, `trueline calibrate` reads it. Nothing that is sent moves the robot. A camera that is unplugged is waited for.

Exit code: 0 recorded, 1 recorded with reported losses (of the robot's packets more than a tenth) or an alarm of --watch, \
2 could not record.")]
pub(crate) struct RecordArgs {
    #[command(flatten)]
    pub(crate) link: LinkArgs,
    #[command(flatten)]
    pub(crate) camera: CameraArgs,
    /// Folder to write; it must not hold a recording
    #[arg(long)]
    pub(crate) out: PathBuf,
    /// sensor.toml, kept in the recording
    #[arg(long)]
    pub(crate) sensor: Option<PathBuf>,
    /// Name of the tool whose poses the controller sends, kept in the recording
    #[arg(long, default_value = "tool0")]
    pub(crate) tool: String,
    /// Watch every weld when it ends, with the cell's state file, as `trueline watch` does
    #[arg(long, value_name = "STATE", requires_all = ["calibration", "sensor"], group = "uses_calibration")]
    pub(crate) watch: Option<PathBuf>,
    /// The calibration in use: with --watch to compare the welds with, with --foxglove to show points in base
    #[arg(long, requires_all = ["uses_calibration", "sensor"])]
    pub(crate) calibration: Option<PathBuf>,
    /// With --watch: receiver of alarms, as for `trueline watch`
    #[arg(long, value_name = "URL", requires = "watch")]
    pub(crate) tell: Vec<String>,
    /// With --watch: a weld ends after this time without a seam point, s: longer than the pause between the seams of a part
    #[arg(long, default_value = "10", value_parser = number::duration, requires = "watch")]
    pub(crate) weld_pause_s: Duration,
    #[command(flatten)]
    pub(crate) serve: ServeArgs,
    #[command(flatten)]
    pub(crate) foxglove: FoxgloveArgs,
    /// How long, s [default: until Ctrl-C, or until the robot has been silent for 5 s]
    #[arg(long, value_parser = number::duration)]
    pub(crate) for_s: Option<Duration>,
    /// Print nothing but errors
    #[arg(long)]
    pub(crate) quiet: bool,
}

#[derive(Args)]
#[command(after_help = "Examples:
  trueline scan plan --write-limits limits.toml                 # limits to begin with; read and narrow them
  trueline scan plan --limits limits.toml                       # dry run: what would be sent; no socket is opened
  trueline scan plan --limits limits.toml --pace 0.1 --bind 192.168.125.10:6510 --robot 192.168.125.1 \\
      --enable-motion --out rehearsal                           # slowly first
  trueline scan plan --limits limits.toml --bind 192.168.125.10:6510 --robot 192.168.125.1 --enable-motion --out scan

The robot runs the module of `trueline robot-program abb --mode guidance`. Ctrl-C stops it smoothly along the path; a second Ctrl-C falls \
silent at once, and the controller stops by its own timeout. These limits are not safety-rated: fence, enabling \
device and emergency stop protect people, and EGM itself has no password: keep its network apart.

Exit code: 0 travelled to the end, 1 ended otherwise (reason printed), 2 could not run.")]
pub(crate) struct ScanArgs {
    /// A plan's folder, or a robot.csv with the path
    pub(crate) path: PathBuf,
    /// Limits of every command
    #[arg(long)]
    pub(crate) limits: Option<PathBuf>,
    /// Write the tightest limits that contain the path, for review before use, and do nothing else
    #[arg(long, conflicts_with_all = ["limits", "enable_motion", "bind", "robot", "out"])]
    pub(crate) write_limits: Option<PathBuf>,
    /// Distance from the tool's origin to the farthest point of its load, for derived limits [default: the planned sensor
    /// and 100 mm; without a plan 500]
    #[arg(long, conflicts_with = "limits", value_parser = number::reach_mm)]
    pub(crate) reach_mm: Option<f64>,
    /// Share of the path's own pace, up to 1
    #[arg(long, default_value_t = 1.0, value_parser = number::pace)]
    pub(crate) pace: f64,
    /// Lead the robot. Asks once more before anything moves
    #[arg(long, requires_all = ["limits", "bind", "robot", "out"])]
    pub(crate) enable_motion: bool,
    /// Address of this PC and port to listen at, for example 192.168.125.10:6510
    #[arg(long, value_name = "IP:PORT", requires = "enable_motion")]
    pub(crate) bind: Option<SocketAddr>,
    /// The robot's address: only this robot is commanded
    #[arg(long, value_name = "IP", requires = "enable_motion")]
    pub(crate) robot: Option<IpAddr>,
    /// Folder for the recording; it must not hold one
    #[arg(long, requires = "enable_motion")]
    pub(crate) out: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) camera: CameraArgs,
    /// sensor.toml, kept in the recording [default: the plan's]
    #[arg(long)]
    pub(crate) sensor: Option<PathBuf>,
    /// Name of the tool that is guided, kept in the recording
    #[arg(long, default_value = "tool0")]
    pub(crate) tool: String,
    /// Rest at the end, s: longer than \CondTime, so that the guidance ends by itself
    #[arg(long, default_value = "4", value_parser = number::hold)]
    pub(crate) hold_s: Duration,
    /// \CommTimeout of the RAPID module, s: a longer silence ends the scan
    #[arg(long, default_value_t = 0.2, value_parser = number::timeout_s)]
    pub(crate) timeout_s: f64,
    /// Longest wait for the controller to start guidance, s; after that nothing is commanded
    #[arg(long, default_value = "60", value_parser = number::armed)]
    pub(crate) armed_s: Duration,
    #[command(flatten)]
    pub(crate) serve: ServeArgs,
    #[command(flatten)]
    pub(crate) foxglove: FoxgloveArgs,
    /// Print nothing but errors and the question
    #[arg(long)]
    pub(crate) quiet: bool,
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;

    #[test]
    fn a_pixel_format_is_one_of_pictures() {
        assert_eq!(pixel_format("BayerRG12p").unwrap().name(), "BayerRG12p");
        for wrong in ["Coord3D_C16", "mono8", "YUV422_8"] {
            assert!(pixel_format(wrong).unwrap_err().contains("Mono12Packed"), "{wrong}");
        }
    }
}
