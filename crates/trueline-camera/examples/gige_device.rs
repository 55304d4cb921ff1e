//! A simulated camera for other people's programs: `gige_device ADDRESS SECONDS [WIDTH HEIGHT HZ LOSS]`.
#![allow(clippy::print_stdout, reason = "a program for the console")]

use std::error::Error;
use std::str::FromStr;
use std::time::Duration;
use trueline_camera::device::{Device, DeviceClock, DeviceSettings, Pictures};
use trueline_dataset::{GrayImage, Pixels};
use trueline_live::HostClock;

/// A bright line that moves down.
struct Line {
    width: usize,
    height: usize,
    row: usize,
}

impl Pictures for Line {
    fn picture(&mut self, _: i64, _: f64) -> Option<GrayImage> {
        let mut pixels = vec![12; self.width * self.height];
        self.row = (self.row + 3) % self.height;
        pixels[self.row * self.width..(self.row + 1) * self.width].fill(230);
        Some(GrayImage { width: self.width, height: self.height, pixels: Pixels::Eight(pixels) })
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let address = arguments.first().ok_or("which address?")?.parse()?;
    let seconds: f64 = argument(&arguments, 1, 10.0)?;
    let (width, height) = (argument(&arguments, 2, 1224)?, argument(&arguments, 3, 1000)?);
    let settings = DeviceSettings {
        width,
        height,
        period_s: 1.0 / argument(&arguments, 4, 30.0)?,
        latency_s: 0.02,
        loss: argument(&arguments, 5, 0.0)?,
        clock: DeviceClock { drift_ppm: 50.0, ..DeviceClock::default() },
        ..DeviceSettings::small(address)
    };
    let pictures = Line { width: width as usize, height: height as usize, row: 0 };
    let device = Device::start(settings, HostClock::start(), pictures)?;
    std::thread::sleep(Duration::from_secs_f64(seconds));
    println!("{:?}", device.counts());
    Ok(())
}

fn argument<T: FromStr>(arguments: &[String], at: usize, otherwise: T) -> Result<T, T::Err> {
    arguments.get(at).map_or(Ok(otherwise), |text| text.parse())
}
