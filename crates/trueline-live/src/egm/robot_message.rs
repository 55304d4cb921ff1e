//! `EgmRobot`: what the controller sends.

use super::header::Header;
use super::pose::{Axes, EgmPose, axes};
use super::wire::{Found, Numbers, Value, WireError, Writer, read};

/// Whether the motors are on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MotorState {
    /// Not told.
    Undefined,
    /// On.
    On,
    /// Off.
    Off,
}

/// State of the motion correction interface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MciState {
    /// Not told.
    Undefined,
    /// In error.
    Error,
    /// Not correcting; so it is while only streaming.
    Stopped,
    /// The PC's references move the robot.
    Running,
}

/// Whether RAPID runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RapidState {
    /// Not told.
    Undefined,
    /// Stopped.
    Stopped,
    /// Running.
    Running,
}

/// `EgmFeedBack` or `EgmPlanned`: where the robot was, or will be, and when.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RobotState {
    /// `joints`, deg.
    pub joints_deg: Option<Axes>,
    /// `cartesian`.
    pub cartesian: Option<EgmPose>,
    /// `externalJoints`, deg or mm.
    pub external_joints: Option<Axes>,
    /// `time`: the controller's clock at this pose, (s, µs), of no known epoch. RobotWare 6.07 and later.
    pub time_s_us: Option<(u64, u64)>,
    /// `timeStamp`: IEEE 1588 time at this pose, (s, ns). RobotWare 7.16 and later, where synchronised.
    pub ptp_s_ns: Option<(u64, u64)>,
}

/// `EgmMeasuredForce`, in the form of RobotWare 6 (`None`) or 7.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MeasuredForce {
    /// `fcActive`, RobotWare 7.
    pub active: Option<bool>,
    /// `force`: N and N·m.
    pub force: Axes,
}

/// `EgmCollisionInfo`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Collision {
    /// `collsionTriggered`.
    pub triggered: Option<bool>,
    /// `collDetQuota`.
    pub quota: Axes,
}

/// `EgmRAPIDdata`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RapidData {
    /// `digVal`.
    pub digital: Option<bool>,
    /// `dnum`.
    pub numbers: Numbers<40>,
}

/// `EgmRobot`; every part may be missing.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RobotMessage {
    /// Field 1.
    pub header: Option<Header>,
    /// Field 2: measured.
    pub feedback: Option<RobotState>,
    /// Field 3: reference.
    pub planned: Option<RobotState>,
    /// Field 4.
    pub motors: Option<MotorState>,
    /// Field 5.
    pub mci: Option<MciState>,
    /// Field 6: the robot is within the tolerance of the last reference.
    pub converged: Option<bool>,
    /// Field 8.
    pub rapid: Option<RapidState>,
    /// Field 9, in either of its forms.
    pub force: Option<MeasuredForce>,
    /// Field 10: share of what the robot can do, %; above 100 it cannot follow. RobotWare 6.10 and later.
    pub utilization_percent: Option<f64>,
    /// Field 11. RobotWare 7.
    pub move_index: Option<u32>,
    /// Field 12. RobotWare 7.
    pub collision: Option<Collision>,
    /// Field 13. RobotWare 7.
    pub rapid_data: Option<RapidData>,
    /// Field 14. RobotWare 7.16.
    pub torque_reference: Option<Axes>,
    /// Parts beside header and feedback that are there and are in no known form.
    pub unread: u32,
}

impl RobotMessage {
    /// Reads a datagram. Fields that are in no known RobotWare are passed over; so are, counted, parts that nobody needs to
    /// know where the robot is and that have another form than in any known RobotWare.
    ///
    /// # Errors
    /// Bytes that are no message, parts that are cut, a header or feedback of another form.
    pub fn decode(bytes: &[u8]) -> Result<Self, WireError> {
        let mut message = Self::default();
        read("EgmRobot", bytes, |field, found| message.set(field, &found))?;
        Ok(message)
    }

    fn set(&mut self, field: u32, found: &Found<'_>) -> Result<(), WireError> {
        match field {
            1 => self.header = Some(Header::decode(found.bytes()?)?),
            2 => self.feedback = Some(RobotState::decode("EgmFeedBack", found.bytes()?)?),
            _ => self.unread += u32::from(self.set_beside(field, found).is_err()),
        }
        Ok(())
    }

    fn set_beside(&mut self, field: u32, found: &Found<'_>) -> Result<(), WireError> {
        match field {
            3 => self.planned = Some(RobotState::decode("EgmPlanned", found.bytes()?)?),
            4 => self.motors = state("EgmMotorState", found)?.map(MotorState::from_number),
            5 => self.mci = state("EgmMCIState", found)?.map(MciState::from_number),
            6 => self.converged = Some(found.whole()? != 0),
            8 => self.rapid = state("EgmRapidCtrlExecState", found)?.map(RapidState::from_number),
            9 => self.force = Some(MeasuredForce::decode(found.bytes()?)?),
            10 => self.utilization_percent = Some(found.double()?),
            11 => self.move_index = Some(found.whole32()?),
            12 => self.collision = Some(Collision::decode(found.bytes()?)?),
            13 => self.rapid_data = Some(RapidData::decode(found.bytes()?)?),
            14 => self.torque_reference = Some(axes("EgmJoints", found.bytes()?)?),
            _ => {}
        }
        Ok(())
    }

    /// The bytes of a datagram.
    #[must_use]
    pub fn encode(&self) -> Vec<u8> {
        let mut out = Writer::default();
        if let Some(header) = &self.header {
            out.message(1, |out| header.encode(out));
        }
        for (field, part) in [(2, &self.feedback), (3, &self.planned)] {
            if let Some(part) = part {
                out.message(field, |out| part.encode(out));
            }
        }
        let states = [
            (4, self.motors.map(MotorState::number)),
            (5, self.mci.map(MciState::number)),
            (8, self.rapid.map(RapidState::number)),
        ];
        for (field, number) in states {
            if let Some(number) = number {
                out.message(field, |out| out.varint(1, number));
            }
        }
        if let Some(converged) = self.converged {
            out.varint(6, u64::from(converged));
        }
        self.encode_newer(&mut out);
        out.into_bytes()
    }

    fn encode_newer(&self, out: &mut Writer) {
        if let Some(force) = &self.force {
            out.message(9, |out| force.encode(out));
        }
        if let Some(utilization) = self.utilization_percent {
            out.double(10, utilization);
        }
        if let Some(index) = self.move_index {
            out.varint(11, u64::from(index));
        }
        if let Some(collision) = &self.collision {
            out.message(12, |out| encode_flag_and_list(out, collision.triggered, collision.quota.as_slice()));
        }
        if let Some(data) = &self.rapid_data {
            out.message(13, |out| encode_flag_and_list(out, data.digital, data.numbers.as_slice()));
        }
        if let Some(torque) = &self.torque_reference {
            out.message(14, |out| out.list(1, torque.as_slice()));
        }
    }
}

/// The number in a message that holds nothing but a state.
fn state(message: &'static str, found: &Found<'_>) -> Result<Option<u64>, WireError> {
    let mut number = None;
    read(message, found.bytes()?, |field, found| {
        if field == 1 {
            number = Some(found.whole()?);
        }
        Ok(())
    })?;
    Ok(number)
}

fn encode_flag_and_list(out: &mut Writer, flag: Option<bool>, list: &[f64]) {
    if let Some(flag) = flag {
        out.varint(1, u64::from(flag));
    }
    out.list(2, list);
}

fn decode_flag_and_list<const N: usize>(
    message: &'static str,
    bytes: &[u8],
) -> Result<(Option<bool>, Numbers<N>), WireError> {
    let (mut flag, mut list) = (None, Numbers::default());
    read(message, bytes, |field, found| {
        match field {
            1 => flag = Some(found.whole()? != 0),
            2 => list.add(&found)?,
            _ => {}
        }
        Ok(())
    })?;
    Ok((flag, list))
}

impl Collision {
    fn decode(bytes: &[u8]) -> Result<Self, WireError> {
        let (triggered, quota) = decode_flag_and_list("EgmCollisionInfo", bytes)?;
        Ok(Self { triggered, quota })
    }
}

impl RapidData {
    fn decode(bytes: &[u8]) -> Result<Self, WireError> {
        let (digital, numbers) = decode_flag_and_list("EgmRAPIDdata", bytes)?;
        Ok(Self { digital, numbers })
    }
}

impl MeasuredForce {
    /// Field 1 is the force in RobotWare 6 and a truth value in RobotWare 7, whose force is field 2.
    fn decode(bytes: &[u8]) -> Result<Self, WireError> {
        let mut measured = Self::default();
        read("EgmMeasuredForce", bytes, |field, found| {
            match (field, found.value) {
                (1, Value::Varint(active)) => measured.active = Some(active != 0),
                (1 | 2, _) => measured.force.add(&found)?,
                _ => {}
            }
            Ok(())
        })?;
        Ok(measured)
    }

    fn encode(&self, out: &mut Writer) {
        match self.active {
            None => out.list(1, self.force.as_slice()),
            Some(_) => encode_flag_and_list(out, self.active, self.force.as_slice()),
        }
    }
}

impl RobotState {
    fn decode(message: &'static str, bytes: &[u8]) -> Result<Self, WireError> {
        let mut state = Self::default();
        read(message, bytes, |field, found| {
            match field {
                // Angles that are more than six are of an arm of another make; the pose does not depend on them.
                1 => state.joints_deg = axes("EgmJoints", found.bytes()?).ok(),
                2 => state.cartesian = Some(EgmPose::decode(found.bytes()?)?),
                3 => state.external_joints = axes("EgmJoints", found.bytes()?).ok(),
                4 => state.time_s_us = Some(instant("EgmClock", found.bytes()?)?),
                5 => state.ptp_s_ns = Some(instant("EgmTimestamp", found.bytes()?)?),
                _ => {}
            }
            Ok(())
        })?;
        Ok(state)
    }

    fn encode(&self, out: &mut Writer) {
        if let Some(joints) = &self.joints_deg {
            out.message(1, |out| out.list(1, joints.as_slice()));
        }
        if let Some(pose) = &self.cartesian {
            out.message(2, |out| pose.encode(out));
        }
        if let Some(joints) = &self.external_joints {
            out.message(3, |out| out.list(1, joints.as_slice()));
        }
        for (field, instant) in [(4, self.time_s_us), (5, self.ptp_s_ns)] {
            if let Some((whole, part)) = instant {
                out.message(field, |out| {
                    out.varint(1, whole);
                    out.varint(2, part);
                });
            }
        }
    }
}

fn instant(message: &'static str, bytes: &[u8]) -> Result<(u64, u64), WireError> {
    let (mut whole, mut part) = (None, None);
    read(message, bytes, |field, found| {
        match field {
            1 => whole = Some(found.whole()?),
            2 => part = Some(found.whole()?),
            _ => {}
        }
        Ok(())
    })?;
    let lacks = |field| WireError::Incomplete { message, field };
    Ok((whole.ok_or(lacks("seconds"))?, part.ok_or(lacks("fraction"))?))
}

impl MotorState {
    fn from_number(number: u64) -> Self {
        match number {
            1 => Self::On,
            2 => Self::Off,
            _ => Self::Undefined,
        }
    }

    fn number(self) -> u64 {
        match self {
            Self::Undefined => 0,
            Self::On => 1,
            Self::Off => 2,
        }
    }
}

impl MciState {
    fn from_number(number: u64) -> Self {
        match number {
            1 => Self::Error,
            2 => Self::Stopped,
            3 => Self::Running,
            _ => Self::Undefined,
        }
    }

    fn number(self) -> u64 {
        match self {
            Self::Undefined => 0,
            Self::Error => 1,
            Self::Stopped => 2,
            Self::Running => 3,
        }
    }
}

impl RapidState {
    fn from_number(number: u64) -> Self {
        match number {
            1 => Self::Stopped,
            2 => Self::Running,
            _ => Self::Undefined,
        }
    }

    fn number(self) -> u64 {
        match self {
            Self::Undefined => 0,
            Self::Stopped => 1,
            Self::Running => 2,
        }
    }
}
