//! A picture from the received packets.

use super::stamps::Packets;
use crate::frame_source::FrameStatus;
use crate::genicam::{Seen, Session};
use telegenic::{Frame, FrameStatus as Driver, PayloadKind};

/// State of a frame, and its content if it can be used.
pub(super) fn of(frame: &Frame, packets: Option<&Packets>, session: &Session) -> (FrameStatus, Seen) {
    let status = status(frame, packets, session);
    if status != FrameStatus::Complete {
        return (status, Seen::default());
    }
    match session.seen(frame.data(), usize::from(frame.x_padding)) {
        Some(seen) => (status, seen),
        // The leader promises more than the packets contain.
        None => (FrameStatus::Incomplete { missing: 1 }, Seen::default()),
    }
}

fn status(frame: &Frame, packets: Option<&Packets>, session: &Session) -> FrameStatus {
    let size = [frame.width, frame.height];
    // Without its leader a picture has no description, but then it is incomplete anyway.
    let has_leader = size != [0, 0];
    if let Some(wrong) = has_leader.then(|| session.wrong(size, frame.pixel_format.0)).flatten() {
        return wrong;
    }
    if frame.status == Driver::Complete && has_leader && matches!(frame.payload, PayloadKind::Image { .. }) {
        return FrameStatus::Complete;
    }
    let missing_bytes = session.bytes().unwrap_or(usize::MAX).saturating_sub(frame.received_size);
    let bytes = packets.map_or(0, |packets| packets.most_bytes).max(1);
    // At least one: the leader or the end of the picture may be all that is missing.
    let missing = u32::try_from(missing_bytes.div_ceil(bytes)).unwrap_or(u32::MAX).max(1);
    FrameStatus::Incomplete { missing }
}
