//! Opens the camera that was chosen.

use crate::error::CellError;
use crate::frame_stamper::StampChoice;
use std::net::Ipv4Addr;
use std::path::PathBuf;
use std::time::{Duration, Instant};
use trueline_camera::{CameraError, CameraSetup, FrameSource, Pace, Reconnecting, Replay};
use trueline_dataset::Sensor;
use trueline_live::HostClock;
use trueline_vision::Joint;

/// Time for which a camera that does not answer is searched: it may just be waking up.
const PATIENCE: Duration = Duration::from_secs(8);

/// The camera.
#[derive(Clone, Debug, PartialEq)]
pub enum CameraChoice {
    /// A GigE Vision camera, and its settings.
    GigE(Ipv4Addr, CameraSetup),
    /// A USB3 Vision camera by its serial number, or the only one plugged in, with its settings.
    #[cfg(feature = "u3v")]
    U3v(Option<String>, CameraSetup),
    /// A device of Video4Linux.
    #[cfg(all(feature = "v4l2", target_os = "linux"))]
    V4l2(trueline_camera::v4l2::V4l2Settings),
    /// The pictures of a dataset folder, at the pace at which they were recorded.
    Replay(PathBuf),
}

/// How a camera is recorded.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraSettings {
    /// The camera.
    pub choice: CameraChoice,
    /// Which stamp of a picture calibration uses.
    pub stamp: StampChoice,
    /// Joint type, for the estimate. Without it profiles determine it, and pictures are those of a fillet.
    pub joint: Option<Joint>,
    /// A camera that is unplugged is waited for; else it is an error.
    pub reconnect: bool,
}

/// Opens the camera. A camera that does not answer is tried again until it does, 8 s are over, or `give_up`
/// returns true.
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
    #[cfg(feature = "u3v")]
    let choice = that_one(choice, camera.serial());
    let reopen = move || {
        open_once(&choice, sensor.as_ref(), clock).map_err(|error| match error {
            CellError::Camera(error) => error,
            other => CameraError::Io(std::io::Error::other(other.to_string())),
        })
    };
    Ok(Box::new(Reconnecting::new(camera, Box::new(reopen))))
}

/// The camera that was opened, where any would have done: another one may be plugged in meanwhile.
#[cfg(feature = "u3v")]
fn that_one(choice: CameraChoice, serial: Option<&str>) -> CameraChoice {
    match choice {
        CameraChoice::U3v(None, setup) => CameraChoice::U3v(serial.map(str::to_owned), setup),
        choice => choice,
    }
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
            Err(CellError::Camera(CameraError::NotFound { .. } | CameraError::NotPluggedIn { .. }))
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
        CameraChoice::GigE(address, setup) => gige(*address, fitted(setup, sensor), clock),
        #[cfg(feature = "u3v")]
        CameraChoice::U3v(serial, setup) => {
            let (serial, setup) = (serial.clone(), fitted(setup, sensor));
            let settings = trueline_camera::u3v::U3vSettings { serial, setup };
            Ok(Box::new(trueline_camera::u3v::U3vCamera::open(&settings, clock)?))
        }
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

/// As the sensor is described: pictures of its size, or profiles.
fn fitted(setup: &CameraSetup, sensor: Option<&Sensor>) -> CameraSetup {
    let mut setup = setup.clone();
    match sensor {
        Some(Sensor::CameraLaser { camera, .. }) => {
            (setup.width, setup.height) = (Some(camera.size[0]), Some(camera.size[1]));
        }
        Some(Sensor::Profiler) => setup.profiles = true,
        _ => {}
    }
    setup
}

#[cfg(feature = "gige")]
fn gige(address: Ipv4Addr, setup: CameraSetup, clock: HostClock) -> Result<Box<dyn FrameSource>, CellError> {
    use trueline_camera::{GigeCamera, GigeSettings};
    let settings = GigeSettings { setup, ..GigeSettings::at(address) };
    Ok(Box::new(GigeCamera::open(&settings, clock)?))
}

#[cfg(not(feature = "gige"))]
fn gige(address: Ipv4Addr, _: CameraSetup, _: HostClock) -> Result<Box<dyn FrameSource>, CellError> {
    Err(CellError::NoGigE { address })
}

#[cfg(all(test, feature = "u3v"))]
mod tests {
    use super::*;

    #[test]
    fn any_camera_is_that_one_once_it_was_opened() {
        let choice = |serial: Option<&str>| {
            CameraChoice::U3v(
                serial.map(str::to_owned),
                CameraSetup { width: Some(8), ..CameraSetup::default() },
            )
        };
        assert_eq!(that_one(choice(None), Some("A1")), choice(Some("A1")));
        assert_eq!(that_one(choice(Some("A2")), Some("A1")), choice(Some("A2")), "the request is kept");
        assert_eq!(that_one(choice(None), None), choice(None), "it has none");
    }
}
