//! `EgmSensor`: what the PC answers.

use super::header::Header;
use super::pose::{Axes, EgmPose, axes};
use super::wire::{WireError, Writer, read};

/// `EgmSensor`; every part may be missing.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SensorMessage {
    /// Field 1.
    pub header: Option<Header>,
    /// `planned.cartesian`: where the robot is to be.
    pub pose: Option<EgmPose>,
    /// `planned.joints`, deg.
    pub joints_deg: Option<Axes>,
    /// `speedRef.cartesians`: mm/s and deg/s, in base.
    pub speed: Option<Axes>,
    /// `speedRef.joints`, deg/s.
    pub joint_speed_deg_s: Option<Axes>,
}

impl SensorMessage {
    /// Reads a datagram.
    ///
    /// # Errors
    /// Bytes that are no message, parts that are cut, known fields of another type.
    pub fn decode(bytes: &[u8]) -> Result<Self, WireError> {
        let mut message = Self::default();
        read("EgmSensor", bytes, |field, found| {
            match field {
                1 => message.header = Some(Header::decode(found.bytes()?)?),
                2 => message.set_planned(found.bytes()?)?,
                3 => message.set_speed(found.bytes()?)?,
                _ => {}
            }
            Ok(())
        })?;
        Ok(message)
    }

    fn set_planned(&mut self, bytes: &[u8]) -> Result<(), WireError> {
        read("EgmPlanned", bytes, |field, found| {
            match field {
                1 => self.joints_deg = Some(axes("EgmJoints", found.bytes()?)?),
                2 => self.pose = Some(EgmPose::decode(found.bytes()?)?),
                _ => {}
            }
            Ok(())
        })
    }

    fn set_speed(&mut self, bytes: &[u8]) -> Result<(), WireError> {
        read("EgmSpeedRef", bytes, |field, found| {
            match field {
                1 => self.joint_speed_deg_s = Some(axes("EgmJoints", found.bytes()?)?),
                2 => self.speed = Some(axes("EgmCartesianSpeed", found.bytes()?)?),
                _ => {}
            }
            Ok(())
        })
    }

    /// The bytes of a datagram.
    #[must_use]
    pub fn encode(&self) -> Vec<u8> {
        let mut out = Writer::default();
        if let Some(header) = &self.header {
            out.message(1, |out| header.encode(out));
        }
        if self.pose.is_some() || self.joints_deg.is_some() {
            out.message(2, |out| {
                if let Some(joints) = &self.joints_deg {
                    out.message(1, |out| out.list(1, joints.as_slice()));
                }
                if let Some(pose) = &self.pose {
                    out.message(2, |out| pose.encode(out));
                }
            });
        }
        if self.speed.is_some() || self.joint_speed_deg_s.is_some() {
            out.message(3, |out| {
                for (field, list) in [(1, &self.joint_speed_deg_s), (2, &self.speed)] {
                    if let Some(list) = list {
                        out.message(field, |out| out.list(1, list.as_slice()));
                    }
                }
            });
        }
        out.into_bytes()
    }
}
