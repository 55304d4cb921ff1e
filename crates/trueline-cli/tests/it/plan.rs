//! Planning as a user does it.

use crate::common;

use common::{code, trueline};
use serde_json::Value;
use std::fs;
use std::path::Path;

fn json(file: &Path) -> Value {
    serde_json::from_str(&fs::read_to_string(file).unwrap()).unwrap()
}

#[test]
fn a_planned_scan_is_simulated_calibrated_and_planned_again() {
    let dir = tempfile::tempdir().unwrap();
    let few = ["--tries", "800", "--shape", "three-passes", "--quiet"];
    let languages = ["--program", "rapid,krl,urscript,ls,csv"];
    let planned =
        trueline(dir.path(), &[&["plan", "--example", "--out", "plan"][..], &few, &languages].concat());
    assert_eq!(code(&planned), 0, "{}", String::from_utf8_lossy(&planned.stderr));
    for file in ["path.csv", "plan.json", "sigma_over_time.csv", "cell.toml", "sensor.toml"] {
        assert!(dir.path().join("plan").join(file).exists(), "{file}");
    }
    for file in
        ["TruelineScan.mod", "trueline_scan.src", "trueline_scan.script", "tl_scan.ls", "waypoints.csv"]
    {
        assert!(fs::metadata(dir.path().join("plan").join(file)).unwrap().len() > 1000, "{file}");
    }
    // 20 s at 250 Hz, both ends and the header.
    assert_eq!(fs::read_to_string(dir.path().join("plan/path.csv")).unwrap().lines().count(), 5002);
    assert_eq!(
        code(&trueline(
            dir.path(),
            &["simulate", "--plan", "plan", "--seed", "5", "--out", "scan", "--quiet"]
        )),
        0
    );
    // A plan predicts the random part.
    let noise_alone = ["--sensor", "fixed", "--robot-accuracy-mm", "0", "--feature-bias-px", "0"];
    let command = ["calibrate", "scan", "--json", "result.json", "--quiet"];
    let calibrated = trueline(dir.path(), &[&command[..], &noise_alone].concat());
    assert_eq!(code(&calibrated), 0, "{}", String::from_utf8_lossy(&calibrated.stdout));
    let (plan, result) = (json(&dir.path().join("plan/plan.json")), json(&dir.path().join("result.json")));
    // The cell is off its guess by up to 10 mm, 5° and 20 mm, so the sigmas differ a little from the plan's.
    let ratio = result["sigma"]["time_offset_s"].as_f64().unwrap()
        / plan["predicted_sigma"]["time_offset_s"].as_f64().unwrap();
    assert!((0.7..1.4).contains(&ratio), "{ratio}");

    // The plan's prediction for a calibration with robot, sensor and bias equals such a calibration, except for the
    // guess.
    let whole = ["calibrate", "scan", "--json", "whole.json", "--quiet"];
    assert_eq!(code(&trueline(dir.path(), &whole)), 0);
    let whole = json(&dir.path().join("whole.json"));
    let seam_error = |of: &Value| of["seam_error"]["rms_mm"].as_f64().unwrap();
    let ratio = seam_error(&whole) / seam_error(&plan["rehearsal"]);
    assert!((0.6..1.7).contains(&ratio), "{ratio}");
    assert!(plan["rehearsal"]["accepted"].as_bool().unwrap());
    assert!(plan["rehearsal"]["runner_up"]["explains"].as_f64().unwrap_or(0.0) < 0.2);

    let again = trueline(
        dir.path(),
        &[&["plan", "plan/cell.toml", "--calibration", "result.json", "--out", "second"][..], &few].concat(),
    );
    assert_eq!(code(&again), 0, "{}", String::from_utf8_lossy(&again.stderr));
    let second = json(&dir.path().join("second/plan.json"));
    // A good guess leaves more of the view to sweep.
    assert!(second["score"].as_f64().unwrap() < plan["score"].as_f64().unwrap());
    assert_eq!(
        code(&trueline(dir.path(), &["simulate", "--plan", "second", "--out", "scan2", "--quiet"])),
        0
    );
}

#[test]
fn what_is_wanted_decides_the_exit_code() {
    let dir = tempfile::tempdir().unwrap();
    let run = |out: &str, want: &str| {
        let arguments = [
            "plan",
            "--example",
            "--out",
            out,
            "--want",
            want,
            "--tries",
            "400",
            "--shape",
            "s",
            "--longest-s",
            "30",
        ];
        trueline(dir.path(), &arguments)
    };
    let reached = run("a", "time=1ms,translation=1mm");
    assert_eq!(code(&reached), 0, "{}", String::from_utf8_lossy(&reached.stderr));
    assert!(json(&dir.path().join("a/plan.json"))["duration_s"].as_f64().unwrap() < 25.0);
    let missed = run("b", "translation=1um");
    assert_eq!(code(&missed), 1);
    assert!(String::from_utf8_lossy(&missed.stdout).contains("MISSED"));
    let used = run("b", "translation=1um");
    assert_eq!(code(&used), 2);
    assert!(String::from_utf8_lossy(&used.stderr).contains("overwritten"));
    // Nothing that a user asks for is left out silently.
    assert_eq!(code(&trueline(dir.path(), &["plan", "--example", "--out", "d", "--longest-s", "9"])), 2);
    assert_eq!(
        code(&trueline(dir.path(), &["simulate", "--plan", "a", "--preset", "weak", "--out", "e"])),
        2
    );
    let unknown = trueline(dir.path(), &["plan", "nowhere.toml", "--out", "c"]);
    assert_eq!(code(&unknown), 2);
    assert!(String::from_utf8_lossy(&unknown.stderr).contains("--example"));
}

#[test]
fn a_seam_error_that_is_missed_says_what_limits_it_and_what_would_help() {
    let dir = tempfile::tempdir().unwrap();
    let arguments = ["plan", "--example", "--out", "s", "--want", "seam=1um", "--duration-s", "10"];
    let few = ["--tries", "400", "--shape", "s"];
    let seam = trueline(dir.path(), &[&arguments[..], &few].concat());
    assert_eq!(code(&seam), 1, "{}", String::from_utf8_lossy(&seam.stderr));
    let missed = json(&dir.path().join("s/plan.json"))["missed"].clone();
    assert!(missed.as_array().is_some_and(|list| list.len() == 1), "{missed}");
    let missed = missed[0].as_str().unwrap();
    assert!(missed.starts_with("seam error: ±"), "{missed}");
    // Its limiting errors are named, largest first, with remedies.
    let robot = missed.find("robot ±").unwrap();
    assert!(missed.find("noise ±").is_none_or(|noise| robot < noise), "{missed}");
    let said = String::from_utf8_lossy(&seam.stdout).into_owned();
    assert!(said.contains("accuracy_mm under [robot]") && said.contains("% of the variance"), "{said}");
    let planned = json(&dir.path().join("s/plan.json"));
    let robots = planned["with_better_robots"].as_array().unwrap();
    let left: Vec<f64> = robots.iter().map(|robot| robot["seam_error_mm"].as_f64().unwrap()).collect();
    assert!(left.len() == 4 && left.windows(2).all(|pair| pair[1] < pair[0]), "{left:?}");
    assert!(!planned["advice"].as_array().unwrap().is_empty());
    // A robot with stated accuracy counts: the plan follows the statement. A search knows of no edge and no form: the seam
    // is stated to have none.
    let of_known_seam = |name: &str, robot: &str| {
        let [cell, sensor] = ["cell.toml", "sensor.toml"]
            .map(|file| fs::read_to_string(dir.path().join("s").join(file)).unwrap());
        let seam = "[seam]\nedge_radius_mm = 0.0\nwaviness_mm = 0.0\n";
        fs::create_dir(dir.path().join(name)).unwrap();
        fs::write(dir.path().join(name).join("cell.toml"), cell).unwrap();
        fs::write(dir.path().join(name).join("sensor.toml"), format!("{sensor}\n{seam}{robot}")).unwrap();
        let (file, out) = (format!("{name}/cell.toml"), format!("{name}-plan"));
        let arguments = ["plan", &file, "--out", &out, "--want", "seam=1um", "--duration-s", "10"];
        assert_eq!(code(&trueline(dir.path(), &[&arguments[..], &few].concat())), 1);
        json(&dir.path().join(out).join("plan.json"))
    };
    let usual = of_known_seam("usual", "");
    let said_mm = usual["with_better_robots"][2]["seam_error_mm"].as_f64().unwrap();
    let good = of_known_seam("good", "[robot]\naccuracy_mm = 0.05\n")["rehearsal"]["seam_error"].clone();
    assert_eq!(good["robot_accuracy_mm"].as_f64(), Some(0.05));
    // Another path, found for this robot; it leaves no more than the old one would have, but for what few tries find.
    let ratio = good["rms_mm"].as_f64().unwrap() / said_mm;
    assert!((0.5..1.1).contains(&ratio), "{ratio}");
}

#[test]
fn a_calibration_that_cannot_be_believed_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let run = |arguments: &[&str]| trueline(dir.path(), arguments);
    let few = ["--tries", "200", "--shape", "s", "--quiet"];
    assert_eq!(code(&run(&[&["plan", "--example", "--out", "plan"][..], &few].concat())), 0);
    assert_eq!(code(&run(&["simulate", "--fault", "robot-clock-step", "--out", "bad", "--quiet"])), 0);
    assert_eq!(code(&run(&["calibrate", "bad", "--json", "bad.json", "--quiet"])), 1);
    assert_eq!(code(&run(&["simulate", "--random-cell", "--out", "other", "--quiet"])), 0);
    assert_eq!(code(&run(&["calibrate", "other", "--json", "other.json", "--quiet"])), 0);
    for (calibration, said) in [
        ("bad.json", "not accepted"),
        ("other.json", "cell"),
        ("other/truth.toml", "does not state its uncertainty"),
    ] {
        let refused = run(&["plan", "plan/cell.toml", "--calibration", calibration, "--out", "second"]);
        let words = String::from_utf8_lossy(&refused.stderr).into_owned();
        assert_eq!(code(&refused), 2, "{calibration}");
        assert!(words.contains(said) && words.contains("hint:"), "{words}");
    }
    assert!(!dir.path().join("second").exists(), "nothing is written");
}

#[test]
fn a_sensor_of_any_name_comes_along() {
    let dir = tempfile::tempdir().unwrap();
    let run = |arguments: &[&str]| trueline(dir.path(), arguments);
    let few = ["--tries", "200", "--shape", "s", "--quiet"];
    assert_eq!(code(&run(&[&["plan", "--example", "--out", "plan"][..], &few].concat())), 0);
    let text = fs::read_to_string(dir.path().join("plan/cell.toml")).unwrap();
    fs::write(
        dir.path().join("cell.toml"),
        text.replace("sensor = \"sensor.toml\"", "sensor = \"mine.toml\""),
    )
    .unwrap();
    fs::copy(dir.path().join("plan/sensor.toml"), dir.path().join("mine.toml")).unwrap();
    let planned = run(&[&["plan", "cell.toml", "--out", "again"][..], &few].concat());
    assert_eq!(code(&planned), 0, "{}", String::from_utf8_lossy(&planned.stderr));
    fs::remove_file(dir.path().join("mine.toml")).unwrap();
    assert_eq!(code(&run(&["simulate", "--plan", "again", "--out", "scan", "--quiet"])), 0);
}

#[test]
fn a_plan_for_stripes_is_rehearsed_with_stripes() {
    let dir = tempfile::tempdir().unwrap();
    let run = |arguments: &[&str]| trueline(dir.path(), arguments);
    for (example, cell) in [("--example=camera", "camera"), ("--example=profiler", "profiler")] {
        let few = ["--use", "stripe", "--tries", "200", "--shape", "two-passes", "--duration-s", "12"];
        let planned = run(&[&["plan", example, "--out", cell][..], &few].concat());
        let said = String::from_utf8_lossy(&planned.stdout).into_owned();
        assert_eq!(code(&planned), 0, "{}", String::from_utf8_lossy(&planned.stderr));
        assert!(said.contains("simulate --plates") && said.contains("runner-up"), "{said}");
        for awkward in ["-0.0 ", "ends 0 %"] {
            assert!(!said.contains(awkward), "{awkward}: {said}");
        }
        let plan = json(&dir.path().join(cell).join("plan.json"));
        assert!(plan["length_mm"].as_f64().unwrap() >= 49.9, "50 mm of the seam");
        let scan = format!("{cell}-scan");
        let simulated = ["simulate", "--plan", cell, "--plates", "--seed", "4", "--out", &scan, "--quiet"];
        let simulated = run(&simulated);
        assert_eq!(code(&simulated), 0, "{}", String::from_utf8_lossy(&simulated.stderr));
        let result = format!("{cell}.json");
        let calibrate = ["calibrate", &scan, "--use", "stripe", "--json", &result, "--quiet"];
        let noise_alone = ["--sensor", "fixed", "--robot-accuracy-mm", "0", "--feature-bias-px", "0"];
        let calibrated = run(&[&calibrate[..], &noise_alone].concat());
        assert_eq!(code(&calibrated), 0, "{}", String::from_utf8_lossy(&calibrated.stdout));
        let result = json(&dir.path().join(&result));
        for axis in 0..3 {
            // The guess is wrong in this cell: sigmas are not quite those of the plan. Of the profiler's plates `calibrate` uses all that is
            // in view, where the plan counts on 25 mm of each.
            let sigma = |of: &Value| of["translation_mm"][axis].as_f64().unwrap();
            let ratio = sigma(&result["sigma"]) / sigma(&plan["predicted_sigma"]);
            assert!((0.3..2.0).contains(&ratio), "{cell}, axis {axis}: {ratio}");
        }
    }
    assert_eq!(
        code(&run(&["plan", "--example", "--out", "points", "--tries", "200", "--shape", "s", "--quiet"])),
        0
    );
    let refused = run(&["simulate", "--plan", "points", "--plates", "--out", "none"]);
    assert_eq!(code(&refused), 2);
    assert!(String::from_utf8_lossy(&refused.stderr).contains("[[plates]]"));
    let angle = ["simulate", "--plan", "camera", "--plates", "--plates-deg", "80", "--out", "none"];
    assert_eq!(code(&run(&angle)), 2, "the angle is that of the cell's plates");
}

#[test]
fn laps_and_edges_are_planned_as_the_cell_says_and_scanned_so() {
    let dir = tempfile::tempdir().unwrap();
    let run = |arguments: &[&str]| trueline(dir.path(), arguments);
    let few = ["--tries", "200", "--shape", "two-passes", "--duration-s", "12"];
    assert_eq!(code(&run(&[&["plan", "--example", "--out", "points", "--quiet"][..], &few].concat())), 0);
    let text = fs::read_to_string(dir.path().join("points/cell.toml")).unwrap();
    fs::copy(dir.path().join("points/sensor.toml"), dir.path().join("sensor.toml")).unwrap();
    let plate = |more: &str| format!("\n[[plates]]\nnormal = [0, 0, 1]\n{more}\n");
    let upper = plate("toward = [0, 1, 0]");
    let lap = format!("{upper}{}", plate("toward = [0, -1, 0]\nbelow_mm = 3"));
    for (name, plates, said, steps) in
        [("lap", &lap, "both parallel plates", 1), ("edge", &upper, "one plate", 0)]
    {
        let file = format!("{name}.toml");
        fs::write(dir.path().join(&file), format!("{text}{plates}")).unwrap();
        let planned = run(&[&["plan", &file, "--use", "stripe", "--out", name][..], &few].concat());
        let words = String::from_utf8_lossy(&planned.stdout).into_owned();
        assert_eq!(code(&planned), 0, "{}", String::from_utf8_lossy(&planned.stderr));
        assert!(words.contains(said), "{words}");
        let scan = format!("{name}-scan");
        let simulated = ["simulate", "--plan", name, "--plates", "--seed", "4", "--out", &scan, "--quiet"];
        assert_eq!(code(&run(&simulated)), 0);
        let result = format!("{name}.json");
        let calibrated = run(&["calibrate", &scan, "--use", "stripe", "--json", &result, "--quiet"]);
        assert_eq!(code(&calibrated), 0, "{}", String::from_utf8_lossy(&calibrated.stdout));
        let result = json(&dir.path().join(&result));
        let found = result["stripes"]["joint_steps"].as_array().unwrap();
        assert_eq!(found.len(), steps, "{name}");
        for step in found {
            let off_mm = step["step_mm"].as_f64().unwrap() - 3.0;
            assert!(off_mm.abs() < 4.0 * step["sigma_mm"].as_f64().unwrap(), "{step}");
        }
    }
    fs::write(dir.path().join("no-side.toml"), format!("{text}{}", plate(""))).unwrap();
    let refused = run(&["plan", "no-side.toml", "--use", "stripe", "--out", "none"]);
    assert_eq!(code(&refused), 2);
    let words = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert!(words.contains("does not state its side") && words.contains("toward"), "{words}");
}

#[test]
fn several_seams_are_several_files() {
    let dir = tempfile::tempdir().unwrap();
    let run = |arguments: &[&str]| trueline(dir.path(), arguments);
    let few = ["--tries", "200", "--shape", "two-passes", "--duration-s", "10", "--quiet"];
    assert_eq!(code(&run(&[&["plan", "--example", "--out", "one"][..], &few].concat())), 0);
    let text = fs::read_to_string(dir.path().join("one/cell.toml")).unwrap();
    fs::copy(dir.path().join("one/sensor.toml"), dir.path().join("sensor.toml")).unwrap();
    fs::write(dir.path().join("two.toml"), text.replace("[seam] ", "[[seam]] ")).unwrap();
    let refused = run(&["plan", "two.toml", "--out", "none"]);
    let words = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert!(code(&refused) == 2 && words.contains("calibrate the scans together"), "{words}");
    // So it is done: two plans, two scans in one cell, one calibration.
    let moved = text.replace("[1002.0, 54.5, 118.5]", "[1000.0, 260.0, 118.5]");
    let moved = moved.replace("[1298.0, 105.5, 121.5]", "[1100.0, 540.0, 121.5]");
    fs::write(dir.path().join("other.toml"), moved).unwrap();
    assert_eq!(code(&run(&[&["plan", "other.toml", "--out", "other"][..], &few].concat())), 0);
    for plan in ["one", "other"] {
        let scan = format!("{plan}-scan");
        assert_eq!(code(&run(&["simulate", "--plan", plan, "--seed", "3", "--out", &scan, "--quiet"])), 0);
    }
    let both = run(&["calibrate", "one-scan", "other-scan", "--json", "both.json", "--quiet"]);
    assert_eq!(code(&both), 0, "{}", String::from_utf8_lossy(&both.stdout));
    assert_eq!(json(&dir.path().join("both.json"))["lines"].as_array().unwrap().len(), 2);
}
