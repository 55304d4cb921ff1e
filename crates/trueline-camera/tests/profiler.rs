//! Range data over loopback: the simulated profiler's input comes out as points, in every format.
#![cfg(feature = "gige")]
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

mod simulated;

use simulated::{facts, patient, take, with};
use trueline_camera::device::{Device, DeviceHandle, DeviceSettings, OutputMode, Pictures, RangeFeatures};
use trueline_camera::{
    CameraError, CameraFrame, CameraSetup, FrameStatus, GigeCamera, GigeSettings, PixelFormat,
};
use trueline_dataset::{GrayImage, Pixels};
use trueline_live::HostClock;

const WIDTH: usize = 64;
const INVALID: u16 = 9;
/// The range runs against its numbers.
const RANGE: RangeFeatures = RangeFeatures {
    along_mm: [0.125, -4.0],
    range_mm: [-0.002, 310.0],
    invalid: INVALID,
    lines_hz: 400.0,
    output_mode: OutputMode::RectifiedC,
};

/// Rows that say when they were exposed; every fifth column has no return.
struct Rows;

impl Pictures for Rows {
    fn picture(&mut self, exposure_start_steady_ns: i64, _: f64) -> Option<GrayImage> {
        let pixels = Pixels::Sixteen((0..WIDTH).map(|k| count(k, exposure_start_steady_ns)).collect());
        Some(GrayImage { width: WIDTH, height: 1, pixels })
    }
}

fn count(column: usize, exposed_ns: i64) -> u16 {
    if column % 5 == 2 { INVALID } else { 1000 + column as u16 + (exposed_ns / 1000 % 60_000) as u16 }
}

/// In decimal digits and by hand, not by the client's own code.
fn expected(exposed_ns: i64) -> Vec<Option<[f64; 2]>> {
    let point = |column| {
        let number = f64::from(count(column, exposed_ns));
        (column % 5 != 2).then(|| [(column as f64 * 0.125 - 4.0) / 1e3, (310.0 - number * 0.002) / 1e3])
    };
    (0..WIDTH).map(point).collect()
}

fn profiler(test: u8, rows: u32, range: RangeFeatures) -> DeviceSettings {
    DeviceSettings {
        width: WIDTH as u32,
        height: rows,
        range: Some(range),
        exposure_us: 200.0,
        ..patient(test)
    }
}

fn wanted(settings: &DeviceSettings) -> GigeSettings {
    with(settings, CameraSetup { profiles: true, ..CameraSetup::default() })
}

fn recorded(settings: &DeviceSettings, count: usize) -> (DeviceHandle, Vec<CameraFrame>) {
    let host = HostClock::start();
    let device = Device::start(settings.clone(), host, Rows).unwrap();
    let mut camera = GigeCamera::open(&wanted(settings), host).unwrap();
    let frames = take(&mut camera, count);
    assert_eq!(frames.len(), count);
    (device, frames)
}

#[test]
fn every_point_of_every_profile_arrives_in_metres_with_its_time() {
    let forms = [OutputMode::RectifiedC, OutputMode::CalibratedAc];
    for (test, (rows, output_mode)) in
        (40..).zip([(1, forms[0]), (8, forms[0]), (1, forms[1]), (8, forms[1])])
    {
        let settings = profiler(test, rows, RangeFeatures { output_mode, ..RANGE });
        let (device, frames) = recorded(&settings, 6);
        let sent = facts(&device, &frames);
        for frame in &frames {
            assert_eq!((frame.status.clone(), frame.image.is_none()), (FrameStatus::Complete, true));
            assert_eq!(frame.profiles.len(), rows as usize);
            let sent = sent.iter().find(|sent| Some(sent.device_ns) == frame.device_ns).unwrap();
            for (row, profile) in frame.profiles.iter().enumerate() {
                // 400 Hz.
                assert_eq!(profile.after_first_ns, row as i64 * 2_500_000);
                // The device's clock runs like the PC's by default, so a row's time is known to a nanosecond's rounding.
                let exposed_ns = sent.exposure_start_ns + profile.after_first_ns;
                for (found, expected) in profile.columns.iter().zip(expected(exposed_ns)) {
                    let same = match (found, expected) {
                        // Last digits.
                        (Some(a), Some(b)) => (0..2).all(|k| (a[k] - b[k]).abs() < 1e-15),
                        (a, b) => a.is_none() && b.is_none(),
                    };
                    assert!(same, "row {row}: {found:?} for {expected:?}");
                }
                assert_eq!(profile.columns.len() - profile.points().count(), 13, "every fifth of 64");
            }
            // The first packet cannot leave before the last row was exposed.
            let end_ns = sent.exposure_start_ns + (i64::from(rows) - 1) * 2_500_000 + 200_000;
            assert!(sent.first_packet_ns >= end_ns);
        }
    }
}

#[test]
fn numbers_that_are_no_lengths_are_refused_by_name() {
    let refused = |settings: &DeviceSettings| {
        let host = HostClock::start();
        let _device = Device::start(settings.clone(), host, Rows).unwrap();
        GigeCamera::open(&wanted(settings), host).err().unwrap()
    };
    let uncalibrated = RangeFeatures { output_mode: OutputMode::UncalibratedC, ..RANGE };
    let error = refused(&profiler(50, 1, uncalibrated));
    assert!(
        matches!(&error, CameraError::Feature { name, why }
        if name == "Scan3dOutputMode" && why.contains("UncalibratedC") && why.contains("RectifiedC")),
        "{error}"
    );
    let error = refused(&profiler(51, 1, RangeFeatures { range_mm: [0.0, 100.0], ..RANGE }));
    assert!(error.to_string().contains("`Scan3dCoordinateScale`: it is 0 for CoordinateC"), "{error}");
    let error = refused(&profiler(52, 2, RangeFeatures { lines_hz: 0.0, ..RANGE }));
    assert!(error.to_string().contains("Set Height to 1"), "{error}");
    // A camera is no profiler.
    let error = refused(&patient(53));
    assert!(
        matches!(&error, CameraError::Format { wanted, offered }
        if wanted.contains("Coord3D_C16") && offered == "Mono8, Mono12, Mono10p, Mono12p, Mono10Packed, Mono12Packed, Mono16"),
        "{error}"
    );
}

#[test]
fn a_profiler_whose_numbers_change_their_form_ends_the_session() {
    use std::time::Duration;
    use trueline_camera::FrameSource;
    let settings = profiler(54, 1, RANGE);
    let host = HostClock::start();
    let device = Device::start(settings.clone(), host, Rows).unwrap();
    let mut camera = GigeCamera::open(&wanted(&settings), host).unwrap();
    take(&mut camera, 2);
    device.set_pixel_format(PixelFormat::Coord3dAc16);
    let ended = (0..400).find_map(|_| camera.next(Duration::from_millis(100)).err());
    assert!(matches!(ended, Some(CameraError::Format { .. })), "{ended:?}");
}
