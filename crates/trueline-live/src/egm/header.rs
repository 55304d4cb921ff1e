//! `EgmHeader`: who counts, and when.

use super::wire::{WireError, Writer, read};

/// What a message is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MessageKind {
    /// `MSGTYPE_UNDEFINED`.
    Undefined,
    /// `MSGTYPE_COMMAND`, kept free by ABB.
    Command,
    /// `MSGTYPE_DATA`: from the robot.
    Data,
    /// `MSGTYPE_CORRECTION`: to the robot, guidance.
    Correction,
    /// `MSGTYPE_PATH_CORRECTION`: to the robot, path correction.
    PathCorrection,
    /// A number that is in no known RobotWare.
    Unknown(u32),
}

impl MessageKind {
    fn from_number(number: u32) -> Self {
        match number {
            0 => Self::Undefined,
            1 => Self::Command,
            2 => Self::Data,
            3 => Self::Correction,
            4 => Self::PathCorrection,
            other => Self::Unknown(other),
        }
    }

    fn number(self) -> u32 {
        match self {
            Self::Undefined => 0,
            Self::Command => 1,
            Self::Data => 2,
            Self::Correction => 3,
            Self::PathCorrection => 4,
            Self::Unknown(number) => number,
        }
    }
}

/// `EgmHeader`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Header {
    /// `seqno`.
    pub sequence: Option<u32>,
    /// `tm`: the sender's clock on sending, ms.
    pub sent_ms: Option<u32>,
    /// `mtype`.
    pub kind: Option<MessageKind>,
}

impl Header {
    pub(super) fn decode(bytes: &[u8]) -> Result<Self, WireError> {
        let mut header = Self::default();
        read("EgmHeader", bytes, |field, found| {
            match field {
                1 => header.sequence = Some(found.whole32()?),
                2 => header.sent_ms = Some(found.whole32()?),
                3 => header.kind = Some(MessageKind::from_number(found.whole32()?)),
                _ => {}
            }
            Ok(())
        })?;
        Ok(header)
    }

    pub(super) fn encode(&self, out: &mut Writer) {
        let mut part = |field, value: Option<u32>| {
            if let Some(value) = value {
                out.varint(field, u64::from(value));
            }
        };
        part(1, self.sequence);
        part(2, self.sent_ms);
        part(3, self.kind.map(MessageKind::number));
    }
}
