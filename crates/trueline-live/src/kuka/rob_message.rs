//! `<Rob>`: one message of the controller.

use crate::frame_filter::PacketError;
use crate::zyx_angles;
use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};
use trueline_geometry::Pose;

/// What a listener needs of a message.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RobMessage {
    /// `RIst`: actual pose of the active tool in the active base, m.
    pub pose: Pose,
    /// `IPOC`: the controller's count of its cycles, in ms.
    pub ipoc: u64,
    /// `Delay`: answers that the controller missed, where it says so.
    pub delayed: Option<u32>,
}

/// Reads a message. Attributes may stand in any order; entities and document types are refused.
///
/// # Errors
/// What is not there, or not as it should be.
pub fn read(bytes: &[u8]) -> Result<RobMessage, PacketError> {
    let text = std::str::from_utf8(bytes).map_err(|_| PacketError::Text("not a text in UTF-8"))?;
    let mut reader = Reader::from_str(text.trim_matches(['\0', ' ', '\r', '\n', '\t']));
    let (mut is_rob, mut in_ipoc) = (false, false);
    let (mut figures, mut ipoc, mut delayed) = (None, None, None);
    loop {
        match reader.read_event().map_err(|_| PacketError::Text("not well-formed XML"))? {
            Event::Start(tag) | Event::Empty(tag) => match tag.name().as_ref() {
                "Rob" => is_rob = true,
                "RIst" => figures = Some(pose_figures(&tag)?),
                "Delay" => delayed = figure(&tag, "D")?.map(|count| count as u32),
                "IPOC" => in_ipoc = true,
                _ => {}
            },
            Event::Text(text) if in_ipoc => {
                ipoc = Some(text.trim().parse().map_err(|_| PacketError::Text("an IPOC that is no number"))?);
            }
            Event::End(tag) if tag.name().as_ref() == "IPOC" => in_ipoc = false,
            Event::DocType(_) | Event::GeneralRef(_) => {
                return Err(PacketError::Text("a document type or an entity, which RSI does not send"));
            }
            Event::Eof => break,
            _ => {}
        }
    }
    if !is_rob {
        return Err(PacketError::Text("no <Rob>: not a message of RSI"));
    }
    let [x, y, z, a, b, c] = figures.ok_or(PacketError::Text("no RIst: add DEF_RIst to the SEND section"))?;
    let ipoc = ipoc.ok_or(PacketError::Text("no IPOC"))?;
    let pose = zyx_angles::pose_from_mm([x, y, z], zyx_angles::from_abc_deg([a, b, c]))
        .ok_or(PacketError::NotFinite)?;
    Ok(RobMessage { pose, ipoc, delayed })
}

fn pose_figures(tag: &BytesStart<'_>) -> Result<[f64; 6], PacketError> {
    let mut figures = [0.0; 6];
    for (figure_of, name) in figures.iter_mut().zip(["X", "Y", "Z", "A", "B", "C"]) {
        *figure_of = figure(tag, name)?.ok_or(PacketError::Text("RIst without all of X Y Z A B C"))?;
    }
    Ok(figures)
}

fn figure(tag: &BytesStart<'_>, name: &str) -> Result<Option<f64>, PacketError> {
    const NO_NUMBER: PacketError = PacketError::Text("a figure that is no number (decimal comma?)");
    let attribute = tag.try_get_attribute(name).map_err(|_| PacketError::Text("not well-formed XML"))?;
    let Some(attribute) = attribute else { return Ok(None) };
    attribute.value.trim().parse().map(Some).map_err(|_| NO_NUMBER)
}
