//! Recordings and the messages in them, and the state of a watch.

use crate::with_file;
use std::io::Cursor;
use trueline_mcap::message::decode;
use trueline_mcap::{Bag, LogReader};
use trueline_watch::Store;

pub(crate) fn mcap(bytes: &[u8]) {
    // Reading from memory fails for no file.
    let Ok(mut reader) = LogReader::open(Cursor::new(bytes)) else { return };
    while let Ok(Some(_)) = reader.next_item() {}
    assert!(reader.damages().iter().all(|damage| !damage.to_string().is_empty()));
}

/// Schemas selected by the first byte; the rest is the message.
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

/// A data base of rosbag2, whole or compressed, or any other kind by its first bytes.
pub(crate) fn rosbag(bytes: &[u8]) {
    with_file("recording.db3", bytes, |file| match Bag::open(file) {
        Ok(bag) => {
            let mut longest = 0;
            let damages = bag.read(&mut |item| {
                longest = longest.max(format!("{item:?}").len());
                Ok(())
            });
            if let Ok(damages) = damages {
                assert!(damages.iter().all(|damage| !damage.to_string().is_empty()));
            }
        }
        Err(error) => assert!(!error.to_string().is_empty()),
    });
}

/// The state of a cell that is watched.
pub(crate) fn watch_state(bytes: &[u8]) {
    with_file("cell.watch", bytes, |file| {
        for opened in [Store::open_to_read(file), Store::open(file)] {
            let Ok(store) = opened.inspect_err(|error| assert!(!error.to_string().is_empty())) else {
                continue;
            };
            for calibration in store.calibrations().unwrap_or_default() {
                drop((store.history(calibration.id, 100), store.last_line(calibration.id)));
            }
            drop(store.receivers());
        }
    });
}
