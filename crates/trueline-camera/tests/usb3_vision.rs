//! Our client and a USB3 Vision camera that is not there: pixels, numbers, stamps, and a device that lies.
#![cfg(feature = "u3v")]
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

mod usb_device;

use std::sync::Arc;
use std::time::{Duration, Instant};
use trueline_camera::u3v::{U3vCamera, U3vSettings};
use trueline_camera::{
    CameraError, CameraFrame, CameraSetup, FrameSource, FrameStatus, LatchMap, PixelFormat, Reconnecting,
    Trigger,
};
use trueline_dataset::Pixels;
use trueline_live::HostClock;
use usb_device::{
    ACQUISITION, ENDPOINTS, EXPOSURE, EXPOSURE_AUTO, Fault, HEIGHT, Noise, PIXEL_FORMAT, SBRM, SBRM_ADDRESS,
    SERIAL, SIRM, STREAM_CONTROL, Sent, TABLE, TABLE_ADDRESS, TRIGGER_MODE, TRIGGER_SOURCE, UsbDevice, WIDTH,
    archive,
};

type Camera = U3vCamera<UsbDevice>;
/// Changes of a good picture.
type Spoil = fn(&mut Sent);
const DESCRIPTION: &str = include_str!("usb_device/description.xml");
const SIZE: [u32; 2] = [64, 48];
/// No test waits longer for a picture that was sent.
const LONGEST: Duration = Duration::from_secs(10);

fn open(device: &Arc<UsbDevice>, setup: CameraSetup, clock: HostClock) -> Result<Camera, CameraError> {
    let settings = U3vSettings { serial: None, setup };
    Camera::over(Arc::clone(device), ENDPOINTS, &settings, clock)
}

fn opened(device: &Arc<UsbDevice>, clock: HostClock) -> Camera {
    open(device, CameraSetup::default(), clock).unwrap()
}

/// The pixels of a picture.
fn pixels(seed: u64, bytes: usize) -> Vec<u8> {
    (0..bytes).map(|at| (at as u64 * 7 + seed * 31) as u8 ^ (at >> 8) as u8).collect()
}

fn good(device: &UsbDevice, block: u64) -> Sent {
    Sent::good(block, device.now_ns(), SIZE, pixels(block, 64 * 48))
}

fn next(camera: &mut dyn FrameSource) -> CameraFrame {
    let begin = Instant::now();
    while begin.elapsed() < LONGEST {
        if let Some(frame) = camera.next(Duration::from_millis(200)).unwrap() {
            return frame;
        }
    }
    panic!("no picture");
}

/// The first error, which must come in time.
fn error(camera: &mut dyn FrameSource) -> CameraError {
    let begin = Instant::now();
    while begin.elapsed() < LONGEST {
        if let Err(error) = camera.next(Duration::from_millis(100)) {
            return error;
        }
    }
    panic!("no error");
}

#[test]
fn every_pixel_number_and_stamp_arrives() {
    let clock = HostClock::start();
    let device = UsbDevice::start(clock);
    let mut camera = opened(&device, clock);
    let about = camera.about().clone();
    assert_eq!(about.name, "trueline Nowhere U3V-1");
    assert_eq!((about.width, about.height, about.trigger), (64, 48, None));
    for block in 0..40 {
        let sent = good(&device, block);
        let before_ns = clock.read().steady_ns;
        device.send(&sent);
        let frame = next(&mut camera);
        let after_ns = clock.read().steady_ns;
        assert_eq!((frame.frame, &frame.status), (block, &FrameStatus::Complete));
        assert_eq!(frame.device_ns, Some(sent.device_ns.cast_signed()));
        assert_eq!(frame.exposure_us, Some(2000.0));
        assert_eq!(frame.image.unwrap().pixels, Pixels::Eight(sent.payload));
        let first_ns = frame.first_packet_ns.unwrap();
        assert!(before_ns <= first_ns && first_ns <= frame.complete_ns && frame.complete_ns <= after_ns);
    }
    let counts = camera.counts();
    assert_eq!((counts.frames, counts.incomplete, counts.missing, counts.bad_chunks), (40, 0, 0, 0));
    drop(camera);
    assert_eq!(
        (device.register(ACQUISITION), device.register(STREAM_CONTROL)),
        (0, 0),
        "it was left running"
    );
}

#[test]
fn the_first_stamp_is_that_of_the_leader_and_the_last_that_of_the_trailer() {
    let clock = HostClock::start();
    let device = UsbDevice::start(clock);
    let mut camera = opened(&device, clock);
    let sent = good(&device, 3);
    let now_ns = || clock.read().steady_ns;
    let begin_ns = now_ns();
    device.send_leader(&sent);
    device.until_taken();
    let leader_taken_ns = now_ns();
    device.send_payload(&sent.payload);
    device.until_taken();
    let payload_taken_ns = now_ns();
    device.send_trailer(&sent);
    let frame = next(&mut camera);
    assert!((begin_ns..=leader_taken_ns).contains(&frame.first_packet_ns.unwrap()));
    assert!((payload_taken_ns..=now_ns()).contains(&frame.complete_ns));
}

#[test]
fn what_is_asked_for_is_set_by_the_rules_of_every_camera() {
    let clock = HostClock::start();
    let device = UsbDevice::start(clock);
    // A program that crashed left it on.
    device.poke(STREAM_CONTROL, &1_u32.to_le_bytes());
    device.poke(TRIGGER_MODE, &1_u32.to_le_bytes());
    let setup = CameraSetup {
        width: Some(32),
        height: Some(20),
        pixel: PixelFormat::of_name("Mono12p"),
        exposure_us: Some(750.0),
        ..CameraSetup::default()
    };
    let mut camera = open(&device, setup, clock).unwrap();
    assert_eq!([WIDTH, HEIGHT, EXPOSURE_AUTO, TRIGGER_MODE].map(|at| device.register(at)), [32, 20, 0, 0]);
    assert_eq!(device.register(PIXEL_FORMAT), 0x010c_0047);
    assert_eq!(f32::from_bits(device.register(EXPOSURE)).to_bits(), 750_f32.to_bits());
    assert_eq!((device.register(STREAM_CONTROL), device.register(ACQUISITION)), (1, 1));
    // 0xabc and 0x123 again and again, the lowest bits first.
    let payload = [0xbc, 0x3a, 0x12].repeat(32 * 20 / 2);
    let sent = Sent { format: 0x010c_0047, ..Sent::good(0, device.now_ns(), [32, 20], payload) };
    device.send(&sent);
    let frame = next(&mut camera);
    let expected = Pixels::Sixteen([0xabc0, 0x1230].repeat(32 * 20 / 2));
    assert_eq!((frame.image.unwrap().pixels, frame.exposure_us), (expected, Some(750.0)));
}

#[test]
fn a_trigger_is_set_and_what_the_camera_does_not_have_is_refused_by_name() {
    let clock = HostClock::start();
    let device = UsbDevice::start(clock);
    let trigger =
        |text: &str| CameraSetup { trigger: text.parse::<Trigger>().unwrap(), ..CameraSetup::default() };
    let camera = open(&device, trigger("Line1"), clock).unwrap();
    assert_eq!(camera.about().trigger.as_deref(), Some("Line1"));
    assert_eq!([TRIGGER_MODE, TRIGGER_SOURCE].map(|at| device.register(at)), [1, 1]);
    drop(camera);
    let refused = |setup| open(&device, setup, clock).err().unwrap().to_string();
    assert!(
        refused(trigger("Line7"))
            .contains("`TriggerSource`: Line7 was requested; the camera offers Software, Line1")
    );
    assert!(refused(trigger("Line1:rising")).contains("`TriggerActivation`"), "the camera has none");
    let fps = CameraSetup { fps: Some(30.0), ..CameraSetup::default() };
    assert!(refused(fps).contains("`AcquisitionFrameRate`"));
    let wide = CameraSetup { width: Some(128), ..CameraSetup::default() };
    assert!(refused(wide).contains("`Width`: 128 was requested; the camera supports 8 to 64"));
    let mono16 = CameraSetup { pixel: Some(PixelFormat::MONO_16), ..CameraSetup::default() };
    assert!(refused(mono16).contains("the camera offers Mono8, Mono12p"));
}

#[test]
fn the_cameras_clock_is_mapped_by_asking_it() {
    let clock = HostClock::start();
    let device = UsbDevice::start(clock);
    let mut camera = opened(&device, clock);
    let samples: Vec<_> = (0..12).filter_map(|_| camera.latch().unwrap()).collect();
    assert_eq!(samples.len(), 12);
    let map = LatchMap::of(&samples).unwrap();
    let at_ns = samples[6].before_ns;
    let error_ns = map.host_ns(at_ns + device.ahead_ns()) - at_ns;
    // Half of the quickest exchange, twice as much at the ends, and a nanosecond of rounding.
    assert!((error_ns as f64).abs() <= 2e9 * map.sigma_s + 1.0, "{error_ns} ns, {map:?}");
}

#[test]
fn chunks_are_read_with_the_lowest_byte_first_and_lengths_that_lie_are_counted() {
    let clock = HostClock::start();
    let device = UsbDevice::start(clock);
    let mut camera = opened(&device, clock);
    let chunk = |id: u32, data: &[u8]| [data, &id.to_le_bytes(), &(data.len() as u32).to_le_bytes()].concat();
    let (stamp, leader_ns) = (0x0102_0304_0506_u64, 0x0102_0300_0000_u64);
    let pixels = pixels(1, 64 * 48);
    let payload =
        [chunk(1, &pixels), chunk(0xa2, &stamp.to_le_bytes()), chunk(0xa3, &(-7_i32).to_le_bytes())].concat();
    let sent = Sent { payload_type: 0x4001, ..Sent::good(0, leader_ns, SIZE, payload) };
    device.send(&sent);
    let frame = next(&mut camera);
    assert_eq!((frame.device_ns, frame.signals.encoder), (Some(stamp.cast_signed()), Some(-7)));
    assert_eq!(frame.image.unwrap().pixels, Pixels::Eight(pixels));
    let mut lies = sent.payload.clone();
    let at = lies.len() - 4;
    lies[at..].copy_from_slice(&0x00ff_ffff_u32.to_le_bytes());
    device.send(&Sent { block: 1, ends: Some(1), payload: lies, ..sent.clone() });
    let frame = next(&mut camera);
    assert_eq!(
        (frame.device_ns, frame.status, camera.counts().bad_chunks),
        (Some(leader_ns.cast_signed()), FrameStatus::Complete, 1)
    );
    // Stamps of 10 s and 1 ns apart, on either side, are not of one clock; the other chunks are as good as before.
    for (block, leader_ns, is_used) in [
        (2, stamp + 10_000_000_000, true),
        (3, stamp + 10_000_000_001, false),
        (4, stamp - 10_000_000_001, false),
        (5, 0, true),
    ] {
        let bad = camera.counts().bad_chunks;
        device.send(&Sent { block, ends: Some(block), device_ns: leader_ns, ..sent.clone() });
        let frame = next(&mut camera);
        let expected = if is_used { stamp } else { leader_ns };
        assert_eq!(frame.device_ns, Some(expected.cast_signed()), "{block}");
        assert_eq!((frame.signals.encoder, frame.status), (Some(-7), FrameStatus::Complete));
        assert_eq!(camera.counts().bad_chunks - bad, u64::from(!is_used), "{block}");
    }
    // All pixels came, and half of the chunks.
    let (cut, valid) = (sent.payload[..64 * 48 + 12].to_vec(), Some(sent.payload.len() as u64));
    device.send(&Sent { block: 6, ends: Some(6), payload: cut, valid, ..sent });
    assert_eq!(next(&mut camera).status, FrameStatus::Incomplete { missing: 1 });
}

/// One unanswered command is sent again; a silent device is still told to stop.
#[test]
fn an_answer_that_is_lost_ends_nothing() {
    let clock = HostClock::start();
    let device = UsbDevice::start(clock);
    device.set_fault(Fault::LosesOne);
    let mut camera = opened(&device, clock);
    device.send(&good(&device, 0));
    assert_eq!(next(&mut camera).status, FrameStatus::Complete);
    assert!(camera.latch().unwrap().is_some() || camera.latch().unwrap().is_some(), "the first may be none");
    device.set_fault(Fault::LosesOne);
    assert!(camera.latch().unwrap().is_some());
    assert_eq!(device.fault(), Fault::None, "nothing was asked");
    device.set_fault(Fault::LosesOne);
    let begin = Instant::now();
    while device.fault() != Fault::None && begin.elapsed() < LONGEST {
        assert_eq!(camera.next(Duration::from_millis(50)).unwrap(), None);
    }
    device.poke(EXPOSURE_AUTO, &2_u32.to_le_bytes());
    assert!(matches!(error(&mut camera), CameraError::ExposureAuto { .. }));
    device.set_fault(Fault::Silent);
    assert!(matches!(error(&mut camera), CameraError::Unplugged { .. }));
    device.set_fault(Fault::None);
    assert_eq!([ACQUISITION, STREAM_CONTROL].map(|at| device.register(at)), [1, 1]);
    drop(camera);
    assert_eq!([ACQUISITION, STREAM_CONTROL].map(|at| device.register(at)), [0, 0], "it was left running");
}

#[test]
fn the_stamp_of_a_picture_without_an_end_is_none_of_the_program_that_takes_it_late() {
    let clock = HostClock::start();
    let device = UsbDevice::start(clock);
    let mut camera = opened(&device, clock);
    device.send(&Sent { ends: None, ..good(&device, 0) });
    device.send(&good(&device, 1));
    device.until_taken();
    let taken_ns = clock.read().steady_ns;
    std::thread::sleep(Duration::from_millis(50));
    let frame = next(&mut camera);
    assert!(matches!(frame.status, FrameStatus::Incomplete { .. }) && frame.complete_ns <= taken_ns);
}

#[test]
fn another_camera_of_the_same_size_does_not_take_over() {
    let clock = HostClock::start();
    for (serial, is_same) in [(b"U3V-1", true), (b"U3V-2", false)] {
        let [device, again] = [(), ()].map(|()| UsbDevice::start(clock));
        again.poke(SERIAL, serial);
        let camera = opened(&device, clock);
        assert_eq!(camera.serial(), Some("U3V-1"));
        let reopen = move || Ok(Box::new(opened(&again, clock)) as Box<dyn FrameSource>);
        let mut camera = Reconnecting::new(Box::new(camera), Box::new(reopen));
        device.unplug();
        let refused = (0..12).find_map(|_| camera.next(Duration::from_millis(100)).err());
        let told = refused.map(|error| error.to_string()).unwrap_or_default();
        assert_eq!(told.is_empty(), is_same, "{told}");
        assert!(is_same || told.contains("it was U3V-1, and now is U3V-2"), "{told}");
    }
}

#[test]
fn pictures_that_lack_something_are_told_and_the_stream_goes_on() {
    let clock = HostClock::start();
    let device = UsbDevice::start(clock);
    let mut camera = opened(&device, clock);
    let bad: [(&str, Spoil); 8] = [
        ("no trailer", |sent| sent.ends = None),
        ("the trailer of another", |sent| sent.ends = Some(sent.block + 1)),
        ("data were discarded", |sent| sent.status = 0xa100),
        ("less is valid than was sent", |sent| sent.valid = Some(100)),
        ("rows are missing", |sent| sent.rows = Some(20)),
        ("more is valid than was sent", |sent| {
            sent.payload.truncate(1000);
            sent.valid = Some(u64::MAX);
        }),
        ("no pixels", |sent| sent.payload.clear()),
        ("lines are filled up, and there is no room", |sent| sent.padding = u16::MAX),
    ];
    let mut block = 0;
    for (what, spoil) in bad {
        let mut sent = good(&device, block);
        spoil(&mut sent);
        device.send(&sent);
        device.send(&good(&device, block + 1));
        let frame = next(&mut camera);
        let is_incomplete = matches!(frame.status, FrameStatus::Incomplete { missing: 1.. });
        assert!(is_incomplete && frame.image.is_none(), "{what}: {:?}", frame.status);
        assert_eq!((frame.frame, next(&mut camera).status), (block, FrameStatus::Complete), "{what}");
        block += 2;
    }
    assert_eq!(camera.counts().incomplete, 8);
}

#[test]
fn lost_pictures_are_counted_by_the_cameras_numbers() {
    let clock = HostClock::start();
    let device = UsbDevice::start(clock);
    let mut camera = opened(&device, clock);
    let numbers: Vec<u64> = [5, 6, 9, 10, 2]
        .into_iter()
        .map(|block| {
            device.send(&good(&device, block));
            next(&mut camera).frame
        })
        .collect();
    assert_eq!((numbers, camera.counts().missing), (vec![0, 1, 4, 5, 6], 2));
}

#[test]
fn what_is_no_picture_is_passed_over_and_never_holds_the_program_up() {
    let clock = HostClock::start();
    let device = UsbDevice::start(clock);
    let mut camera = opened(&device, clock);
    for garbage in
        [vec![], vec![0; 8], b"U3VL".to_vec(), [b"U3VL", &[0xff; 28][..]].concat(), b"U3VT".repeat(8)]
    {
        device.send_raw(garbage);
    }
    device.send(&good(&device, 0));
    let frame = next(&mut camera);
    assert_eq!((frame.frame, frame.status), (0, FrameStatus::Complete));
    // Garbage that never ends.
    let (flood, ended) = (Arc::clone(&device), Arc::new(std::sync::atomic::AtomicBool::new(false)));
    let ends = Arc::clone(&ended);
    let thread = std::thread::spawn(move || {
        while !ends.load(std::sync::atomic::Ordering::Relaxed) {
            flood.send_raw(vec![7; 40]);
            std::thread::sleep(Duration::from_micros(200));
        }
    });
    std::thread::sleep(Duration::from_millis(100));
    let begin = Instant::now();
    drop(camera);
    let took = begin.elapsed();
    ended.store(true, std::sync::atomic::Ordering::Relaxed);
    thread.join().unwrap();
    assert!(took < Duration::from_secs(5), "{took:?}");
}

#[test]
fn a_camera_that_goes_within_a_picture_and_comes_back_goes_on() {
    let clock = HostClock::start();
    let device = UsbDevice::start(clock);
    let again = UsbDevice::start(clock);
    let (mut camera, back) = (opened(&device, clock), Arc::clone(&again));
    device.send(&good(&device, 0));
    assert_eq!(next(&mut camera).frame, 0);
    let sent = good(&device, 1);
    device.send_leader(&sent);
    device.send_payload(&sent.payload[..1000]);
    device.unplug();
    assert!(matches!(error(&mut camera), CameraError::Unplugged { .. }));
    assert!(matches!(error(&mut camera), CameraError::Unplugged { .. }), "it stays away");
    assert!(matches!(camera.latch(), Err(CameraError::Unplugged { .. })));
    let reopen = move || Ok(Box::new(opened(&back, clock)) as Box<dyn FrameSource>);
    let mut camera = Reconnecting::new(Box::new(camera), Box::new(reopen));
    let begin = Instant::now();
    while again.register(ACQUISITION) == 0 && begin.elapsed() < LONGEST {
        assert_eq!(camera.next(Duration::from_millis(100)).unwrap(), None);
    }
    again.send(&good(&again, 0));
    assert_eq!((next(&mut camera).status, camera.interruptions()), (FrameStatus::Complete, 1));
}

#[test]
fn another_size_or_format_ends_the_session_and_so_does_an_automatic() {
    let clock = HostClock::start();
    let device = UsbDevice::start(clock);
    let mut camera = opened(&device, clock);
    device.send(&Sent { size: [64, 40], ..good(&device, 0) });
    assert_eq!(next(&mut camera).status, FrameStatus::WrongSize { width: 64, height: 40 });
    assert!(matches!(camera.next(LONGEST), Err(CameraError::FrameSizeChanged { .. })));
    for (format, payload_type, told) in
        [(0x0110_0007, 1, "Mono16"), (7, 1, "0x00000007"), (0, 0x4000, "type 0x4000")]
    {
        device.send(&Sent { format, payload_type, ..good(&device, 1) });
        assert!(
            matches!(next(&mut camera).status, FrameStatus::WrongFormat { found } if found.contains(told))
        );
        assert!(error(&mut camera).to_string().contains(told));
    }
    device.poke(EXPOSURE_AUTO, &2_u32.to_le_bytes());
    assert!(
        matches!(error(&mut camera), CameraError::ExposureAuto { feature, .. } if feature == "ExposureAuto")
    );
}

#[test]
fn answers_that_are_late_or_to_another_command_are_not_taken() {
    let clock = HostClock::start();
    for fault in [Fault::Stale, Fault::Pending] {
        let device = UsbDevice::start(clock);
        device.set_fault(fault);
        let camera = opened(&device, clock);
        assert_eq!(camera.about().name, "trueline Nowhere U3V-1", "{fault:?}");
    }
    let bad = [
        (Fault::PendingForEver, "timeout"),
        (Fault::Silent, "timeout"),
        (Fault::Half, "bytes"),
        (Fault::LongerThanItIs, "acknowledge"),
        (Fault::OtherCommand, "acknowledge"),
        (Fault::OtherPrefix, "prefix"),
    ];
    for (fault, expected) in bad {
        let device = UsbDevice::start(clock);
        device.set_fault(fault);
        let told = open(&device, CameraSetup::default(), clock).err().unwrap().to_string();
        assert!(told.starts_with("usb: it does not answer") && told.contains(expected), "{fault:?}: {told}");
        // The same once it was open.
        let device = UsbDevice::start(clock);
        let mut camera = opened(&device, clock);
        device.set_fault(fault);
        let answered = camera.latch();
        assert!(!matches!(answered, Ok(Some(_))), "{fault:?}: {answered:?}");
    }
}

/// Registers with wrong contents: their places, and the messages.
#[test]
fn registers_that_lie_are_refused_in_words() {
    let clock = HostClock::start();
    let far = u64::MAX.to_le_bytes();
    let lies: [(&str, u64, &[u8], &str); 14] = [
        ("bootstrap registers beyond the memory", SBRM_ADDRESS, &far, "outside its memory"),
        ("none", SBRM_ADDRESS, &[0x77; 8], "status"),
        ("no room for a command", SBRM + 0x14, &1_u32.to_le_bytes(), "command transfer too small"),
        ("no room for an answer", SBRM + 0x18, &12_u32.to_le_bytes(), "too small to carry data"),
        ("a stream beyond the memory", SBRM + 0x20, &far, "outside its memory"),
        ("no stream", SBRM + 0x20, &[0; 8], "has no stream"),
        ("an alignment of 2^40", SIRM, &(40_u32 << 24).to_le_bytes(), "alignment"),
        ("an alignment of 2^30", SIRM, &(30_u32 << 24).to_le_bytes(), "alignment"),
        ("pictures of 2^60 bytes", SIRM + 8, &(1_u64 << 60).to_le_bytes(), "more than 1 GiB"),
        (
            "pictures of 1 GiB",
            SIRM + 8,
            &(1_u64 << 30).to_le_bytes(),
            "1073741824 bytes for a picture, but 64 x 48 px of Mono8 need 3072",
        ),
        (
            "pictures of 99 bytes",
            SIRM + 8,
            &99_u64.to_le_bytes(),
            "99 bytes for a picture, but 64 x 48 px of Mono8 need 3072",
        ),
        ("a leader of 4 GiB", SIRM + 0x10, &u32::MAX.to_le_bytes(), "more than 64 KiB"),
        ("a trailer of 4 GiB", SIRM + 0x14, &u32::MAX.to_le_bytes(), "more than 64 KiB"),
        ("a table beyond the memory", TABLE_ADDRESS, &far, "outside its memory"),
    ];
    for (what, address, bytes, expected) in lies {
        let device = UsbDevice::start(clock);
        device.poke(address, bytes);
        let told = open(&device, CameraSetup::default(), clock).err().unwrap().to_string();
        assert!(told.contains(expected), "{what}: {told}");
        assert_eq!(device.register(STREAM_CONTROL), 0, "{what}: the stream was left on");
    }
}

#[test]
fn files_that_lie_are_refused_in_words() {
    let clock = HostClock::start();
    let entry = TABLE + 72;
    let lies: [(&str, u64, &[u8], &str); 6] = [
        ("no file", TABLE, &[0; 8], "has none"),
        ("a file for chunks alone", entry + 4, &1_u32.to_le_bytes(), "has none"),
        ("more files than can be", TABLE, &[0xff; 8], ""),
        ("no bytes", entry + 16, &[0; 8], "it states a length of 0 bytes"),
        ("2^60 bytes", entry + 16, &(1_u64 << 60).to_le_bytes(), "1152921504606846976 bytes"),
        ("beyond the memory", entry + 8, &[0xff; 8], "outside its memory"),
    ];
    for (what, address, bytes, expected) in lies {
        let device = UsbDevice::start(clock);
        device.poke(address, bytes);
        let told = open(&device, CameraSetup::default(), clock).err().map(|error| error.to_string());
        assert_eq!(told.is_none(), expected.is_empty(), "{what}: {told:?}");
        assert!(told.unwrap_or_default().contains(expected), "{what}");
    }
}

/// Entities that grow by ten each time, an archive that says that it grows, and descriptions that go round in circles.
#[test]
fn descriptions_that_lie_are_refused_and_archives_are_opened() {
    let clock = HostClock::start();
    let zipped = archive(DESCRIPTION.as_bytes(), DESCRIPTION.len() as u32);
    let device = UsbDevice::with_description(clock, &zipped, 1);
    assert_eq!(opened(&device, clock).about().width, 64);
    let mut entities = "<!ENTITY a0 \"aaaaaaaaaa\">".to_owned();
    for number in 1..12 {
        let before = format!("&a{};", number - 1).repeat(10);
        entities += &format!("<!ENTITY a{number} \"{before}\">");
    }
    let bomb = format!(
        "<!DOCTYPE R [{entities}]><RegisterDescription><Category Name=\"Root\">&a11;</Category></RegisterDescription>"
    );
    let circle = DESCRIPTION.replace("<pValue>WidthReg</pValue>", "<pValue>Width</pValue>");
    let giant = DESCRIPTION.replace("0x40000</Address><Length>4<", "0x40000</Address><Length>4000000000000<");
    let nowhere = DESCRIPTION.replace("0x40000</Address>", "0xFFFFFFFFFFFFFFFF</Address>");
    let cases: [(&str, Vec<u8>, &str); 8] = [
        ("a bomb", bomb.into_bytes(), "description"),
        ("an archive that claims 4 GiB", archive(DESCRIPTION.as_bytes(), u32::MAX), "too large"),
        ("an archive cut off", zipped[..zipped.len() / 2].to_vec(), "central-directory"),
        ("no description", vec![0xfe; 999], "description"),
        ("no features", b"<RegisterDescription/>".to_vec(), "PixelFormat"),
        ("a circle", circle.into_bytes(), "circular"),
        ("a register of 4 TB", giant.into_bytes(), "out of range"),
        ("a register nowhere", nowhere.into_bytes(), "outside its memory"),
    ];
    for (what, description, expected) in cases {
        let device = UsbDevice::with_description(clock, &description, 0);
        let told = open(&device, CameraSetup { width: Some(32), ..CameraSetup::default() }, clock).err();
        let told = told.map_or_else(|| "opened".to_owned(), |error| error.to_string());
        assert!(told.contains(expected), "{what}: {told}");
    }
}

#[test]
fn whatever_a_device_answers_or_sends_is_a_picture_or_an_error() {
    let clock = HostClock::start();
    let (mut opened_ones, mut good_ones) = (0, 0);
    for seed in 1..=300_u64 {
        let device = UsbDevice::start(clock);
        let seed = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15);
        let mut noise = Noise(seed);
        // One in three lies while it is opened, the others only afterwards.
        if noise.below(3) == 0 {
            device.set_fault(Fault::Noise(seed));
        }
        let Ok(mut camera) = open(&device, CameraSetup::default(), clock) else { continue };
        device.set_fault(Fault::Noise(seed));
        opened_ones += 1;
        for block in 0..4 {
            // This stamp identifies the picture: the number may be spoilt.
            let mut sent = Sent { device_ns: 1 + block, ..good(&device, block) };
            for _ in 0..noise.below(3) {
                let some = noise.below(u64::MAX);
                match noise.below(8) {
                    0 => sent.block = some,
                    1 => sent.size = [some as u32, (some >> 32) as u32],
                    2 => sent.valid = Some(some),
                    3 => sent.padding = some as u16,
                    4 => sent.payload.truncate(some as usize % 4000),
                    5 => sent.payload_type = some as u16,
                    6 => sent.ends = (some & 1 == 0).then_some(some),
                    _ => device.send_raw(vec![some as u8; some as usize % 200]),
                }
            }
            device.send_leader(&sent);
            device.send_payload(&sent.payload);
            device.send_trailer(&sent);
        }
        for _ in 0..6 {
            match camera.next(Duration::from_millis(3)) {
                Ok(Some(frame)) => {
                    let is_good = frame.status == FrameStatus::Complete;
                    assert_eq!(frame.image.is_some(), is_good);
                    if let Some(image) = frame.image {
                        let block = frame.device_ns.unwrap().cast_unsigned() - 1;
                        assert_eq!(image.pixels, Pixels::Eight(pixels(block, 64 * 48)), "{seed:#x}");
                    }
                    good_ones += u64::from(is_good);
                }
                Ok(None) => {}
                Err(error) => assert!(!error.to_string().is_empty()),
            }
        }
    }
    assert!(
        opened_ones > 150 && good_ones > 150,
        "{opened_ones} opened, {good_ones} pictures: nothing was tested"
    );
}
