//! A second implementation of the format reads what is written here. Opt-in: `PYTHON_WITH_MCAP=.../python3 cargo test`, see
//! `interop/read_recording.py` for what it needs.

use crate::common;
use crate::datagram;

use common::{entries, read_items, recorded, robot, unfinished};
use datagram::full_datagram;
use std::io::Write as _;
use std::path::Path;
use std::process::Command;
use trueline_mcap::{Entry, Item, RobotEntry};

fn told(python: &str, bytes: &[u8]) -> String {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("a.mcap");
    std::fs::write(&file, bytes).unwrap();
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/interop/read_recording.py");
    let output = Command::new(python).arg(script).arg(&file).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

#[test]
fn python_reads_every_message_with_the_schema_in_the_file() {
    let Ok(python) = std::env::var("PYTHON_WITH_MCAP") else {
        let mut stderr = std::io::stderr();
        writeln!(stderr, "SKIPPED: interop: PYTHON_WITH_MCAP names no Python").unwrap();
        return;
    };
    let full = [0, 1].map(|k| Entry::Robot(RobotEntry { datagram: full_datagram(k), ..robot(k) }));
    for (bytes, truncated) in
        [(recorded(full.into()), false), (recorded(entries(64)), false), (unfinished(entries(60)), true)]
    {
        let said = told(&python, &bytes);
        let (items, _) = read_items(&bytes);
        let messages = items.iter().filter(|i| matches!(i, Item::Message { .. })).count();
        for words in [
            format!("\"truncated\": {truncated}"),
            "\"decode_errors\": []".to_owned(),
            "\"damage\": []".to_owned(),
            "\"profile\": \"trueline\"".to_owned(),
            format!("\"messages\": {messages}, \"metadata\""),
        ] {
            assert!(said.contains(&words), "{words} is not in {said}");
        }
    }
}
