//! The registers of a device, and its stream. The device's statements about itself are bounded.

use super::bounded::{Arrivals, Bounded};
use super::errors::{is_silence, of_register};
use crate::genicam::Latched;
use std::cell::{Cell, RefCell};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;
use telegenic::genicam::port::PortIo;
use trueline_live::HostClock;
use viva_u3v::registers::{abrm, capability, sbrm, sirm};
use viva_u3v::{
    Abrm, ControlChannel, DEFAULT_MAX_TRANSFER_SIZE, Sbrm, Sirm, StreamLayout, U3vError, U3vStream, UsbSpeed,
    UsbTransfer,
};

/// Any device accepts and sends this many bytes at once, before it has stated its own number.
const FIRST_TRANSFER: u32 = 1024;
/// Largest request at once: each answer has this much room.
const MOST_TRANSFER: u32 = 1 << 16;
/// Bounds of the time of an answer. Statements of the device are used within these.
const ANSWER: [Duration; 2] = [Duration::from_millis(500), Duration::from_secs(2)];
/// In addition to the device's own time for an answer.
const ON_THE_WIRE_MS: u32 = 100;
/// A command that was not answered is sent again, so often in all.
const TIMES: u32 = 3;
/// Larger sizes are not a picture, even if the device claims them, and not a leader or trailer.
const MOST_PAYLOAD: u64 = 1 << 30;
const MOST_FRAMING: u32 = 1 << 16;
/// A picture without its next piece within this time has lost its end.
const NEXT_PIECE: Duration = Duration::from_secs(1);

/// The endpoints of a device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct UsbEndpoints {
    /// Answers to commands.
    pub control_in: u8,
    /// Commands.
    pub control_out: u8,
    /// Pictures; `None` of a device that has none.
    pub stream_in: Option<u8>,
}

/// A device that answers.
pub(super) struct Link<T: UsbTransfer + 'static> {
    control: RefCell<ControlChannel<Bounded<T>>>,
    usb: Arc<Bounded<T>>,
    endpoints: UsbEndpoints,
    abrm: Abrm,
    sbrm: Sbrm,
    clock: HostClock,
    /// How often a command is sent that is not answered.
    times: Cell<u32>,
}

/// Statements of a device about its stream, and how pictures are read from it.
pub(super) struct Opening {
    sirm: Sirm,
    endpoint: u8,
    /// Sizes of the transfers.
    pub layout: StreamLayout,
}

impl<T: UsbTransfer + 'static> Link<T> {
    /// Asks a device for its description; its stream ends when `ends` is set.
    pub(super) fn open(
        usb: Arc<T>,
        endpoints: UsbEndpoints,
        arrivals: Arrivals,
        ends: Arc<AtomicBool>,
        clock: HostClock,
    ) -> Result<Self, U3vError> {
        let usb = Arc::new(Bounded::new(usb, arrivals, ends));
        let UsbEndpoints { control_in, control_out, .. } = endpoints;
        let mut control =
            ControlChannel::new(Arc::clone(&usb), control_in, control_out, FIRST_TRANSFER, FIRST_TRANSFER);
        control.set_timeout(ANSWER[0]);
        let abrm = repeated(TIMES, || Abrm::read_from(&mut control))?;
        let answer_ms = abrm.max_device_response_time_ms.saturating_add(ON_THE_WIRE_MS);
        control.set_timeout(Duration::from_millis(u64::from(answer_ms)).clamp(ANSWER[0], ANSWER[1]));
        let sbrm_address = within(abrm.sbrm_address, sbrm::LEN)?;
        let sbrm = repeated(TIMES, || Sbrm::read_from(&mut control, sbrm_address))?;
        let [command, answer] =
            [sbrm.max_cmd_transfer, sbrm.max_ack_transfer].map(|bytes| bytes.min(MOST_TRANSFER));
        control.set_max_transfer(command, answer);
        Ok(Self {
            control: RefCell::new(control),
            usb,
            endpoints,
            abrm,
            sbrm,
            clock,
            times: Cell::new(TIMES),
        })
    }

    /// Statements of the device about itself.
    pub(super) fn abrm(&self) -> &Abrm {
        &self.abrm
    }

    /// Its speed if it is below USB 3.
    pub(super) fn slow(&self) -> Option<UsbSpeed> {
        let speed = self.usb.link_speed().or(self.sbrm.current_speed);
        speed.filter(|speed| *speed < UsbSpeed::Super)
    }

    /// From now on no command is sent again: the device is silent.
    pub(super) fn ask_once(&self) {
        self.times.set(1);
    }

    /// Sends a command, and again without an answer: a late answer to the first is recognised by its number, and ignored.
    fn ask<A>(
        &self,
        mut command: impl FnMut(&mut ControlChannel<Bounded<T>>) -> Result<A, U3vError>,
    ) -> Result<A, U3vError> {
        repeated(self.times.get(), || command(&mut self.control.borrow_mut()))
    }

    /// Reads bytes of its memory.
    pub(super) fn read(&self, address: u64, length: usize) -> Result<Vec<u8>, U3vError> {
        let address = within(address, length as u64)?;
        self.ask(|control| control.read_mem(address, length))
    }

    fn write(&self, address: u64, data: &[u8]) -> Result<(), U3vError> {
        let address = within(address, data.len() as u64)?;
        self.ask(|control| control.write_mem(address, data))
    }

    /// Its clock, which its stream is stamped with, ns.
    pub(super) fn latched(&self) -> Latched {
        if self.abrm.device_capability & capability::TIMESTAMP == 0 {
            return Latched::No;
        }
        let latched = self.write(abrm::TIMESTAMP_LATCH, &1_u32.to_le_bytes());
        let answered_ns = self.clock.read().steady_ns;
        let read = latched.and_then(|()| self.read(abrm::TIMESTAMP, 8));
        match read.as_ref().map(|bytes| bytes.first_chunk::<8>()) {
            Ok(Some(bytes)) => Latched::At(u64::from_le_bytes(*bytes), Some(answered_ns)),
            Ok(None) => Latched::No,
            Err(error) if is_silence(error) => Latched::Silence,
            Err(_) => Latched::No,
        }
    }

    fn sirm(&self) -> Result<Sirm, U3vError> {
        let address = self.sbrm.sirm_address;
        if address == 0 {
            return Err(U3vError::Device("has no stream"));
        }
        let address = within(address, sirm::LEN)?;
        self.ask(|control| Sirm::read_from(control, address))
    }

    /// How the stream of pictures of `payload` bytes is opened, unless the device states the size. Nothing is sent to
    /// it.
    pub(super) fn stream(&self, payload: u64) -> Result<Opening, U3vError> {
        let endpoint = self.endpoints.stream_in.ok_or(U3vError::Device("has no endpoint for pictures"))?;
        let sirm = self.sirm()?;
        let payload = if sirm.required_payload_size == 0 { payload } else { sirm.required_payload_size };
        if payload > MOST_PAYLOAD {
            return Err(U3vError::Device("states more than 1 GiB for a picture"));
        }
        let framing = [sirm.required_leader_size, sirm.required_trailer_size];
        if framing.into_iter().any(|bytes| bytes > MOST_FRAMING) {
            return Err(U3vError::Device("states more than 64 KiB for the leader or trailer of a picture"));
        }
        let packet = self.usb.max_packet_size(endpoint).and_then(|bytes| u32::try_from(bytes).ok());
        let alignment = sirm.alignment()?.max(packet.unwrap_or(1));
        let [leader, trailer] = framing;
        let layout = StreamLayout::new(payload, leader, trailer, alignment, DEFAULT_MAX_TRANSFER_SIZE)?;
        Ok(Opening { sirm, endpoint, layout })
    }

    /// Opens the stream of pictures. After an error it is off.
    pub(super) fn start_stream(&self, opening: &Opening) -> Result<U3vStream, U3vError> {
        let Opening { sirm, endpoint, layout } = opening;
        let mut queue = self.usb.bulk_in(*endpoint)?;
        self.ask(|control| sirm.configure(control, layout))?;
        // Transfers of an earlier program are dropped.
        queue.reset()?;
        if let Err(error) = self.ask(|control| sirm.enable(control)) {
            // It may have received it, and only the answer was lost.
            let _ = self.ask(|control| sirm.disable(control));
            return Err(error);
        }
        let mut stream = U3vStream::new(queue, *layout);
        stream.set_timeout(NEXT_PIECE);
        Ok(stream)
    }

    /// Stops the device's pictures.
    pub(super) fn stop_stream(&self) -> Result<(), U3vError> {
        let sirm = self.sirm()?;
        self.ask(|control| sirm.disable(control))
    }
}

/// Asks this many times in all without an answer.
fn repeated<A>(times: u32, mut ask: impl FnMut() -> Result<A, U3vError>) -> Result<A, U3vError> {
    for _ in 1..times {
        match ask() {
            Err(U3vError::Timeout) => {}
            answer => return answer,
        }
    }
    ask()
}

/// An address with `length` bytes that can be counted.
fn within(address: u64, length: u64) -> Result<u64, U3vError> {
    let end = address.checked_add(length);
    end.map(|_| address).ok_or(U3vError::Device("states registers outside its memory"))
}

impl<T: UsbTransfer + 'static> PortIo for Link<T> {
    fn read(&self, address: u64, buffer: &mut [u8]) -> telegenic::Result<()> {
        let data = Self::read(self, address, buffer.len()).map_err(|error| of_register(&error))?;
        if data.len() != buffer.len() {
            return Err(of_register(&U3vError::Device("answered with fewer bytes than requested")));
        }
        buffer.copy_from_slice(&data);
        Ok(())
    }

    fn write(&self, address: u64, data: &[u8]) -> telegenic::Result<()> {
        Self::write(self, address, data).map_err(|error| of_register(&error))
    }
}
