//! Names and texts of strangers are shown, and not obeyed by the terminal: in files, tables, recordings and on the command line.
#![cfg(unix)]

use crate::common;

use common::trueline;
use std::fs;
use std::path::Path;

/// Clears the screen, sets its title, is red (in C1), goes back, and turns what follows.
const EVIL: &str = "a\x1b[2J\x1b]0;t\x07\u{9b}31m\x08\u{202e}b";

/// Everything that a command wrote: nothing in it is obeyed.
fn shown(folder: &Path, arguments: &[&str]) -> (Option<i32>, String) {
    let output = trueline(folder, arguments);
    let said =
        [&output.stdout[..], &output.stderr[..]].map(|bytes| String::from_utf8(bytes.to_vec()).unwrap());
    for text in &said {
        let obeyed =
            |c: char| c.is_control() && !matches!(c, '\n' | '\t') || ('\u{202a}'..='\u{202e}').contains(&c);
        assert!(!text.contains(obeyed), "{arguments:?}: {text:?}");
    }
    (output.status.code(), said.concat())
}

/// The same; and it gets the earlier name.
fn told(folder: &Path, arguments: &[&str]) -> Option<i32> {
    let (code, said) = shown(folder, arguments);
    assert!(said.contains("[2J"), "{arguments:?} does not show the name: {said}");
    code
}

fn dataset(folder: &Path) {
    let simulate = ["simulate", "--preset", "quick", "--out", EVIL, "--quiet"];
    assert_eq!(shown(folder, &simulate).0, Some(0));
}

#[test]
fn names_of_folders_and_files_are_shown() {
    let place = tempfile::tempdir().unwrap();
    let folder = place.path();
    dataset(folder);
    let [json, html, missing] = [format!("{EVIL}.json"), format!("{EVIL}.html"), format!("{EVIL}-missing")];
    assert_eq!(told(folder, &["calibrate", EVIL, "--json", &json, "--report", &html, "-v"]), Some(0));
    shown(folder, &["calibrate", EVIL, "--json", "-"]);
    shown(folder, &["calibrate", EVIL, EVIL, "--json", "-"]);
    for arguments in [
        &["calibrate", &missing][..],
        &["doctor", &missing],
        &["evaluate", EVIL, "--calibration", &missing],
        &["diff", &json, &missing],
        &["export", &missing, "--as", "kuka"],
        &["apply", &missing, "--calibration", &json, "--out", "points.csv"],
        &["plan", &missing, "--out", "plan"],
        &["scan", &missing],
        &["import", "mcap", &missing, "--out", "imported"],
        &["import", "csv", &missing, "--robot", "abb", "--out", "imported"],
        &["watch", "--state", "cell.sqlite", "--calibration", &json, &missing],
        &["history", "--state", &missing],
        &["features", &missing],
        &["sensor", "intrinsics", &missing, "--board", "chessboard:9x6:25"],
        // Words of the command line that are no names of files.
        &["calibrate", EVIL, &format!("--{EVIL}")],
        &[EVIL],
        &["export", &json, "--as", EVIL],
        &["calibrate", EVIL, "--speed-mm-s", EVIL],
    ] {
        assert_eq!(told(folder, arguments), Some(2), "{arguments:?}");
    }
    shown(folder, &["doctor", EVIL]);
    shown(folder, &["apply", EVIL, "--calibration", &json, "--out", &format!("{EVIL}.csv")]);
    shown(folder, &["evaluate", EVIL, "--calibration", &json, "--json", "-"]);
    shown(
        folder,
        &["watch", "--state", &format!("{EVIL}.sqlite"), "--calibration", &json, EVIL, "--json", "-"],
    );
    shown(folder, &["history", "--state", &format!("{EVIL}.sqlite")]);
}

#[test]
fn texts_in_tables_and_settings_are_shown() {
    let place = tempfile::tempdir().unwrap();
    let folder = place.path();
    dataset(folder);
    fs::rename(folder.join(EVIL), folder.join("scan")).unwrap();
    assert_eq!(shown(folder, &["calibrate", "scan", "--json", "result.json", "--quiet"]).0, Some(0));
    let with = |name: &str, from: &str, to: &str| {
        let file = folder.join("scan").join(name);
        let before = fs::read_to_string(&file).unwrap();
        assert!(before.contains(from), "{name}: {before:.200}");
        fs::write(&file, before.replacen(from, to, 1)).unwrap();
        assert_eq!(told(folder, &["calibrate", "scan"]), Some(2), "{name}: {to:?}");
        fs::write(file, before).unwrap();
    };
    with("robot.csv", "x_mm", &format!("x{EVIL}_mm"));
    with("robot.csv", "\n", &format!("\n{EVIL}"));
    with("features.csv", "u_px", &format!("u{EVIL}_px"));
    with("features.csv", "\n", &format!("\n{EVIL}"));
    let toml = EVIL
        .chars()
        .map(|c| if c.is_ascii_graphic() { c.to_string() } else { format!("\\u{:04x}", u32::from(c)) });
    let toml: String = toml.collect();
    with("sensor.toml", "camera_laser", &toml);
    with("sensor.toml", "kind", &format!("\"{toml}\" = 1\nkind"));
    // A result that another program wrote.
    let result = fs::read_to_string(folder.join("result.json")).unwrap();
    for (from, to) in [("\"translation", format!("\"{toml}")), ("sensor.toml", toml.clone())] {
        fs::write(folder.join("other.json"), result.replace(from, &to)).unwrap();
        for arguments in [
            &["export", "other.json", "--as", "kuka"][..],
            &["diff", "result.json", "other.json", "--json", "-"],
            &["evaluate", "scan", "--calibration", "other.json", "--json", "-"],
        ] {
            shown(folder, arguments);
        }
    }
}

#[test]
fn topics_of_recordings_are_shown() {
    let place = tempfile::tempdir().unwrap();
    let record = |opcode: u8, body: &[u8]| [&[opcode][..], &(body.len() as u64).to_le_bytes(), body].concat();
    let text = |text: &str| [&(text.len() as u32).to_le_bytes(), text.as_bytes()].concat();
    let schema = [&1_u16.to_le_bytes()[..], &text(EVIL), &text("ros2msg"), &text("float64 x")].concat();
    let channel = [&[1, 0, 1, 0][..], &text(&format!("/{EVIL}")), &text("cdr"), &[0; 4]].concat();
    let message = [&1_u16.to_le_bytes()[..], &[0; 20], &[0, 1, 0, 0], &[0; 8]].concat();
    let magic = b"\x89MCAP0\r\n".to_vec();
    let header = [text(EVIL), text(EVIL)].concat();
    let bytes = [
        magic.clone(),
        record(0x01, &header),
        record(0x03, &schema),
        record(0x04, &channel),
        record(0x05, &message),
        record(0x0f, &[0; 4]),
        record(0x02, &[0; 20]),
        magic,
    ]
    .concat();
    fs::write(place.path().join("evil.mcap"), bytes).unwrap();
    assert_eq!(told(place.path(), &["import", "mcap", "evil.mcap", "--out", "imported"]), Some(2));
}
