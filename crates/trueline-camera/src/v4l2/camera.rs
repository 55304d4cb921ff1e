//! One session with one device.

use super::layout::Layout;
use super::stamps::{self, Stamped};
use crate::error::CameraError;
use crate::frame_source::{CameraFrame, FrameSource, FrameStatus, SourceAbout};
use crate::latch_clock::LatchSample;
use crate::pixel_format::PixelFormat;
use std::io;
use std::path::PathBuf;
use std::time::Duration;
use trueline_dataset::{Channel, FrameSignals};
use trueline_live::HostClock;
use v4l::buffer::{Flags, Metadata, Type};
use v4l::capability::Flags as Can;
use v4l::control::{Control, Value};
use v4l::io::mmap::Stream;
use v4l::io::traits::CaptureStream;
use v4l::video::Capture;
use v4l::video::capture::Parameters;
use v4l::{Device, Format, FourCC, Fraction};

/// Buffers of the kernel: one is being read, others are filled meanwhile.
const BUFFERS: u32 = 8;
/// How long the first picture may take.
const FIRST: Duration = Duration::from_secs(5);
/// Something can be read: an event of poll.
const POLLIN: i16 = 1;
/// Controls of the kernel \[Linux, v4l2-controls.h\]: exposure by hand, its time, automatic gain.
const EXPOSURE_AUTO: u32 = 0x009a_0901;
const EXPOSURE_ABSOLUTE: u32 = 0x009a_0902;
const AUTOGAIN: u32 = 0x0098_0912;
const BY_HAND: i64 = 1;
/// The unit of an exposure time, µs.
const EXPOSURE_STEP_US: f64 = 100.0;
/// Errors of the operating system: the device is gone; another program has it; there is no such control.
const ENODEV: i32 = 19;
const EBUSY: i32 = 16;
const EINVAL: i32 = 22;
const ENOTTY: i32 = 25;
/// The rate is stated in thousandths of a hertz.
const RATE_DENOMINATOR: u32 = 1000;

/// Settings of a device; `None` changes nothing.
#[derive(Clone, Debug, PartialEq)]
pub struct V4l2Settings {
    /// The device's file: `/dev/video0`.
    pub path: PathBuf,
    /// Columns and rows, px.
    pub size: Option<[u32; 2]>,
    /// Pixel format.
    pub pixel: Option<PixelFormat>,
    /// The channel used of a colour picture; mosaics and RGB need it.
    pub channel: Option<Channel>,
    /// Exposure time, µs; in steps of 100.
    pub exposure_us: Option<f64>,
    /// Pictures a second, Hz.
    pub fps: Option<f64>,
}

/// A device that gives pictures.
pub struct V4l2Camera {
    stream: Stream<'static>,
    path: String,
    clock: HostClock,
    session: Session,
    about: SourceAbout,
    numbers: Numbers,
    exposure_us: Option<f64>,
    /// The first picture is taken when the device is opened: it shows the kind of stamps.
    first: Option<CameraFrame>,
    stamped: Stamped,
    last_ns: i64,
}

/// Properties that all pictures of a session share.
#[derive(Clone, Copy)]
struct Session {
    layout: Layout,
    size: [u32; 2],
    stride: usize,
    channel: Channel,
}

impl V4l2Camera {
    /// Opens a device, sets it up, turns its automatics off and waits for the first picture. Stamps are on `clock`.
    ///
    /// # Errors
    /// A device that is missing, busy, not a camera, cannot be set as requested, or gives no picture within five
    /// seconds.
    pub fn open(settings: &V4l2Settings, clock: HostClock) -> Result<Self, CameraError> {
        let path = settings.path.display().to_string();
        let failed = |what: &'static str| move |error: io::Error| of_device(&path_of(settings), what, &error);
        let device = Device::with_path(&settings.path).map_err(failed("it cannot be opened"))?;
        let can = device.query_caps().map_err(failed("it is not a video device"))?;
        if !can.capabilities.contains(Can::VIDEO_CAPTURE | Can::STREAMING) {
            return Err(CameraError::Video { device: path, why: "it does not give pictures".to_owned() });
        }
        let session = set_up(&device, settings)?;
        let mut stream =
            Stream::with_buffers(&device, Type::VideoCapture, BUFFERS).map_err(failed("buffers"))?;
        stream.set_timeout(FIRST);
        let mut opened = Self {
            about: about(&can.card, &can.bus, session.size),
            stream,
            path,
            clock,
            session,
            numbers: Numbers::default(),
            exposure_us: settings.exposure_us,
            first: None,
            stamped: Stamped::Unknown,
            last_ns: clock.read().steady_ns,
        };
        opened.first = Some(opened.take()?);
        opened.about.stamp_meaning = opened.stamped.meaning().to_owned();
        Ok(opened)
    }

    /// The next picture of the stream; waits for it.
    fn take(&mut self) -> Result<CameraFrame, CameraError> {
        let silent_ns = self.clock.read().steady_ns - self.last_ns;
        let (data, meta) = match self.stream.next() {
            Ok(taken) => taken,
            Err(error) if error.raw_os_error() == Some(ENODEV) => {
                return Err(CameraError::Unplugged { silent_s: silent_ns.max(0) as f64 * 1e-9 });
            }
            Err(error) if error.kind() == io::ErrorKind::TimedOut => {
                let why = format!("no picture within {} s", FIRST.as_secs());
                return Err(CameraError::Video { device: self.path.clone(), why });
            }
            Err(error) => return Err(of_device(&self.path, "a picture", &error)),
        };
        let read_ns = self.clock.read().steady_ns;
        self.last_ns = read_ns;
        self.stamped = Stamped::by(meta.flags);
        let Session { layout, size, stride, channel } = self.session;
        let used = data.get(..meta.bytesused as usize).unwrap_or(data);
        let is_good = !meta.flags.contains(Flags::ERROR);
        let image = if is_good { layout.picture(used, size, stride, channel) } else { None };
        let status =
            if image.is_some() { FrameStatus::Complete } else { FrameStatus::Incomplete { missing: 1 } };
        Ok(CameraFrame {
            image,
            profiles: Vec::new(),
            frame: self.numbers.unwrapped(meta.sequence),
            exposure_us: self.exposure_us,
            signals: FrameSignals::default(),
            status,
            ..stamped(self.stamped, meta, read_ns, self.clock)
        })
    }
}

/// A frame with nothing but its stamps, ns; it was read at a steady time.
fn stamped(stamped: Stamped, meta: &Metadata, read_ns: i64, clock: HostClock) -> CameraFrame {
    let machine_ns = stamps::machine_ns(meta);
    let steady_ns = stamps::steady_ns(machine_ns, clock);
    let (device_ns, first_packet_ns, complete_ns) = match stamped {
        Stamped::Beginning => (Some(machine_ns), Some(steady_ns), read_ns),
        Stamped::End => (None, None, steady_ns),
        Stamped::Unknown => (None, None, read_ns),
    };
    CameraFrame {
        image: None,
        profiles: Vec::new(),
        frame: 0,
        device_ns,
        first_packet_ns,
        complete_ns,
        exposure_us: None,
        signals: FrameSignals::default(),
        status: FrameStatus::Complete,
    }
}

impl FrameSource for V4l2Camera {
    fn next(&mut self, timeout: Duration) -> Result<Option<CameraFrame>, CameraError> {
        if let Some(first) = self.first.take() {
            return Ok(Some(first));
        }
        let timeout_ms = i32::try_from(timeout.as_millis()).unwrap_or(i32::MAX);
        match self.stream.handle().poll(POLLIN, timeout_ms) {
            Ok(0) => Ok(None),
            // Also if the device is gone: taking a picture reports it.
            Ok(_) => self.take().map(Some),
            Err(error) if error.kind() == io::ErrorKind::Interrupted => Ok(None),
            Err(error) => Err(of_device(&self.path, "waiting", &error)),
        }
    }

    fn about(&self) -> &SourceAbout {
        &self.about
    }

    /// The clock of the stamps is this machine's own.
    fn latch(&mut self) -> Result<Option<LatchSample>, CameraError> {
        Ok((self.stamped == Stamped::Beginning).then(|| stamps::latch(self.clock)))
    }
}

/// Makes a counter that never falls of one of 32 bits.
#[derive(Clone, Copy, Debug, Default)]
struct Numbers {
    last: Option<(u32, u64)>,
}

impl Numbers {
    fn unwrapped(&mut self, sequence: u32) -> u64 {
        let number = match self.last {
            None => u64::from(sequence),
            Some((last, number)) => match sequence.wrapping_sub(last) {
                ahead @ 1..=0x7fff_ffff => number + u64::from(ahead),
                // It restarted: the number of lost pictures is unknown.
                _ => number + 1,
            },
        };
        self.last = Some((sequence, number));
        number
    }
}

fn path_of(settings: &V4l2Settings) -> String {
    settings.path.display().to_string()
}

fn about(card: &str, bus: &str, [width, height]: [u32; 2]) -> SourceAbout {
    SourceAbout {
        name: format!("{card} at {bus}"),
        width: width as usize,
        height: height as usize,
        tick_hz: Some(1e9),
        stamp_meaning: String::new(),
        trigger: None,
    }
}

fn of_device(device: &str, what: &str, error: &io::Error) -> CameraError {
    if error.raw_os_error() == Some(EBUSY) {
        return CameraError::Busy { at: device.to_owned() };
    }
    CameraError::Video { device: device.to_owned(), why: format!("{what}: {error}") }
}

/// Sets format, size, rate and exposure, and refuses different values of the device.
fn set_up(device: &Device, settings: &V4l2Settings) -> Result<Session, CameraError> {
    let path = path_of(settings);
    let refused = |why: String| CameraError::Video { device: path.clone(), why };
    let failed = |what: &'static str| move |error: io::Error| of_device(&path_of(settings), what, &error);
    let now = device.format().map_err(failed("its format"))?;
    let code = match settings.pixel {
        None => now.fourcc.repr,
        Some(format) => Layout::code_of(format)
            .ok_or_else(|| refused(format!("{format} has no code of Video4Linux that is understood")))?,
    };
    let [width, height] = settings.size.unwrap_or([now.width, now.height]);
    let wanted = Format { width, height, ..Format::new(width, height, FourCC::new(&code)) };
    let format = device.set_format(&wanted).map_err(failed("its format"))?;
    let offered = || {
        let formats = device.enum_formats().unwrap_or_default();
        formats.iter().map(|format| format.fourcc.to_string()).collect::<Vec<_>>().join(", ")
    };
    if format.fourcc.repr != code {
        let wanted = FourCC::new(&code).to_string();
        return Err(CameraError::Format { wanted, offered: offered() });
    }
    if [format.width, format.height] != [width, height] {
        let why = format!(
            "{width} x {height} px were requested, but it gives {} x {}",
            format.width, format.height
        );
        return Err(refused(why));
    }
    let Some(layout) = Layout::of_code(code) else {
        let wanted =
            "GREY, Y10, Y12, Y16, YUYV, UYVY, MJPG, RGB3, BGR3 or a mosaic of 8, 10 or 12 bits".to_owned();
        return Err(CameraError::Format { wanted, offered: offered() });
    };
    let channel = channel(layout, settings.channel, &format.fourcc.to_string())?;
    set_rate(device, settings)?;
    set_exposure(device, settings)?;
    Ok(Session { layout, size: [width, height], stride: format.stride as usize, channel })
}

fn channel(layout: Layout, asked: Option<Channel>, format: &str) -> Result<Channel, CameraError> {
    match asked {
        None if layout.needs_channel() => Err(CameraError::NoChannel { format: format.to_owned() }),
        Some(_) if !layout.has_colours() => Err(CameraError::NoColours { format: format.to_owned() }),
        asked => Ok(asked.unwrap_or_default()),
    }
}

fn set_rate(device: &Device, settings: &V4l2Settings) -> Result<(), CameraError> {
    let Some(fps) = settings.fps else { return Ok(()) };
    let failed = |error: io::Error| of_device(&path_of(settings), "the rate", &error);
    let thousandths = (fps * f64::from(RATE_DENOMINATOR)).round() as u32;
    let wanted = Parameters::new(Fraction::new(RATE_DENOMINATOR, thousandths.max(1)));
    let set = device.set_params(&wanted).map_err(failed)?.interval;
    let set_fps = f64::from(set.denominator) / f64::from(set.numerator.max(1));
    if (set_fps / fps - 1.0).abs() > 0.01 {
        let why = format!("{fps} Hz were requested, but it gives {set_fps:.3} Hz");
        return Err(CameraError::Video { device: path_of(settings), why });
    }
    Ok(())
}

/// Automatic settings are turned off if there are some: they move the instant of an exposure.
fn set_exposure(device: &Device, settings: &V4l2Settings) -> Result<(), CameraError> {
    let failed = |error: io::Error| of_device(&path_of(settings), "exposure", &error);
    let is_missing = |error: &io::Error| matches!(error.raw_os_error(), Some(EINVAL | ENOTTY));
    for (id, value) in [(EXPOSURE_AUTO, Value::Integer(BY_HAND)), (AUTOGAIN, Value::Boolean(false))] {
        match device.control(id) {
            Ok(_) => device.set_control(Control { id, value }).map_err(failed)?,
            Err(error) if is_missing(&error) => {}
            Err(error) => return Err(failed(error)),
        }
    }
    let Some(exposure_us) = settings.exposure_us else { return Ok(()) };
    let steps = (exposure_us / EXPOSURE_STEP_US).round().max(1.0) as i64;
    device.set_control(Control { id: EXPOSURE_ABSOLUTE, value: Value::Integer(steps) }).map_err(failed)?;
    match device.control(EXPOSURE_ABSOLUTE).map_err(failed)?.value {
        Value::Integer(set) if set == steps => Ok(()),
        other => {
            let why =
                format!("{exposure_us} µs were requested ({steps} steps of 100), but it set {other:?} steps");
            Err(CameraError::Video { device: path_of(settings), why })
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;

    #[test]
    fn numbers_go_on_over_the_wrap_and_after_a_restart() {
        let mut numbers = Numbers::default();
        let unwrapped: Vec<u64> =
            [u32::MAX - 1, u32::MAX, 0, 3, 3, 1].into_iter().map(|n| numbers.unwrapped(n)).collect();
        let from = u64::from(u32::MAX);
        assert_eq!(unwrapped, [from - 1, from, from + 1, from + 4, from + 5, from + 6]);
    }

    #[test]
    fn what_is_no_camera_is_said() {
        let at = |path: &str| V4l2Settings {
            path: path.into(),
            size: None,
            pixel: None,
            channel: None,
            exposure_us: None,
            fps: None,
        };
        let told = |path: &str| V4l2Camera::open(&at(path), HostClock::start()).err().unwrap().to_string();
        assert!(told("/dev/no-video").starts_with("/dev/no-video: it cannot be opened: No such file"));
        assert!(told("/dev/null").starts_with("/dev/null: it is not a video device"));
    }

    #[test]
    fn a_channel_is_asked_for_where_it_is_needed_and_refused_where_there_is_none() {
        let mosaic = Layout::of_code(*b"RGGB").unwrap();
        assert!(matches!(channel(mosaic, None, "RGGB"), Err(CameraError::NoChannel { .. })));
        assert_eq!(channel(mosaic, Some(Channel::Red), "RGGB").unwrap(), Channel::Red);
        let gray = Layout::of_code(*b"GREY").unwrap();
        assert!(matches!(channel(gray, Some(Channel::Red), "GREY"), Err(CameraError::NoColours { .. })));
        assert_eq!(channel(Layout::Jpeg, None, "MJPG").unwrap(), Channel::Gray);
    }
}
