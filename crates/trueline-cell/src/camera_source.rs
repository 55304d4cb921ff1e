//! Opens the camera that was chosen.

use crate::error::CellError;
use crate::frame_stamper::StampChoice;
use std::net::Ipv4Addr;
use std::path::PathBuf;
use std::time::{Duration, Instant};
use trueline_camera::{CameraError, FrameSource, Pace, PixelFormat, Reconnecting, Replay, Trigger};
use trueline_dataset::{Channel, Sensor};
use trueline_live::HostClock;
use trueline_vision::Joint;

/// How long a camera that does not answer is looked for: it may just be waking up.
const PATIENCE: Duration = Duration::from_secs(8);

/// Which camera.
#[derive(Clone, Debug, PartialEq)]
pub enum CameraChoice {
    /// A GigE Vision camera.
    GigE(GigeChoice),
    /// A device of Video4Linux.
    #[cfg(all(feature = "v4l2", target_os = "linux"))]
    V4l2(trueline_camera::v4l2::V4l2Settings),
    /// The pictures of a dataset folder, at the pace at which they were recorded.
    Replay(PathBuf),
}

/// A GigE Vision camera, and what is set on it.
#[derive(Clone, Debug, PartialEq)]
pub struct GigeChoice {
    /// Its address.
    pub address: Ipv4Addr,
    /// Exposure time to set, µs; as it is if not given.
    pub exposure_us: Option<f64>,
    /// Pictures a second to set; as it is if not given.
    pub fps: Option<f64>,
    /// What begins an exposure.
    pub trigger: Trigger,
    /// Pixel format to set; else as it is, or gray levels of 8 bits if that cannot be used.
    pub pixel: Option<PixelFormat>,
    /// The laser's colour, of which pictures with colours are looked at.
    pub channel: Option<Channel>,
}

/// How a camera is recorded.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraSettings {
    /// Which camera.
    pub choice: CameraChoice,
    /// Which stamp of a picture calibration uses.
    pub stamp: StampChoice,
    /// Joint type, for the estimate.
    pub joint: Joint,
    /// A camera that is unplugged is waited for; else it is an error.
    pub reconnect: bool,
}

/// Opens the camera; one that does not answer is looked for again until it does, 8 s are over, or `give_up` says so.
pub(crate) fn open(
    settings: &CameraSettings,
    sensor: Option<&Sensor>,
    clock: HostClock,
    give_up: &dyn Fn() -> bool,
) -> Result<Box<dyn FrameSource>, CellError> {
    let camera = open_patiently(&settings.choice, sensor, clock, give_up)?;
    if !settings.reconnect {
        return Ok(camera);
    }
    let (choice, sensor) = (settings.choice.clone(), sensor.cloned());
    let reopen = move || {
        open_once(&choice, sensor.as_ref(), clock).map_err(|error| match error {
            CellError::Camera(error) => error,
            other => CameraError::Io(std::io::Error::other(other.to_string())),
        })
    };
    Ok(Box::new(Reconnecting::new(camera, Box::new(reopen))))
}

fn open_patiently(
    choice: &CameraChoice,
    sensor: Option<&Sensor>,
    clock: HostClock,
    give_up: &dyn Fn() -> bool,
) -> Result<Box<dyn FrameSource>, CellError> {
    let start = Instant::now();
    loop {
        match open_once(choice, sensor, clock) {
            Err(CellError::Camera(CameraError::NotFound { .. }))
                if start.elapsed() < PATIENCE && !give_up() => {}
            opened => return opened,
        }
    }
}

fn open_once(
    choice: &CameraChoice,
    sensor: Option<&Sensor>,
    clock: HostClock,
) -> Result<Box<dyn FrameSource>, CellError> {
    match choice {
        CameraChoice::Replay(folder) => Ok(Box::new(Replay::open(folder, Pace::Times(1.0), clock)?)),
        CameraChoice::GigE(choice) => gige(choice, sensor, clock),
        #[cfg(all(feature = "v4l2", target_os = "linux"))]
        CameraChoice::V4l2(settings) => {
            let mut settings = settings.clone();
            if let Some(Sensor::CameraLaser { camera, .. }) = sensor {
                settings.size = Some(camera.size);
            }
            Ok(Box::new(trueline_camera::v4l2::V4l2Camera::open(&settings, clock)?))
        }
    }
}

#[cfg(feature = "gige")]
fn gige(
    choice: &GigeChoice,
    sensor: Option<&Sensor>,
    clock: HostClock,
) -> Result<Box<dyn FrameSource>, CellError> {
    use trueline_camera::{GigeCamera, GigeSettings};
    let GigeChoice { address, exposure_us, fps, trigger, pixel, channel } = choice.clone();
    let mut settings =
        GigeSettings { exposure_us, fps, trigger, pixel, channel, ..GigeSettings::at(address) };
    match sensor {
        Some(Sensor::CameraLaser { camera, .. }) => {
            (settings.width, settings.height) = (Some(camera.size[0]), Some(camera.size[1]));
        }
        Some(Sensor::Profiler) => settings.profiles = true,
        _ => {}
    }
    Ok(Box::new(GigeCamera::open(&settings, clock)?))
}

#[cfg(not(feature = "gige"))]
fn gige(choice: &GigeChoice, _: Option<&Sensor>, _: HostClock) -> Result<Box<dyn FrameSource>, CellError> {
    Err(CellError::NoGigE { address: choice.address })
}
