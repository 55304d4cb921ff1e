//! A simulated camera whose every pixel is known, and the client at work on it.
#![allow(dead_code, reason = "each test binary uses what it needs")]

use std::net::Ipv4Addr;
use std::thread;
use std::time::{Duration, Instant};
use trueline_camera::device::{Device, DeviceHandle, DeviceSettings, Pictures, SentFrame};
use trueline_camera::{
    CameraError, CameraFrame, CameraSetup, FrameSource, GigeCamera, GigeSettings, PixelFormat,
};
use trueline_dataset::{GrayImage, Pixels};
use trueline_live::HostClock;

/// No test waits longer than this for anything.
pub(crate) const LONGEST: Duration = Duration::from_secs(15);
/// Pictures are made in much less; a machine that is busy with other things gets this long.
pub(crate) const PATIENT_S: f64 = 0.08;

/// An address that no other test and no other run of the tests uses.
pub(crate) fn address(test: u8) -> Ipv4Addr {
    let [_, _, high, low] = std::process::id().to_be_bytes();
    Ipv4Addr::new(127, 1 + high % 250, low, test)
}

/// Pictures that say when they were exposed.
pub(crate) struct Known {
    pub width: usize,
    pub height: usize,
}

impl Pictures for Known {
    fn picture(&mut self, exposure_start_steady_ns: i64, _: f64) -> Option<GrayImage> {
        Some(known(self.width, self.height, exposure_start_steady_ns))
    }
}

/// The picture of an exposure.
pub(crate) fn known(width: usize, height: usize, exposure_start_ns: i64) -> GrayImage {
    let seed = (exposure_start_ns / 1000) as usize;
    let mut pixels: Vec<u8> =
        (0..width * height).map(|i| ((i * 7 + seed) >> 2) as u8 ^ (i >> 9) as u8).collect();
    pixels[..8].copy_from_slice(&exposure_start_ns.to_le_bytes());
    GrayImage { width, height, pixels: Pixels::Eight(pixels) }
}

pub(crate) fn patient(test: u8) -> DeviceSettings {
    DeviceSettings { latency_s: PATIENT_S, ..DeviceSettings::small(address(test)) }
}

pub(crate) fn start(settings: &DeviceSettings, host: HostClock) -> DeviceHandle {
    let pictures = Known { width: settings.width as usize, height: settings.height as usize };
    Device::start(settings.clone(), host, pictures).unwrap()
}

pub(crate) fn asked(settings: &DeviceSettings) -> GigeSettings {
    GigeSettings { packet_size: Some(settings.packet_bytes), ..GigeSettings::at(settings.address) }
}

/// The same, with something set.
pub(crate) fn with(settings: &DeviceSettings, setup: CameraSetup) -> GigeSettings {
    GigeSettings { setup, ..asked(settings) }
}

pub(crate) fn open(settings: &DeviceSettings, host: HostClock) -> GigeCamera {
    GigeCamera::open(&asked(settings), host).unwrap()
}

/// So many pictures, or fewer if they do not come in time.
pub(crate) fn take(camera: &mut dyn FrameSource, count: usize) -> Vec<CameraFrame> {
    let begin = Instant::now();
    let mut frames = Vec::new();
    while frames.len() < count && begin.elapsed() < LONGEST {
        frames.extend(camera.next(Duration::from_millis(200)).unwrap());
    }
    frames
}

/// Pictures until the first error, which must come in time.
pub(crate) fn until_error(
    camera: &mut dyn FrameSource,
    longest: Duration,
) -> (Vec<CameraFrame>, CameraError) {
    let begin = Instant::now();
    let mut frames = Vec::new();
    loop {
        match camera.next(Duration::from_millis(100)) {
            Ok(frame) => frames.extend(frame),
            Err(error) => return (frames, error),
        }
        assert!(begin.elapsed() < longest, "no error after {} pictures", frames.len());
    }
}

/// A picture of eight bits in a format of two bytes.
pub(crate) fn widened(image: &GrayImage, format: PixelFormat) -> GrayImage {
    let Pixels::Eight(levels) = &image.pixels else { panic!("eight bits are widened") };
    let mask = u16::MAX << (16 - format.bits());
    let pixels = Pixels::Sixteen(levels.iter().map(|level| (u16::from(*level) * 257) & mask).collect());
    GrayImage { pixels, ..*image }
}

/// The sent pictures, including these: the receiver has a picture a moment before the device notes it.
pub(crate) fn facts(device: &DeviceHandle, frames: &[CameraFrame]) -> Vec<SentFrame> {
    let last_ns = frames.last().unwrap().device_ns.unwrap();
    let begin = Instant::now();
    loop {
        let sent = device.sent();
        if sent.last().is_some_and(|sent| sent.device_ns >= last_ns) || begin.elapsed() > LONGEST {
            return sent;
        }
        thread::sleep(Duration::from_millis(5));
    }
}
