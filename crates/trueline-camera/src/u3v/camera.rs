//! One session with one camera: from opening it to the last picture.

use super::bounded::Arrivals;
use super::errors::{is_silence, of_device};
use super::features::UsbFeatures;
use super::link::{Link, UsbEndpoints};
use super::settings::U3vSettings;
use super::stream::{Picture, Pictures};
use super::{description, found, picture};
use crate::error::CameraError;
use crate::frame_source::{CameraFrame, FrameSource, FrameStatus, SourceAbout};
use crate::genicam::{
    Asked, Attended, ChunkNames, ChunkOrder, Features, Latch, Session, Told, Watch, begin, chunks,
    exposure_us, next_picture, size, waiting_pictures,
};
use crate::latch_clock::LatchSample;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;
use trueline_live::HostClock;
use viva_u3v::{NusbTransfer, PAYLOAD_TYPE_IMAGE_EXTENDED_CHUNK, RawFrame, U3vStream, UsbTransfer};

/// A picture may follow this many lost ones; beyond that their number is unknown.
const MOST_LOST: u64 = 10_000;

/// Room for chunks and padded lines, on top of twice the size of the pixels: a picture gets no more, bytes.
const MOST_BESIDE_PIXELS: u64 = 1 << 20;
/// The stamps of leader and chunk are of one picture and one clock: further apart one of them is something else, ns.
const STAMPS_APART_NS: u64 = 10_000_000_000;

/// Counts of the pictures so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct U3vCounts {
    /// Pictures given, good or bad.
    pub frames: u64,
    /// Of these, pictures that lack something.
    pub incomplete: u64,
    /// Missing pictures: gaps in the camera's counter.
    pub missing: u64,
    /// Pictures dropped because those before them were not taken in time; among the missing ones.
    pub not_taken: u64,
    /// Pictures with chunk data of inconsistent lengths, which are not used, or with a stamp more than 10 s from that of the
    /// leader, which is used instead.
    pub bad_chunks: u64,
}

/// A camera that sends pictures.
pub struct U3vCamera<T: UsbTransfer + 'static = NusbTransfer> {
    features: UsbFeatures<T>,
    pictures: Pictures,
    transfer_bytes: usize,
    chunk_names: ChunkNames,
    latch: Latch,
    watch: Watch,
    numbers: Numbers,
    clock: HostClock,
    last_ns: i64,
    session: Session,
    about: SourceAbout,
    serial: String,
    exposure_us: Option<f64>,
    counts: U3vCounts,
    /// Consequence of the last bad picture for the session.
    pending: Option<CameraError>,
    gone: bool,
}

impl U3vCamera {
    /// Looks for a camera, sets it up, turns its automatics off and starts it. Stamps are on `clock`.
    ///
    /// # Errors
    /// [`CameraError::NotPluggedIn`], [`CameraError::Usb`], [`CameraError::Format`], [`CameraError::Feature`] or [`CameraError::Io`].
    pub fn open(settings: &U3vSettings, clock: HostClock) -> Result<Self, CameraError> {
        let (usb, serial) = found::open(settings.serial.as_deref())?;
        let interfaces = usb.interfaces();
        let endpoints = UsbEndpoints {
            control_in: interfaces.control_ep_in,
            control_out: interfaces.control_ep_out,
            stream_in: interfaces.stream_ep_in,
        };
        let mut camera = Self::over(Arc::new(usb), endpoints, settings, clock)?;
        // It is found again by the serial number of its plug, if its registers state another.
        if let Some(serial) = serial {
            camera.serial = serial;
        }
        Ok(camera)
    }
}

impl<T: UsbTransfer + 'static> U3vCamera<T> {
    /// The same for a camera that was found, over any transfers.
    ///
    /// # Errors
    /// As [`U3vCamera::open`].
    pub fn over(
        usb: Arc<T>,
        endpoints: UsbEndpoints,
        settings: &U3vSettings,
        clock: HostClock,
    ) -> Result<Self, CameraError> {
        let (arrivals, ends) = (Arrivals::new(clock), Arc::<AtomicBool>::default());
        let link = Link::open(usb, endpoints, arrivals.clone(), Arc::clone(&ends), clock)
            .map_err(|error| of_device("usb", "it does not answer as a USB3 Vision camera does", &error))?;
        let name = name(&link);
        let xml = description::read(&link, &name)?;
        let mut features = UsbFeatures::new(&xml, link)?;
        // A program that crashed may have left it on.
        let _ = features.link.stop_stream();
        let (session, trigger) = begin(&mut features, &settings.setup)?;
        let stream = stream(&mut features, &session, &name)?;
        let layout = *stream.layout();
        let waiting = waiting_pictures(layout.payload_size as usize);
        let pictures = Pictures::of(stream, arrivals, ends, waiting);
        let pictures = pictures.inspect_err(|_| {
            let _ = features.link.stop_stream();
        })?;
        let mut opened = Self {
            about: about(&features.link, name, session.size, trigger),
            serial: features.link.abrm().serial_number.clone(),
            exposure_us: exposure_us(&mut features),
            features,
            pictures,
            transfer_bytes: layout.payload_transfer_size as usize,
            chunk_names: ChunkNames::of(&xml),
            latch: Latch::new(clock),
            watch: Watch::start(),
            numbers: Numbers::default(),
            clock,
            last_ns: clock.read().steady_ns,
            session,
            counts: U3vCounts::default(),
            pending: None,
            gone: false,
        };
        let _ = opened.features.set_integer("TLParamsLocked", 1);
        opened.features.execute("AcquisitionStart")?;
        Ok(opened)
    }

    /// Counts of the pictures so far.
    #[must_use]
    pub fn counts(&self) -> U3vCounts {
        U3vCounts { not_taken: self.pictures.not_taken(), ..self.counts }
    }

    fn unplugged(&mut self) -> CameraError {
        self.gone = true;
        let silent_ns = self.clock.read().steady_ns - self.last_ns;
        CameraError::Unplugged { silent_s: silent_ns.max(0) as f64 * 1e-9 }
    }

    fn given(&mut self, picture: &Picture) -> CameraFrame {
        let Picture { frame, first_ns, complete_ns } = picture;
        let (status, seen) = picture::of(frame, &self.session, self.transfer_bytes);
        let (number, missing) = self.numbers.next(frame.leader.block_id);
        self.counts.frames += 1;
        self.counts.incomplete += u64::from(matches!(status, FrameStatus::Incomplete { .. }));
        self.counts.missing += missing;
        self.pending = self.session.verdict(&status);
        self.last_ns = self.last_ns.max(*complete_ns);
        let told = if status == FrameStatus::Complete { self.told_by_chunks(frame) } else { Told::default() };
        let ns = told.ticks.or(Some(frame.leader.timestamp).filter(|ns| *ns != 0));
        CameraFrame {
            image: seen.image,
            profiles: seen.profiles,
            frame: number,
            device_ns: ns.and_then(|ns| i64::try_from(ns).ok()),
            first_packet_ns: *first_ns,
            complete_ns: *complete_ns,
            exposure_us: told.exposure_us.or(self.exposure_us),
            signals: told.signals,
            status,
        }
    }

    /// Statements of a frame's chunks, if the camera sends some.
    fn told_by_chunks(&mut self, frame: &RawFrame) -> Told {
        let has_chunks = frame.leader.payload_type == PAYLOAD_TYPE_IMAGE_EXTENDED_CHUNK;
        let chunks = chunks(if has_chunks { &frame.payload } else { &[] }, ChunkOrder::LittleEndian);
        let Ok(chunks) = chunks else {
            self.counts.bad_chunks += 1;
            return Told::default();
        };
        let mut told = Told::by(&self.chunk_names, &chunks);
        let leader_ns = frame.leader.timestamp;
        let is_far = |ns: &u64| leader_ns != 0 && ns.abs_diff(leader_ns) > STAMPS_APART_NS;
        if told.ticks.take_if(|ns| is_far(ns)).is_some() {
            self.counts.bad_chunks += 1;
        }
        told
    }
}

impl<T: UsbTransfer + 'static> Attended for U3vCamera<T> {
    fn wait(&mut self, timeout: Duration) -> Result<Option<CameraFrame>, CameraError> {
        match self.pictures.next(timeout) {
            Ok(picture) => Ok(picture.map(|picture| self.given(&picture))),
            Err(error) if is_silence(&error) => Err(self.unplugged()),
            Err(error) => Err(of_device(&self.about.name, "the stream ended", &error)),
        }
    }

    fn look(&mut self) -> Result<(), CameraError> {
        if self.gone {
            return Err(self.unplugged());
        }
        let answers = self.watch.look(&mut self.features, &mut self.exposure_us)?;
        if answers { Ok(()) } else { Err(self.unplugged()) }
    }

    fn pending(&mut self) -> &mut Option<CameraError> {
        &mut self.pending
    }
}

impl<T: UsbTransfer + 'static> FrameSource for U3vCamera<T> {
    fn next(&mut self, timeout: Duration) -> Result<Option<CameraFrame>, CameraError> {
        next_picture(self, timeout)
    }

    fn latch(&mut self) -> Result<Option<LatchSample>, CameraError> {
        let link = &self.features.link;
        match self.latch.ask(|| link.latched(), |ns| i64::try_from(ns).unwrap_or(i64::MAX)) {
            Asked::Answer(sample) => Ok(Some(sample)),
            Asked::No => Ok(None),
            Asked::Silence => Err(self.unplugged()),
        }
    }

    fn about(&self) -> &SourceAbout {
        &self.about
    }

    fn serial(&self) -> Option<&str> {
        Some(self.serial.as_str()).filter(|serial| !serial.is_empty())
    }
}

impl<T: UsbTransfer + 'static> Drop for U3vCamera<T> {
    fn drop(&mut self) {
        // A silent camera may still receive commands; an unplugged one costs no time, since its transfers fail at once.
        if self.gone {
            self.features.link.ask_once();
        }
        let _ = self.features.execute("AcquisitionStop");
        let _ = self.features.set_integer("TLParamsLocked", 0);
        self.pictures.stop();
        let _ = self.features.link.stop_stream();
    }
}

/// Makes numbers that never fall of the camera's own.
#[derive(Clone, Copy, Debug, Default)]
struct Numbers {
    last: Option<(u64, u64)>,
}

impl Numbers {
    /// The number of a block, and how many are missing before it. The first is 0.
    fn next(&mut self, block: u64) -> (u64, u64) {
        let (number, missing) = match self.last {
            None => (0, 0),
            Some((last, number)) => match block.wrapping_sub(last) {
                ahead @ 1..=MOST_LOST => (number + ahead, ahead - 1),
                // It restarted: the number of lost pictures is unknown.
                _ => (number + 1, 0),
            },
        };
        self.last = Some((block, number));
        (number, missing)
    }
}

/// The stream of pictures, which must have room for one, and not for many.
fn stream<T: UsbTransfer + 'static>(
    features: &mut UsbFeatures<T>,
    session: &Session,
    name: &str,
) -> Result<U3vStream, CameraError> {
    // If the stream's registers do not state it, the feature must.
    let payload = size(features, "PayloadSize").unwrap_or(0);
    let failed = |error| of_device(name, "its stream cannot be opened", &error);
    let opening = features.link.stream(u64::from(payload)).map_err(failed)?;
    let (room, needed) = (opening.layout.payload_size, session.bytes().unwrap_or(usize::MAX) as u64);
    if !(needed..=needed.saturating_mul(2).saturating_add(MOST_BESIDE_PIXELS)).contains(&room) {
        let [width, height] = session.size;
        let why = format!(
            "it states {room} bytes for a picture, but {width} x {height} px of {} need {needed}",
            session.format
        );
        return Err(CameraError::Usb { device: name.to_owned(), why });
    }
    features.link.start_stream(&opening).map_err(failed)
}

fn name<T: UsbTransfer + 'static>(link: &Link<T>) -> String {
    let abrm = link.abrm();
    format!("{} {} {}", abrm.manufacturer_name, abrm.model_name, abrm.serial_number).trim().to_owned()
}

fn about<T: UsbTransfer + 'static>(
    link: &Link<T>,
    name: String,
    [width, height]: [u32; 2],
    trigger: Option<String>,
) -> SourceAbout {
    let name = link.slow().map_or_else(|| name.clone(), |speed| format!("{name}, at {speed}"));
    SourceAbout {
        name,
        width: width as usize,
        height: height as usize,
        tick_hz: Some(1e9),
        trigger,
        stamp_meaning: "the camera's clock in the leader of the picture, in nanoseconds: start or end of the exposure, as its maker chose"
            .to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_never_fall_and_gaps_are_counted() {
        let mut numbers = Numbers::default();
        let blocks = [7, 8, 11, 11, 0, 1, u64::MAX, 0, MOST_LOST, 2 * MOST_LOST + 1];
        let given: Vec<(u64, u64)> = blocks.into_iter().map(|block| numbers.next(block)).collect();
        let far = MOST_LOST;
        let expected = [
            (0, 0),
            (1, 0),
            (4, 2),
            (5, 0),
            (6, 0),
            (7, 0),
            (8, 0),
            (9, 0),
            (9 + far, far - 1),
            (10 + far, 0),
        ];
        assert_eq!(given, expected);
    }
}
