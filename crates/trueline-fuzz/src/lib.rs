//! Every parser of foreign bytes, one function each, and the gate before every command: for fuzzers and for the permanent
//! corpus.
//!
//! A target takes any bytes and comes back. A refusal must have a message, and an accepted file must be usable.
//!
//! ```
//! for (_, target) in trueline_fuzz::TARGETS {
//!     target(b"anything");
//! }
//! ```

mod files;
mod motion;
mod packets;
mod recordings;

use std::path::Path;

/// A parser under test: it must come back from any bytes.
pub type Target = fn(&[u8]);

/// All parsers by name.
pub const TARGETS: [(&str, Target); 30] = [
    ("robot_csv", files::robot_csv),
    ("features_csv", files::features_csv),
    ("profiles_csv", files::profiles_csv),
    ("stripes_csv", files::stripes_csv),
    ("foreign_table", files::foreign_table),
    ("table_of_program", files::table_of_program),
    ("profiles_parquet", files::profiles_parquet),
    ("foreign_profiles", files::foreign_profiles),
    ("dxf", files::dxf),
    ("plan", files::plan),
    ("sensor_toml", files::sensor_toml),
    ("guess_toml", files::guess_toml),
    ("limits_toml", files::limits_toml),
    ("cell_toml", files::cell_toml),
    ("result_json", files::result_json),
    ("picture", files::picture),
    ("point_cloud", files::point_cloud),
    ("mcap", recordings::mcap),
    ("ros_message", recordings::ros_message),
    ("rosbag", recordings::rosbag),
    ("watch_state", recordings::watch_state),
    ("egm", packets::egm),
    ("hspo", packets::hspo),
    ("rtde", packets::rtde),
    ("stream_motion", packets::stream_motion),
    ("rsi", packets::rsi),
    ("gvcp", packets::gvcp),
    ("gvsp", packets::gvsp),
    ("gige_chunks", packets::gige_chunks),
    ("gate", motion::gate),
];

/// Runs a target by name.
///
/// # Panics
/// Unknown name: the harness is wrong, not the parser.
#[expect(clippy::panic, reason = "a fuzzing harness reports by panicking")]
pub fn run(name: &str, bytes: &[u8]) {
    let Some((_, target)) = TARGETS.iter().find(|(known, _)| *known == name) else {
        panic!("there is no target {name}");
    };
    target(bytes);
}

/// Gives a target that reads files a file, in memory if possible: a database waits for a disk.
#[expect(clippy::expect_used, reason = "a fuzzing harness reports by panicking")]
fn with_file(name: &str, bytes: &[u8], target: impl FnOnce(&Path)) {
    let memory = Path::new("/dev/shm");
    let folder =
        tempfile::tempdir_in(memory).or_else(|_| tempfile::tempdir()).expect("a folder for the file");
    let file = folder.path().join(name);
    std::fs::write(&file, bytes).expect("a file");
    target(&file);
}
