//! MCAP files and the messages in them.

use std::io::Cursor;
use trueline_mcap::LogReader;
use trueline_mcap::message::decode;

pub(crate) fn mcap(bytes: &[u8]) {
    // Reading from memory fails for no file.
    let Ok(mut reader) = LogReader::open(Cursor::new(bytes)) else { return };
    while let Ok(Some(_)) = reader.next_item() {}
    assert!(reader.damages().iter().all(|damage| !damage.to_string().is_empty()));
}

/// What the first byte chooses, the rest being the message.
const SCHEMAS: [(&str, &str); 8] = [
    ("geometry_msgs/msg/PoseStamped", "cdr"),
    ("tf2_msgs/msg/TFMessage", "cdr"),
    ("sensor_msgs/msg/Image", "cdr"),
    ("sensor_msgs/msg/CompressedImage", "cdr"),
    ("sensor_msgs/msg/PointCloud2", "cdr"),
    ("sensor_msgs/msg/LaserScan", "cdr"),
    ("geometry_msgs/PoseStamped", "ros1"),
    ("foxglove.PoseInFrame", "protobuf"),
];

pub(crate) fn ros_message(bytes: &[u8]) {
    let Some((&choice, message)) = bytes.split_first() else { return };
    let (schema, encoding) = SCHEMAS[usize::from(choice) % SCHEMAS.len()];
    if let Err(problem) = decode(schema, encoding, message) {
        assert!(!problem.to_string().is_empty());
    }
}
