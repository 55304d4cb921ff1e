//! External axes in the packets of robots, as they were recorded.
//!
//! | protocol | where | names |
//! |---|---|---|
//! | ABB EGM | `externalJoints` of the feedback, deg or mm | `eax_a` … `eax_f` |
//! | KUKA RSI | element `EIPos`, deg or mm | `E1` … `E6` |
//! | FANUC Stream Motion, versions 1 and 2 | behind the pose of the status, deg or mm | `EXT1` … `EXT3` |

use prost::Message;

/// Names and values, deg or mm.
pub(crate) type Values = Vec<(String, f64)>;

/// `abb.egm.EgmRobot`, the part about external axes.
#[derive(Clone, PartialEq, Message)]
struct EgmRobot {
    #[prost(message, optional, tag = "2")]
    feedback: Option<EgmFeedBack>,
}

#[derive(Clone, PartialEq, Message)]
struct EgmFeedBack {
    #[prost(message, optional, tag = "3")]
    external_joints: Option<EgmJoints>,
}

#[derive(Clone, PartialEq, Message)]
struct EgmJoints {
    #[prost(double, repeated, tag = "1")]
    joints: Vec<f64>,
}

/// The values of a datagram of EGM; empty if it has none, or is another message.
#[must_use]
pub(crate) fn of_egm(bytes: &[u8]) -> Values {
    const NAMES: [&str; 6] = ["eax_a", "eax_b", "eax_c", "eax_d", "eax_e", "eax_f"];
    let message = EgmRobot::decode(bytes).ok();
    let joints = message.and_then(|message| message.feedback?.external_joints);
    let named = NAMES.iter().zip(joints.map(|joints| joints.joints).unwrap_or_default());
    named.map(|(name, value)| ((*name).to_owned(), value)).collect()
}

/// The values of a packet of another protocol.
#[must_use]
pub(crate) fn of_packet(bytes: &[u8]) -> Values {
    match std::str::from_utf8(bytes) {
        Ok(text) if text.trim_start().starts_with('<') => of_rsi(text),
        _ => of_stream_motion(bytes),
    }
}

/// The attributes of `<EIPos E1="…" …/>`.
fn of_rsi(text: &str) -> Values {
    let element = text.split_once("<EIPos").and_then(|(_, rest)| rest.split_once('>'));
    let attributes = element.map(|(attributes, _)| attributes.trim_end_matches('/')).unwrap_or_default();
    let mut values = Vec::new();
    // Between two quotes stands a value, and before it a name.
    let mut parts = attributes.split(['"', '\'']);
    while let (Some(name), Some(value)) = (parts.next(), parts.next()) {
        let name = name.trim().trim_end_matches('=').trim_end();
        if let Ok(value) = value.trim().parse() {
            values.push((name.to_owned(), value));
        }
    }
    values
}

/// Bytes of a status of Stream Motion, versions 1 and 2: its type, …
const STATUS_BYTES: usize = 132;
/// … and where its external axes begin, behind X, Y, Z, W, P and R.
const EXTERNAL_AT: usize = 48;

fn of_stream_motion(bytes: &[u8]) -> Values {
    let is_status = bytes.len() == STATUS_BYTES && bytes.starts_with(&[0; 4]);
    let numbers = bytes.get(EXTERNAL_AT..).filter(|_| is_status).unwrap_or_default();
    let (fours, _) = numbers.as_chunks::<4>();
    let named = ["EXT1", "EXT2", "EXT3"].into_iter().zip(fours);
    named.map(|(name, four)| (name.to_owned(), f64::from(f32::from_be_bytes(*four)))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_of_rsi_are_attributes_of_one_element() {
        let text = r#"<Rob Type="KUKA"><RIst X="1" Y="2" Z="3" A="0" B="0" C="0"/><EIPos E1="12.5" E2="-3"/><IPOC>4</IPOC></Rob>"#;
        assert_eq!(of_packet(text.as_bytes()), [("E1".to_owned(), 12.5), ("E2".to_owned(), -3.0)]);
        assert!(of_packet(text.replace("EIPos", "ESPos").as_bytes()).is_empty());
    }

    #[test]
    fn axes_of_stream_motion_stand_behind_the_pose() {
        let mut bytes = vec![0; STATUS_BYTES];
        bytes[EXTERNAL_AT..EXTERNAL_AT + 4].copy_from_slice(&90.5_f32.to_be_bytes());
        assert_eq!(of_packet(&bytes)[0], ("EXT1".to_owned(), 90.5));
        assert!(of_packet(&bytes[1..]).is_empty());
    }
}
