//! `<Rob>`: one message of the controller.

use super::input_element::InputElement;
use super::ipoc::Ipoc;
use crate::frame_filter::PacketError;
use crate::zyx_angles;
use quick_xml::Reader;
use quick_xml::events::{BytesStart, BytesText, Event};
use trueline_geometry::Pose;

/// Fields of a message that a listener needs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RobMessage {
    /// `RIst`: actual pose of the active tool in the active base, m.
    pub pose: Pose,
    /// `IPOC`: the controller's count of its cycles, in ms.
    pub ipoc: Ipoc,
    /// `Delay`: answers that the controller missed, if it reports them.
    pub delayed: Option<u32>,
    /// Digital inputs.
    pub inputs: Inputs,
}

/// The inputs' element in a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Inputs {
    /// It is not there.
    Missing,
    /// It exists, but is not a whole number or a truth value.
    Odd,
    /// The inputs, the first in the lowest bit.
    Bits(u64),
}

/// Reads a message. Attributes and elements may come in any order, each element once; entities and document types are
/// refused.
///
/// # Errors
/// Missing or invalid elements.
pub fn read(bytes: &[u8], inputs: &InputElement) -> Result<RobMessage, PacketError> {
    let text = std::str::from_utf8(bytes).map_err(|_| PacketError::Text("not a text in UTF-8"))?;
    let mut reader = Reader::from_str(text.trim_matches(['\0', ' ', '\r', '\n', '\t']));
    let mut parts = Parts::default();
    // Names of the elements that are open; only those directly in <Rob> count.
    let mut open: Vec<String> = Vec::new();
    loop {
        match reader.read_event().map_err(|_| PacketError::Text("not well-formed XML"))? {
            Event::Start(tag) => {
                parts.begin(&tag, &open, inputs)?;
                open.push(tag.name().as_ref().to_owned());
            }
            Event::Empty(tag) => parts.begin(&tag, &open, inputs)?,
            Event::Text(text) => parts.text(&text, &open, inputs)?,
            Event::End(_) => drop(open.pop()),
            Event::DocType(_) | Event::GeneralRef(_) | Event::CData(_) => {
                return Err(PacketError::Text("a document type or an entity, which RSI does not send"));
            }
            Event::Eof => break,
            _ => {}
        }
    }
    if !open.is_empty() {
        return Err(PacketError::Text("not well-formed XML"));
    }
    parts.message()
}

#[derive(Default)]
struct Parts {
    is_rob: bool,
    figures: Option<[f64; 6]>,
    ipoc: Option<Ipoc>,
    delayed: Option<u32>,
    inputs: Option<Inputs>,
}

impl Parts {
    fn begin(
        &mut self,
        tag: &BytesStart<'_>,
        open: &[String],
        inputs: &InputElement,
    ) -> Result<(), PacketError> {
        // Twice the same attribute is not well-formed, wherever it stands.
        if tag.attributes().any(|attribute| attribute.is_err()) {
            return Err(PacketError::Text("not well-formed XML"));
        }
        if open.get(1).is_some_and(|name| name == "IPOC") {
            return Err(PacketError::Text("an IPOC that is not a number"));
        }
        let (depth, name) = (open.len(), tag.name());
        match (depth, name.as_ref()) {
            (0, "Rob") if !self.is_rob => self.is_rob = true,
            (0, "Rob") => return Err(PacketError::Text("two messages in one datagram")),
            (0, _) => return Err(PacketError::Text("no <Rob>: not a message of RSI")),
            (1, "RIst") if self.figures.is_none() => self.figures = Some(pose_figures(tag)?),
            (1, "RIst") => return Err(PacketError::Text("RIst twice")),
            (1, "Delay") => self.delayed = figure(tag, "D")?.map(|count| count as u32),
            _ => {}
        }
        if let (1, Some(attribute)) = (depth, inputs.attribute_of(name.as_ref())) {
            let value = tag.try_get_attribute(attribute);
            let value = value.map_err(|_| PacketError::Text("not well-formed XML"))?;
            self.inputs = Some(value.map_or(Inputs::Missing, |value| bits(&value.value)));
        }
        Ok(())
    }

    fn text(
        &mut self,
        text: &BytesText<'_>,
        open: &[String],
        inputs: &InputElement,
    ) -> Result<(), PacketError> {
        let [_, name] = open else { return Ok(()) };
        if name == "IPOC" {
            let ipoc = Ipoc::read(text.trim()).ok_or(PacketError::Text("an IPOC that is not a number"))?;
            if self.ipoc.replace(ipoc).is_some() {
                return Err(PacketError::Text("IPOC twice"));
            }
        } else if inputs.is_text_of(name) {
            self.inputs = Some(bits(text));
        }
        Ok(())
    }

    fn message(self) -> Result<RobMessage, PacketError> {
        if !self.is_rob {
            return Err(PacketError::Text("no <Rob>: not a message of RSI"));
        }
        let figures = self.figures.ok_or(PacketError::Text("no RIst: add DEF_RIst to the SEND section"))?;
        let [x, y, z, a, b, c] = figures;
        let ipoc = self.ipoc.ok_or(PacketError::Text("no IPOC"))?;
        let pose = zyx_angles::pose_from_mm([x, y, z], zyx_angles::from_abc_deg([a, b, c]))
            .ok_or(PacketError::NotFinite)?;
        Ok(RobMessage { pose, ipoc, delayed: self.delayed, inputs: self.inputs.unwrap_or(Inputs::Missing) })
    }
}

/// Inputs are a truth value (`BOOL`) or a whole number (`LONG`); of a negative one the 32 bits that KRL gives an INT.
fn bits(text: &str) -> Inputs {
    match text.trim() {
        "TRUE" | "true" | "True" => Inputs::Bits(1),
        "FALSE" | "false" | "False" => Inputs::Bits(0),
        number => match number.parse::<i64>() {
            Ok(number) if number >= 0 => Inputs::Bits(number as u64),
            Ok(number) => {
                i32::try_from(number).map_or(Inputs::Odd, |number| Inputs::Bits(u64::from(number as u32)))
            }
            Err(_) => Inputs::Odd,
        },
    }
}

fn pose_figures(tag: &BytesStart<'_>) -> Result<[f64; 6], PacketError> {
    let mut figures = [0.0; 6];
    for (figure_of, name) in figures.iter_mut().zip(["X", "Y", "Z", "A", "B", "C"]) {
        *figure_of = figure(tag, name)?.ok_or(PacketError::Text("RIst without all of X Y Z A B C"))?;
    }
    Ok(figures)
}

fn figure(tag: &BytesStart<'_>, name: &str) -> Result<Option<f64>, PacketError> {
    const NO_NUMBER: PacketError = PacketError::Text("a figure that is not a number (decimal comma?)");
    let attribute = tag.try_get_attribute(name).map_err(|_| PacketError::Text("not well-formed XML"))?;
    let Some(attribute) = attribute else { return Ok(None) };
    attribute.value.trim().parse().map(Some).map_err(|_| NO_NUMBER)
}
