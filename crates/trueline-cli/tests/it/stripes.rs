//! Whole stripes as a user uses them: a camera's, a profiler's, both together, and where they are not there.

use crate::common;

use common::{code, trueline, words};
use serde_json::Value;
use std::fs;

/// Largest error of a translation against the truth in its own ±.
fn sigmas_off(folder: &std::path::Path, result: &Value) -> f64 {
    let truth: toml::Table = fs::read_to_string(folder.join("truth.toml")).unwrap().parse().unwrap();
    let of = |k: usize| truth["tool_from_camera"]["translation_mm"][k].as_float().unwrap();
    let off = (0..3).map(|k| {
        let found = result["tool_from_camera"]["translation_mm"][k].as_f64().unwrap();
        (found - of(k)).abs() / result["sigma"]["translation_mm"][k].as_f64().unwrap()
    });
    off.fold(0.0, f64::max)
}

#[test]
fn stripes_of_a_camera_and_profiles_calibrate_with_the_plates_in_the_result() {
    let dir = tempfile::tempdir().unwrap();
    let run = |arguments: &[&str]| trueline(dir.path(), arguments);
    // With this bow a plate that is seen from r₁ to r₂ leans by 0.1 mm (r₁ + r₂)/(25 mm)². The camera sees both plates alike; of the
    // profiler's, of which the stripes.csv of `features` has the support points, r₁ + r₂ is 63.4 mm and 60.5 mm by their distances from the corner (quantiles of
    // 2 % and 98 %, as the planes have them), which opens the angle by 0.027°.
    for (preset, what, leaning_deg) in
        [("quick", "both", 0.0), ("profiler", "both", 0.027), ("profiler", "stripe", 0.027)]
    {
        let out = format!("{preset}-{what}");
        let simulate =
            ["simulate", "--preset", preset, "--duration-s", "8", "--plates", "--plates-deg", "95"];
        assert_eq!(code(&run(&[&simulate[..], &["--bow-mm", "0.1", "--out", &out, "--quiet"]].concat())), 0);
        let folder = dir.path().join(&out);
        assert_eq!(folder.join("profiles.csv").exists(), preset == "profiler");
        let noise_alone = ["--robot-accuracy-mm", "0", "--feature-bias-px", "0", "--json", "-"];
        let output =
            run(&[&["calibrate", &out, "--use", what, "--report", "report.html"], &noise_alone[..]].concat());
        assert_eq!(code(&output), 0, "{out}: {}", words(&output));
        let result: Value = serde_json::from_slice(&output.stdout).unwrap();
        assert_eq!(result["stripes"]["used"], what);
        assert_eq!(result["stripes"]["decided_by"], "asked");
        let planes = result["planes"].as_array().unwrap();
        assert_eq!(planes.len(), 2);
        for plane in planes {
            assert!(plane["sigma_deg"].as_f64().unwrap() < 0.1, "{plane}");
            assert!(plane["bow_mm"].as_f64().unwrap() > 0.0, "{plane}");
        }
        let angle = &result["stripes"]["joint_angles"][0];
        let (deg, sigma) = (angle["angle_deg"].as_f64().unwrap(), angle["sigma_deg"].as_f64().unwrap());
        assert!((deg - 95.0 - leaning_deg).abs() < 4.0 * sigma, "{deg} ± {sigma}");
        assert!(sigmas_off(&folder, &result) < 4.0, "{out}: {result:#}");
        assert!(words(&output).contains("whole stripes"), "{}", words(&output));
        // The residuals beside the answer are not its own.
        let said = words(&output).split_whitespace().collect::<Vec<_>>().join(" ");
        assert_eq!(said.matches("(of the fit to the seam points alone)").count(), 3, "{said}");
        let page = std::fs::read_to_string(dir.path().join("report.html")).unwrap();
        assert!(page.contains("These residuals are from the fit to the seam points alone."));
    }
}

#[test]
fn an_option_that_would_change_nothing_of_the_simulated_scan_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    // Each has a folder of its own: none replaces a folder with other files.
    let of = |arguments: &str| {
        let out = format!("of{}", arguments.replace(' ', ""));
        let whole = format!("simulate --duration-s 2 --quiet --force --out {out} {arguments}");
        trueline(dir.path(), &whole.split(' ').collect::<Vec<_>>())
    };
    for (refused, has_use) in [
        ("--preset profiler --plates --column-noise-px 1", "--preset paper --plates --column-noise-px 1"),
        ("--preset profiler --feature-noise-px 1", "--preset paper --feature-noise-px 1"),
        ("--preset paper --plates --feature-noise-px 1", "--preset paper --feature-noise-px 1"),
        ("--preset paper --feature-noise-mm 1", "--preset profiler --plates --feature-noise-mm 0.1"),
        ("--preset paper --plates --parquet", "--preset profiler --plates --parquet"),
        ("--preset paper --plates --mixed 0.5", "--preset profiler --plates --mixed 0.5"),
        ("--images --outliers 0.1", "--preset paper --plates --outliers 0.1"),
        ("--preset profiler --plates --outliers 0.1", "--preset profiler --outliers 0.1"),
        (
            "--preset profiler --plates --rounded-mm 1",
            "--preset profiler --plates --one-plate --rounded-mm 1",
        ),
        (
            "--preset profiler --plates --one-plate --gap-filled 0.1",
            "--preset profiler --plates --gap-mm 2 --gap-filled 0.1",
        ),
        ("--plates --joint lap", "--images --frame-period-ms 1000 --joint lap"),
        (
            "--images --joint lap --opening-deg 80",
            "--images --frame-period-ms 1000 --joint fillet --opening-deg 80",
        ),
    ] {
        let output = of(refused);
        assert_eq!(code(&output), 2, "{refused}");
        assert!(words(&output).contains("has no effect"), "{refused}: {}", words(&output));
        let output = of(has_use);
        assert_eq!(code(&output), 0, "{has_use}: {}", words(&output));
    }
}

#[test]
fn stripes_alone_are_enough_and_without_any_they_cannot_be_asked_for() {
    let dir = tempfile::tempdir().unwrap();
    let run = |arguments: &[&str]| trueline(dir.path(), arguments);
    assert_eq!(code(&run(&["simulate", "--plates", "--duration-s", "10", "--out", "scan", "--quiet"])), 0);
    fs::remove_file(dir.path().join("scan/features.csv")).unwrap();
    let output =
        run(&["calibrate", "scan", "--robot-accuracy-mm", "0", "--feature-bias-px", "0", "--json", "-"]);
    assert_eq!(code(&output), 0, "{}", words(&output));
    let result: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(result["stripes"]["decided_by"], "agreement");
    assert!(sigmas_off(&dir.path().join("scan"), &result) < 4.0, "{result:#}");
    assert_eq!(code(&run(&["simulate", "--duration-s", "5", "--out", "points", "--quiet"])), 0);
    let refused = run(&["calibrate", "points", "--use", "stripe"]);
    assert_eq!(code(&refused), 2);
    assert!(words(&refused).contains("the recording has none"), "{}", words(&refused));
    let papers = run(&["calibrate", "scan", "--use", "both", "--residual", "point-to-line"]);
    assert_eq!(code(&papers), 2, "{}", words(&papers));
}

#[test]
fn a_lap_and_a_plate_with_an_edge_calibrate_by_their_stripes() {
    let dir = tempfile::tempdir().unwrap();
    let run = |arguments: &[&str]| trueline(dir.path(), arguments);
    let joints: [(&str, &[&str], usize); 4] = [
        ("lap", &["--step-mm", "4"], 2),
        ("edge", &["--one-plate"], 1),
        ("profiles", &["--step-mm", "4", "--preset", "profiler"], 2),
        ("profiles-of-an-edge", &["--one-plate", "--preset", "profiler"], 1),
    ];
    for (out, joint, plates) in joints {
        let simulate = ["simulate", "--plates", "--duration-s", "8", "--out", out, "--quiet"];
        assert_eq!(code(&run(&[&simulate[..], joint].concat())), 0);
        let noise_alone = ["--robot-accuracy-mm", "0", "--feature-bias-px", "0", "--json", "-"];
        // A good scan's edge points know as much as one plate and its edge: these are asked for.
        let what = ["--report", "report.html", "--use", "stripe"];
        let what = if plates == 1 { &what[..] } else { &what[..2] };
        let output = run(&[&["calibrate", out], what, &noise_alone[..]].concat());
        assert_eq!(code(&output), 0, "{out}: {}", words(&output));
        let result: Value = serde_json::from_slice(&output.stdout).unwrap();
        let decided = if plates == 1 { "asked" } else { "agreement" };
        assert_eq!(result["stripes"]["decided_by"], decided, "{out}: {}", words(&output));
        assert_eq!(result["planes"].as_array().unwrap().len(), plates);
        assert!(result["stripes"]["joint_angles"].as_array().unwrap().is_empty());
        assert!(sigmas_off(&dir.path().join(out), &result) < 4.0, "{out}: {result:#}");
        let steps = result["stripes"]["joint_steps"].as_array().unwrap();
        assert_eq!(steps.len(), plates - 1);
        for step in steps {
            let (mm, sigma) = (step["step_mm"].as_f64().unwrap(), step["sigma_mm"].as_f64().unwrap());
            assert!((mm - 4.0).abs() < 4.0 * sigma && sigma < 0.05, "{mm} ± {sigma}");
        }
        let said =
            if plates == 2 { " mm step; plate 0 bowed" } else { "one plate with an edge; plate 0 bowed" };
        assert!(words(&output).contains(said), "{}", words(&output));
    }
}

#[test]
fn a_joint_that_hardly_shows_is_written_and_doubted() {
    let dir = tempfile::tempdir().unwrap();
    let run = |arguments: &[&str]| trueline(dir.path(), arguments);
    for (out, gap) in [("gap", &["--gap-mm", "2"][..]), ("fillet", &[])] {
        let ask =
            ["simulate", "--plates", "--preset", "profiler", "--duration-s", "4", "--quiet", "--out", out];
        assert_eq!(code(&run(&[&ask[..], gap].concat())), 0);
    }
    // At the start of the scan the plates are tacked: the first profiles alone show a corner.
    let text = |folder: &str| fs::read_to_string(dir.path().join(folder).join("profiles.csv")).unwrap();
    let (gap, fillet) = (text("gap"), text("fillet"));
    let time_s = |row: &str| row.split(',').next().unwrap().parse::<f64>().ok();
    let first_s = gap.lines().find_map(time_s).unwrap();
    let is_first = |row: &&str| time_s(row).is_some_and(|time_s| time_s < first_s + 0.2);
    let rows = gap.lines().take(1).chain(fillet.lines().skip(1).filter(is_first));
    let rows = rows.chain(gap.lines().skip(1).filter(|row| !is_first(row)));
    fs::write(dir.path().join("gap/profiles.csv"), rows.collect::<Vec<_>>().join("\n")).unwrap();
    let doubted = run(&["features", "gap", "--joint", "fillet"]);
    assert_eq!(code(&doubted), 1, "{}", words(&doubted));
    assert!(words(&doubted).contains("check the joint type (--joint)"), "{}", words(&doubted));
    assert!(dir.path().join("gap/features.csv").exists());
    let found = run(&["features", "gap", "--joint", "butt"]);
    assert_eq!(code(&found), 0, "{}", words(&found));
}

#[test]
fn the_joint_of_profiles_is_named_or_told_and_one_that_they_are_not_searched_for_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let run = |arguments: &[&str]| trueline(dir.path(), arguments);
    let butt = [
        "simulate",
        "--plates",
        "--gap-mm",
        "2",
        "--preset",
        "profiler",
        "--duration-s",
        "8",
        "--out",
        "gap",
        "--quiet",
    ];
    assert_eq!(code(&run(&butt)), 0);
    let refused = run(&["features", "gap", "--joint", "groove"]);
    assert_eq!(code(&refused), 2);
    assert!(words(&refused).contains("profiles are not searched for a groove"), "{}", words(&refused));
    let other = run(&["calibrate", "gap", "--joint", "fillet"]);
    assert_eq!(code(&other), 2, "{}", words(&other));
    let found = run(&["features", "gap"]);
    assert_eq!(code(&found), 0, "{}", words(&found));
    assert!(words(&found).contains("middle of a gap"), "{}", words(&found));
    let output =
        run(&["calibrate", "gap", "--robot-accuracy-mm", "0", "--feature-bias-px", "0", "--json", "-"]);
    assert_eq!(code(&output), 0, "{}", words(&output));
    let result: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert!(sigmas_off(&dir.path().join("gap"), &result) < 4.0, "{result:#}");
}
