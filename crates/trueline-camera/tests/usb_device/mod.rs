//! A simulated USB3 Vision camera: its memory, its answers to commands, and its pictures, by the standards (USB3 Vision for
//! the registers of the stream and for leader and trailer, GenCP for commands, bootstrap registers and the table of files).
#![allow(dead_code, reason = "each test uses what it needs")]

use std::collections::VecDeque;
use std::sync::{Arc, Condvar, Mutex, MutexGuard};
use std::time::{Duration, Instant};
use trueline_camera::u3v::{U3vError, UsbEndpoints, UsbTransfer};
use trueline_live::HostClock;

pub(crate) const ENDPOINTS: UsbEndpoints =
    UsbEndpoints { control_in: 0x81, control_out: 0x01, stream_in: Some(0x82) };
const DESCRIPTION: &str = include_str!("description.xml");

/// Addresses in the device's memory.
pub(crate) const ABRM: u64 = 0;
pub(crate) const SBRM: u64 = 0x1_0000;
pub(crate) const SIRM: u64 = 0x2_0000;
pub(crate) const TABLE: u64 = 0x3_0000;
pub(crate) const REGISTERS: u64 = 0x4_0000;
pub(crate) const FILE: u64 = 0x10_0000;
/// Of the bootstrap registers.
pub(crate) const SERIAL: u64 = 0x144;
const CAPABILITY: u64 = 0x1c4;
const ANSWER_MS: u64 = 0x1cc;
pub(crate) const TABLE_ADDRESS: u64 = 0x1d0;
pub(crate) const SBRM_ADDRESS: u64 = 0x1d8;
const TIMESTAMP: u64 = 0x1f0;
const TIMESTAMP_LATCH: u64 = 0x1f8;
/// Of the stream.
pub(crate) const STREAM_CONTROL: u64 = SIRM + 4;
const PAYLOAD_TRANSFER: u64 = SIRM + 0x1c;
/// Of the features; see the description.
pub(crate) const WIDTH: u64 = REGISTERS;
pub(crate) const HEIGHT: u64 = REGISTERS + 4;
pub(crate) const PIXEL_FORMAT: u64 = REGISTERS + 8;
pub(crate) const EXPOSURE: u64 = REGISTERS + 0xc;
pub(crate) const EXPOSURE_AUTO: u64 = REGISTERS + 0x10;
pub(crate) const ACQUISITION: u64 = REGISTERS + 0x14;
pub(crate) const TRIGGER_MODE: u64 = REGISTERS + 0x18;
pub(crate) const TRIGGER_SOURCE: u64 = REGISTERS + 0x1c;

const READ: u16 = 0x0800;
const WRITE: u16 = 0x0802;
const PENDING: u16 = 0x0805;
const INVALID_ADDRESS: u16 = 0x8003;

/// The device's mistakes in its answers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Fault {
    #[default]
    None,
    /// It sends the answer to an earlier command first.
    Stale,
    /// It asks for more time before each answer.
    Pending,
    /// It asks for more time again and again.
    PendingForEver,
    /// It says nothing.
    Silent,
    /// It does not answer one command.
    LosesOne,
    /// Its answers have half of the bytes that were asked for.
    Half,
    /// Its answers say that they are longer than they are.
    LongerThanItIs,
    /// Its answers are to another command.
    OtherCommand,
    /// Its answers begin with something else.
    OtherPrefix,
    /// Bits of its answers are turned by this.
    Noise(u64),
}

/// A picture and what is wrong with it.
#[derive(Clone, Debug)]
pub(crate) struct Sent {
    pub block: u64,
    pub device_ns: u64,
    pub size: [u32; 2],
    pub format: u32,
    pub padding: u16,
    pub payload: Vec<u8>,
    pub payload_type: u16,
    pub status: u16,
    /// The valid size by the trailer; `None` for everything sent.
    pub valid: Option<u64>,
    /// Rows that the trailer says; `None` for those of the leader.
    pub rows: Option<u32>,
    /// The block that the trailer names; `None` for no trailer.
    pub ends: Option<u64>,
}

impl Sent {
    /// A good picture of the device's size and format.
    pub(crate) fn good(block: u64, device_ns: u64, size: [u32; 2], payload: Vec<u8>) -> Self {
        Self {
            block,
            device_ns,
            size,
            format: 0x0108_0001,
            padding: 0,
            payload,
            payload_type: 1,
            status: 0,
            valid: None,
            rows: None,
            ends: Some(block),
        }
    }
}

struct State {
    memory: Vec<(u64, Vec<u8>)>,
    answers: VecDeque<Vec<u8>>,
    transfers: VecDeque<Vec<u8>>,
    fault: Fault,
    last_answer: Option<Vec<u8>>,
    unplugged: bool,
    /// A program waits for the next transfer of the stream.
    is_awaited: bool,
}

/// The device.
pub(crate) struct UsbDevice {
    state: Mutex<State>,
    something_came: Condvar,
    clock: HostClock,
    /// Its clock less the steady one, ns.
    ahead_ns: i64,
}

impl UsbDevice {
    /// With a description in a form: 0 as it is, 1 as an archive.
    pub(crate) fn with_description(clock: HostClock, description: &[u8], form: u32) -> Arc<Self> {
        let mut abrm = vec![0; 0x210];
        put(&mut abrm, 0, &0x0001_0002_u32.to_le_bytes());
        put(&mut abrm, 4, b"trueline");
        put(&mut abrm, 0x44, b"Nowhere");
        put(&mut abrm, SERIAL, b"U3V-1");
        put(&mut abrm, CAPABILITY, &(1_u64 << 3 | 1 << 9).to_le_bytes());
        put(&mut abrm, ANSWER_MS, &100_u32.to_le_bytes());
        put(&mut abrm, TABLE_ADDRESS, &TABLE.to_le_bytes());
        put(&mut abrm, SBRM_ADDRESS, &SBRM.to_le_bytes());
        let mut sbrm = vec![0; 0x44];
        put(&mut sbrm, 4, &1_u64.to_le_bytes());
        put(&mut sbrm, 0x14, &256_u32.to_le_bytes());
        put(&mut sbrm, 0x18, &512_u32.to_le_bytes());
        put(&mut sbrm, 0x1c, &1_u32.to_le_bytes());
        put(&mut sbrm, 0x20, &SIRM.to_le_bytes());
        put(&mut sbrm, 0x28, &0x30_u32.to_le_bytes());
        put(&mut sbrm, 0x40, &8_u32.to_le_bytes());
        let mut sirm = vec![0; 0x30];
        put(&mut sirm, 0, &(3_u32 << 24).to_le_bytes());
        put(&mut sirm, 0x10, &52_u32.to_le_bytes());
        put(&mut sirm, 0x14, &32_u32.to_le_bytes());
        let mut table = vec![0; 8 + 2 * 64];
        put(&mut table, 0, &2_u64.to_le_bytes());
        // The first file describes chunks alone, and is none of ours.
        put(&mut table, 12, &1_u32.to_le_bytes());
        put(&mut table, 72 + 4, &(form << 10).to_le_bytes());
        put(&mut table, 72 + 8, &FILE.to_le_bytes());
        put(&mut table, 72 + 16, &(description.len() as u64).to_le_bytes());
        let mut registers = vec![0; 0x40];
        put(&mut registers, 0, &64_u32.to_le_bytes());
        put(&mut registers, 4, &48_u32.to_le_bytes());
        put(&mut registers, 8, &0x0108_0001_u32.to_le_bytes());
        put(&mut registers, 0xc, &2000_f32.to_le_bytes());
        put(&mut registers, 0x10, &2_u32.to_le_bytes());
        let memory = vec![
            (ABRM, abrm),
            (SBRM, sbrm),
            (SIRM, sirm),
            (TABLE, table),
            (REGISTERS, registers),
            (FILE, description.to_vec()),
        ];
        let state = State {
            memory,
            answers: VecDeque::new(),
            transfers: VecDeque::new(),
            fault: Fault::None,
            last_answer: None,
            unplugged: false,
            is_awaited: false,
        };
        let ahead_ns = 5_000_000_000 - clock.read().steady_ns;
        let device = Self { state: Mutex::new(state), something_came: Condvar::new(), clock, ahead_ns };
        device.tell_payload();
        Arc::new(device)
    }

    /// One that does all as it should: 64 x 48 px.
    pub(crate) fn start(clock: HostClock) -> Arc<Self> {
        Self::with_description(clock, DESCRIPTION.as_bytes(), 0)
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap()
    }

    /// Its clock now, ns.
    pub(crate) fn now_ns(&self) -> u64 {
        (self.clock.read().steady_ns + self.ahead_ns).cast_unsigned()
    }

    /// Its clock less the steady one, ns.
    pub(crate) fn ahead_ns(&self) -> i64 {
        self.ahead_ns
    }

    pub(crate) fn set_fault(&self, fault: Fault) {
        self.state().fault = fault;
    }

    pub(crate) fn fault(&self) -> Fault {
        self.state().fault
    }

    /// A register of four bytes.
    pub(crate) fn register(&self, address: u64) -> u32 {
        let bytes = self.state().read(address, 4).unwrap();
        u32::from_le_bytes(bytes.try_into().unwrap())
    }

    /// Writes its memory, as if the device itself did.
    pub(crate) fn poke(&self, address: u64, bytes: &[u8]) {
        assert!(self.state().write(address, bytes), "{address:#x} is no memory");
    }

    pub(crate) fn unplug(&self) {
        self.state().unplugged = true;
        self.something_came.notify_all();
    }

    /// Sends bytes as one transfer of the stream.
    pub(crate) fn send_raw(&self, transfer: Vec<u8>) {
        self.state().transfers.push_back(transfer);
        self.something_came.notify_all();
    }

    /// Waits until all that was sent was taken, and the next is waited for.
    pub(crate) fn until_taken(&self) {
        let is_taken = || {
            let state = self.state();
            state.is_awaited && state.transfers.is_empty()
        };
        while !is_taken() {
            std::thread::sleep(Duration::from_micros(100));
        }
    }

    /// Sends the leader of a picture.
    pub(crate) fn send_leader(&self, sent: &Sent) {
        let mut leader = vec![0; 52];
        put(&mut leader, 0, b"U3VL");
        put(&mut leader, 6, &52_u16.to_le_bytes());
        put(&mut leader, 8, &sent.block.to_le_bytes());
        put(&mut leader, 18, &sent.payload_type.to_le_bytes());
        put(&mut leader, 20, &sent.device_ns.to_le_bytes());
        put(&mut leader, 28, &sent.format.to_le_bytes());
        put(&mut leader, 32, &sent.size[0].to_le_bytes());
        put(&mut leader, 36, &sent.size[1].to_le_bytes());
        put(&mut leader, 48, &sent.padding.to_le_bytes());
        self.send_raw(leader);
    }

    /// Sends the pixels in the transfers that the program wrote to the registers of the stream.
    pub(crate) fn send_payload(&self, payload: &[u8]) {
        let [size, count, last] = [0, 4, 8].map(|at| self.register(PAYLOAD_TRANSFER + at) as usize);
        let mut rest = payload;
        for length in std::iter::repeat_n(size, count).chain([last]).filter(|length| *length > 0) {
            let (piece, after) = rest.split_at(length.min(rest.len()));
            self.send_raw(piece.to_vec());
            if piece.len() < length {
                return;
            }
            rest = after;
        }
    }

    pub(crate) fn send_trailer(&self, sent: &Sent) {
        let Some(block) = sent.ends else { return };
        let mut trailer = vec![0; 32];
        put(&mut trailer, 0, b"U3VT");
        put(&mut trailer, 6, &32_u16.to_le_bytes());
        put(&mut trailer, 8, &block.to_le_bytes());
        put(&mut trailer, 16, &sent.status.to_le_bytes());
        put(&mut trailer, 20, &sent.valid.unwrap_or(sent.payload.len() as u64).to_le_bytes());
        put(&mut trailer, 28, &sent.rows.unwrap_or(sent.size[1]).to_le_bytes());
        self.send_raw(trailer);
    }

    /// Sends a picture, if a program asked for pictures.
    pub(crate) fn send(&self, sent: &Sent) {
        let is_on = self.register(STREAM_CONTROL) == 1 && self.register(ACQUISITION) == 1;
        assert!(is_on, "pictures were not asked for");
        self.send_leader(sent);
        self.send_payload(&sent.payload);
        self.send_trailer(sent);
    }

    /// The size of a picture with its chunks.
    fn tell_payload(&self) {
        let bits = self.register(PIXEL_FORMAT) >> 16 & 0xff;
        let pixels = u64::from(self.register(WIDTH)) * u64::from(self.register(HEIGHT));
        let bytes = (pixels * u64::from(bits)).div_ceil(8) + 36;
        self.poke(SIRM + 8, &bytes.to_le_bytes());
    }

    fn execute(&self, command: u16, data: &[u8]) -> (u16, Vec<u8>) {
        let address = u64::from_le_bytes(data[..8].try_into().unwrap());
        if command == READ {
            let length = usize::from(u16::from_le_bytes([data[10], data[11]]));
            let read = self.state().read(address, length);
            return read.map_or((INVALID_ADDRESS, Vec::new()), |bytes| (0, bytes));
        }
        if !self.state().write(address, &data[8..]) {
            return (INVALID_ADDRESS, Vec::new());
        }
        if address == TIMESTAMP_LATCH {
            self.poke(TIMESTAMP, &self.now_ns().to_le_bytes());
        }
        if (WIDTH..=PIXEL_FORMAT).contains(&address) {
            self.tell_payload();
        }
        (0, [[0; 2], (data.len() as u16 - 8).to_le_bytes()].concat())
    }
}

impl State {
    fn read(&self, address: u64, length: usize) -> Option<Vec<u8>> {
        self.memory.iter().find_map(|(start, bytes)| {
            let at = usize::try_from(address.checked_sub(*start)?).ok()?;
            bytes.get(at..at.checked_add(length)?).map(<[u8]>::to_vec)
        })
    }

    fn write(&mut self, address: u64, data: &[u8]) -> bool {
        self.memory.iter_mut().any(|(start, bytes)| {
            let at = address.checked_sub(*start).and_then(|at| usize::try_from(at).ok());
            let room = at.and_then(|at| bytes.get_mut(at..at.checked_add(data.len())?));
            room.is_some_and(|room| {
                room.copy_from_slice(data);
                true
            })
        })
    }

    /// Puts an answer into its place, with its mistake.
    fn answer(&mut self, [status, command, request]: [u16; 3], data: &[u8]) {
        let packet = |status: u16, command: u16, length: u16, request: u16, data: &[u8]| {
            let words = [status, command, length, request].map(u16::to_le_bytes);
            [b"U3VC", words.as_flattened(), data].concat()
        };
        let length = data.len() as u16;
        let good = packet(status, command, length, request, data);
        let pending = packet(0, PENDING, 4, request, &[0, 0, 10, 0]);
        match self.fault {
            Fault::None => self.answers.push_back(good.clone()),
            Fault::Stale => {
                self.answers.extend(self.last_answer.clone());
                self.answers.push_back(good.clone());
            }
            Fault::Pending => self.answers.extend([pending, good.clone()]),
            Fault::PendingForEver => self.answers.extend(std::iter::repeat_n(pending, 500)),
            Fault::Silent => {}
            Fault::LosesOne => self.fault = Fault::None,
            Fault::Half => {
                let half = &data[..data.len() / 2];
                self.answers.push_back(packet(status, command, half.len() as u16, request, half));
            }
            Fault::LongerThanItIs => {
                self.answers.push_back(packet(status, command, u16::MAX, request, data));
            }
            Fault::OtherCommand => {
                self.answers.push_back(packet(status, command ^ 2, length, request, data));
            }
            Fault::OtherPrefix => self.answers.push_back([b"U3VX", &good[4..]].concat()),
            Fault::Noise(seed) => {
                let mut noisy = good.clone();
                let mut noise = Noise(seed);
                if noise.below(8) == 0 {
                    let at = noise.below(noisy.len() as u64) as usize;
                    noisy[at] ^= 1 << noise.below(8);
                    noisy.truncate(noisy.len() - noise.below(3) as usize);
                }
                self.fault = Fault::Noise(noise.0);
                self.answers.push_back(noisy);
            }
        }
        self.last_answer = Some(good);
    }
}

impl UsbTransfer for UsbDevice {
    fn bulk_write(&self, endpoint: u8, data: &[u8], _: Duration) -> Result<usize, U3vError> {
        assert_eq!(endpoint, ENDPOINTS.control_out);
        if self.state().unplugged {
            return Err(U3vError::Disconnected);
        }
        assert!(data.len() <= 1024, "the device takes no more");
        assert_eq!(&data[..4], b"U3VC");
        let word = |at: usize| u16::from_le_bytes([data[at], data[at + 1]]);
        let [flags, command, length, request] = [4, 6, 8, 10].map(word);
        assert_eq!((flags, usize::from(length)), (0x4000, data.len() - 12), "an answer is wanted");
        assert!(matches!(command, READ | WRITE) && request != 0);
        let (status, answer) = self.execute(command, &data[12..]);
        self.state().answer([status, command + 1, request], &answer);
        Ok(data.len())
    }

    /// That of USB 3: a program has room for complete packets.
    fn max_packet_size(&self, _: u8) -> Option<usize> {
        Some(1024)
    }

    fn bulk_read(&self, endpoint: u8, buffer: &mut [u8], timeout: Duration) -> Result<usize, U3vError> {
        let until = Instant::now() + timeout;
        let mut state = self.state();
        loop {
            if state.unplugged {
                return Err(U3vError::Disconnected);
            }
            let is_stream = Some(endpoint) == ENDPOINTS.stream_in;
            let queue = if is_stream { &mut state.transfers } else { &mut state.answers };
            if let Some(transfer) = queue.pop_front() {
                if transfer.len() > buffer.len() {
                    return Err(U3vError::usb("more came than there was room for"));
                }
                buffer[..transfer.len()].copy_from_slice(&transfer);
                return Ok(transfer.len());
            }
            let left = until.saturating_duration_since(Instant::now());
            // Nothing else answers a command, so nobody has to wait for it.
            if left.is_zero() || !is_stream {
                return Err(U3vError::Timeout);
            }
            state.is_awaited = true;
            state = self.something_came.wait_timeout(state, left).unwrap().0;
            state.is_awaited = false;
        }
    }
}

/// An archive of one file, which is what its directory says that it has, bytes.
pub(crate) fn archive(file: &[u8], claimed: u32) -> Vec<u8> {
    let crc = file.iter().fold(u32::MAX, |crc, byte| {
        (0..8).fold(crc ^ u32::from(*byte), |crc, _| crc >> 1 ^ if crc & 1 == 1 { 0xedb8_8320 } else { 0 })
    });
    let [crc, length] = [!crc, file.len() as u32].map(u32::to_le_bytes);
    // Version, flags, method and time; then sum and sizes, and the length of the name.
    let facts =
        [&[20, 0, 0, 0, 0, 0, 0, 0, 0, 0][..], &crc, &length, &claimed.to_le_bytes(), &[1, 0, 0, 0]].concat();
    let local = [b"PK\x03\x04", &facts[..], b"x", file].concat();
    let directory = [b"PK\x01\x02", &[20, 0][..], &facts, &[0; 14], b"x"].concat();
    let sizes = [directory.len() as u32, local.len() as u32].map(u32::to_le_bytes);
    let end = [b"PK\x05\x06", &[0, 0, 0, 0, 1, 0, 1, 0][..], sizes.as_flattened(), &[0, 0]].concat();
    [local, directory, end].concat()
}

/// Numbers that look like chance.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Noise(pub u64);

impl Noise {
    pub(crate) fn below(&mut self, most: u64) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0 % most
    }
}

fn put(bytes: &mut [u8], at: u64, data: &[u8]) {
    bytes[at as usize..at as usize + data.len()].copy_from_slice(data);
}
