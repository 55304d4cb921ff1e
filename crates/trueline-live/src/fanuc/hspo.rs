//! High Speed Position Output: the controller sends pose and clock to the PC, with any program running. There are no
//! answers.
//!
//! The order of the three angles is that of their names (yaw, pitch, roll) in the only public reader; that they are W, P, R has
//! not been seen on a controller.

use super::wrapping_clock::WrappingClock;
use crate::frame_filter::{PacketError, Rejection, SequenceStatus};
use crate::robot_source::{PoseMeaning, RobotPose, RobotStatus, SourceAbout};
use crate::udp_source::DatagramProtocol;
use crate::zyx_angles;
use trueline_geometry::Pose;

/// Bytes of a packet with the tool's pose.
const POSE_BYTES: usize = 48;
const POSE: u16 = 1;
const JOINTS: u16 = 4;
const VARIABLES: u16 = 16;
const MICROSECOND_NS: i64 = 1000;

/// The stream of one controller.
#[derive(Clone, Debug, Default)]
pub struct Hspo {
    clock: WrappingClock,
}

/// Content of a packet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Raw {
    /// Counts the packets of this type.
    index: u32,
    clock_us: u32,
    base_from_tool: Pose,
    /// The last word: inputs or outputs, as the controller is set.
    io: u32,
}

impl DatagramProtocol for Hspo {
    type Raw = Raw;

    fn decode(&self, bytes: &[u8]) -> Result<(u32, Raw), Rejection> {
        let length = PacketError::Length { found: bytes.len() };
        let kind = u16::from_be_bytes(array(bytes, 12).ok_or(length)?);
        if u32::from_be_bytes(array(bytes, 0).ok_or(length)?) != 1 {
            return Err(PacketError::Text("a version of HSPO other than 1").into());
        }
        match kind {
            POSE if bytes.len() == POSE_BYTES => {}
            POSE => return Err(length.into()),
            JOINTS => return Err(PacketError::NotNeeded("joint positions, which are not needed").into()),
            VARIABLES => return Err(PacketError::NotNeeded("variables, which are not needed").into()),
            other => return Err(PacketError::Kind { found: other.into() }.into()),
        }
        let mut figures = [0.0; 6];
        for (k, figure) in figures.iter_mut().enumerate() {
            *figure = f64::from(f32::from_be_bytes(array(bytes, 16 + 4 * k).ok_or(length)?));
        }
        let [x, y, z, w, p, r] = figures;
        let index = u32::from_be_bytes(array(bytes, 4).ok_or(length)?);
        let clock_us = u32::from_be_bytes(array(bytes, 8).ok_or(length)?);
        let base_from_tool = zyx_angles::pose_from_mm([x, y, z], zyx_angles::from_wpr_deg([w, p, r]))
            .ok_or(PacketError::NotFinite)?;
        let io = u32::from_be_bytes(array(bytes, POSE_BYTES - 4).ok_or(length)?);
        Ok((index, Raw { index, clock_us, base_from_tool, io }))
    }

    fn place(&mut self, raw: Raw, status: SequenceStatus) -> (RobotPose, SequenceStatus) {
        let numbers = match status {
            SequenceStatus::First => None,
            SequenceStatus::Newest { skipped } => Some(skipped.saturating_add(1)),
            // Its time is that of the newest; a late packet only counts.
            SequenceStatus::Late => Some(1),
        };
        let device_ns = self.clock.unwrapped_ns(raw.clock_us, MICROSECOND_NS, numbers);
        let pose = RobotPose {
            sequence: raw.index,
            device_ns,
            base_from_tool: raw.base_from_tool,
            status: RobotStatus::Unknown,
            inputs: Some(raw.io.into()),
        };
        (pose, status)
    }

    fn about(&self) -> SourceAbout {
        SourceAbout {
            protocol: "FANUC HSPO, version 1".to_owned(),
            pose: PoseMeaning::TcpInActiveBase,
            clock: "µs that wrap",
            controller: None,
            notes: Vec::new(),
        }
    }
}

/// Bytes at a place.
pub(crate) fn array<const N: usize>(bytes: &[u8], at: usize) -> Option<[u8; N]> {
    bytes.get(at..at + N)?.try_into().ok()
}
