//! Descriptors of trueline's own messages, for programs that know nothing of trueline.
//!
//! `abb.egm.EgmRobot` leaves out field 9, `measuredForce`: RobotWare 6 and 7 use it in two forms that contradict each
//! other, and a viewer that meets the other one shows nothing at all. The bytes hold it all the same.

use prost::Message;
use prost_types::field_descriptor_proto::{Label, Type};
use prost_types::{
    DescriptorProto, EnumDescriptorProto, EnumValueDescriptorProto, FieldDescriptorProto,
    FileDescriptorProto, FileDescriptorSet, OneofDescriptorProto,
};

const EGM_FILE: &str = "abb/egm.proto";

/// A `FileDescriptorSet` with all of trueline's messages and what they use.
pub(crate) fn own_descriptors() -> Vec<u8> {
    FileDescriptorSet { file: vec![egm_file(), own_file()] }.encode_to_vec()
}

/// A field: its name, number and type. `Kind::Message` and `Kind::Enum` name theirs in full.
struct Field(&'static str, i32, Kind);

#[derive(Clone, Copy)]
enum Kind {
    /// A number, text or bytes.
    Plain(Type),
    /// The same, where absence means something.
    Optional(Type),
    /// A list.
    List(Type),
    Message(&'static str),
    Messages(&'static str),
    Enum(&'static str),
}
use Kind::{Enum, List, Messages, Optional, Plain};

fn message(name: &str, fields: &[Field]) -> DescriptorProto {
    let mut message = DescriptorProto { name: Some(name.to_owned()), ..Default::default() };
    for Field(name, number, kind) in fields {
        let (label, of, type_name) = match *kind {
            Plain(of) | Optional(of) => (Label::Optional, of, None),
            List(of) => (Label::Repeated, of, None),
            Kind::Message(name) => (Label::Optional, Type::Message, Some(name)),
            Messages(name) => (Label::Repeated, Type::Message, Some(name)),
            Enum(name) => (Label::Optional, Type::Enum, Some(name)),
        };
        let mut field = FieldDescriptorProto {
            name: Some((*name).to_owned()),
            number: Some(*number),
            r#type: Some(of as i32),
            label: Some(label as i32),
            type_name: type_name.map(str::to_owned),
            ..Default::default()
        };
        if matches!(kind, Optional(_)) {
            // proto3 writes an optional field as a choice of one.
            field.proto3_optional = Some(true);
            field.oneof_index = Some(message.oneof_decl.len() as i32);
            message
                .oneof_decl
                .push(OneofDescriptorProto { name: Some(format!("_{name}")), ..Default::default() });
        }
        message.field.push(field);
    }
    message
}

const NS: Kind = Plain(Type::Int64);
const NS_IF_KNOWN: Kind = Optional(Type::Int64);
const TEXT: Kind = Plain(Type::String);

/// What was exchanged with the robot.
fn robot_messages() -> Vec<DescriptorProto> {
    let datagram = [
        Field("robot", 1, Kind::Message(".abb.egm.EgmRobot")),
        Field("source", 2, TEXT),
        Field("kernel_wall_ns", 3, NS_IF_KNOWN),
        Field("read_wall_ns", 4, NS),
        Field("steady_ns", 5, NS),
        Field("device_ns", 6, NS),
        Field("ptp_ns", 7, NS_IF_KNOWN),
    ];
    let packet = [
        Field("packet", 1, Plain(Type::Bytes)),
        Field("source", 2, TEXT),
        Field("kernel_wall_ns", 3, NS_IF_KNOWN),
        Field("read_wall_ns", 4, NS),
        Field("steady_ns", 5, NS),
        Field("device_ns", 6, NS),
    ];
    let rejected = [
        Field("datagram", 1, Plain(Type::Bytes)),
        Field("source", 2, TEXT),
        Field("steady_ns", 3, NS),
        Field("reason", 4, TEXT),
    ];
    let answer = [
        Field("sensor", 1, Kind::Message(".abb.egm.EgmSensor")),
        Field("destination", 2, TEXT),
        Field("steady_ns", 3, NS),
        Field("sequence", 4, Plain(Type::Uint32)),
    ];
    let inputs = [
        Field("before_ns", 1, NS),
        Field("steady_ns", 2, NS),
        Field("device_before_ns", 3, NS),
        Field("device_ns", 4, NS),
        Field("bits_before", 5, Plain(Type::Uint64)),
        Field("bits", 6, Plain(Type::Uint64)),
    ];
    vec![
        message("Inputs", &inputs),
        message("RobotDatagram", &datagram),
        message("RobotPacket", &packet),
        message("RejectedDatagram", &rejected),
        message("Answer", &answer),
        message("Clock", &[Field("steady_ns", 1, NS), Field("wall_ns", 2, NS)]),
    ]
}

/// What came from the camera.
fn camera_messages() -> Vec<DescriptorProto> {
    let frame = [
        Field("frame", 1, Plain(Type::Uint64)),
        Field("stamp_ns", 2, NS),
        Field("first_packet_ns", 3, NS_IF_KNOWN),
        Field("complete_ns", 4, NS_IF_KNOWN),
        Field("device_ns", 5, NS_IF_KNOWN),
        Field("exposure_us", 6, Optional(Type::Double)),
        Field("status", 7, TEXT),
        Field("picture_bytes", 8, Plain(Type::Uint64)),
        Field("encoder", 9, Optional(Type::Int64)),
        Field("lines", 10, Optional(Type::Uint64)),
        Field("counter", 11, Optional(Type::Int64)),
        Field("camera_frame", 12, Optional(Type::Uint64)),
    ];
    let feature = [
        Field("stamp_ns", 1, NS),
        Field("line", 2, Plain(Type::Uint32)),
        Field("frame", 3, Optional(Type::Uint64)),
        Field("device_ns", 4, NS_IF_KNOWN),
        Field("pixel", 5, List(Type::Double)),
        Field("point", 6, List(Type::Double)),
        Field("profile", 7, List(Type::Double)),
        Field("sigma", 8, List(Type::Double)),
        Field("correlation", 9, Plain(Type::Double)),
    ];
    vec![
        message("Frame", &frame),
        message("Feature", &feature),
        message("Features", &[Field("features", 1, Messages(".trueline.Feature"))]),
    ]
}

fn own_file() -> FileDescriptorProto {
    FileDescriptorProto {
        name: Some("trueline/recording.proto".to_owned()),
        package: Some("trueline".to_owned()),
        dependency: vec![EGM_FILE.to_owned()],
        syntax: Some("proto3".to_owned()),
        message_type: [robot_messages(), camera_messages()].concat(),
        ..Default::default()
    }
}

/// ABB's messages with every field optional: what is missing must be seen to be missing.
fn egm_file() -> FileDescriptorProto {
    let mut file = FileDescriptorProto {
        name: Some(EGM_FILE.to_owned()),
        package: Some("abb.egm".to_owned()),
        syntax: Some("proto2".to_owned()),
        ..Default::default()
    };
    file.message_type.extend(egm_parts());
    file.message_type.extend(egm_states());
    file.message_type.push(message(
        "EgmRobot",
        &[
            Field("header", 1, Kind::Message(".abb.egm.EgmHeader")),
            Field("feedBack", 2, Kind::Message(".abb.egm.EgmFeedBack")),
            Field("planned", 3, Kind::Message(".abb.egm.EgmPlanned")),
            Field("motorState", 4, Kind::Message(".abb.egm.EgmMotorState")),
            Field("mciState", 5, Kind::Message(".abb.egm.EgmMCIState")),
            Field("mciConvergenceMet", 6, Plain(Type::Bool)),
            Field("testSignals", 7, Kind::Message(".abb.egm.EgmTestSignals")),
            Field("rapidExecState", 8, Kind::Message(".abb.egm.EgmRapidCtrlExecState")),
            Field("utilizationRate", 10, Plain(Type::Double)),
            Field("moveIndex", 11, Plain(Type::Uint32)),
            Field("CollisionInfo", 12, Kind::Message(".abb.egm.EgmCollisionInfo")),
            Field("RAPIDdata", 13, Kind::Message(".abb.egm.EgmRAPIDdata")),
            Field("torqueRef", 14, Kind::Message(".abb.egm.EgmJoints")),
        ],
    ));
    file.message_type.push(message(
        "EgmSensor",
        &[
            Field("header", 1, Kind::Message(".abb.egm.EgmHeader")),
            Field("planned", 2, Kind::Message(".abb.egm.EgmPlanned")),
            Field("speedRef", 3, Kind::Message(".abb.egm.EgmSpeedRef")),
        ],
    ));
    file
}

fn egm_parts() -> Vec<DescriptorProto> {
    const NUMBER: Kind = Plain(Type::Double);
    const COUNT: Kind = Plain(Type::Uint64);
    const JOINTS: Kind = Kind::Message(".abb.egm.EgmJoints");
    let state = [
        Field("joints", 1, JOINTS),
        Field("cartesian", 2, Kind::Message(".abb.egm.EgmPose")),
        Field("externalJoints", 3, JOINTS),
        Field("time", 4, Kind::Message(".abb.egm.EgmClock")),
        Field("timeStamp", 5, Kind::Message(".abb.egm.EgmTimestamp")),
    ];
    let pose = [
        Field("pos", 1, Kind::Message(".abb.egm.EgmCartesian")),
        Field("orient", 2, Kind::Message(".abb.egm.EgmQuaternion")),
        Field("euler", 3, Kind::Message(".abb.egm.EgmEuler")),
    ];
    let speed = [
        Field("joints", 1, JOINTS),
        Field("cartesians", 2, Kind::Message(".abb.egm.EgmCartesianSpeed")),
        Field("externalJoints", 3, JOINTS),
    ];
    let xyz = [Field("x", 1, NUMBER), Field("y", 2, NUMBER), Field("z", 3, NUMBER)];
    let quaternion =
        [Field("u0", 1, NUMBER), Field("u1", 2, NUMBER), Field("u2", 3, NUMBER), Field("u3", 4, NUMBER)];
    let flag_and_list = |flag, list| [Field(flag, 1, Plain(Type::Bool)), Field(list, 2, List(Type::Double))];
    vec![
        message("EgmCartesian", &xyz),
        message("EgmEuler", &xyz),
        message("EgmQuaternion", &quaternion),
        message("EgmPose", &pose),
        message("EgmJoints", &[Field("joints", 1, List(Type::Double))]),
        message("EgmCartesianSpeed", &[Field("value", 1, List(Type::Double))]),
        message("EgmTestSignals", &[Field("signals", 1, List(Type::Double))]),
        message("EgmClock", &[Field("sec", 1, COUNT), Field("usec", 2, COUNT)]),
        message("EgmTimestamp", &[Field("sec", 1, COUNT), Field("nsec", 2, COUNT)]),
        message("EgmFeedBack", &state),
        message("EgmPlanned", &state),
        message("EgmSpeedRef", &speed),
        message("EgmCollisionInfo", &flag_and_list("collsionTriggered", "collDetQuota")),
        message("EgmRAPIDdata", &flag_and_list("digVal", "dnum")),
    ]
}

/// The header, and messages that hold nothing but a state.
fn egm_states() -> Vec<DescriptorProto> {
    let state = |name, of: (&str, &'static str), values: &[&str]| {
        let mut state = message(name, &[Field("state", 1, Enum(of.1))]);
        state.enum_type.push(numbered(of.0, values));
        state
    };
    let mut header = message(
        "EgmHeader",
        &[
            Field("seqno", 1, Plain(Type::Uint32)),
            Field("tm", 2, Plain(Type::Uint32)),
            Field("mtype", 3, Enum(".abb.egm.EgmHeader.MessageType")),
        ],
    );
    header.enum_type.push(numbered(
        "MessageType",
        &[
            "MSGTYPE_UNDEFINED",
            "MSGTYPE_COMMAND",
            "MSGTYPE_DATA",
            "MSGTYPE_CORRECTION",
            "MSGTYPE_PATH_CORRECTION",
        ],
    ));
    vec![
        header,
        state(
            "EgmMotorState",
            ("MotorStateType", ".abb.egm.EgmMotorState.MotorStateType"),
            &["MOTORS_UNDEFINED", "MOTORS_ON", "MOTORS_OFF"],
        ),
        state(
            "EgmMCIState",
            ("MCIStateType", ".abb.egm.EgmMCIState.MCIStateType"),
            &["MCI_UNDEFINED", "MCI_ERROR", "MCI_STOPPED", "MCI_RUNNING"],
        ),
        state(
            "EgmRapidCtrlExecState",
            ("RapidCtrlExecStateType", ".abb.egm.EgmRapidCtrlExecState.RapidCtrlExecStateType"),
            &["RAPID_UNDEFINED", "RAPID_STOPPED", "RAPID_RUNNING"],
        ),
    ]
}

fn numbered(name: &str, values: &[&str]) -> EnumDescriptorProto {
    let value = |(number, name): (usize, &&str)| EnumValueDescriptorProto {
        name: Some((*name).to_owned()),
        number: Some(number as i32),
        ..Default::default()
    };
    EnumDescriptorProto {
        name: Some(name.to_owned()),
        value: values.iter().enumerate().map(value).collect(),
        ..Default::default()
    }
}
