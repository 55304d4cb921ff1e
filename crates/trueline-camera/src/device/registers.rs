//! The registers of the device and the description by which programs find them.

use super::settings::{Chunks, DeviceSettings, OutputMode, RangeFeatures, TriggerOf};
use crate::pixel_format::PixelFormat;
use crate::trigger::TriggerEdge;
use std::net::SocketAddr;
use telegenic::emulator::{DeviceConfig, GigeDevice, Reaction, XML_ADDRESS};
use telegenic::gige::proto::bootstrap as standard;

const WIDTH: u32 = 0x2000;
const HEIGHT: u32 = 0x2004;
const ACQUISITION: u32 = 0x2008;
const ACQUISITION_MODE: u32 = 0x200C;
const PIXEL_FORMAT: u32 = 0x2010;
const EXPOSURE: u32 = 0x2014;
const EXPOSURE_AUTO: u32 = 0x201C;
const FRAME_RATE: u32 = 0x2020;
const OFFSET_X: u32 = 0x2024;
const OFFSET_Y: u32 = 0x2028;
const GAIN_AUTO: u32 = 0x202C;
const PTP_ENABLE: u32 = 0x2030;
const PTP_STATUS: u32 = 0x2034;
/// Mode, source and activation of each trigger, a block each.
const TRIGGERS: u32 = 0x2200;
const TRIGGER_BLOCK: u32 = 16;
const ACQUISITION_START: u32 = 0;
const FRAME_START: u32 = 1;
const LINE_START: u32 = 2;
/// The input that something may be wired to.
const LINE_1: u32 = 1;
const OUTPUT_MODE: u32 = 0x2100;
const LINE_RATE: u32 = 0x2108;
/// Scale, offset, invalid number and its use, of coordinate A and of coordinate C.
const COORDINATES: [u32; 2] = [0x2120, 0x2160];

const CONTINUOUS: u32 = 0;
const AUTO_CONTINUOUS: u32 = 2;
const PTP_LISTENING: u32 = 3;
const PTP_SLAVE: u32 = 8;
/// Big-endian, UTF-8.
const DEVICE_MODE: u32 = 0x8000_0001;
/// Persistent and link-local addresses.
const IP_CONFIG: u32 = 5;
const DESCRIPTION: &str = include_str!("description.xml");
const RANGE_FEATURES: &str = include_str!("range_features.xml");
const TRIGGER_FEATURES: &str = include_str!("trigger_features.xml");
const LINE_START_ENTRY: &str = r#"<EnumEntry Name="LineStart"><Value>2</Value></EnumEntry>"#;
const COLOUR_FORMATS: &str = r#"<EnumEntry Name="BayerRG8"><Value>17301513</Value></EnumEntry><EnumEntry Name="BayerRG12"><Value>17825809</Value></EnumEntry><EnumEntry Name="BayerRG10p"><Value>17432664</Value></EnumEntry><EnumEntry Name="BayerRG12p"><Value>17563737</Value></EnumEntry><EnumEntry Name="RGB8"><Value>35127316</Value></EnumEntry>"#;
const RANGE_FORMATS: &str = r#"<EnumEntry Name="Coord3D_C16"><Value>17825976</Value></EnumEntry><EnumEntry Name="Coord3D_AC16"><Value>35651771</Value></EnumEntry>"#;
/// A stripe of a camera is seen in rows by pairs.
const LEAST_HEIGHT_OF_PICTURES: &str = "2";
/// From the description's address to the end of the memory.
const DESCRIPTION_ROOM: usize = 0x8000;
const SERIAL_ROOM: usize = standard::SERIAL_NUMBER_SIZE - 1;
/// Allowed exposure times, µs.
const EXPOSURES_US: [f64; 2] = [1.0, 1e6];
/// Allowed frame rates, Hz.
const FRAME_RATES: [f64; 2] = [0.1, 1000.0];

/// The registers.
pub(super) struct Registers {
    device: GigeDevice,
    period_s: f64,
    /// The frame rate register as it started: as long as it stands, the period is the exact one.
    frame_rate: u32,
    range: Option<RangeFeatures>,
}

/// Present settings of a program.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Wanted {
    /// Columns and rows, px.
    pub size: [u32; 2],
    /// First column and row, px.
    pub offset: [u32; 2],
    /// Format; `None` for a code that is not known.
    pub format: Option<PixelFormat>,
    /// Exposure time, s.
    pub exposure_s: f64,
    /// Between exposures, s of the camera's clock.
    pub period_s: f64,
    /// Size of a packet on the wire, bytes.
    pub packet_bytes: u32,
    /// Between the rows of a profiler, s of its clock; 0 for a camera, which exposes all at once.
    pub line_period_s: f64,
    /// Whether one picture is enough.
    pub single: bool,
    /// Trigger of each picture, or of each row of a profiler; `None` if it runs freely.
    pub trigger: Option<WantedTrigger>,
    /// Destination of the packets.
    pub to: SocketAddr,
}

/// A signal that something waits for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct WantedTrigger {
    /// Which changes count.
    pub edge: TriggerEdge,
    /// Each row waits for one, and not the whole frame.
    pub each_row: bool,
    /// Whether it is the input that something may be wired to.
    pub is_wired: bool,
}

impl Registers {
    /// As after switching on.
    pub(super) fn new(settings: &DeviceSettings) -> Self {
        let [a, b, c, d] = settings.address.octets();
        let config = DeviceConfig {
            width: settings.width,
            height: settings.height,
            exposure_us: settings.exposure_us as f32,
            gain: 1.0,
            manufacturer: "trueline".to_owned(),
            model: "Simulated".to_owned(),
            device_version: env!("CARGO_PKG_VERSION").to_owned(),
            serial: settings.serial.chars().filter(char::is_ascii).take(SERIAL_ROOM).collect(),
            mac: [2, 0, a, b, c, d],
        };
        let mut device = GigeDevice::new(settings.address, &config);
        let frame_rate = ((1.0 / settings.period_s) as f32).to_bits();
        for (register, value) in [
            (standard::DEVICE_MODE, DEVICE_MODE),
            (standard::SUPPORTED_IP_CONFIG, IP_CONFIG),
            (standard::CURRENT_IP_CONFIG, IP_CONFIG),
            (standard::N_NETWORK_INTERFACES, 1),
            (standard::STREAM_CHANNEL_PACKET_SIZE, u32::from(settings.packet_bytes)),
            (ACQUISITION_MODE, CONTINUOUS),
            (FRAME_RATE, frame_rate),
            (PTP_STATUS, PTP_LISTENING),
        ] {
            device.write_reg(register, value);
        }
        device.set_packet_resend(true);
        device.set_max_packet_size(Some(settings.packet_bytes));
        let mut registers = Self { device, period_s: settings.period_s, frame_rate, range: settings.range };
        registers.set_range(settings.range.as_ref());
        registers.describe(settings);
        registers
    }

    fn describe(&mut self, settings: &DeviceSettings) {
        let [features, formats, least_height, line_start] = match settings.range {
            Some(_) => [RANGE_FEATURES, RANGE_FORMATS, "1", LINE_START_ENTRY],
            None => ["", "", LEAST_HEIGHT_OF_PICTURES, ""],
        };
        let colours = if settings.has_colours { COLOUR_FORMATS } else { "" };
        let trigger = if settings.can_be_triggered { TRIGGER_FEATURES } else { "" };
        let xml = DESCRIPTION
            .replace("COLOUR_FORMATS", colours)
            .replace("TRIGGER_FEATURES", trigger)
            .replace("LINE_START", line_start)
            .replace("RANGE_FEATURES", features)
            .replace("CHUNK_BYTES", &settings.chunks.map_or(0, |_| Chunks::BYTES).to_string())
            .replace("RANGE_FORMATS", formats)
            .replace("LEAST_HEIGHT", least_height)
            .replace("SENSOR_WIDTH", &settings.width.to_string())
            .replace("SENSOR_HEIGHT", &settings.height.to_string());
        let url = format!("Local:trueline.xml;{XML_ADDRESS:X};{:X}", xml.len());
        self.put(XML_ADDRESS, xml.as_bytes(), DESCRIPTION_ROOM);
        self.put(standard::XML_URL_0, url.as_bytes(), standard::XML_URL_SIZE);
    }

    fn set_range(&mut self, range: Option<&RangeFeatures>) {
        let Some(range) = range else { return };
        let mode = match range.output_mode {
            OutputMode::UncalibratedC => 0,
            OutputMode::CalibratedAc => 3,
            OutputMode::RectifiedC => 7,
        };
        let format = match range.output_mode {
            OutputMode::CalibratedAc => PixelFormat::Coord3dAc16,
            OutputMode::UncalibratedC | OutputMode::RectifiedC => PixelFormat::Coord3dC16,
        };
        self.device.write_reg(OUTPUT_MODE, mode);
        self.device.write_reg(PIXEL_FORMAT, format.code());
        self.put(LINE_RATE, &range.lines_hz.to_be_bytes(), 8);
        // A column is a number as any other.
        let coordinates = [(range.along_mm, None), (range.range_mm, Some(range.invalid))];
        for (address, ([scale, offset], invalid)) in COORDINATES.into_iter().zip(coordinates) {
            for (place, number) in [scale, offset, f64::from(invalid.unwrap_or(0))].into_iter().enumerate() {
                self.put(address + 8 * place as u32, &number.to_be_bytes(), 8);
            }
            self.device.write_reg(address + 24, u32::from(invalid.is_some()));
        }
    }

    fn put(&mut self, address: u32, bytes: &[u8], room: usize) {
        let mut bytes = bytes.to_vec();
        bytes.resize(room, 0);
        let words = bytes.chunks_exact(4).map(|b| u32::from_be_bytes([b[0], b[1], b[2], b[3]]));
        for (at, word) in (address..).step_by(4).zip(words) {
            self.device.write_reg(at, word);
        }
    }

    /// Sets the source of the packets of pictures.
    pub(crate) fn set_stream_port(&mut self, port: u16) {
        self.device.write_reg(standard::STREAM_CHANNEL_SOURCE_PORT, u32::from(port));
    }

    /// Lets the registers answer a command.
    pub(super) fn answer(&mut self, command: &[u8], from: SocketAddr) -> Reaction {
        self.device.handle_datagram(command, from)
    }

    /// Destination of the pictures' packets, if a program opened the stream.
    pub(crate) fn stream_to(&self) -> Option<SocketAddr> {
        self.device.stream_dest()
    }

    /// How long a program in control may be silent, ms.
    pub(crate) fn heartbeat_ms(&self) -> u32 {
        self.device.read_reg(standard::HEARTBEAT_TIMEOUT).max(500)
    }

    /// Shows a latched clock, ns.
    pub(super) fn latch(&mut self, device_ns: i64) {
        let ticks = device_ns.cast_unsigned();
        self.device.write_reg(standard::TIMESTAMP_LATCHED_HIGH, (ticks >> 32) as u32);
        self.device.write_reg(standard::TIMESTAMP_LATCHED_LOW, ticks as u32);
    }

    /// Without control there are no pictures either.
    pub(super) fn release(&mut self) {
        for register in [standard::CONTROL_CHANNEL_PRIVILEGE, ACQUISITION, standard::STREAM_CHANNEL_PORT] {
            self.device.write_reg(register, 0);
        }
    }

    /// Present settings of a program; `None` while it wants no pictures.
    pub(super) fn wanted(&self) -> Option<Wanted> {
        let read = |register| self.device.read_reg(register);
        let to = self.device.stream_dest().filter(|_| read(ACQUISITION) == 1)?;
        // The start of the acquisition has no wire.
        if self.trigger(ACQUISITION_START).is_some() {
            return None;
        }
        let of_row = self.range.and_then(|_| self.trigger(LINE_START));
        let real = |register, [least, most]: [f64; 2]| {
            f64::from(f32::from_bits(read(register))).max(least).min(most)
        };
        let line_period_s = self.range.map_or(0.0, |range| 1.0 / range.lines_hz);
        let period_s = if self.range.is_some() {
            line_period_s * f64::from(read(HEIGHT))
        } else if read(FRAME_RATE) == self.frame_rate {
            self.period_s
        } else {
            1.0 / real(FRAME_RATE, FRAME_RATES)
        };
        Some(Wanted {
            size: [read(WIDTH), read(HEIGHT)],
            offset: [read(OFFSET_X), read(OFFSET_Y)],
            format: PixelFormat::of_code(read(PIXEL_FORMAT)),
            exposure_s: real(EXPOSURE, EXPOSURES_US) * 1e-6,
            period_s,
            packet_bytes: read(standard::STREAM_CHANNEL_PACKET_SIZE) & standard::SCPS_PACKET_SIZE_MASK,
            line_period_s,
            single: read(ACQUISITION_MODE) != CONTINUOUS,
            trigger: of_row.map(|row| WantedTrigger { each_row: true, ..row }).or(self.trigger(FRAME_START)),
            to,
        })
    }

    /// A trigger that is on.
    fn trigger(&self, selector: u32) -> Option<WantedTrigger> {
        let at = TRIGGERS + TRIGGER_BLOCK * selector;
        let [mode, source, activation] = [0, 4, 8].map(|place| self.device.read_reg(at + place));
        let edge = match activation {
            0 => TriggerEdge::Rising,
            1 => TriggerEdge::Falling,
            _ => TriggerEdge::Any,
        };
        (mode == 1).then_some(WantedTrigger { edge, each_row: false, is_wired: source == LINE_1 })
    }

    /// As if a program had set one of the triggers: that of the acquisition, of each frame or of each row; the input is `Line1`.
    pub(super) fn set_trigger(&mut self, of: TriggerOf, on: bool) {
        let selector = match of {
            TriggerOf::Acquisition => ACQUISITION_START,
            TriggerOf::Frame => FRAME_START,
            TriggerOf::Row => LINE_START,
        };
        let at = TRIGGERS + TRIGGER_BLOCK * selector;
        self.device.write_reg(at, u32::from(on));
        self.device.write_reg(at + 4, LINE_1);
    }

    /// Ends the acquisition of a single picture.
    pub(crate) fn end_acquisition(&mut self) {
        self.device.clear_acquisition();
    }

    /// As if a program or the camera itself had changed it.
    pub(super) fn set_size(&mut self, width: u32, height: u32) {
        self.device.write_reg(WIDTH, width);
        self.device.write_reg(HEIGHT, height);
    }

    /// As if a program or the camera itself had changed it.
    pub(crate) fn set_format(&mut self, format: PixelFormat) {
        self.device.write_reg(PIXEL_FORMAT, format.code());
    }

    /// As if a program or the camera itself had changed it.
    pub(super) fn set_exposure_auto(&mut self, on: bool) {
        self.device.write_reg(EXPOSURE_AUTO, if on { AUTO_CONTINUOUS } else { 0 });
    }

    /// As if a program or the camera itself had changed it.
    pub(super) fn set_gain_auto(&mut self, on: bool) {
        self.device.write_reg(GAIN_AUTO, if on { AUTO_CONTINUOUS } else { 0 });
    }

    /// Switches the precision time protocol on, and has it follow a clock or look for one.
    pub(super) fn set_ptp(&mut self, on: bool, slave: bool) {
        self.device.write_reg(PTP_ENABLE, u32::from(on));
        self.device.write_reg(PTP_STATUS, if slave { PTP_SLAVE } else { PTP_LISTENING });
    }
}
