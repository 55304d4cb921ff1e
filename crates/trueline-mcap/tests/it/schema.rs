//! The descriptors in the file fit its bytes: any viewer shows every field without knowing trueline.

use crate::common;
use crate::datagram;

use common::{entries, read_items, recorded, robot};
use datagram::full_datagram;
use prost::Message;
use prost::encoding::{WireType, decode_key, decode_varint};
use prost_types::field_descriptor_proto::Type;
use prost_types::{DescriptorProto, FileDescriptorSet};
use std::collections::{BTreeMap, BTreeSet};
use trueline_live::egm::{EgmFeedBack, EgmHeader, EgmPose, EgmSensor, EgmSpeedRef, MessageType};
use trueline_mcap::{AnswerEntry, Entry, Item, RobotEntry};

/// All messages of a set by their full name.
fn messages(set: &[u8]) -> BTreeMap<String, DescriptorProto> {
    let mut messages = BTreeMap::new();
    for file in FileDescriptorSet::decode(set).unwrap().file {
        for message in &file.message_type {
            messages.insert(format!(".{}.{}", file.package(), message.name()), message.clone());
        }
    }
    messages
}

/// Walks through bytes by their descriptor; tells fields that it does not have.
fn walk(
    known: &BTreeMap<String, DescriptorProto>,
    name: &str,
    mut bytes: &[u8],
    unknown: &mut BTreeSet<String>,
) {
    let message = &known[name];
    while !bytes.is_empty() {
        let (number, wire) = decode_key(&mut bytes).unwrap();
        let field = message.field.iter().find(|field| field.number() as u32 == number);
        let value = match wire {
            WireType::Varint => {
                decode_varint(&mut bytes).unwrap();
                None
            }
            WireType::LengthDelimited => {
                let length = decode_varint(&mut bytes).unwrap() as usize;
                let (value, rest) = bytes.split_at(length);
                bytes = rest;
                Some(value)
            }
            other => {
                bytes = &bytes[if other == WireType::SixtyFourBit { 8 } else { 4 }..];
                None
            }
        };
        let Some(field) = field else {
            unknown.insert(format!("{name} {number}"));
            continue;
        };
        let expected = match field.r#type() {
            Type::Double => WireType::SixtyFourBit,
            Type::Fixed32 => WireType::ThirtyTwoBit,
            Type::String | Type::Bytes | Type::Message => WireType::LengthDelimited,
            _ => WireType::Varint,
        };
        let is_packed =
            field.label() == prost_types::field_descriptor_proto::Label::Repeated && value.is_some();
        assert!(wire == expected || is_packed, "{name} {number}: {wire:?}");
        if let (Type::Message, Some(value)) = (field.r#type(), value)
            && field.type_name() != ".google.protobuf.Timestamp"
        {
            walk(known, field.type_name(), value, unknown);
        }
    }
}

#[test]
fn every_field_is_described() {
    let mut all = entries(16);
    for k in 0..2 {
        all.push(Entry::Robot(RobotEntry { datagram: full_datagram(k), ..robot(k) }));
        all.push(Entry::Robot(RobotEntry { is_egm: false, kernel_wall_ns: Some(7), ..robot(k) }));
        let [joints, speed, joint_speed] = [1.0, 2.0, 3.0].map(|value| Some([value; 6].into()));
        let answer = EgmSensor {
            header: Some(EgmHeader::new(1, 2, MessageType::Correction)),
            planned: Some(EgmFeedBack {
                joints,
                cartesian: Some(EgmPose::full(&common::pose(k))),
                ..EgmFeedBack::default()
            }),
            speed_ref: Some(EgmSpeedRef { joints: joint_speed, cartesians: speed, external_joints: None }),
        };
        let (to, steady_ns) = (robot(k).from, robot(k).steady_ns);
        all.push(Entry::Answer(AnswerEntry { datagram: answer.encode_to_vec(), to, steady_ns, sequence: k }));
    }
    let (items, _) = read_items(&recorded(all));
    let mut unknown = BTreeSet::new();
    for item in &items {
        let Item::Message { channel, data, .. } = item else { continue };
        let schema = channel.schema.as_ref().unwrap();
        walk(&messages(&schema.data), &format!(".{}", schema.name), data, &mut unknown);
    }
    // 15 is the field that is made up in `common::robot`.
    assert_eq!(unknown.into_iter().collect::<Vec<_>>(), [".abb.egm.EgmRobot 15"]);
}
