//! Our client and the simulated camera over loopback: pixels, numbers and stamps.
#![cfg(feature = "gige")]
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

mod simulated;

use simulated::{Known, facts, known, open, patient, start, take, widened, with};
use std::time::Duration;
use trueline_camera::device::{Chunks, Device, DeviceHandle, DeviceSettings, SentFrame};
use trueline_camera::gige::{Adapter, PtpState, discover};
use trueline_camera::{
    CameraError, CameraFrame, CameraSetup, FrameSource, FrameStatus, GigeCamera, GigeSettings, Mosaic,
    PixelFormat, Samples,
};
use trueline_dataset::{Channel, Pixels};
use trueline_live::HostClock;

/// The two clocks of the PC are not read at the same instant, ns.
const CLOCKS_APART_NS: i64 = 100_000;

fn fact<'a>(sent: &'a [SentFrame], frame: &CameraFrame) -> &'a SentFrame {
    sent.iter().find(|sent| Some(sent.device_ns) == frame.device_ns).unwrap()
}

fn check(device: &DeviceHandle, settings: &DeviceSettings, frames: &[CameraFrame]) {
    let (width, height) = (settings.width as usize, settings.height as usize);
    let sent = facts(device, frames);
    for frame in frames {
        let truth = fact(&sent, frame);
        assert_eq!(frame.status, FrameStatus::Complete);
        assert_eq!(frame.frame, u64::from(truth.block_id));
        assert_eq!(truth.device_ns, device.device_ns(truth.exposure_start_ns));
        assert!(frame.image == Some(known(width, height, truth.exposure_start_ns)), "{}", frame.frame);
        let first_ns = frame.first_packet_ns.unwrap();
        assert!(first_ns > truth.first_packet_ns - CLOCKS_APART_NS && first_ns <= frame.complete_ns);
        let waits_s = settings.readout_s + settings.latency_s;
        let due_ns = truth.exposure_start_ns + ((settings.exposure_us * 1e-6 + waits_s) * 1e9) as i64;
        assert!(truth.first_packet_ns >= due_ns, "a packet before its time");
    }
}

#[test]
fn every_pixel_number_and_stamp_arrives() {
    let host = HostClock::start();
    let settings = patient(1);
    let device = start(&settings, host);
    let mut camera = open(&settings, host);
    let frames = take(&mut camera, 40);
    assert_eq!(frames.len(), 40);
    check(&device, &settings, &frames);
    assert!(frames.iter().all(|frame| frame.exposure_us == Some(2000.0)));
    let about = camera.about();
    assert_eq!((about.width, about.height, about.tick_hz), (320, 240, Some(1e9)));
    assert_eq!(about.name, "trueline Simulated SIM-1");
    assert_eq!(camera.ptp(), PtpState::Off);
    let counts = camera.counts();
    assert_eq!((counts.frames, counts.incomplete, counts.not_taken), (40, 0, 0));
}

#[test]
fn a_region_a_rate_an_exposure_and_a_format_are_set() {
    let host = HostClock::start();
    let settings = patient(2);
    let device = start(&settings, host);
    device.set_ptp(true, true);
    let setup = CameraSetup {
        width: Some(160),
        height: Some(100),
        offset: Some([64, 20]),
        pixel: Some(PixelFormat::MONO_12),
        exposure_us: Some(5000.0),
        fps: Some(80.0),
        ..CameraSetup::default()
    };
    let wanted = with(&settings, setup);
    let mut camera = GigeCamera::open(&wanted, host).unwrap();
    let frames = take(&mut camera, 20);
    let sent = facts(&device, &frames);
    assert_eq!(camera.ptp(), PtpState::Slave);
    for frame in &frames {
        let exposure_ns = fact(&sent, frame).exposure_start_ns;
        let whole = widened(&known(320, 240, exposure_ns), PixelFormat::MONO_12);
        let trueline_dataset::Pixels::Sixteen(whole) = whole.pixels else { panic!("widened") };
        let image = frame.image.as_ref().unwrap();
        let trueline_dataset::Pixels::Sixteen(cut) = &image.pixels else { panic!("12 bits were asked for") };
        for (row, line) in cut.chunks_exact(160).enumerate() {
            let at = (20 + row) * 320 + 64;
            assert_eq!(line, &whole[at..at + 160], "row {row}");
        }
        assert_eq!(frame.exposure_us, Some(5000.0));
    }
    for pair in sent.windows(2) {
        let apart = f64::from(pair[1].block_id) - f64::from(pair[0].block_id);
        let apart_ns = (pair[1].device_ns - pair[0].device_ns) as f64;
        assert!((apart_ns - apart * 12.5e6).abs() < 3.0, "{apart_ns} ns");
    }
}

#[test]
fn packed_pictures_arrive_as_they_were() {
    let host = HostClock::start();
    for pixel in PixelFormat::PACKED {
        let settings = patient(2);
        let device = start(&settings, host);
        let wanted = with(
            &settings,
            CameraSetup { width: Some(168), height: Some(98), pixel: Some(pixel), ..CameraSetup::default() },
        );
        let mut camera = GigeCamera::open(&wanted, host).unwrap();
        let frames = take(&mut camera, 3);
        let sent = facts(&device, &frames);
        for frame in &frames {
            let whole = widened(&known(320, 240, fact(&sent, frame).exposure_start_ns), pixel);
            let trueline_dataset::Pixels::Sixteen(whole) = whole.pixels else { panic!("widened") };
            let image = frame.image.as_ref().unwrap();
            let trueline_dataset::Pixels::Sixteen(cut) = &image.pixels else { panic!("{pixel}") };
            for (row, line) in cut.chunks_exact(168).enumerate() {
                assert_eq!(line, &whole[row * 320..row * 320 + 168], "{pixel}, row {row}");
            }
        }
    }
}

fn colour(test: u8) -> DeviceSettings {
    DeviceSettings { has_colours: true, ..patient(test) }
}

#[test]
fn of_colours_the_lasers_channel_arrives() {
    let host = HostClock::start();
    let bayer = |samples| PixelFormat::Bayer(Mosaic::Rg, samples);
    let formats =
        [bayer(Samples::Eight), bayer(Samples::Twelve), bayer(Samples::TenP), bayer(Samples::TwelveP)];
    for pixel in formats.into_iter().chain([PixelFormat::Rgb8]) {
        let settings = colour(32);
        let device = start(&settings, host);
        let wanted = with(
            &settings,
            CameraSetup { pixel: Some(pixel), channel: Some(Channel::Red), ..CameraSetup::default() },
        );
        let mut camera = GigeCamera::open(&wanted, host).unwrap();
        let frames = take(&mut camera, 3);
        assert_eq!(frames.len(), 3, "{pixel}");
        let sent = facts(&device, &frames);
        for frame in &frames {
            let whole = known(320, 240, fact(&sent, frame).exposure_start_ns);
            let Pixels::Eight(whole) = whole.pixels else { panic!("eight bits are known") };
            let image = frame.image.as_ref().unwrap();
            // The simulated laser is red: red pixels see all of it, the others only the background.
            let is_red = |at: usize| {
                pixel == PixelFormat::Rgb8 || [at % 320, at / 320].iter().all(|place| place.is_multiple_of(2))
            };
            let mask = u16::MAX << (16 - pixel.bits());
            for at in (0..whole.len()).filter(|at| is_red(*at)) {
                let (found, expected) = match &image.pixels {
                    Pixels::Eight(levels) => (u16::from(levels[at]), u16::from(whole[at])),
                    Pixels::Sixteen(levels) => (levels[at], (u16::from(whole[at]) * 257) & mask),
                };
                assert_eq!(found, expected, "{pixel}, {at}");
            }
            // Blue pixels see hardly any of it: the last one of the mosaic is not its own level.
            let Pixels::Sixteen(levels) = &image.pixels else { continue };
            let mean = [0, 2, 640, 642].map(|step| u32::from(levels[step])).iter().sum::<u32>();
            assert_eq!(u32::from(levels[321]), (mean + 2) / 4, "{pixel}");
        }
    }
}

#[test]
fn the_format_that_a_camera_is_set_to_is_kept_where_it_can_be_used() {
    let host = HostClock::start();
    let settings = colour(33);
    let device = start(&settings, host);
    let opened = |pixel: PixelFormat, channel: Option<Channel>| {
        device.set_pixel_format(pixel);
        GigeCamera::open(&with(&settings, CameraSetup { channel, ..CameraSetup::default() }), host)
    };
    let bits = |camera: &mut GigeCamera| match take(camera, 1)[0].image.as_ref().unwrap().pixels {
        Pixels::Eight(_) => 8,
        Pixels::Sixteen(_) => 16,
    };
    let packed = PixelFormat::Mono(Samples::TwelveP);
    assert_eq!(bits(&mut opened(packed, None).unwrap()), 16, "as it is set");
    let mosaic = PixelFormat::Bayer(Mosaic::Rg, Samples::TwelveP);
    assert_eq!(bits(&mut opened(mosaic, Some(Channel::Red)).unwrap()), 16, "as it is set");
    // Without the laser's colour a mosaic cannot be used, and the camera offers gray levels.
    assert_eq!(bits(&mut opened(mosaic, None).unwrap()), 8);
    let refused = opened(packed, Some(Channel::Red)).err().unwrap();
    assert!(matches!(&refused, CameraError::NoColours { format } if format == "Mono12p"), "{refused}");
    let asked_for = with(&settings, CameraSetup { pixel: Some(mosaic), ..CameraSetup::default() });
    let refused = GigeCamera::open(&asked_for, host).err().unwrap();
    assert!(matches!(&refused, CameraError::NoChannel { format } if format == "BayerRG12p"), "{refused}");
}

#[test]
fn lost_packets_are_sent_again() {
    let host = HostClock::start();
    let settings = DeviceSettings { loss: 0.01, ..patient(3) };
    let device = start(&settings, host);
    let mut camera = open(&settings, host);
    let frames = take(&mut camera, 60);
    let complete: Vec<CameraFrame> =
        frames.iter().filter(|frame| frame.status == FrameStatus::Complete).cloned().collect();
    // A picture has 55 packets, so without sending again every second one would be broken.
    assert!(complete.len() >= 50, "{} of {}", complete.len(), frames.len());
    check(&device, &settings, &complete);
    assert!(frames.iter().all(|f| f.image.is_some() == (f.status == FrameStatus::Complete)));
    assert!(device.counts().lost_packets > 0);
    assert!(camera.counts().resent_packets > 0, "{:?}", camera.counts());
}

#[test]
fn dropped_pictures_are_gaps_in_the_numbers() {
    let host = HostClock::start();
    let settings = DeviceSettings { frame_drop: 0.2, ..patient(4) };
    let device = start(&settings, host);
    let mut camera = open(&settings, host);
    let frames = take(&mut camera, 50);
    check(&device, &settings, &frames);
    let missing: u64 = frames.windows(2).map(|pair| pair[1].frame - pair[0].frame - 1).sum();
    assert!(missing >= 2, "a fifth of 60 were dropped");
    assert_eq!(camera.counts().missing, missing);
    let counts = device.counts();
    assert!(counts.dropped + counts.late + counts.link_busy >= missing, "{counts:?}");
}

#[test]
fn a_picture_that_is_not_ready_in_time_is_dropped_and_counted() {
    struct Slow(Known, u32);
    impl trueline_camera::device::Pictures for Slow {
        fn picture(&mut self, start_ns: i64, exposure_s: f64) -> Option<trueline_dataset::GrayImage> {
            self.1 += 1;
            if self.1.is_multiple_of(4) {
                std::thread::sleep(Duration::from_millis(120));
            }
            self.0.picture(start_ns, exposure_s)
        }
    }
    let host = HostClock::start();
    let settings = DeviceSettings { period_s: 0.05, ..patient(5) };
    let slow = Slow(Known { width: 320, height: 240 }, 0);
    let device = Device::start(settings.clone(), host, slow).unwrap();
    let mut camera = open(&settings, host);
    let frames = take(&mut camera, 12);
    check(&device, &settings, &frames);
    assert!(device.counts().late >= 2, "{:?}", device.counts());
    assert!(camera.counts().missing >= 2);
}

#[test]
fn full_size_pictures_arrive() {
    let host = HostClock::start();
    let small = patient(6);
    let settings =
        DeviceSettings { width: 2448, height: 2000, period_s: 0.25, latency_s: 0.15, loss: 1e-4, ..small };
    let device = start(&settings, host);
    let mut camera = open(&settings, host);
    let frames = take(&mut camera, 6);
    let complete: Vec<CameraFrame> =
        frames.iter().filter(|frame| frame.status == FrameStatus::Complete).cloned().collect();
    assert!(complete.len() >= 4, "{:?}", camera.counts());
    check(&device, &settings, &complete);
    // 4.9 MB take 40 ms at 1 Gbit/s.
    let took_ns = complete[0].complete_ns - complete[0].first_packet_ns.unwrap();
    assert!(took_ns > 35_000_000, "{took_ns}");
}

#[test]
fn the_packet_size_is_found_and_the_camera_is_found() {
    let host = HostClock::start();
    let settings = DeviceSettings { packet_bytes: 9000, serial: "FOUND-ME".to_owned(), ..patient(7) };
    let device = start(&settings, host);
    let adapter = Adapter {
        name: "lo".to_owned(),
        address: [127, 0, 0, 1].into(),
        netmask: [255, 0, 0, 0].into(),
        // Of several devices on one machine only one hears a true broadcast.
        broadcast: settings.address,
    };
    let found = discover(Some(&adapter), Duration::from_millis(300)).unwrap();
    let camera = found.iter().find(|camera| camera.serial == "FOUND-ME").unwrap();
    assert_eq!((camera.address, camera.reachable), (settings.address, true));
    let mut camera = GigeCamera::open(&GigeSettings::at(camera.address), host).unwrap();
    let frames = take(&mut camera, 5);
    check(&device, &settings, &frames);
    // 76800 pixels in packets of 9000 bytes, with leader and trailer.
    let counts = device.counts();
    assert_eq!(counts.packets, counts.sent * (76_800_u64.div_ceil(9000 - 36) + 2));
}

#[test]
fn chunks_tell_time_and_exposure_and_those_that_lie_are_counted_and_not_believed() {
    for (test, chunks) in [(30, Chunks::Good), (31, Chunks::Lying)] {
        let host = HostClock::start();
        let settings = DeviceSettings { chunks: Some(chunks), ..patient(test) };
        let device = start(&settings, host);
        let mut camera = open(&settings, host);
        let frames = take(&mut camera, 10);
        // Pixels, numbers and stamps are as they are without chunks.
        check(&device, &settings, &frames);
        let (bad, exposure_us) = if chunks == Chunks::Lying { (10, 2000.0) } else { (0, 2000.125) };
        assert!(frames.iter().all(|frame| frame.exposure_us == Some(exposure_us)));
        assert_eq!(camera.counts().bad_chunks, bad);
    }
}
