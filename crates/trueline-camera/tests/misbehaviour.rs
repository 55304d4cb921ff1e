//! Faults of cameras, and their messages.
#![cfg(feature = "gige")]
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

mod simulated;

use simulated::{address, open, patient, start, take, until_error, with};
use std::time::{Duration, Instant};
use trueline_camera::device::DeviceSettings;
use trueline_camera::{
    CameraError, CameraSetup, FrameSource, FrameStatus, GigeCamera, GigeSettings, PixelFormat,
};
use trueline_live::HostClock;

const SOON: Duration = Duration::from_secs(5);

#[test]
fn a_pulled_cable_is_told_within_three_seconds_and_what_came_before_it_is_given() {
    let host = HostClock::start();
    let settings = patient(1);
    let device = start(&settings, host);
    let mut camera = open(&settings, host);
    assert_eq!(take(&mut camera, 3).len(), 3);
    // Pictures wait while nobody takes them.
    std::thread::sleep(Duration::from_millis(300));
    device.unplug();
    let pulled = Instant::now();
    let (frames, error) = until_error(&mut camera, SOON);
    let after = pulled.elapsed();
    assert!(frames.len() >= 5, "{}", frames.len());
    assert!(after < Duration::from_secs(3), "{after:?}");
    let CameraError::Unplugged { silent_s } = error else { panic!("{error}") };
    assert!(silent_s > 0.1 && silent_s < after.as_secs_f64() + 0.2, "{silent_s}");
    assert!(matches!(camera.next(Duration::ZERO), Err(CameraError::Unplugged { .. })), "it stays gone");
}

#[test]
fn pictures_of_another_size_are_marked_and_end_the_session() {
    for (number, [width, height]) in [[160, 120], [320, 280]].into_iter().enumerate() {
        let host = HostClock::start();
        let settings = patient(10 + number as u8);
        let device = start(&settings, host);
        let mut camera = open(&settings, host);
        take(&mut camera, 3);
        device.set_size(width, height);
        let (frames, error) = until_error(&mut camera, SOON);
        let last = frames.last().unwrap();
        assert_eq!((&last.status, &last.image), (&FrameStatus::WrongSize { width, height }, &None));
        assert!(
            matches!(error, CameraError::FrameSizeChanged { was: [320, 240], is } if is == [width, height]),
            "{error}"
        );
    }
}

#[test]
fn pictures_of_another_format_are_marked_and_end_the_session() {
    let host = HostClock::start();
    let settings = patient(3);
    let device = start(&settings, host);
    let mut camera = open(&settings, host);
    take(&mut camera, 3);
    device.set_pixel_format(PixelFormat::MONO_12);
    let (frames, error) = until_error(&mut camera, SOON);
    assert!(
        matches!(&frames.last().unwrap().status, FrameStatus::WrongFormat { found } if found == "Mono12")
    );
    let CameraError::Format { wanted, offered } = error else { panic!("{error}") };
    assert_eq!((wanted.as_str(), offered.as_str()), ("Mono8", "Mono12"));
}

#[test]
fn an_automatic_that_comes_back_on_is_named() {
    let host = HostClock::start();
    let settings = patient(4);
    let device = start(&settings, host);
    // As somebody left it: opening turns it off.
    device.set_exposure_auto(true);
    let mut camera = open(&settings, host);
    assert_eq!(take(&mut camera, 70).len(), 70, "more than a second of pictures");
    device.set_exposure_auto(true);
    let (_, error) = until_error(&mut camera, SOON);
    assert!(
        matches!(&error, CameraError::ExposureAuto { feature, value } if feature == "ExposureAuto" && value == "Continuous"),
        "{error}"
    );
    device.set_exposure_auto(false);
    device.set_gain_auto(true);
    let (_, error) = until_error(&mut camera, SOON);
    assert!(matches!(&error, CameraError::ExposureAuto { feature, .. } if feature == "GainAuto"), "{error}");
}

#[test]
fn a_second_program_is_turned_away_until_the_first_has_gone() {
    let host = HostClock::start();
    let settings = patient(5);
    let device = start(&settings, host);
    let first = open(&settings, host);
    let error = GigeCamera::open(&simulated::asked(&settings), host).err().unwrap();
    assert!(matches!(error, CameraError::Busy { .. }), "{error}");
    assert!(device.counts().denied > 0);
    drop(first);
    let mut second = open(&settings, host);
    assert_eq!(take(&mut second, 3).len(), 3);
}

#[test]
fn a_program_that_falls_silent_loses_the_camera() {
    let host = HostClock::start();
    let settings = patient(6);
    let device = start(&settings, host);
    let socket = std::net::UdpSocket::bind("127.0.0.1:0").unwrap();
    let control = telegenic::gige::proto::gvcp::encode_write_reg(&[(0xa00, 2), (0x938, 500)], 1);
    socket.send_to(&control, (settings.address, 3956)).unwrap();
    let begin = Instant::now();
    while device.counts().heartbeats_lost == 0 && begin.elapsed() < SOON {
        std::thread::sleep(Duration::from_millis(20));
    }
    assert!(begin.elapsed() > Duration::from_millis(500));
    let mut camera = open(&settings, host);
    assert_eq!(take(&mut camera, 2).len(), 2);
}

#[test]
fn nobody_there_is_said_with_a_hint() {
    let begin = Instant::now();
    let nobody = address(7);
    let error = GigeCamera::open(&GigeSettings::at(nobody), HostClock::start()).err().unwrap();
    assert!(begin.elapsed() < SOON);
    assert_eq!(error.to_string(), format!("no camera answers at {nobody}"));
    assert!(error.hint().contains("3956"));
}

#[test]
fn what_the_camera_cannot_do_is_said_with_what_it_can() {
    let host = HostClock::start();
    let settings = DeviceSettings { serial: "A-SERIAL-NUMBER-THAT-IS-TOO-LONG".to_owned(), ..patient(8) };
    let device = start(&settings, host);
    let refused = |settings: GigeSettings| GigeCamera::open(&settings, host).err().unwrap();
    let error =
        refused(with(&settings, CameraSetup { pixel: Some(PixelFormat::MONO_10), ..CameraSetup::default() }));
    assert_eq!(
        error.to_string(),
        "pictures are required as Mono10, the camera offers Mono8, Mono12, Mono10p, Mono12p, Mono10Packed, Mono12Packed, Mono16"
    );
    let error = refused(with(&settings, CameraSetup { width: Some(4000), ..CameraSetup::default() }));
    assert!(matches!(&error, CameraError::Feature { name, .. } if name == "Width"), "{error}");
    let error = refused(with(&settings, CameraSetup { exposure_us: Some(1e9), ..CameraSetup::default() }));
    assert!(matches!(&error, CameraError::Feature { name, .. } if name == "ExposureTime"), "{error}");
    assert_eq!(device.counts().sent, 0);
}
