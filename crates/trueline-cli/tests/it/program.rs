//! The program as a user runs it: exit codes, output, files.

use crate::common;

use common::{code, trueline, words};
use serde_json::Value;
use std::fs;
use std::path::Path;
use std::process::Command;

fn calibrate_json(folder: &Path, arguments: &[&str]) -> (i32, Value) {
    let mut all = vec!["calibrate"];
    all.extend(arguments);
    all.extend(["--json", "-", "--quiet"]);
    let output = trueline(folder, &all);
    // With --quiet the reasons are all that is said.
    let told = String::from_utf8_lossy(&output.stderr);
    assert!(told.lines().all(|line| line.starts_with("not accepted: ")), "{told}");
    assert_eq!(told.is_empty(), code(&output) == 0, "{told}");
    (code(&output), serde_json::from_slice(&output.stdout).unwrap())
}

#[test]
fn demo_writes_its_report() {
    let dir = tempfile::tempdir().unwrap();
    let output = trueline(dir.path(), &["demo"]);
    assert_eq!(code(&output), 0);
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(
        text.contains("Calibration accepted") && text.contains("ms  (images are stamped late)"),
        "{text}"
    );
    let report = fs::read_to_string(dir.path().join("trueline-demo/report.html")).unwrap();
    assert!(report.starts_with("<!doctype html>") && !report.contains("{{"), "unfilled placeholder");
    // Self-contained: nothing is loaded from anywhere.
    assert!(!report.contains("src=\"http") && !report.contains("href=\"http"));
}

#[test]
fn simulated_devices_are_commands_of_a_second_program_and_of_this_one() {
    let help = |program: &str| Command::new(program).args(["robot-sim", "--help"]).output().unwrap().stdout;
    let told = String::from_utf8(help(env!("CARGO_BIN_EXE_trueline-testbench"))).unwrap();
    assert!(told.contains("Usage: trueline-testbench robot-sim"), "{told}");
    assert_eq!(help(env!("CARGO_BIN_EXE_trueline")), told.into_bytes());
}

#[test]
fn simulate_and_calibrate_follow_the_schema() {
    let dir = tempfile::tempdir().unwrap();
    assert_eq!(
        code(&trueline(dir.path(), &["simulate", "--preset", "two-lines", "--out", "scan", "--quiet"])),
        0
    );
    let (exit, result) = calibrate_json(dir.path(), &["scan"]);
    assert_eq!((exit, result["status"].as_str()), (0, Some("accepted")));
    assert_eq!(result["schema_version"], 3);
    assert_eq!(result["tool"]["name"], "trueline");
    assert!((result["time_offset_s"].as_f64().unwrap() - 0.01773).abs() < 1e-3);
    for (key, length) in [("translation_mm", 3), ("rotation_wxyz", 4)] {
        assert_eq!(result["tool_from_camera"][key].as_array().unwrap().len(), length);
    }
    assert_eq!(result["lines"].as_array().unwrap().len(), 2);
    assert_eq!(result["lines"][1]["orthonormal"].as_array().unwrap().len(), 4);
    assert_eq!(result["lines"][0]["pluecker"]["moment_mm"].as_array().unwrap().len(), 3);
    let three = |v: &Value| [0, 1, 2].map(|k| v[k].as_f64().unwrap());
    let (p, v) = (three(&result["lines"][0]["point_mm"]), three(&result["lines"][0]["direction"]));
    let moment = three(&result["lines"][0]["pluecker"]["moment_mm"]);
    // Moment = point × direction, the first component written out; points of a metre, 1e-16 each.
    assert!((moment[0] - (p[1] * v[2] - p[2] * v[1])).abs() < 1e-9, "{moment:?}");
    let order = result["covariance"]["order"].as_array().unwrap();
    assert_eq!(order.len(), 15);
    // The covariance and the sigmas say the same, in the units of their names.
    let index = order.iter().position(|name| name == "translation_x_mm").unwrap();
    let variance = result["covariance"]["matrix"][index][index].as_f64().unwrap();
    let sigma = result["sigma"]["translation_mm"][0].as_f64().unwrap();
    assert!((variance.sqrt() / sigma - 1.0).abs() < 1e-12);
    assert_eq!(result["observability"]["rank"], 15);
    assert_eq!(result["inputs"]["robot.csv"].as_str().unwrap().len(), 64);
    assert!(!result["iterations"].as_array().unwrap().is_empty());
}

#[test]
fn what_is_not_seen_is_null_and_exits_1() {
    let dir = tempfile::tempdir().unwrap();
    let simulate = ["simulate", "--preset", "constant-attitude", "--out", "scan", "--quiet"];
    assert_eq!(code(&trueline(dir.path(), &simulate)), 0);
    let (exit, result) = calibrate_json(dir.path(), &["scan"]);
    assert_eq!((exit, result["status"].as_str()), (1, Some("not_accepted")));
    assert!(result["tool_from_camera"]["translation_mm"].as_array().unwrap().iter().all(Value::is_null));
    assert!(result["sigma"]["translation_mm"].as_array().unwrap().iter().all(Value::is_null));
    assert!(result["time_offset_s"].is_f64());
    let unobservable = result["observability"]["unobservable"].as_array().unwrap();
    assert!(unobservable.iter().any(|u| u["parameter"] == "hand_eye_translation"));
    assert!(!result["reasons"].as_array().unwrap().is_empty());
}

#[test]
fn a_guess_and_a_hold() {
    let dir = tempfile::tempdir().unwrap();
    assert_eq!(code(&trueline(dir.path(), &["simulate", "--out", "scan", "--quiet"])), 0);
    let truth = fs::read_to_string(dir.path().join("scan/truth.toml")).unwrap();
    let guess: String = truth.split("[[lines]]").next().unwrap().replace("0.01773", "0.0");
    fs::write(dir.path().join("guess.toml"), guess).unwrap();
    let (_, free) = calibrate_json(dir.path(), &["scan", "--initial", "guess.toml"]);
    // The fit is repeated with measured noise, with the stamps' choice and with the bias, about five steps each.
    assert!(free["iterations"].as_array().unwrap().len() <= 30);
    assert_eq!(free["iterations"][0]["time_offset_s"], 0.0);
    let (_, held) = calibrate_json(dir.path(), &["scan", "--initial", "guess.toml", "--fix", "time-offset"]);
    assert_eq!(held["time_offset_s"], 0.0);
    assert!(held["sigma"]["time_offset_s"].is_null());
}

/// The paper's residual has no edge and no waves: statements about them would be ignored. It assumes that there are none.
#[test]
fn the_papers_residual_refuses_a_seam_that_it_does_not_know() {
    let dir = tempfile::tempdir().unwrap();
    assert_eq!(
        code(&trueline(dir.path(), &["simulate", "--preset", "quick", "--out", "scan", "--quiet"])),
        0
    );
    for option in ["--edge-radius-mm", "--waviness-mm"] {
        let with = |mm: &str| {
            let asked = ["calibrate", "scan", "--quiet", "--residual", "point-to-line", option, mm];
            trueline(dir.path(), &asked)
        };
        let refused = with("0.1");
        assert_eq!(code(&refused), 2);
        assert!(
            words(&refused).contains(&format!("`{option}`: the point-to-line residual")),
            "{}",
            words(&refused)
        );
        assert_ne!(code(&with("0")), 2);
    }
}

/// The preset's seam through two of its points; their uncertainty is a part of the seam error.
#[test]
fn a_seam_is_held_where_a_drawing_has_it() {
    let dir = tempfile::tempdir().unwrap();
    assert_eq!(code(&trueline(dir.path(), &["simulate", "--out", "scan", "--quiet"])), 0);
    let drawn = "1051.476,62.909,118.995:1248.524,97.091,121.005";
    let held_mm = |sigma_mm: &str| {
        let words = ["scan", "--drawn-line", drawn, "--drawn-line-sigma-mm", sigma_mm];
        let (_, result) = calibrate_json(dir.path(), &words);
        let line = &result["options"]["drawn_lines"][0];
        assert_eq!(line["anchor_mm"][0], 1051.476, "{line}");
        assert_eq!(line["offset_sigma_mm"].as_f64().unwrap().to_string(), sigma_mm);
        result["seam_error"]["budget_mm"]["held"].as_f64().unwrap()
    };
    // It is linear in the statement about the points.
    let (coarse, fine) = (held_mm("0.5"), held_mm("0.05"));
    assert!(fine > 0.0 && (coarse / fine - 10.0).abs() < 0.01, "{coarse} {fine}");
    let missing = trueline(dir.path(), &["calibrate", "scan", "--drawn-line", drawn]);
    assert_eq!(code(&missing), 2);
}

#[test]
fn a_wanted_accuracy_that_is_not_met_exits_1_with_the_reason() {
    let dir = tempfile::tempdir().unwrap();
    assert_eq!(code(&trueline(dir.path(), &["simulate", "--out", "scan", "--quiet"])), 0);
    let (met, _) =
        calibrate_json(dir.path(), &["scan", "--require", "time=1ms,translation=2mm,rotation=1deg"]);
    assert_eq!(met, 0);
    let (missed, result) = calibrate_json(dir.path(), &["scan", "--require", "translation=0.001mm"]);
    assert_eq!(missed, 1);
    assert_eq!(result["reasons"][0]["code"], "requirement-missed");
    assert_eq!(result["reasons"][0]["required_mm"], 0.001);
    let reason = result["reasons"][0]["text"].as_str().unwrap();
    assert!(reason.contains("translation") && reason.contains("0.001 mm"), "{reason}");
    // The numbers are there all the same.
    assert!(result["tool_from_camera"]["translation_mm"][0].is_f64());
    assert_eq!(code(&trueline(dir.path(), &["calibrate", "scan", "--require", "time=1mm"])), 2);
}

#[test]
fn accepting_partial_results_holds_the_unseen_at_the_guess_and_says_so() {
    let dir = tempfile::tempdir().unwrap();
    let simulate = ["simulate", "--preset", "constant-attitude", "--out", "scan", "--quiet"];
    assert_eq!(code(&trueline(dir.path(), &simulate)), 0);
    let truth = fs::read_to_string(dir.path().join("scan/truth.toml")).unwrap();
    fs::write(dir.path().join("guess.toml"), truth.split("[[lines]]").next().unwrap()).unwrap();
    let (exit, result) = calibrate_json(dir.path(), &["scan", "--accept-partial", "--initial", "guess.toml"]);
    assert_eq!((exit, result["status"].as_str()), (0, Some("accepted")));
    assert_eq!(result["observability"]["held_at_guess"], true);
    // Without a guess there is nothing to hold anything at.
    assert_eq!(code(&trueline(dir.path(), &["calibrate", "scan", "--accept-partial"])), 2);
}

#[test]
fn stamps_as_recorded_or_regularised() {
    let dir = tempfile::tempdir().unwrap();
    assert_eq!(code(&trueline(dir.path(), &["simulate", "--out", "scan", "--quiet"])), 0);
    let (_, raw) = calibrate_json(dir.path(), &["scan", "--stamps", "raw"]);
    let (_, regular) = calibrate_json(dir.path(), &["scan", "--stamps", "regular"]);
    assert_eq!(raw["stamps"]["features"]["used"], "raw");
    assert_eq!(regular["stamps"]["features"]["used"], "regular");
    // The preset's 0.1 ms of jitter is found either way.
    let jitter_s = raw["stamps"]["features"]["jitter_s"].as_f64().unwrap();
    assert!((5e-5..2e-4).contains(&jitter_s), "{jitter_s}");
    assert!(raw["sigma_noise"]["time_offset_s"].as_f64() > regular["sigma_noise"]["time_offset_s"].as_f64());
}

#[test]
fn the_doctor_names_the_mistake() {
    let dir = tempfile::tempdir().unwrap();
    assert_eq!(code(&trueline(dir.path(), &["simulate", "--out", "scan", "--quiet"])), 0);
    let healthy = trueline(dir.path(), &["doctor", "scan"]);
    assert_eq!(code(&healthy), 0);
    let robot = dir.path().join("scan/robot.csv");
    let text = fs::read_to_string(&robot).unwrap();
    fs::write(&robot, text.replacen("x_mm,y_mm,z_mm", "x_m,y_m,z_m", 1)).unwrap();
    let ill = trueline(dir.path(), &["doctor", "scan"]);
    assert_eq!(code(&ill), 1);
    let words = String::from_utf8(ill.stdout).unwrap();
    assert!(words.contains("they are millimetres"), "{words}");
    let json = trueline(dir.path(), &["doctor", "scan", "--quiet", "--json", "-"]);
    let found: Value = serde_json::from_slice(&json.stdout).unwrap();
    assert!(found["findings"][0].as_str().unwrap().contains("millimetres"));
    assert_eq!(code(&trueline(dir.path(), &["doctor", "nowhere"])), 2);
}

#[test]
fn bad_input_exits_2_and_writes_nothing() {
    let dir = tempfile::tempdir().unwrap();
    let output =
        trueline(dir.path(), &["calibrate", "nothing", "--json", "out.json", "--report", "out.html"]);
    assert_eq!(code(&output), 2);
    let words = String::from_utf8(output.stderr).unwrap();
    assert!(words.starts_with("error: there is no file or folder `nothing`\n\nhint: "), "{words}");
    assert!(output.stdout.is_empty());
    assert!(!dir.path().join("out.json").exists() && !dir.path().join("out.html").exists());
    assert_eq!(code(&trueline(dir.path(), &["calibrate"])), 2);
    assert_eq!(code(&trueline(dir.path(), &["simulate", "--out", "x", "--duration-s", "nan"])), 2);
    assert!(!dir.path().join("x").exists());
    // A dataset is never written over.
    assert_eq!(code(&trueline(dir.path(), &["simulate", "--out", "scan", "--quiet"])), 0);
    assert_eq!(code(&trueline(dir.path(), &["simulate", "--out", "scan", "--quiet"])), 2);
}

#[test]
fn help_shows_examples() {
    let dir = tempfile::tempdir().unwrap();
    for command in [vec!["--help"], vec!["calibrate", "--help"], vec!["import", "csv", "--help"]] {
        let output = trueline(dir.path(), &command);
        assert_eq!(code(&output), 0);
        assert!(String::from_utf8(output.stdout).unwrap().contains("Example"), "{command:?}");
    }
}

/// The fields that the judge of shop cells reads.
const OF_THE_JUDGE: [&str; 12] = [
    "good_scan",
    "time_offset_s",
    "time_offset_interval_s",
    "tool_from_camera",
    "t0_s",
    "speed_mm_s",
    "points_in_tool_mm",
    "velocity_in_tool",
    "reported_rotation",
    "reported_position_mm",
    "torch_reference_mm",
    "torch_reached",
];

#[test]
fn a_cell_of_a_shop_comes_with_its_check_pass() {
    let dir = tempfile::tempdir().unwrap();
    let shop = ["simulate", "--shop", "calm", "--seed", "4", "--only", "rounded-edge", "--out", "cell"];
    let output = trueline(dir.path(), &shop);
    assert_eq!(code(&output), 0, "{}", words(&output));
    assert!(words(&output).contains("a calm shop, rounded-edge alone"), "{}", words(&output));
    let text = fs::read_to_string(dir.path().join("cell/check/truth.json")).unwrap();
    let truth: Value = serde_json::from_str(&text).unwrap();
    for field in OF_THE_JUDGE {
        assert!(truth.get(field).is_some_and(|value| !value.is_null()), "{field}");
    }
    assert_eq!(truth["errors"].as_object().unwrap().len(), 1);
    calibrate_json(dir.path(), &["cell"]);
    fs::write(dir.path().join("result.json"), "").unwrap();
    let applied = trueline(dir.path(), &["calibrate", "cell", "--json", "result.json", "--quiet"]);
    assert!(code(&applied) < 2, "{}", words(&applied));
    // The same cell may be written once more, over itself alone.
    assert_eq!(code(&trueline(dir.path(), &[&shop[..], &["--force"]].concat())), 0);
    assert!(!dir.path().join("cell.replaced-1").exists());
}

/// Seed 2 is a camera or a profiler: it has stripes with --plates alone.
#[test]
fn a_shop_with_plates_writes_stripes() {
    let dir = tempfile::tempdir().unwrap();
    for (out, plates) in [("without", &[][..]), ("with", &["--plates"])] {
        let command = ["simulate", "--shop", "calm", "--seed", "2", "--quiet", "--out", out];
        let output = trueline(dir.path(), &[&command[..], plates].concat());
        assert_eq!(code(&output), 0, "{}", words(&output));
        assert_eq!(dir.path().join(out).join("stripes.csv").exists(), out == "with");
    }
}

#[test]
fn a_shop_refuses_options_that_it_would_not_use() {
    let dir = tempfile::tempdir().unwrap();
    let others: [&[&str]; 7] = [
        &["--preset", "good"],
        &["--plates", "--bow-mm", "0.2"],
        &["--outliers", "0.2"],
        &["--time-offset-ms", "5"],
        &["--fault", "focal"],
        &["--tilt-deg", "5"],
        &["--boards", "chessboard:9x6:20"],
    ];
    for other in others {
        let output = trueline(dir.path(), &[&["simulate", "--shop", "calm", "--out", "x"], other].concat());
        assert!(
            code(&output) == 2 && words(&output).contains("cannot be used with"),
            "{other:?}: {}",
            words(&output)
        );
    }
    let alone = trueline(dir.path(), &["simulate", "--only", "bow", "--out", "x"]);
    assert!(code(&alone) == 2 && words(&alone).contains("--shop"), "{}", words(&alone));
    let both = ["simulate", "--shop", "calm", "--only", "linearity,intrinsics", "--out", "x"];
    let both = trueline(dir.path(), &both);
    assert!(code(&both) == 2 && words(&both).contains("cannot have it"), "{}", words(&both));
    assert!(!dir.path().join("x").exists());
}
