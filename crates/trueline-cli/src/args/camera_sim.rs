//! `trueline-testbench camera-sim`.

use crate::args::choice::one_of;
use crate::args::number;
use crate::args::simulate::{JOINTS_OF_PICTURES, LOOKS};
use clap::Args;
use std::net::{Ipv4Addr, SocketAddr};
use std::path::PathBuf;
use trueline_camera::device::{Chunks, DeviceClock, DeviceSettings};
use trueline_cell::{CameraWiring, WiredInput};
use trueline_sim::{Joint, Look};

#[derive(Args)]
#[command(after_help = "Example, a whole cell on this machine (three terminals):
  trueline plan --example --out plan --duration-s 30
  trueline-testbench camera-sim plan --robot-truth 127.0.0.1:7001 --fps 5 --for-s 120
  trueline-testbench robot-sim --pc 127.0.0.1:6510 --path plan --truth-to 127.0.0.1:7001
  trueline record --bind 127.0.0.1:6510 --camera 127.0.0.1 --sensor plan/sensor.toml --out cell

A GigE Vision camera at --address, or a profiler that sends range data (Coord3D_C16) where the plan's sensor is one: its pictures are drawn from where `robot-sim` truly is at each exposure, with hand-eye and line \
off the plan's guess as far as the plan allows for. Its own clock stamps the start of each exposure. The first \
packet leaves exposure, readout and latency later; drawing has to be done by then, else the picture is dropped. \
The true time offset of first-packet stamps is half the exposure + readout + latency (+ some 0.05 ms of network).")]
pub(crate) struct CameraSimArgs {
    /// A plan's folder
    pub(crate) plan: PathBuf,
    /// Address to which `robot-sim --truth-to` sends the robot's true pose
    #[arg(long, value_name = "IP:PORT")]
    pub(crate) robot_truth: SocketAddr,
    /// Wire its output (exposure active) to the input of `stream-sim --input-from`
    #[arg(long, value_name = "IP:PORT")]
    pub(crate) trigger_to: Option<SocketAddr>,
    /// Wire an encoder on the robot's path to its input Line1: a signal after this travel of the tool, mm, for `record
    /// --trigger Line1`
    #[arg(long, conflicts_with = "trigger_to", value_parser = number::above_zero)]
    pub(crate) encoder_mm: Option<f64>,
    /// Address of this machine to which a robot's digital output is wired (`--output-to` of `robot-sim` and `stream-sim`): its input
    /// Line1, for `record --trigger Line1`
    #[arg(long, value_name = "IP:PORT", conflicts_with_all = ["trigger_to", "encoder_mm"])]
    pub(crate) trigger_from: Option<SocketAddr>,
    /// Send chunk data with every picture: time, exposure, encoder, lines, counter of the trigger, number
    #[arg(long)]
    pub(crate) chunks: bool,
    /// Its sensor has a mosaic of colours (BayerRG8, BayerRG12p, … and RGB8), and the laser is red
    #[arg(long)]
    pub(crate) colours: bool,
    /// Address of this machine that the camera has
    #[arg(long, default_value = "127.0.0.1")]
    pub(crate) address: Ipv4Addr,
    /// Hand-eye and line as the plan's guess has them
    #[arg(long)]
    pub(crate) exact_guess: bool,
    /// Pictures a second
    #[arg(long, default_value_t = 5.0, value_parser = number::above_zero)]
    pub(crate) fps: f64,
    /// Exposure time, ms
    #[arg(long, default_value_t = 2.0, value_parser = number::above_zero)]
    pub(crate) exposure_ms: f64,
    /// Readout, ms
    #[arg(long, default_value_t = 4.0, value_parser = number::below_a_billion)]
    pub(crate) readout_ms: f64,
    /// From there to the first packet, ms: the time to draw the picture in
    #[arg(long, default_value_t = 150.0, value_parser = number::below_a_billion)]
    pub(crate) latency_ms: f64,
    /// How much its clock runs fast, ppm
    #[arg(long, default_value_t = 50.0, value_parser = number::camera_drift_ppm)]
    pub(crate) drift_ppm: f64,
    /// Its clock's reading at the start, s
    #[arg(long, default_value_t = 900.0, value_parser = number::below_a_billion)]
    pub(crate) epoch_s: f64,
    /// Its network, Mbit/s; 0 is no limit
    #[arg(long, default_value_t = 1000.0, value_parser = number::below_a_billion)]
    pub(crate) mbit_s: f64,
    /// Largest packet, bytes
    #[arg(long, default_value_t = 9000, value_parser = clap::value_parser!(u16).range(100..=9200))]
    pub(crate) packet_bytes: u16,
    /// Share of packets that are lost (and can be asked for again)
    #[arg(long, default_value_t = 0.0, value_parser = number::partial_share)]
    pub(crate) loss: f64,
    /// Share of pictures that are dropped
    #[arg(long, default_value_t = 0.0, value_parser = number::partial_share)]
    pub(crate) frame_drop: f64,
    /// How the plates look
    #[arg(long, value_parser = one_of(&LOOKS), default_value = "clean")]
    pub(crate) look: fn() -> Look,
    /// Joint type
    #[arg(long, value_parser = one_of(&JOINTS_OF_PICTURES), default_value = "fillet")]
    pub(crate) joint: fn() -> Joint,
    /// Profiles in a frame of a profiler, evenly spaced over its time
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub(crate) profiles_per_frame: u32,
    /// Write the truth: time offset of first-packet stamps, hand-eye, line
    #[arg(long)]
    pub(crate) truth: Option<PathBuf>,
    /// How long, s [default: until Ctrl-C]
    #[arg(long, value_parser = number::above_zero)]
    pub(crate) for_s: Option<f64>,
    /// The cable is pulled after so long, s
    #[arg(long, value_parser = number::above_zero)]
    pub(crate) unplug_at_s: Option<f64>,
    /// Seed of the errors of the guess, of noise and loss
    #[arg(long, default_value_t = 1)]
    pub(crate) seed: u64,
    /// Print nothing but errors
    #[arg(long)]
    pub(crate) quiet: bool,
}

impl CameraSimArgs {
    /// How its pictures look.
    pub(crate) fn look(&self) -> Look {
        Look { exposure_s: self.exposure_ms * 1e-3, ..(self.look)() }
    }

    /// Upper limit of the exposure of a sensor that takes this many rows one after the other, s.
    pub(crate) fn longest_exposure_s(&self) -> f64 {
        1.0 / (self.fps * f64::from(self.profiles_per_frame))
    }

    /// Its wiring.
    pub(crate) fn wiring(&self) -> CameraWiring {
        let by_encoder = self.encoder_mm.map(|mm| WiredInput::Encoder { step_m: mm * 1e-3 });
        let input = by_encoder.or(self.trigger_from.map(WiredInput::Robot));
        CameraWiring { output_to: self.trigger_to, input }
    }

    /// The true time offset of first-packet stamps, s.
    pub(crate) fn time_offset_s(&self) -> f64 {
        1e-3 * (0.5 * self.exposure_ms + self.readout_ms + self.latency_ms)
    }

    /// The camera, whatever its sensor.
    pub(crate) fn device(&self) -> DeviceSettings {
        DeviceSettings {
            address: self.address,
            period_s: 1.0 / self.fps,
            exposure_us: self.exposure_ms * 1e3,
            readout_s: self.readout_ms * 1e-3,
            latency_s: self.latency_ms * 1e-3,
            clock: DeviceClock {
                epoch_ns: (self.epoch_s * 1e9) as i64,
                drift_ppm: self.drift_ppm,
                ..DeviceClock::default()
            },
            packet_bytes: self.packet_bytes,
            pace_bits_per_s: self.mbit_s * 1e6,
            loss: self.loss,
            frame_drop: self.frame_drop,
            seed: self.seed,
            serial: format!("SIM-{}", self.seed),
            chunks: self.chunks.then_some(Chunks::Good),
            has_colours: self.colours,
            ..DeviceSettings::small(self.address)
        }
    }
}
