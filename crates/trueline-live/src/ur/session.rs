//! The PC's side of RTDE: bytes in, bytes and poses out. It asks for fields, never writes one, and so moves nothing.

use super::variables::{Kind, output};
use super::wire::{self, CONTROLLER, DATA, OUTPUTS, Package, START, TEXT, VERSION, package};
use crate::frame_filter::PacketError;
use crate::robot_source::{RobotPose, RobotStatus};
use nalgebra::Vector3;
use trueline_geometry::{Pose, so3};

/// The requested fields; those unknown to a controller are left out, except the first two.
const WANTED: [&str; 9] = [
    "timestamp",
    "actual_TCP_pose",
    "actual_q",
    "tcp_offset",
    "robot_mode",
    "safety_status",
    "runtime_state",
    "speed_scaling",
    "actual_digital_input_bits",
];
const NEEDED: usize = 2;
/// Requested rate, Hz; slower controllers send at their own rate.
const RATE_HZ: f64 = 500.0;

/// Metres and radians that no pose has.
const MOST_M_OR_RAD: f64 = 1e4;
/// Seconds that no controller has been on for.
const MOST_S: f64 = 1e9;

/// Why a session cannot go on.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SessionError {
    /// Not RTDE.
    #[error(transparent)]
    Size(#[from] wire::BadSize),
    /// Neither version 2 nor 1.
    #[error("the controller supports neither version 2 nor 1 of RTDE")]
    Version,
    /// A field that cannot be done without.
    #[error("the controller does not support the field {name}")]
    NotFound {
        /// Its name.
        name: &'static str,
    },
    /// It does not begin.
    #[error("the controller refused to start the stream")]
    NotStarted,
    /// An answer that makes no sense.
    #[error("the controller's answer to '{}' makes no sense", char::from(*kind))]
    Answer {
        /// The question.
        kind: u8,
    },
}

/// Content of a package.
#[derive(Clone, Debug, PartialEq)]
pub enum Told {
    /// The controller's software.
    Controller([u32; 4]),
    /// Words of the controller; 0 and 1 are grave.
    Text(u8, String),
    /// A pose, or the reason for its absence in the package.
    Pose(Result<RobotPose, PacketError>),
    /// The tool was changed: poses before and after are not of the same frame.
    ToolChanged,
    /// Something odd that does no harm.
    Odd(&'static str),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    Version,
    Controller,
    Outputs,
    Start,
    Streaming,
}

/// One connection's conversation.
#[derive(Clone, Debug)]
pub struct Session {
    stage: Stage,
    version: u16,
    asked: Vec<&'static str>,
    fields: Vec<(&'static str, Kind)>,
    recipe: u8,
    waiting: Vec<u8>,
    tool: Option<[f64; 6]>,
    cycle: u32,
    odd_recipe: bool,
}

impl Session {
    /// Begins; the bytes are to be sent.
    #[must_use]
    pub fn begin() -> (Self, Vec<u8>) {
        let session = Self {
            stage: Stage::Version,
            version: 2,
            asked: WANTED.to_vec(),
            fields: Vec::new(),
            recipe: 0,
            waiting: Vec::new(),
            tool: None,
            cycle: 0,
            odd_recipe: false,
        };
        (session, package(VERSION, &2_u16.to_be_bytes()))
    }

    /// The version of the protocol that was agreed.
    #[must_use]
    pub fn version(&self) -> u16 {
        self.version
    }

    /// Whether poses come.
    #[must_use]
    pub fn is_streaming(&self) -> bool {
        self.stage == Stage::Streaming
    }

    /// Reads the received bytes; appends the bytes to send. `each` gets every package and its content.
    ///
    /// # Errors
    /// [`SessionError`]: the connection is of no use any more.
    pub fn take(
        &mut self,
        bytes: &[u8],
        send: &mut Vec<u8>,
        mut each: impl FnMut(&[u8], Told),
    ) -> Result<(), SessionError> {
        let mut waiting = std::mem::take(&mut self.waiting);
        waiting.extend(bytes);
        let mut used = 0;
        while let Some(package) = wire::first(&waiting[used..])? {
            used += package.whole.len();
            if let Some(told) = self.package(&package, send)? {
                each(package.whole, told);
            }
            if self.tool_changed(&package) {
                each(package.whole, Told::ToolChanged);
            }
        }
        waiting.drain(..used);
        self.waiting = waiting;
        Ok(())
    }

    fn package(&mut self, package: &Package<'_>, send: &mut Vec<u8>) -> Result<Option<Told>, SessionError> {
        match (package.kind, self.stage) {
            (TEXT, _) if self.version == 1 => Ok(package
                .payload
                .split_first()
                .map(|(level, words)| Told::Text(*level, String::from_utf8_lossy(words).into_owned()))),
            (TEXT, _) => Ok(wire::text(package.payload).map(|(level, words)| Told::Text(level, words))),
            (VERSION, Stage::Version) => self.agree(package.payload, send).map(|()| None),
            (CONTROLLER, Stage::Controller) => {
                self.ask_for_fields(send);
                Ok(software(package.payload).map(Told::Controller))
            }
            (OUTPUTS, Stage::Outputs) => self.offered(package.payload, send),
            (START, Stage::Start) if package.payload.first() == Some(&1) => {
                self.stage = Stage::Streaming;
                Ok(None)
            }
            (START, Stage::Start) => Err(SessionError::NotStarted),
            // Data may come before the answer to the start.
            (DATA, Stage::Start | Stage::Streaming) => Ok(Some(self.data(package.payload))),
            _ => Ok(Some(Told::Odd("an unrequested package"))),
        }
    }

    fn agree(&mut self, payload: &[u8], send: &mut Vec<u8>) -> Result<(), SessionError> {
        match (payload.first(), self.version) {
            (Some(1), _) => {
                self.stage = Stage::Controller;
                send.extend(package(CONTROLLER, &[]));
                Ok(())
            }
            (Some(_), 2) => {
                self.version = 1;
                send.extend(package(VERSION, &1_u16.to_be_bytes()));
                Ok(())
            }
            (Some(_), _) => Err(SessionError::Version),
            (None, _) => Err(SessionError::Answer { kind: VERSION }),
        }
    }

    fn ask_for_fields(&mut self, send: &mut Vec<u8>) {
        let mut payload = Vec::new();
        if self.version > 1 {
            payload.extend(RATE_HZ.to_be_bytes());
        }
        payload.extend(self.asked.join(",").as_bytes());
        send.extend(package(OUTPUTS, &payload));
        self.stage = Stage::Outputs;
    }

    fn offered(&mut self, payload: &[u8], send: &mut Vec<u8>) -> Result<Option<Told>, SessionError> {
        let answer = || SessionError::Answer { kind: OUTPUTS };
        let types = match self.version {
            1 => payload,
            _ => {
                let (recipe, types) = payload.split_first().ok_or_else(answer)?;
                self.recipe = *recipe;
                types
            }
        };
        let types = std::str::from_utf8(types).map_err(|_| answer())?;
        let types: Vec<&str> = types.trim_end_matches(',').split(',').collect();
        if types.len() != self.asked.len() {
            return Err(answer());
        }
        let unknown = |kind: &str| kind == "NOT_FOUND";
        if let Some(name) = WANTED[..NEEDED].iter().zip(&types).find(|(_, kind)| unknown(kind)) {
            return Err(SessionError::NotFound { name: name.0 });
        }
        let names = self.asked.clone();
        if types.iter().any(|kind| unknown(kind)) {
            let known = names.into_iter().zip(&types).filter(|(_, kind)| !unknown(kind));
            self.asked = known.map(|(name, _)| name).collect();
            self.ask_for_fields(send);
            return Ok(Some(Told::Odd("a controller that does not support all fields: the others are used")));
        }
        // A test server of the maker answers with the names; the types of these fields are known anyway.
        let echoed = types == names;
        let kinds = names.iter().zip(&types).map(|(name, kind)| match echoed {
            true => output(name),
            false => Kind::named(kind),
        });
        let kinds: Option<Vec<Kind>> = kinds.collect();
        self.fields = names.into_iter().zip(kinds.ok_or_else(answer)?).collect();
        self.stage = Stage::Start;
        send.extend(package(START, &[]));
        Ok(echoed.then_some(Told::Odd("a server that repeats the names where their types belong")))
    }

    fn data(&mut self, payload: &[u8]) -> Told {
        let length: usize = self.fields.iter().map(|(_, kind)| kind.bytes()).sum();
        let Some((recipe, values)) = self.values(payload, length) else {
            return Told::Pose(Err(PacketError::Length { found: payload.len() }));
        };
        if recipe.is_some_and(|recipe| recipe != self.recipe)
            && !std::mem::replace(&mut self.odd_recipe, true)
        {
            return Told::Odd("a recipe number other than the one that was agreed");
        }
        self.cycle = self.cycle.wrapping_add(1);
        Told::Pose(self.pose(values))
    }

    fn values<'a>(&self, payload: &'a [u8], length: usize) -> Option<(Option<u8>, &'a [u8])> {
        if self.version == 1 {
            return (payload.len() == length).then_some((None, payload));
        }
        let (recipe, values) = payload.split_first()?;
        (values.len() == length).then_some((Some(*recipe), values))
    }

    fn field<'a>(&self, name: &str, values: &'a [u8]) -> Option<&'a [u8]> {
        let place = self.fields.iter().position(|(known, _)| *known == name)?;
        let start = self.fields[..place].iter().map(|(_, kind)| kind.bytes()).sum::<usize>();
        values.get(start..start + self.fields[place].1.bytes())
    }

    fn pose(&self, values: &[u8]) -> Result<RobotPose, PacketError> {
        let stamp_s = self.field("timestamp", values).and_then(double).ok_or(PacketError::NotFinite)?;
        let tcp = self.field("actual_TCP_pose", values).and_then(six).ok_or(PacketError::NotFinite)?;
        // No arm reaches so far, or rotates so often, and beyond it a rotation is lost in rounding.
        let is_pose = tcp.iter().all(|figure| figure.abs() < MOST_M_OR_RAD);
        let is_time = stamp_s.abs() < MOST_S;
        if !is_pose || !is_time {
            return Err(PacketError::NotFinite);
        }
        let [x, y, z, rx, ry, rz] = tcp;
        let int = |name: &str| {
            let bytes = self.field(name, values)?;
            bytes.try_into().ok().map(i32::from_be_bytes)
        };
        Ok(RobotPose {
            sequence: self.cycle,
            device_ns: (stamp_s * 1e9).round() as i64,
            base_from_tool: Pose::from_parts(
                Vector3::new(x, y, z).into(),
                so3::exp(&Vector3::new(rx, ry, rz)),
            ),
            status: status(int("robot_mode"), int("safety_status")),
            inputs: self.field("actual_digital_input_bits", values).and_then(bits),
        })
    }

    fn tool_changed(&mut self, package: &Package<'_>) -> bool {
        if package.kind != DATA {
            return false;
        }
        let length: usize = self.fields.iter().map(|(_, kind)| kind.bytes()).sum();
        let values = self.values(package.payload, length).map(|(_, values)| values);
        let Some(tool) = values.and_then(|values| self.field("tcp_offset", values)).and_then(six) else {
            return false;
        };
        self.tool.replace(tool).is_some_and(|before| before != tool)
    }
}

fn double(bytes: &[u8]) -> Option<f64> {
    bytes.try_into().ok().map(f64::from_be_bytes)
}

fn bits(bytes: &[u8]) -> Option<u64> {
    bytes.try_into().ok().map(u64::from_be_bytes)
}

fn six(bytes: &[u8]) -> Option<[f64; 6]> {
    let mut figures = [0.0; 6];
    for (figure, bytes) in figures.iter_mut().zip(bytes.chunks_exact(8)) {
        *figure = double(bytes)?;
    }
    (bytes.len() == 48).then_some(figures)
}

fn software(payload: &[u8]) -> Option<[u32; 4]> {
    let mut version = [0; 4];
    for (part, bytes) in version.iter_mut().zip(payload.chunks_exact(4)) {
        *part = bytes.try_into().ok().map(u32::from_be_bytes)?;
    }
    (payload.len() == 16).then_some(version)
}

/// `robot_mode` 7 is RUNNING, `safety_status` 1 is NORMAL and 2 is REDUCED.
fn status(robot_mode: Option<i32>, safety: Option<i32>) -> RobotStatus {
    match (robot_mode, safety) {
        (_, Some(3)) => RobotStatus::Stopped("protective stop"),
        (_, Some(5..=7)) => RobotStatus::Stopped("emergency or safeguard stop"),
        (_, Some(8 | 9)) => RobotStatus::Stopped("violation or fault of the safety system"),
        (Some(7), _) => RobotStatus::Ready,
        (Some(_), _) => RobotStatus::Stopped("not running (power off, booting or brakes on)"),
        (None, _) => RobotStatus::Unknown,
    }
}
