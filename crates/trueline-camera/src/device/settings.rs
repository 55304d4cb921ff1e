//! Settings of the simulation.

use super::device_clock::DeviceClock;
use std::net::Ipv4Addr;

/// A simulated camera.
#[derive(Clone, Debug, PartialEq)]
pub struct DeviceSettings {
    /// Address of this machine that it answers at; the port is 3956, as of every such camera.
    pub address: Ipv4Addr,
    /// Columns of the sensor, px.
    pub width: u32,
    /// Rows of the sensor, px.
    pub height: u32,
    /// Between the starts of two exposures, s of the camera's clock, until a program sets a frame rate.
    pub period_s: f64,
    /// Exposure time until a program sets another, µs.
    pub exposure_us: f64,
    /// From the end of the exposure until the sensor is read out, s.
    pub readout_s: f64,
    /// From there until the first packet leaves, s: the time that making the picture may take.
    pub latency_s: f64,
    /// Its clock.
    pub clock: DeviceClock,
    /// Largest packet on the wire, bytes.
    pub packet_bytes: u16,
    /// Speed of its network, bit/s; 0 for no limit.
    pub pace_bits_per_s: f64,
    /// Share of packets that are lost.
    pub loss: f64,
    /// Share of pictures that are dropped.
    pub frame_drop: f64,
    /// Seed of the random numbers.
    pub seed: u64,
    /// Serial number; 15 characters count.
    pub serial: String,
    /// Chunk data behind the pixels; `None` for none.
    pub chunks: Option<Chunks>,
    /// It is a profiler: its pictures are profiles, a row each; `None` for a camera.
    pub range: Option<RangeFeatures>,
    /// Its sensor has a mosaic of colours, and the scene is lit by a red laser.
    pub has_colours: bool,
    /// It has triggers, all of them off at first.
    pub can_be_triggered: bool,
}

/// The event that a trigger starts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TriggerOf {
    /// All pictures.
    Acquisition,
    /// Each picture, or each frame of a profiler.
    Frame,
    /// Each row of a profiler.
    Row,
}

/// Form of the chunk data: the picture, the camera's time, the exposure time and the state of its inputs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Chunks {
    /// As the standard has it.
    Good,
    /// With a length that lies.
    Lying,
}

impl Chunks {
    /// Bytes behind the pixels: time, exposure time and number of the picture, encoder, lines and counter, and seven times identifier
    /// and length.
    pub(super) const BYTES: usize = 3 * 8 + 3 * 4 + 7 * 8;
}

/// Statements of a simulated profiler about its numbers. Its pictures hold the numbers of coordinate C in 16 bits;
/// coordinate A follows from the column. It starts with `Coord3D_C16`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RangeFeatures {
    /// Scale and offset of coordinate A, mm.
    pub along_mm: [f64; 2],
    /// Scale and offset of coordinate C, mm.
    pub range_mm: [f64; 2],
    /// The number for no return.
    pub invalid: u16,
    /// Profiles per second, Hz. A frame takes one period per row, so the frame rate is this over the height.
    pub lines_hz: f64,
    /// Kind of its numbers, in the words of `Scan3dOutputMode`.
    pub output_mode: OutputMode,
}

/// Kind of a profiler's numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OutputMode {
    /// Rows on the detector.
    UncalibratedC,
    /// Ranges in columns that are evenly spaced along the stripe.
    RectifiedC,
    /// Both coordinates.
    CalibratedAc,
}

impl DeviceSettings {
    /// A small sensor on a good network.
    #[must_use]
    pub fn small(address: Ipv4Addr) -> Self {
        Self {
            address,
            width: 320,
            height: 240,
            period_s: 0.02,
            exposure_us: 2000.0,
            readout_s: 0.002,
            latency_s: 0.005,
            clock: DeviceClock::default(),
            packet_bytes: 1500,
            pace_bits_per_s: 1e9,
            loss: 0.0,
            frame_drop: 0.0,
            seed: 1,
            serial: "SIM-1".to_owned(),
            chunks: None,
            range: None,
            has_colours: false,
            can_be_triggered: true,
        }
    }
}
