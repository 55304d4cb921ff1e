//! The messages of trueline's own recordings that are read back.

use crate::message::content::{Content, FrameStamps, Kind};
use crate::message::content_error::ContentError;
use crate::message::external;
use crate::message::stamp;
use crate::wire::proto;
use crate::write::entry::InputsEntry;
use prost::Message;
use trueline_dataset::{Feature, FrameSignals, LAST_LINE, MOST_CORRELATION, Measured};

/// Kind of the messages of a schema.
#[must_use]
pub(crate) fn kind(schema: &str) -> Kind {
    match schema {
        "trueline.Frame" => Kind::Frame,
        "trueline.Features" => Kind::Features,
        "trueline.RobotDatagram" => Kind::RobotClocks,
        "trueline.RobotPacket" => Kind::RobotPacket,
        "trueline.Inputs" => Kind::Inputs,
        _ => Kind::Other,
    }
}

/// Understands a message.
///
/// # Errors
/// [`ContentError`] names the faulty field.
pub(crate) fn decode(schema: &str, bytes: &[u8]) -> Result<Content, ContentError> {
    let broken = |error: prost::DecodeError| ContentError::Protobuf { why: error.to_string() };
    match kind(schema) {
        Kind::Frame => {
            let wire = proto::Frame::decode(bytes).map_err(broken)?;
            Ok(Content::Frame(FrameStamps {
                frame: wire.frame,
                stamp_ns: stamp::in_range(wire.stamp_ns)?,
                first_packet_ns: wire.first_packet_ns,
                complete_ns: wire.complete_ns,
                device_ns: wire.device_ns.map(stamp::in_range).transpose()?,
                exposure_us: wire.exposure_us,
                status: wire.status,
                picture_bytes: wire.picture_bytes,
                signals: FrameSignals {
                    encoder: wire.encoder,
                    lines: wire.lines,
                    counter: wire.counter,
                    camera_frame: wire.camera_frame,
                },
            }))
        }
        Kind::Features => {
            let wire = proto::Features::decode(bytes).map_err(broken)?;
            Ok(Content::Features(wire.features.iter().map(feature).collect::<Result<_, _>>()?))
        }
        Kind::RobotClocks => {
            let wire = proto::RobotDatagram::decode(bytes).map_err(broken)?;
            let ptp_ns = wire.ptp_ns.map(stamp::in_range).transpose()?;
            Ok(Content::ExternalAxes(wire.steady_ns, ptp_ns, external::of_egm(&wire.robot)))
        }
        Kind::RobotPacket => {
            let wire = proto::RobotPacket::decode(bytes).map_err(broken)?;
            Ok(Content::ExternalAxes(wire.steady_ns, None, external::of_packet(&wire.packet)))
        }
        Kind::Inputs => {
            let wire = proto::Inputs::decode(bytes).map_err(broken)?;
            Ok(Content::Inputs(InputsEntry {
                between_ns: [wire.before_ns, wire.steady_ns],
                device_ns: [wire.device_before_ns, wire.device_ns],
                bits: [wire.bits_before, wire.bits],
            }))
        }
        _ => Ok(Content::Other),
    }
}

fn feature(wire: &proto::Feature) -> Result<Feature, ContentError> {
    let measured = match (wire.pixel.as_slice(), wire.point.as_slice(), wire.profile.as_slice()) {
        (&[u, v], [], []) => Measured::Pixel([u, v]),
        ([], &[x, y, z], []) => Measured::Point([x, y, z]),
        ([], [], &[x, z]) => Measured::Profile([x, z]),
        _ => return Err(ContentError::Feature),
    };
    let sigma = match wire.sigma.as_slice() {
        [] => None,
        &[a, b] if a > 0.0 && b > 0.0 => Some([a, b]),
        _ => return Err(ContentError::Feature),
    };
    // NaN is not within either.
    let correlation = wire.correlation;
    let most = if sigma.is_some() { MOST_CORRELATION } else { 0.0 };
    if !(-most..=most).contains(&correlation) {
        return Err(ContentError::Feature);
    }
    let mut numbers = wire.pixel.iter().chain(&wire.point).chain(&wire.profile).chain(&wire.sigma);
    if !numbers.all(|v| v.is_finite()) {
        return Err(ContentError::NotFinite { field: "the seam point" });
    }
    if wire.line > LAST_LINE {
        return Err(ContentError::Feature);
    }
    let (stamp_ns, line, frame) = (stamp::in_range(wire.stamp_ns)?, wire.line, wire.frame);
    let device_ns = wire.device_ns.map(stamp::in_range).transpose()?;
    Ok(Feature { stamp_ns, line, frame, device_ns, measured, sigma, correlation })
}
