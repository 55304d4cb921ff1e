//! Streams without a common clock, datasets that are mended, tolerances, calibrations of another cell, and a shell's comforts.

use serde_json::Value;
use std::fs;
use std::path::Path;
use std::process::{Command, Output};
use trueline_dataset::{features_csv, folder, robot_csv};

fn trueline(folder: &Path, line: &str) -> Output {
    let words = line.split_whitespace();
    Command::new(env!("CARGO_BIN_EXE_trueline")).current_dir(folder).args(words).output().unwrap()
}

/// Exit code, stdout and stderr.
fn told(folder: &Path, line: &str) -> (i32, String, String) {
    let output = trueline(folder, line);
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
    (output.status.code().unwrap(), text(output.stdout), text(output.stderr))
}

fn succeeds(folder: &Path, line: &str) -> (String, String) {
    let (code, out, words) = told(folder, line);
    assert_eq!(code, 0, "{line}: {out}{words}");
    (out, words)
}

fn json(file: &Path) -> Value {
    serde_json::from_str(&fs::read_to_string(file).unwrap()).unwrap()
}

#[test]
fn streams_without_a_common_clock_are_aligned_and_the_offset_is_that_of_the_recorded_stamps() {
    let dir = tempfile::tempdir().unwrap();
    succeeds(dir.path(), "simulate --preset quick --out scan --quiet");
    let mut recording = folder::read(&dir.path().join("scan")).unwrap();
    // The camera's clock began 1234.5 s before the robot's.
    recording.features.iter_mut().for_each(|feature| feature.stamp_ns += 1_234_500_000_000);
    let mut csv = Vec::new();
    features_csv::write(&mut csv, &recording.features).unwrap();
    fs::write(dir.path().join("scan/features.csv"), csv).unwrap();
    assert_eq!(told(dir.path(), "calibrate scan").0, 2, "without a word the streams never overlap");

    let (out, words) =
        succeeds(dir.path(), "calibrate scan --align-clocks --json result.json --report page.html");
    assert!(words.contains("the image clock is 1234.5"), "{words}");
    let result = json(&dir.path().join("result.json"));
    let truth_s = recording.truth.unwrap().parameters.time_offset_s;
    let off_s = result["time_offset_s"].as_f64().unwrap() - (1234.5 + truth_s);
    assert!(off_s.abs() < 5.0 * result["sigma"]["time_offset_s"].as_f64().unwrap(), "{off_s}");
    assert!((result["images_ahead_s"].as_f64().unwrap() - 1234.5).abs() < 1.0);
    let rule = result["time_offset_use"]["rule"].as_str().unwrap();
    assert!(rule.starts_with("true exposure = stamp − 12345"), "of the stamps as recorded: {rule}");
    // One number everywhere; where it stands beside its ± it is rounded as that is, to 0.01 ms here.
    let shown = &rule[..rule.rfind('.').unwrap() + 3];
    assert!((out + &words).contains(shown), "{words}");
    assert!(fs::read_to_string(dir.path().join("page.html")).unwrap().contains(shown));
    let (exported, _) = succeeds(dir.path(), "export result.json --as time-offset");
    assert!(exported.contains(rule.trim_start_matches("true exposure = ")), "{exported}");
    // The offset of the stamps as recorded is what the recording is used with.
    succeeds(dir.path(), "apply scan -c result.json -o seam.csv -q");
    assert!(fs::read_to_string(dir.path().join("seam.csv")).unwrap().lines().count() > 100);
    // The same as a dataset of one clock.
    succeeds(dir.path(), "import csv scan --align-clocks --out aligned");
    succeeds(dir.path(), "calibrate aligned -q");
    assert_eq!(told(dir.path(), "calibrate scan scan --align-clocks").0, 2);
}

#[test]
fn doctor_writes_the_dataset_without_the_mistake() {
    let dir = tempfile::tempdir().unwrap();
    succeeds(dir.path(), "simulate --preset quick --out scan --quiet");
    let mut recording = folder::read(&dir.path().join("scan")).unwrap();
    recording.robot.iter_mut().for_each(|sample| sample.base_from_tool = sample.base_from_tool.inverse());
    let mut csv = Vec::new();
    robot_csv::write(&mut csv, &recording.robot).unwrap();
    fs::write(dir.path().join("scan/robot.csv"), csv).unwrap();
    // A refusal begins with the cause.
    let (code, _, words) =
        told(dir.path(), "calibrate scan --json refused.json --report refused.html --quiet");
    let refused = fs::read_to_string(dir.path().join("refused.json")).unwrap();
    assert!(refused.contains("\"probable_cause\": \"the poses are tool_from_base"), "{refused:.2000}");
    let page = fs::read_to_string(dir.path().join("refused.html")).unwrap();
    assert!(page.contains("Probable cause") && page.contains("the poses are tool_from_base"));
    assert!(
        code == 1 && words.starts_with("not accepted: probable cause: the poses are tool_from_base"),
        "{words}"
    );
    let (code, out, words) = told(dir.path(), "doctor scan --fix mended");
    assert_eq!(code, 1);
    assert!(out.contains("the poses are tool_from_base") && words.contains("inverted poses"), "{out}{words}");
    assert!(out.contains("other mistakes ruled out") && !out.contains("u mirrored"), "{out}");
    succeeds(dir.path(), "calibrate mended --quiet");
    // Correct data are not changed.
    let (code, _, words) = told(dir.path(), "doctor mended --fix again");
    assert!(code == 0 && words.contains("nothing to fix"), "{words}");
    assert!(!dir.path().join("again").exists());
    assert!(told(dir.path(), "doctor scan --verbose").1.contains("if undone: u mirrored"));
}

#[test]
fn evaluate_holds_a_scan_against_a_tolerance_and_knows_a_calibration_of_another_cell() {
    let dir = tempfile::tempdir().unwrap();
    succeeds(dir.path(), "simulate --preset quick --out scan --quiet");
    succeeds(dir.path(), "calibrate scan --json result.json --quiet");
    let (_, words) = succeeds(dir.path(), "evaluate scan -c result.json --tolerance 1mm --json passed.json");
    assert!(words.contains("Passed: ") && words.contains("within 1 mm"), "{words}");
    let passed = json(&dir.path().join("passed.json"));
    assert_eq!((&passed["tolerance"]["passed"], &passed["other_cell"]), (&true.into(), &Value::Null));
    assert_eq!(passed["differs"], Value::Null);
    // Effects that another cell would not explain are reported without a failure: too small a shift, and a delay of 7
    // ms.
    for (key, shift_mm, delay_s) in [("shift", 3.0, 0.0), ("delay", 0.0, 0.007)] {
        let mut wrong = json(&dir.path().join("result.json"));
        let x = wrong["tool_from_camera"]["translation_mm"][0].as_f64().unwrap();
        wrong["tool_from_camera"]["translation_mm"][0] = (x + shift_mm).into();
        wrong["time_offset_s"] = (wrong["time_offset_s"].as_f64().unwrap() + delay_s).into();
        fs::write(dir.path().join("wrong.json"), wrong.to_string()).unwrap();
        let (_, words) = succeeds(dir.path(), "evaluate scan -c wrong.json --json differs.json");
        assert!(words.contains("warning: this calibration does not match this scan"), "{key}: {words}");
        let told = json(&dir.path().join("differs.json"));
        assert_eq!(told["other_cell"], Value::Null, "{key}");
        // The scan's own calibration minus the wrong one, to a tenth of the added error: far more than ten of its ±.
        let found = [told["differs"]["shift_mm"].as_f64(), told["differs"]["time_offset_s"].as_f64()];
        assert!((found[0].unwrap() - shift_mm).abs() < 0.3, "{key}: {found:?}");
        assert!((found[1].unwrap() + delay_s).abs() < 0.0007, "{key}: {found:?}");
    }
    let (code, _, words) =
        told(dir.path(), "evaluate scan -c result.json --tolerance 1um --report report.html");
    assert!(code == 1 && words.contains("NOT passed: "), "{words}");
    assert!(fs::read_to_string(dir.path().join("report.html")).unwrap().contains("NOT passed"));
    assert_eq!(told(dir.path(), "evaluate scan -c result.json --tolerance 1").0, 2);

    let mut other = json(&dir.path().join("result.json"));
    let x = other["tool_from_camera"]["translation_mm"][0].as_f64().unwrap();
    other["tool_from_camera"]["translation_mm"][0] = (x + 40.0).into();
    fs::write(dir.path().join("other.json"), other.to_string()).unwrap();
    let (code, _, words) = told(dir.path(), "evaluate scan -c other.json");
    assert!(
        code == 1 && words.contains("does not belong to this scan") && words.contains("40.0 mm"),
        "{words}"
    );
    // A move of 2 mm is real, and harmless where 5 mm are allowed.
    other["tool_from_camera"]["translation_mm"][0] = (x + 2.0).into();
    fs::write(dir.path().join("other.json"), other.to_string()).unwrap();
    assert_eq!(told(dir.path(), "diff result.json other.json -q").0, 1);
    assert_eq!(told(dir.path(), "diff result.json other.json --tolerance 5mm -q").0, 0);
    let (code, _, words) = told(dir.path(), "diff result.json other.json --tolerance 1mm");
    assert!(code == 1 && words.contains("BEYOND the tolerance of 1 mm"), "{words}");
}

/// One sensor, once with the file that is off and once with the file as the scan corrected it: the bracket has not moved.
#[test]
fn the_file_of_the_sensor_is_told_from_the_bracket() {
    let dir = tempfile::tempdir().unwrap();
    succeeds(dir.path(), "simulate -p good --fault plane-offset=1 -o scan -q");
    succeeds(dir.path(), "calibrate scan -q --json stated.json");
    let stated_sha256 = file_of(dir.path(), "stated.json")["sha256"].clone();
    succeeds(dir.path(), "calibrate scan -q --json off.json --write-sensor corrected.toml");
    let off = file_of(dir.path(), "off.json");
    assert!(off["name"] == "corrected.toml" && off["corrected"] == true && off["sha256"] != stated_sha256);
    // With the stated file its transform is used no further without a word.
    let (code, _, words) = told(dir.path(), "apply scan -c off.json --out seam.csv -q");
    assert!(code == 0 && words.contains("belongs to (corrected.toml)"), "{words}");
    fs::copy(dir.path().join("corrected.toml"), dir.path().join("scan/sensor.toml")).unwrap();
    let (_, words) = succeeds(dir.path(), "apply scan -c off.json --out seam.csv -q");
    assert!(!words.contains("belongs to"), "{words}");
    succeeds(dir.path(), "calibrate scan -q --json right.json");
    let (code, table, words) = told(dir.path(), "diff off.json right.json");
    assert!(code == 0 && !words.contains("different sensor files"), "{table}{words}");
    let words = told(dir.path(), "diff stated.json right.json").2;
    assert!(words.contains("different sensor files"), "{words}");
    let (_, words) = succeeds(dir.path(), "export off.json --as matrix");
    assert!(words.contains("belongs to the sensor file corrected.toml"), "{words}");
}

/// The result's statement about the sensor file of its transform.
fn file_of(at: &Path, result: &str) -> serde_json::Value {
    let result: serde_json::Value = serde_json::from_slice(&fs::read(at.join(result)).unwrap()).unwrap();
    let text = result.to_string();
    // One transform: no other key has one, rivals aside.
    assert!(!text.contains("corrected_tool_from_camera") && !text.contains("uncorrected"), "{text}");
    result["sensor"]["file"].clone()
}

#[test]
fn shells_complete_manuals_are_written_and_colours_can_be_asked_for() {
    let dir = tempfile::tempdir().unwrap();
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let (script, _) = succeeds(dir.path(), &format!("completions {shell}"));
        assert!(script.contains("calibrate") && script.contains("align-clocks"), "{shell}");
    }
    succeeds(dir.path(), "man --out man");
    for page in
        ["trueline.1", "trueline-calibrate.1", "trueline-import-csv.1", "trueline-sensor-intrinsics.1"]
    {
        let text = fs::read_to_string(dir.path().join("man").join(page)).unwrap();
        assert!(text.contains(".SH NAME") && text.contains(".SH SYNOPSIS"), "{page}");
    }
    succeeds(dir.path(), "simulate -p quick -o scan -q");
    let always = succeeds(dir.path(), "calibrate scan --color always").0;
    let never = succeeds(dir.path(), "calibrate scan --color never").0;
    assert!(always.contains("\u{1b}[32m") && !never.contains('\u{1b}'));
}

/// The widest terminal that is promised to do, in columns.
const WIDEST: usize = 100;

#[test]
fn no_line_of_help_is_wider_than_a_hundred_columns() {
    let dir = tempfile::tempdir().unwrap();
    succeeds(dir.path(), "man --out man");
    let pages = fs::read_dir(dir.path().join("man")).unwrap();
    let mut too_wide = Vec::new();
    for page in pages {
        let name = page.unwrap().file_name().into_string().unwrap();
        let command = name
            .trim_end_matches(".1")
            .trim_start_matches("trueline")
            .trim_start_matches("-testbench")
            .replacen('-', " ", 1);
        // Names of commands have hyphens too: `sensor-intrinsics` is two words, `robot-sim` one.
        let line = match command.trim() {
            two if two.starts_with("sensor-") || two.starts_with("import-") => two.replacen('-', " ", 1),
            one => one.to_owned(),
        };
        let (help, _) = succeeds(dir.path(), &format!("{line} --help"));
        let wide = help.lines().filter(|line| line.chars().count() > WIDEST);
        too_wide.extend(wide.map(|line| format!("{name}: {line}")));
    }
    assert!(too_wide.is_empty(), "{}", too_wide.join("\n"));
}

#[test]
fn folders_appear_whole_and_are_replaced_on_request_alone() {
    let dir = tempfile::tempdir().unwrap();
    // Remains of an interrupted run do no harm.
    fs::create_dir(dir.path().join("scan.unfinished")).unwrap();
    fs::write(dir.path().join("scan.unfinished/robot.csv"), "half").unwrap();
    succeeds(dir.path(), "simulate -p quick -o scan -q");
    assert!(!dir.path().join("scan.unfinished").exists());
    let (code, _, words) = told(dir.path(), "simulate -p profiler -o scan -q");
    assert!(code == 2 && words.contains("already exists") && words.contains("--force"), "{words}");
    succeeds(dir.path(), "simulate -p profiler -o scan -q --force");
    assert!(fs::read_to_string(dir.path().join("scan/sensor.toml")).unwrap().contains("profiler"));
    // The earlier file may be somebody's recording.
    let former = fs::read_to_string(dir.path().join("scan.replaced-1/sensor.toml")).unwrap();
    assert!(former.contains("camera_laser"), "{former}");
    fs::remove_dir_all(dir.path().join("scan.replaced-1")).unwrap();
    // A folder with anything else in it is not trueline's to remove.
    fs::write(dir.path().join("scan/notes.txt"), "mine").unwrap();
    let (code, _, words) = told(dir.path(), "simulate -p quick -o scan -q --force");
    assert!(code == 2 && words.contains("`notes.txt` in this folder would be lost"), "{words}");
    assert_eq!(fs::read_to_string(dir.path().join("scan/notes.txt")).unwrap(), "mine");
    let left: Vec<_> = fs::read_dir(dir.path()).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    assert_eq!(left, ["scan"], "nothing unfinished is left");
}

#[test]
fn output_is_checked_before_the_work() {
    let dir = tempfile::tempdir().unwrap();
    succeeds(dir.path(), "simulate -p quick -o scan -q");
    for (line, words) in [
        ("calibrate scan --report scan", "scan: is a folder"),
        ("calibrate scan --json nowhere/result.json", "there is no folder `nowhere`"),
        ("calibrate scan --write-sensor scan", "scan: is a folder"),
        ("apply scan -c scan/truth.toml -o nowhere/seam.csv", "there is no folder `nowhere`"),
        ("evaluate scan -c scan/truth.toml --csv scan", "scan: is a folder"),
    ] {
        let (code, out, told) = told(dir.path(), line);
        assert!(code == 2 && out.is_empty() && told.contains(words), "{line}: {told}");
    }
}

#[test]
fn reasons_are_told_with_quiet_and_more_with_verbose_and_no_line_is_long() {
    let dir = tempfile::tempdir().unwrap();
    succeeds(dir.path(), "simulate -p constant-attitude -o still -q");
    let (code, out, words) = told(dir.path(), "calibrate still -q");
    assert!(code == 1 && out.is_empty() && words.contains("not accepted: translation along"), "{words}");
    succeeds(dir.path(), "simulate -p quick -o scan -q");
    let (said, words) = succeeds(dir.path(), "calibrate scan -v -j result.json");
    for part in ["read: ", "calibrate: ", "written: file result.json"] {
        assert!(words.contains(part), "{part}: {words}");
    }
    assert!(said.lines().all(|line| line.chars().count() <= 100), "{said}");
    let seam_error = said.find("seam error").unwrap();
    assert!(seam_error < said.find("time offset").unwrap(), "the error of a seam point comes first");
    assert!(!succeeds(dir.path(), "calibrate scan").1.contains("read: "));
}

#[test]
fn the_demo_keeps_its_scan_and_says_what_to_try_next() {
    let dir = tempfile::tempdir().unwrap();
    let (said, _) = succeeds(dir.path(), "demo");
    assert!(said.contains("in standard deviations: time offset") && said.contains("Try next:"), "{said}");
    succeeds(dir.path(), "calibrate trueline-demo/scan -q");
    succeeds(dir.path(), "export trueline-demo/result.json --as kuka -q");
    succeeds(dir.path(), "apply trueline-demo/scan -c trueline-demo/result.json -o seam.csv -q");
    succeeds(dir.path(), "apply trueline-demo/scan -c trueline-demo/result.json -o seam.mcap -q");
    assert!(fs::read(dir.path().join("seam.mcap")).unwrap().starts_with(b"\x89MCAP"));
    // A second run replaces what the first wrote and touches nothing else.
    fs::write(dir.path().join("trueline-demo/mine.txt"), "kept").unwrap();
    succeeds(dir.path(), "demo -q");
    assert!(dir.path().join("trueline-demo/mine.txt").exists());
}

/// A row with some of its numbers multiplied and shifted; a header stays.
fn scaled(line: &str, factor: f64, columns: std::ops::Range<usize>, shift: f64) -> String {
    let fields = line.split(',').enumerate().map(|(k, field)| match field.parse::<f64>() {
        Ok(number) if columns.contains(&k) => format!("{}", number * factor + shift),
        _ => field.to_owned(),
    });
    fields.collect::<Vec<_>>().join(",")
}

#[test]
fn mistakes_with_files_are_told_as_what_they_are() {
    let dir = tempfile::tempdir().unwrap();
    succeeds(dir.path(), "simulate -p quick -o scan -q");
    let copy = |name: &str| {
        let folder = dir.path().join(name);
        fs::create_dir(&folder).unwrap();
        for file in ["robot.csv", "features.csv", "sensor.toml"] {
            fs::copy(dir.path().join("scan").join(file), folder.join(file)).unwrap();
        }
        folder
    };
    let swapped = copy("swapped");
    fs::rename(swapped.join("robot.csv"), swapped.join("x")).unwrap();
    fs::rename(swapped.join("features.csv"), swapped.join("robot.csv")).unwrap();
    fs::rename(swapped.join("x"), swapped.join("features.csv")).unwrap();
    let headless = copy("headless");
    let text = fs::read_to_string(headless.join("robot.csv")).unwrap();
    fs::write(headless.join("robot.csv"), text.split_once('\n').unwrap().1).unwrap();
    let latin = copy("latin");
    let mut bytes = b"# 5 \xb5m\n".to_vec();
    bytes.extend(fs::read(latin.join("sensor.toml")).unwrap());
    fs::write(latin.join("sensor.toml"), bytes).unwrap();
    let typo = copy("typo");
    let text = fs::read_to_string(typo.join("sensor.toml")).unwrap();
    fs::write(typo.join("sensor.toml"), text.replace("width = ", "widht = ")).unwrap();
    let changed = |name: &str, file: &str, row: &dyn Fn(usize, &str) -> String| {
        let file = copy(name).join(file);
        let text = fs::read_to_string(&file).unwrap();
        let rows: Vec<String> = text.lines().enumerate().map(|(k, line)| row(k, line)).collect();
        fs::write(file, rows.join("\n") + "\n").unwrap();
    };
    changed("renamed", "robot.csv", &|_, line| line.replace("x_mm,y_mm,z_mm", "X,Y,Z"));
    changed("metres", "robot.csv", &|k, line| scaled(line, if k > 0 { 1e-3 } else { 1.0 }, 1..4, 0.0));
    changed("late", "features.csv", &|k, line| scaled(line, 1.0, 0..1, if k > 0 { 500.0 } else { 0.0 }));
    for (line, words, hint) in [
        ("calibrate swapped", "robot.csv, line 1: has the columns of features.csv", "are swapped"),
        ("calibrate headless", "robot.csv, line 1: there is no header", "the first line names the columns"),
        ("calibrate latin", "sensor.toml: is not UTF-8 text", "save it as UTF-8"),
        ("calibrate typo", "sensor.toml, line 4: column 1: unknown field `widht`", "compare with a file"),
        ("calibrate renamed", "column `X`: unknown column", "is it `x_mm`?"),
        ("calibrate metres", "all positions of the robot lie within 0.2", "check whether they are metres"),
        ("calibrate late", "do not overlap in time", "--align-clocks"),
        ("features scan", "there are no pictures", "they are not needed"),
        ("import lvs-st-calib nowhere --out x", "there is no folder `nowhere`", "check its name"),
        ("callibrate scan", "unrecognized subcommand", "'calibrate', 'evaluate'"),
        ("calibrate scan --initial gess.toml", "gess.toml: this file does not exist", "check its name"),
    ] {
        let (code, _, told) = told(dir.path(), line);
        // Metres under a name that says mm calibrate, to something that is not accepted.
        let expected = if line.ends_with("metres") { 1 } else { 2 };
        assert!(code == expected && told.contains(words) && told.contains(hint), "{line}: {told}");
    }
}

/// Lines are broken for a terminal; piped lines stay whole, for line-by-line searches.
#[test]
fn words_fit_the_terminal() {
    let dir = tempfile::tempdir().unwrap();
    let said = |columns: Option<&str>| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_trueline"));
        command.current_dir(dir.path()).args(["calibrate", "."]).env_remove("COLUMNS");
        if let Some(columns) = columns {
            command.env("COLUMNS", columns);
        }
        String::from_utf8(command.output().unwrap().stderr).unwrap()
    };
    let widest = |text: &str| text.lines().map(|line| line.chars().count()).max().unwrap();
    assert!(widest(&said(None)) > WIDEST, "or nothing is shown here: {}", said(None));
    for columns in [80, WIDEST] {
        let text = said(Some(&columns.to_string()));
        assert!(widest(&text) <= columns, "{text}");
        let words = |text: &str| text.split_whitespace().map(str::to_owned).collect::<Vec<_>>();
        assert_eq!(words(&text), words(&said(None)), "no word is lost");
    }
}
