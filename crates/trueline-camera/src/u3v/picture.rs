//! A picture from the received transfers.

use crate::frame_source::FrameStatus;
use crate::genicam::{Seen, Session};
use viva_u3v::{PAYLOAD_TYPE_IMAGE, PAYLOAD_TYPE_IMAGE_EXTENDED_CHUNK, RawFrame};

/// State of a frame, and its content if it can be used. Its pixels arrive in transfers of `transfer_bytes`.
pub(super) fn of(frame: &RawFrame, session: &Session, transfer_bytes: usize) -> (FrameStatus, Seen) {
    let leader = &frame.leader;
    let is_image = matches!(leader.payload_type, PAYLOAD_TYPE_IMAGE | PAYLOAD_TYPE_IMAGE_EXTENDED_CHUNK);
    if !is_image {
        let found = format!("payload of type {:#06x}", leader.payload_type);
        return (FrameStatus::WrongFormat { found }, Seen::default());
    }
    if let Some(wrong) = session.wrong([leader.width, leader.height], leader.pixel_format) {
        return (wrong, Seen::default());
    }
    let seen = if is_whole(frame, session) {
        session.seen(&frame.payload, usize::from(leader.x_padding))
    } else {
        None
    };
    match seen {
        Some(seen) => (FrameStatus::Complete, seen),
        None => {
            let bytes = session.bytes().unwrap_or(usize::MAX).saturating_sub(frame.payload.len());
            // At least one: the trailer may be all that is missing.
            let missing = u32::try_from(bytes.div_ceil(transfer_bytes.max(1))).unwrap_or(u32::MAX).max(1);
            (FrameStatus::Incomplete { missing }, Seen::default())
        }
    }
}

/// Whether the trailer came and reports all rows, with no more bytes than arrived: chunks follow the pixels.
fn is_whole(frame: &RawFrame, session: &Session) -> bool {
    frame.trailer.as_ref().is_some_and(|end| {
        end.status == 0
            && end.size_y.is_none_or(|rows| rows >= session.size[1])
            && end.valid_payload_size <= frame.payload.len() as u64
    })
}
