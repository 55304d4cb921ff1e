//! Takes pictures from a device of Video4Linux and says a line about each: `v4l2_client DEVICE COUNT [PIXEL-FORMAT [EXPOSURE-US FPS]]`.
#![allow(clippy::print_stdout, reason = "a program for the console")]

#[cfg(target_os = "linux")]
fn main() -> Result<(), String> {
    run().map_err(|error| error.to_string())
}

#[cfg(target_os = "linux")]
fn run() -> Result<(), Box<dyn std::error::Error>> {
    use std::time::Duration;
    use trueline_camera::v4l2::{V4l2Camera, V4l2Settings};
    use trueline_camera::{FrameSource, PixelFormat};
    use trueline_dataset::{Channel, Pixels};
    use trueline_live::HostClock;

    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let number = |at: usize| arguments.get(at).map(|text| text.parse::<f64>()).transpose();
    let pixel =
        arguments.get(2).map(|name| PixelFormat::of_name(name).ok_or("no pixel format")).transpose()?;
    let settings = V4l2Settings {
        path: arguments.first().ok_or("which device?")?.into(),
        size: None,
        pixel,
        channel: pixel.filter(|format| format.has_colours()).map(|_| Channel::Red),
        exposure_us: number(3)?,
        fps: number(4)?,
    };
    let clock = HostClock::start();
    let mut camera = V4l2Camera::open(&settings, clock)?;
    let about = camera.about().clone();
    println!(
        "name=\"{}\" size={}x{} stamp=\"{}\"",
        about.name, about.width, about.height, about.stamp_meaning
    );
    println!("latch={}", camera.latch()?.is_some());
    let (count, mut taken) = (number(1)?.unwrap_or(10.0) as u64, 0);
    while taken < count {
        let Some(frame) = camera.next(Duration::from_millis(200))? else { continue };
        taken += 1;
        let levels: Vec<u32> = match frame.image.as_ref().map(|image| &image.pixels) {
            Some(Pixels::Eight(levels)) => levels.iter().map(|level| u32::from(*level)).collect(),
            Some(Pixels::Sixteen(levels)) => levels.iter().map(|level| u32::from(*level)).collect(),
            None => Vec::new(),
        };
        let now_ns = clock.read().steady_ns;
        let age_ms = |at_ns: i64| (now_ns - at_ns) as f64 * 1e-6;
        println!(
            "frame={} status={:?} pixels={} sum={} first={:?} begin_ms={:?} complete_ms={:.3} device={}",
            frame.frame,
            frame.status,
            levels.len(),
            levels.iter().map(|level| u64::from(*level)).sum::<u64>(),
            levels.first(),
            frame.first_packet_ns.map(age_ms),
            age_ms(frame.complete_ns),
            frame.device_ns.is_some(),
        );
    }
    Ok(())
}

#[cfg(not(target_os = "linux"))]
fn main() {
    println!("Video4Linux is Linux'");
}
