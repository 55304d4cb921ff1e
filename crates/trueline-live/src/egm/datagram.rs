//! Datagrams of the controller: a part that nobody needs must not cost the pose.

use super::messages::egm_header::MessageType;
use super::messages::{EgmHeader, EgmRobot};
use prost::encoding::{DecodeContext, decode_key, skip_field};
use prost::{DecodeError, Message};

/// Why bytes are no message of a robot.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum WireError {
    /// They end inside a field, or are none.
    #[error("the bytes are cut off, or no protocol-buffer fields")]
    NotFields,
    /// Header or feedback cannot be read.
    #[error("{0} has another form than in any known RobotWare")]
    Form(&'static str),
}

impl EgmHeader {
    /// Number, sender's clock, ms, and purpose.
    #[must_use]
    pub fn new(sequence: u32, sent_ms: u32, kind: MessageType) -> Self {
        Self { seqno: Some(sequence), tm: Some(sent_ms), mtype: Some(kind.into()) }
    }
}

impl EgmRobot {
    /// Reads a datagram. Fields that are in no known RobotWare are passed over; so are parts beside header and feedback that
    /// have another form than in any known RobotWare.
    ///
    /// # Errors
    /// Bytes that are no message, parts that are cut, a header or feedback of another form.
    pub fn read(bytes: &[u8]) -> Result<Self, WireError> {
        let (mut message, mut rest) = (Self::default(), bytes);
        while !rest.is_empty() {
            let (number, field) = next_field(&mut rest).map_err(|_| WireError::NotFields)?;
            let before = message;
            match (message.merge(field), number) {
                (Ok(()), _) => {}
                (Err(_), 1) => return Err(WireError::Form("EgmHeader")),
                (Err(_), 2) => return Err(WireError::Form("EgmFeedBack")),
                (Err(_), _) => message = before,
            }
        }
        Ok(message)
    }
}

/// Takes a field with its number from the front.
fn next_field<'a>(rest: &mut &'a [u8]) -> Result<(u32, &'a [u8]), DecodeError> {
    let whole = *rest;
    let (number, wire_type) = decode_key(rest)?;
    skip_field(wire_type, number, rest, DecodeContext::default())?;
    Ok((number, &whole[..whole.len() - rest.len()]))
}
