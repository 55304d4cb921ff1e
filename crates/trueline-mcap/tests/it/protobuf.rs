//! The code and the descriptors that are committed are those of the `.proto` files. With `UPDATE=1` they are written.

use prost::Message;
use prost_types::field_descriptor_proto::{Label, Type};
use prost_types::{DescriptorProto, FieldDescriptorProto, FileDescriptorSet};
use std::fs;
use std::path::{Path, PathBuf};

/// EGM's lists have at most so many numbers; in code they are not in the heap, because the thread that answers the robot reads
/// them.
const LISTS: [(&str, &str); 6] = [
    ("EgmJoints", "Axes"),
    ("EgmCartesianSpeed", "Axes"),
    ("EgmTestSignals", "Axes"),
    ("EgmMeasuredForce", "Axes"),
    ("EgmCollisionInfo", "Collision"),
    ("EgmRAPIDdata", "RapidData"),
];

fn crates() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

fn compiled() -> FileDescriptorSet {
    let folders = ["trueline-mcap/proto", "trueline-live/proto"].map(|folder| crates().join(folder));
    let mut compiler = protox::Compiler::new(folders).unwrap();
    compiler.include_imports(true).include_source_info(true);
    compiler.open_file("trueline/recording.proto").unwrap();
    compiler.file_descriptor_set()
}

fn message<'a>(set: &'a mut FileDescriptorSet, name: &str) -> &'a mut DescriptorProto {
    set.file
        .iter_mut()
        .flat_map(|file| &mut file.message_type)
        .find(|message| message.name() == name)
        .unwrap()
}

fn field<'a>(set: &'a mut FileDescriptorSet, of: &str, name: &str) -> &'a mut FieldDescriptorProto {
    message(set, of).field.iter_mut().find(|field| field.name() == name).unwrap()
}

/// What a viewer needs.
fn descriptors(mut set: FileDescriptorSet) -> Vec<u8> {
    for file in &mut set.file {
        file.source_code_info = None;
        for field in file.message_type.iter_mut().flat_map(|message| &mut message.field) {
            field.json_name = None;
        }
    }
    set.encode_to_vec()
}

/// What code knows better than a viewer: a datagram is kept as it came, and field 9 of EgmRobot is read in both of its forms.
fn for_code(mut set: FileDescriptorSet) -> FileDescriptorSet {
    for (of, name) in [("RobotDatagram", "robot"), ("Answer", "sensor")] {
        let datagram = field(&mut set, of, name);
        datagram.set_type(Type::Bytes);
        datagram.type_name = None;
    }
    let force = field(&mut set, "EgmRobot", "measuredForce");
    force.set_type(Type::Message);
    force.type_name = Some(".abb.egm.EgmMeasuredForce".to_owned());
    field(&mut set, "EgmRobot", "RAPIDdata").name = Some("rapid_data".to_owned());
    for (list, _) in LISTS {
        for numbers in &mut message(&mut set, list).field {
            numbers.set_label(Label::Optional);
        }
    }
    // MOTORS_ON is MotorStateType::On.
    let messages = set.file.iter_mut().flat_map(|file| &mut file.message_type);
    for value in messages.flat_map(|message| &mut message.enum_type).flat_map(|of| &mut of.value) {
        value.name = value.name().split_once('_').map(|(_, name)| name.to_owned());
    }
    set
}

fn check(committed: &Path, made: &[u8]) {
    if std::env::var_os("UPDATE").is_some() {
        fs::write(committed, made).unwrap();
    }
    let same = fs::read(committed).unwrap() == made;
    assert!(same, "{}: not as the .proto files have it; UPDATE=1 writes it", committed.display());
}

#[test]
fn what_is_committed_is_what_the_proto_files_say() {
    let set = compiled();
    check(&crates().join("trueline-mcap/proto/recording.bin"), &descriptors(set.clone()));
    let folder = tempfile::tempdir().unwrap();
    let mut config = prost_build::Config::new();
    config.out_dir(folder.path()).disable_comments([".trueline"]);
    for (list, of) in LISTS {
        config.extern_path(format!(".abb.egm.{list}"), format!("super::numbers::{of}"));
    }
    config.compile_fds(for_code(set)).unwrap();
    for (package, file) in
        [("abb.egm", "trueline-live/src/egm/messages.rs"), ("trueline", "trueline-mcap/src/wire/proto.rs")]
    {
        let made = fs::read(folder.path().join(format!("{package}.rs"))).unwrap();
        check(&crates().join(file), &made);
    }
}
