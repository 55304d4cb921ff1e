//! One session with one camera: from connecting to the last picture.

use super::block_ids::BlockIds;
use super::errors::connecting;
use super::latch::latched;
use super::picture;
use super::ptp::{self, PtpState};
use super::settings::GigeSettings;
use super::stamps::{LatchStamps, PacketStamps};
use crate::error::CameraError;
use crate::frame_source::{CameraFrame, FrameSource, FrameStatus, SourceAbout};
use crate::genicam::{
    Asked, Attended, ChunkNames, ChunkOrder, Features, Latch, Session, Told, Watch, begin, chunks, driver,
    exposure_us, next_picture, size, waiting_pictures,
};
use crate::latch_clock::LatchSample;
use std::time::{Duration, Instant};
use telegenic::gige::proto::bootstrap::{TIMESTAMP_TICK_FREQUENCY_HIGH, TIMESTAMP_TICK_FREQUENCY_LOW};
use telegenic::gige::{GigECamera, GigeConfig};
use telegenic::{
    Frame, FrameChannel, GenICamera, PacketSize, PayloadKind, SocketOption, StreamChannel, StreamConfig,
};
use trueline_live::HostClock;

/// The driver asks for a sign of life at a third of this, and the camera frees itself after it, ms.
const HEARTBEAT_MS: u32 = 1500;
/// A command is repeated after this, this many times; then the camera is gone. With the heartbeat the loss is known
/// within 1.2 s.
const ANSWER: Duration = Duration::from_millis(150);
const REPEATS: u8 = 3;
/// Room in the kernel for packets that wait to be read, in pictures and bytes: the kernel may give less.
const SOCKET_PICTURES: usize = 4;
const LEAST_SOCKET_BYTES: usize = 8 << 20;
/// Longer than the driver repeats a command.
const REGISTERS: Duration = Duration::from_secs(2);
const DISCONNECT: Duration = Duration::from_millis(300);

/// Counts of the pictures so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct GigeCounts {
    /// Pictures given, good or bad.
    pub frames: u64,
    /// Of these, pictures with packets lost for good.
    pub incomplete: u64,
    /// Missing pictures: gaps in the camera's counter.
    pub missing: u64,
    /// Packets that the camera sent again.
    pub resent_packets: u64,
    /// Packets that the kernel dropped because they were not read in time.
    pub socket_drops: u64,
    /// Pictures dropped because those before them were not taken in time.
    pub not_taken: u64,
    /// Pictures with chunk data of inconsistent lengths; their chunks are not used.
    pub bad_chunks: u64,
    /// Stray packets with a number that the camera's counter cannot have reached; dropped.
    pub stray: u64,
}

/// A camera that sends pictures.
pub struct GigeCamera {
    camera: GenICamera,
    stream: Option<StreamChannel>,
    frames: FrameChannel,
    packets: PacketStamps,
    chunk_names: ChunkNames,
    latch: Latch,
    latch_stamps: LatchStamps,
    watch: Watch,
    ids: BlockIds,
    last_frame: Option<u64>,
    clock: HostClock,
    last_packet_ns: i64,
    session: Session,
    about: SourceAbout,
    tick_hz: u64,
    exposure_us: Option<f64>,
    ptp: PtpState,
    counts: GigeCounts,
    /// Consequence of the last bad picture for the session.
    pending: Option<CameraError>,
    /// A camera that did not answer a repeated command is gone, even if it answers later: its pictures have a hole.
    gone: bool,
}

impl GigeCamera {
    /// Connects, sets the camera up, turns its automatics off and starts it. Stamps are on `clock`.
    ///
    /// # Errors
    /// [`CameraError::NotFound`], [`CameraError::Busy`], [`CameraError::Format`], [`CameraError::Feature`] or
    /// [`CameraError::Io`].
    pub fn open(settings: &GigeSettings, clock: HostClock) -> Result<Self, CameraError> {
        let latch_stamps = LatchStamps::new(clock);
        let mut camera = connect(settings, latch_stamps.clone())?;
        let (session, trigger) = begin(&mut camera, &settings.setup)?;
        let tick_hz = tick_hz(camera.transport());
        let chunk_names = chunk_names(&mut camera);
        let packets = PacketStamps::new(clock);
        let stream = open_stream(&mut camera, settings, packets.clone())?;
        let frames = stream.1.subscribe(stream.0);
        let mut opened = Self {
            about: SourceAbout { trigger, ..about(camera.transport(), session.size, tick_hz) },
            exposure_us: exposure_us(&mut camera),
            ptp: ptp::state(&mut camera),
            camera,
            stream: Some(stream.1),
            frames,
            packets,
            chunk_names,
            latch: Latch::new(clock),
            latch_stamps,
            watch: Watch::start(),
            ids: BlockIds::default(),
            last_frame: None,
            clock,
            last_packet_ns: clock.read().steady_ns,
            session,
            tick_hz,
            counts: GigeCounts::default(),
            pending: None,
            gone: false,
        };
        let _ = Features::set_integer(&mut opened.camera, "TLParamsLocked", 1);
        Features::execute(&mut opened.camera, "AcquisitionStart")?;
        Ok(opened)
    }

    /// One exchange with the camera's clock; `None` if the camera has none that can be latched.
    ///
    /// # Errors
    /// [`CameraError::Unplugged`].
    pub fn latch(&mut self) -> Result<Option<LatchSample>, CameraError> {
        let tick_hz = self.tick_hz;
        let camera = self.camera.transport();
        let exchange = || latched(camera, &self.latch_stamps);
        match self.latch.ask(exchange, |ticks| device_ns(ticks, tick_hz)) {
            Asked::Answer(sample) => Ok(Some(sample)),
            Asked::No => Ok(None),
            Asked::Silence => Err(self.unplugged()),
        }
    }

    /// Whether the camera's clock follows another, as it was when the session began.
    #[must_use]
    pub fn ptp(&self) -> PtpState {
        self.ptp.clone()
    }

    /// Counts of the pictures so far.
    #[must_use]
    pub fn counts(&self) -> GigeCounts {
        let stats = self.stream.as_ref().map(StreamChannel::stats).unwrap_or_default();
        GigeCounts {
            socket_drops: stats.socket_drops,
            not_taken: stats.underruns + stats.frames_dropped,
            ..self.counts
        }
    }

    fn unplugged(&mut self) -> CameraError {
        self.gone = true;
        let last_ns = self.packets.newest_ns().unwrap_or(i64::MIN).max(self.last_packet_ns);
        let silent_ns = self.clock.read().steady_ns - last_ns;
        CameraError::Unplugged { silent_s: silent_ns.max(0) as f64 * 1e-9 }
    }

    /// A picture; `None` for a stray packet.
    fn given(&mut self, frame: &Frame) -> Option<CameraFrame> {
        let packets = self.packets.take(frame.frame_id);
        let (status, seen) = picture::of(frame, packets.as_ref(), &self.session);
        let is_whole = !matches!(status, FrameStatus::Incomplete { .. });
        let Some(number) = self.ids.unwrapped(frame.frame_id, is_whole) else {
            self.counts.stray += 1;
            return None;
        };
        self.count(number, &status);
        self.counts.resent_packets += u64::from(packets.map_or(0, |p| p.resent));
        self.pending = self.session.verdict(&status);
        let complete_ns = packets.map_or_else(|| self.clock.read().steady_ns, |p| p.last_ns);
        self.last_packet_ns = self.last_packet_ns.max(complete_ns);
        let told = if is_whole { self.told_by_chunks(frame) } else { Told::default() };
        let ticks = told.ticks.or(Some(frame.timestamp_ticks).filter(|ticks| *ticks != 0));
        Some(CameraFrame {
            image: seen.image,
            profiles: seen.profiles,
            frame: number,
            device_ns: ticks.map(|ticks| device_ns(ticks, self.tick_hz)),
            first_packet_ns: packets.map(|p| p.first_ns),
            complete_ns,
            exposure_us: told.exposure_us.or(self.exposure_us),
            signals: told.signals,
            status,
        })
    }

    /// Statements of a frame's chunks, if the camera sends some.
    fn told_by_chunks(&mut self, frame: &Frame) -> Told {
        let has_chunks = matches!(frame.payload, PayloadKind::Image { has_chunks: true });
        match chunks(if has_chunks { frame.data() } else { &[] }, ChunkOrder::BigEndian) {
            Ok(chunks) => Told::by(&self.chunk_names, &chunks),
            Err(_) => {
                self.counts.bad_chunks += 1;
                Told::default()
            }
        }
    }

    fn count(&mut self, number: u64, status: &FrameStatus) {
        self.counts.frames += 1;
        self.counts.incomplete += u64::from(matches!(status, FrameStatus::Incomplete { .. }));
        if let Some(last) = self.last_frame.replace(number) {
            self.counts.missing += number.saturating_sub(last + 1);
        }
    }
}

impl Attended for GigeCamera {
    fn wait(&mut self, timeout: Duration) -> Result<Option<CameraFrame>, CameraError> {
        let until = Instant::now() + timeout;
        while let Some(frame) = self.frames.wait_for(until.saturating_duration_since(Instant::now())) {
            if let Some(picture) = self.given(&frame) {
                return Ok(Some(picture));
            }
        }
        Ok(None)
    }

    fn look(&mut self) -> Result<(), CameraError> {
        if self.gone || !self.camera.is_connected() {
            return Err(self.unplugged());
        }
        let answers = self.watch.look(&mut self.camera, &mut self.exposure_us)?;
        if answers { Ok(()) } else { Err(self.unplugged()) }
    }

    fn pending(&mut self) -> &mut Option<CameraError> {
        &mut self.pending
    }
}

impl FrameSource for GigeCamera {
    fn next(&mut self, timeout: Duration) -> Result<Option<CameraFrame>, CameraError> {
        next_picture(self, timeout)
    }

    fn latch(&mut self) -> Result<Option<LatchSample>, CameraError> {
        Self::latch(self)
    }

    fn about(&self) -> &SourceAbout {
        &self.about
    }
}

impl Drop for GigeCamera {
    fn drop(&mut self) {
        if self.camera.is_connected() {
            let _ = self.camera.execute("AcquisitionStop");
            let _ = self.camera.set_integer("TLParamsLocked", 0);
        }
        // The stream closes its channel through the connection, so it goes first.
        drop(self.stream.take());
        self.camera.disconnect(DISCONNECT);
    }
}

/// The chunks in the camera's description.
fn chunk_names(camera: &mut GenICamera) -> ChunkNames {
    let description = camera.transport_mut().genicam_xml().ok();
    description.map_or_else(ChunkNames::default, |xml| ChunkNames::of(&String::from_utf8_lossy(&xml)))
}

fn connect(settings: &GigeSettings, stamps: LatchStamps) -> Result<GenICamera, CameraError> {
    let mut config = GigeConfig::new(settings.address);
    config.heartbeat_timeout_ms = HEARTBEAT_MS;
    config.gvcp_timeout = ANSWER;
    config.retries = REPEATS;
    let mut transport = GigECamera::with_config(config);
    transport.set_telemetry(stamps);
    let mut camera = GenICamera::from_transport(transport);
    camera.connect().map_err(|error| connecting(error, settings.address))?;
    Ok(camera)
}

/// The stream, and how many pictures may wait.
fn open_stream(
    camera: &mut GenICamera,
    settings: &GigeSettings,
    stamps: PacketStamps,
) -> Result<(usize, StreamChannel), CameraError> {
    let payload = size(camera, "PayloadSize")? as usize;
    let waiting = waiting_pictures(payload);
    let config = StreamConfig {
        payload_size: Some(payload),
        packet_size: settings.packet_size.map_or(PacketSize::Auto, PacketSize::Fixed),
        n_buffers: waiting,
        stream_socket: vec![SocketOption::RecvBuffer(LEAST_SOCKET_BYTES.max(SOCKET_PICTURES * payload))],
        ..StreamConfig::new()
    };
    let stream = camera.transport().open_stream_with_telemetry(config, stamps);
    Ok((waiting, stream.map_err(|error| driver("stream", &error))?))
}

/// Zero where the camera does not tell.
fn tick_hz(camera: &GigECamera) -> u64 {
    let registers = vec![TIMESTAMP_TICK_FREQUENCY_HIGH, TIMESTAMP_TICK_FREQUENCY_LOW];
    let values = camera.read_registers(registers).ok().and_then(|asked| asked.wait_timeout(REGISTERS).ok());
    match values.as_deref() {
        Some([high, low]) => u64::from(*high) << 32 | u64::from(*low),
        _ => 0,
    }
}

fn device_ns(ticks: u64, tick_hz: u64) -> i64 {
    let ns = match tick_hz {
        0 | 1_000_000_000 => u128::from(ticks),
        hz => u128::from(ticks) * 1_000_000_000 / u128::from(hz),
    };
    i64::try_from(ns).unwrap_or(i64::MAX)
}

fn about(camera: &GigECamera, [width, height]: [u32; 2], tick_hz: u64) -> SourceAbout {
    let name = camera
        .device_info()
        .map(|info| format!("{} {} {}", info.manufacturer, info.model, info.serial).trim().to_owned());
    let unit = if tick_hz == 0 { "in ticks of unknown length" } else { "in nanoseconds" };
    SourceAbout {
        name: name.unwrap_or_default(),
        width: width as usize,
        height: height as usize,
        tick_hz: (tick_hz != 0).then_some(tick_hz as f64),
        trigger: None,
        stamp_meaning: format!(
            "the camera's clock in the leader of the picture, {unit}: start or end of the exposure, as its maker chose"
        ),
    }
}
