//! Settings of a live recording, by the names of the options of `trueline record`.

use crate::failure::Failure;
use crate::named::{choice, positive, sigmas};
use crate::pictures::joint_of;
use pyo3::prelude::*;
use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::sync::Arc;
use std::time::Duration;
use trueline::live::{
    ARRIVAL, CameraChoice, CameraRecorder, CameraSettings, CameraSetup, Cell, CellError, LiveEstimate,
    PixelFormat, READING, RecordingSettings, StampChoice, Trigger,
};
use trueline_dataset::{Channel, SensorFile, sensor_toml};
use trueline_live::{HostClock, LinkAddress, LinkError, Protocol};

const PROTOCOLS: [(&str, Protocol); 5] = [
    ("egm", Protocol::Egm),
    ("ur-rtde", Protocol::UrRtde),
    ("fanuc-hspo", Protocol::FanucHspo),
    ("fanuc-stream-motion", Protocol::FanucStreamMotion),
    ("kuka-rsi", Protocol::KukaRsi),
];
const LASERS: [(&str, Channel); 4] =
    [("red", Channel::Red), ("green", Channel::Green), ("blue", Channel::Blue), ("gray", Channel::Gray)];
const STAMPS: [(&str, StampChoice); 3] = [
    ("first-packet", StampChoice::FirstPacket),
    ("complete", StampChoice::Complete),
    ("exposure", StampChoice::Exposure),
];

/// Keywords of `record`.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct LiveSettings {
    out: PathBuf,
    protocol: String,
    bind: Option<String>,
    robot: Option<String>,
    robot_port: Option<u16>,
    camera: Option<String>,
    replay: Option<PathBuf>,
    exposure_us: Option<f64>,
    fps: Option<f64>,
    trigger: Option<String>,
    pixel_format: Option<String>,
    laser: Option<String>,
    stamp: String,
    joint: Option<String>,
    sensor_toml: Option<String>,
    tool: String,
    for_s: Option<f64>,
    want: [Option<f64>; 3],
}

impl LiveSettings {
    /// Addresses of PC and robot.
    ///
    /// # Errors
    /// An invalid or missing address.
    pub(crate) fn address(&self) -> Result<LinkAddress, Failure> {
        let address = LinkAddress {
            protocol: choice("protocol", &self.protocol, &PROTOCOLS)?,
            bind: parsed::<SocketAddr>("bind", self.bind.as_deref())?,
            robot: parsed::<IpAddr>("robot", self.robot.as_deref())?,
            robot_port: self.robot_port,
        };
        address.check().map_err(Failure::from)?;
        Ok(address)
    }

    /// Camera and estimate.
    ///
    /// # Errors
    /// A camera or a sensor that cannot be used.
    pub(crate) fn cell(&self, clock: HostClock, give_up: &dyn Fn() -> bool) -> Result<Cell, Failure> {
        self.address()?;
        let sensor: Option<SensorFile> = match &self.sensor_toml {
            Some(text) => Some(sensor_toml::parse_file(Path::new("sensor"), text)?),
            None => None,
        };
        let camera = match self.camera_settings()? {
            Some(settings) => {
                let sensor = sensor.as_ref().map(|file| &file.sensor);
                Some(CameraRecorder::open(&settings, sensor, clock, give_up).map_err(Failure::from)?)
            }
            None => None,
        };
        let want = self.want.iter().any(Option::is_some).then(|| sigmas("want", self.want)).transpose()?;
        let estimate = match (&camera, sensor) {
            (Some(_), Some(sensor)) => Some(Arc::new(LiveEstimate::new(sensor, want))),
            _ if want.is_some() => {
                return Err(Failure::new(
                    "want: an estimate needs a camera and its sensor",
                    "camera=\"IP\" or replay=\"DATASET\", and sensor=…",
                ));
            }
            _ => None,
        };
        Ok(Cell::new(camera, estimate))
    }

    fn camera_settings(&self) -> Result<Option<CameraSettings>, Failure> {
        let exposure_us = positive("exposure_us", self.exposure_us)?;
        let fps = positive("fps", self.fps)?;
        let address = parsed::<Ipv4Addr>("camera", self.camera.as_deref())?;
        let others = [&self.trigger, &self.pixel_format, &self.laser].iter().any(|option| option.is_some());
        if address.is_none() && (exposure_us.is_some() || fps.is_some() || others) {
            return Err(Failure::new(
                "exposure_us, fps, trigger, pixel_format, laser: are set on a camera, and none is named",
                "camera=\"IP\", or leave them out",
            ));
        }
        let choice_of_camera = match (&self.replay, address) {
            (Some(_), Some(_)) => {
                return Err(Failure::new(
                    "camera and replay: only one of them gives the pictures",
                    "leave one out",
                ));
            }
            (Some(folder), None) => CameraChoice::Replay(folder.clone()),
            (None, Some(address)) => CameraChoice::GigE(
                address,
                CameraSetup {
                    exposure_us,
                    fps,
                    trigger: self.trigger.as_deref().map(trigger).transpose()?.unwrap_or_default(),
                    pixel: self.pixel_format.as_deref().map(pixel_format).transpose()?,
                    channel: self.laser.as_deref().map(|name| choice("laser", name, &LASERS)).transpose()?,
                    ..CameraSetup::default()
                },
            ),
            (None, None) => return Ok(None),
        };
        Ok(Some(CameraSettings {
            choice: choice_of_camera,
            stamp: choice("stamp", &self.stamp, &STAMPS)?,
            joint: self.joint.as_deref().map(joint_of).transpose()?,
            reconnect: true,
        }))
    }

    /// Purpose of the recording.
    pub(crate) fn recording(&self, cell: &Cell) -> RecordingSettings<'_> {
        RecordingSettings {
            folder: &self.out,
            sensor_toml: self.sensor_toml.clone(),
            tool: &self.tool,
            robot: if self.protocol == "ur-rtde" { READING } else { ARRIVAL },
            command: "trueline.record(…)".to_owned(),
            camera: cell.stamp_meaning(),
            estimate: cell.estimate(),
            welds: cell.welds(),
            listener: cell.listener(),
        }
    }

    /// How long, at most.
    pub(crate) fn longest(&self) -> Result<Option<Duration>, Failure> {
        Ok(positive("for_s", self.for_s)?.map(Duration::from_secs_f64))
    }
}

fn trigger(text: &str) -> Result<Trigger, Failure> {
    text.parse().map_err(|error| {
        Failure::new(format!("trigger: {text:?}: {error}"), "for example \"Line1\", or \"Line1:falling\"")
    })
}

fn pixel_format(name: &str) -> Result<PixelFormat, Failure> {
    choice(
        "pixel_format",
        name,
        &PixelFormat::pictures().map(|format| (format.name(), format)).collect::<Vec<_>>(),
    )
}

fn parsed<T: FromStr>(name: &str, text: Option<&str>) -> Result<Option<T>, Failure>
where
    T::Err: std::fmt::Display,
{
    let read = |text: &str| {
        text.parse().map_err(|error| {
            Failure::new(
                format!("{name}: {text:?}: {error}"),
                "for example \"192.168.0.10\", with \":6510\" for a port",
            )
        })
    };
    text.map(read).transpose()
}

impl From<LinkError> for Failure {
    fn from(error: LinkError) -> Self {
        Self::new(
            error.to_string(),
            "bind=\"IP:PORT\" of this PC for a robot that speaks first, else robot=\"IP\"",
        )
    }
}

impl From<CellError> for Failure {
    fn from(error: CellError) -> Self {
        let hint = error.hint();
        Self::new(error.to_string(), hint)
    }
}
