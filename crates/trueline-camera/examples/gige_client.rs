//! Takes pictures from a camera and says on one line how that went: `gige_client ADDRESS COUNT [WIDTH HEIGHT US]`.
#![allow(clippy::print_stdout, reason = "a program for the console")]

use std::error::Error;
use std::time::{Duration, Instant};
use trueline_camera::{
    CameraSetup, FrameSource, FrameStatus, GigeCamera, GigeSettings, LatchMap, LatchSample,
};
use trueline_live::HostClock;

const LONGEST: Duration = Duration::from_secs(60);
const PACKET_BYTES: u16 = 1400;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let number = |at: usize| arguments.get(at).map(|text| text.parse::<u32>()).transpose();
    let address = arguments.first().ok_or("which address?")?.parse()?;
    let count = u64::from(number(1)?.unwrap_or(100));
    let setup = CameraSetup {
        width: number(2)?,
        height: number(3)?,
        exposure_us: number(4)?.map(f64::from),
        ..CameraSetup::default()
    };
    let settings = GigeSettings { packet_size: Some(PACKET_BYTES), setup, ..GigeSettings::at(address) };
    let mut camera = GigeCamera::open(&settings, HostClock::start())?;
    let (begin, mut complete, mut latches) = (Instant::now(), 0, Vec::<LatchSample>::new());
    let mut stamps = Vec::new();
    while camera.counts().frames < count && begin.elapsed() < LONGEST {
        let Some(frame) = camera.next(Duration::from_secs(1))? else { continue };
        complete += u64::from(frame.status == FrameStatus::Complete);
        stamps.extend(frame.device_ns.zip(frame.first_packet_ns));
        latches.extend(camera.latch()?);
    }
    let counts = camera.counts();
    let about = camera.about();
    println!(
        "name=\"{}\" size={}x{} frames={} complete={complete} incomplete={} missing={} resent={} socket_drops={} \
         fps={:.1} ptp={:?} latch={} stamp_ppm={:+.1}",
        about.name,
        about.width,
        about.height,
        counts.frames,
        counts.incomplete,
        counts.missing,
        counts.resent_packets,
        counts.socket_drops,
        counts.frames as f64 / begin.elapsed().as_secs_f64(),
        camera.ptp(),
        LatchMap::of(&latches).map_or("none".to_owned(), |map| format!(
            "{:+.1}ppm±{:.1}us",
            map.drift_ppm,
            map.sigma_s * 1e6
        )),
        stamp_ppm(&stamps),
    );
    if complete < count { Err(format!("{complete} of {count} pictures are complete").into()) } else { Ok(()) }
}

/// By how much stamps gain on arrivals from the first to the last picture, parts per million.
fn stamp_ppm(stamps: &[(i64, i64)]) -> f64 {
    let ends = stamps.first().zip(stamps.last());
    ends.map_or(0.0, |(first, last)| ((last.0 - first.0) as f64 / (last.1 - first.1) as f64 - 1.0) * 1e6)
}
