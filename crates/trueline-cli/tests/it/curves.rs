//! Curved seams as users calibrate them: cast, answered, refused, used.

use crate::common;

use common::{code, trueline, words};
use serde_json::Value;
use std::fs;
use std::path::Path;

/// The result of a calibration that ends with this code.
fn calibrated(folder: &Path, arguments: &[&str], expected: i32) -> Value {
    let all = [&["calibrate"][..], arguments, &["--json", "result.json", "--quiet"]].concat();
    let output = trueline(folder, &all);
    assert_eq!(code(&output), expected, "{arguments:?}: {}", words(&output));
    serde_json::from_slice(&fs::read(folder.join("result.json")).unwrap()).unwrap()
}

fn cast(folder: &Path, seam: &[&str], out: &str) {
    let output = trueline(folder, &[&["simulate", "--seam"][..], seam, &["--out", out]].concat());
    assert_eq!(code(&output), 0, "{}", words(&output));
}

fn truth(dataset: &Path) -> toml::Table {
    toml::from_str(&fs::read_to_string(dataset.join("truth.toml")).unwrap()).unwrap()
}

/// Largest error of time offset and translation in their standard deviations.
fn off_in_sigmas(result: &Value, truth: &toml::Table) -> f64 {
    let place = truth["tool_from_camera"]["translation_mm"].as_array().unwrap();
    let sigma = |of: &Value| of.as_f64().unwrap();
    let of_place = place.iter().enumerate().map(|(k, expected)| {
        let found = result["tool_from_camera"]["translation_mm"][k].as_f64().unwrap();
        (found - expected.as_float().unwrap()).abs() / sigma(&result["sigma"]["translation_mm"][k])
    });
    let found = result["time_offset_s"].as_f64().unwrap();
    let of_time = (found - truth["time_offset_s"].as_float().unwrap()).abs();
    of_place.fold(of_time / sigma(&result["sigma"]["time_offset_s"]), f64::max)
}

#[test]
fn a_pipe_is_calibrated_from_nothing_and_a_straight_seam_stays_a_line() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path();
    cast(folder, &["pipe", "--seed", "3"], "pipe");
    let result = calibrated(folder, &["pipe"], 0);
    // Four numbers beyond four standard deviations: one run in 4,000.
    assert!(off_in_sigmas(&result, &truth(&folder.join("pipe"))) < 4.0, "{result:#}");
    assert_eq!(result["curves"][0]["closed"], true);
    // Of radius 50 mm: the spline leaves its ± of it.
    let length_mm = result["curves"][0]["length_mm"].as_f64().unwrap();
    assert!((length_mm - 314.16).abs() < 1.0, "{length_mm}");
    assert_eq!(result["lines"].as_array().unwrap().len(), 0);
    let models = result["models_tried"].as_array().unwrap();
    assert_eq!((&models[0]["target"], &models[0]["taken"]), (&"curve".into(), &true.into()));
    assert!(models[1..].iter().all(|model| model["target"] == "line" && model["taken"] == false));
    // Its points are within 0.3 mm of the true ring: the ± of seam points are 0.2 mm.
    let text = fs::read_to_string(folder.join("pipe/truth_curve.csv")).unwrap();
    let number = |field: &str| field.parse::<f64>().unwrap();
    let ring: Vec<Vec<f64>> =
        text.lines().skip(1).map(|line| line.split(',').map(number).collect()).collect();
    for point in result["curves"][0]["points_mm"].as_array().unwrap() {
        let to = |true_point: &Vec<f64>| {
            let squared = (0..3).map(|k| (point[k].as_f64().unwrap() - true_point[k]).powi(2));
            squared.sum::<f64>().sqrt()
        };
        // The true points are 1.6 mm apart.
        let nearest = ring.iter().map(to).fold(f64::INFINITY, f64::min);
        assert!(nearest < 0.8 + 0.5, "{point} {nearest}");
    }
    for command in [
        &["export", "result.json", "--as", "matrix"][..],
        &["apply", "pipe", "--calibration", "result.json", "--out", "points.csv"],
        &["calibrate", "pipe", "--report", "report.html", "--quiet"],
    ] {
        let output = trueline(folder, command);
        assert_eq!(code(&output), 0, "{command:?}: {}", words(&output));
    }

    cast(folder, &["straight", "--seed", "3"], "straight");
    let result = calibrated(folder, &["straight"], 0);
    assert_eq!(result["lines"].as_array().unwrap().len(), 1);
    assert!(result["curves"].is_null());
    let forced = calibrated(folder, &["straight", "--target", "curve"], 0);
    assert!(off_in_sigmas(&forced, &truth(&folder.join("straight"))) < 4.0, "{forced:#}");
    assert_eq!(forced["curves"][0]["closed"], false);
}

#[test]
fn once_over_a_curve_is_refused_until_the_hand_eye_is_known() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path();
    let weave = ["--seam-weave-hz", "2", "--seam-tilt-deg", "3", "--seam-passes", "1", "--duration-s", "12"];
    cast(folder, &[&["arc", "--seed", "4"][..], &weave].concat(), "once");
    let result = calibrated(folder, &["once", "--target", "curve"], 1);
    assert!(result["tool_from_camera"]["translation_mm"][0].is_null());
    assert!(result["time_offset_s"].is_null());
    let has = |of: &Value, code: &str| of.as_array().unwrap().iter().any(|one| one["code"] == code);
    assert!(has(&result["warnings"], "curve-from-one-pass"), "{result:#}");
    assert!(has(&result["reasons"], "ambiguous-time-offset"), "{result:#}");
    let expected = truth(&folder.join("once"))["time_offset_s"].as_float().unwrap();
    let known = ["once", "--target", "curve", "--initial", "once/truth.toml", "--offset-within", "0.6"];
    let known = calibrated(folder, &known, 1);
    let (found, sigma) =
        (known["time_offset_s"].as_f64().unwrap(), known["sigma"]["time_offset_s"].as_f64().unwrap());
    // The weave shows it to 0.1 ms; the uncertainty of the hand-eye transform widens the ±.
    assert!((found - expected).abs() < (4.0 * sigma).min(1e-3), "{found} {expected} {sigma}");
    assert!(known["tool_from_camera"]["translation_mm"][0].is_null());
}

#[test]
fn what_a_curve_has_no_use_for_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path();
    for (options, name) in [
        (&["--preset", "paper"][..], "--preset"),
        (&["--time-offset-ms", "10"], "--time-offset-ms"),
        (&["--tilt-deg", "5"], "--tilt-deg"),
        (&["--seam-passes", "0"], "--seam-passes"),
        (&["--seam-part-moves", "0.3,9"], "0.3,0.1"),
        (&["--plates", "--bow-mm", "0.2"], "--bow-mm"),
        (&["--plates", "--roughness-mm", "0.02"], "--roughness-mm"),
        (&["--plates", "--step-mm", "3"], "--step-mm"),
        (&["--plates", "--column-noise-px", "0.5"], "--column-noise-px"),
        (&["--plates", "--profile-look", "mixed=0.1"], "--profile-look"),
    ] {
        let output =
            trueline(folder, &[&["simulate", "--seam", "arc", "--out", "scan"][..], options].concat());
        assert_eq!(code(&output), 2, "{options:?}");
        assert!(words(&output).contains(name), "{}", words(&output));
    }
    cast(folder, &["arc"], "arc");
    let output = trueline(folder, &["calibrate", "arc", "--target", "curve", "--residual", "point-to-line"]);
    assert_eq!(code(&output), 2, "{}", words(&output));
}

/// Columns of a table by name.
fn columns<const N: usize>(file: &Path, names: [&str; N]) -> Vec<[f64; N]> {
    let text = fs::read_to_string(file).unwrap();
    let mut lines = text.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let header = lines.next().unwrap();
    let at = names.map(|name| header.iter().position(|of| *of == name).unwrap());
    lines.map(|row| at.map(|column| row[column].parse().unwrap())).collect()
}

#[test]
fn stripes_beside_a_curve_are_written_and_read() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path();
    cast(folder, &["pipe", "--plates", "--seed", "3", "--outliers", "0"], "pipe");
    let names = ["time_s", "plate", "x1_mm", "z1_mm", "x2_mm", "z2_mm", "sigma_mm"];
    let stripes = columns(&folder.join("pipe/stripes.csv"), names);
    let features = columns(&folder.join("pipe/features.csv"), ["time_s", "x_mm", "z_mm"]);
    assert!(features.len() > 600, "{}", features.len());
    assert_eq!(stripes.len(), 2 * features.len());
    for (both, [time_s, x, z]) in stripes.chunks(2).zip(features) {
        for (stripe, number) in both.iter().zip([0.0, 1.0]) {
            let [stamp_s, plate, x1, z1, x2, z2, sigma_mm] = *stripe;
            assert_eq!((stamp_s, plate), (time_s, number));
            // 40 points with noise of 0.04 mm.
            assert!((sigma_mm - 0.04 * (2.0_f64 / 40.0).sqrt()).abs() < 1e-9, "{sigma_mm}");
            // The seam point is on both lines.
            let away = (x - x1) * (z2 - z1) - (z - z1) * (x2 - x1);
            assert!(away.abs() / (x2 - x1).hypot(z2 - z1) < 1e-6, "{away}");
        }
    }
    let sigmas = columns(&folder.join("pipe/features.csv"), ["sigma_x_mm", "sigma_z_mm"]);
    // Lines square to each other that are extrapolated by 2.2 standard deviations of their places: ± 1.7 times that of a
    // support point. Tilts change the angles by a third.
    assert!(sigmas.iter().flatten().all(|sigma_mm| (0.01..0.03).contains(sigma_mm)));
    let read = trueline_dataset::folder::read(&folder.join("pipe")).unwrap();
    assert_eq!((read.features.len(), read.stripes.len()), (stripes.len() / 2, stripes.len()));

    // The same again, over the folder.
    cast(folder, &["pipe", "--plates", "--seed", "3", "--force"], "pipe");
    for using in [&["pipe"][..], &["pipe", "--use", "both"]] {
        let result = calibrated(folder, &[using, &["--robot-accuracy-mm", "0"]].concat(), 0);
        // Bends move these seam points, so they are not used beside the stripes.
        assert_eq!(result["stripes"]["used"], "stripe");
        // Four numbers beyond four standard deviations: one run in 4,000.
        assert!(off_in_sigmas(&result, &truth(&folder.join("pipe"))) < 4.0, "{result:#}");
    }

    let drawing = ["pipe", "--seam-cad", "pipe/truth_curve.csv"];
    let output = trueline(folder, &[&["calibrate"][..], &drawing].concat());
    assert_eq!(code(&output), 2, "{}", words(&output));
    assert!(words(&output).contains("not used together with a drawing"), "{}", words(&output));

    // Beside a line the estimator has no knowledge of how they were cast.
    cast(folder, &["straight", "--plates", "--seed", "3"], "straight");
    let result = calibrated(folder, &["straight", "--use", "stripe"], 0);
    // Four numbers beyond four standard deviations: one run in 4,000.
    assert!(off_in_sigmas(&result, &truth(&folder.join("straight"))) < 4.0, "{result:#}");
}

#[test]
fn a_drawing_makes_a_pipe_surer_and_says_where_the_part_is() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path();
    cast(folder, &["saddle", "--seed", "3"], "saddle");
    let ideal = ["saddle", "--robot-accuracy-mm", "0"];
    let free = calibrated(folder, &ideal, 0);
    let cad = ["--seam-cad", "saddle/truth_curve.csv", "--cad-tolerance-mm", "0.02"];
    let known = calibrated(folder, &[&ideal[..], &cad].concat(), 0);
    let [sure_mm, unsure_mm] = [&known, &free].map(|result| result["seam_error"]["rms_mm"].as_f64().unwrap());
    // The design has 0.028 mm for 0.045 with an exact drawing.
    assert!(sure_mm < 0.75 * unsure_mm, "{sure_mm} {unsure_mm}");
    // Four numbers beyond four standard deviations: one run in 4,000.
    assert!(off_in_sigmas(&known, &truth(&folder.join("saddle"))) < 4.0, "{known:#}");
    let found = &known["curves"][0]["cad"];
    assert_eq!((&found["file"], &found["used"]), (&"saddle/truth_curve.csv".into(), &true.into()));
    assert!(found["rms_mm"].as_f64().unwrap() < 0.06, "{found}");
    // The drawing is in base: up to the half-turn of a saddle the part is where it was drawn.
    assert!(found["symmetric_about"]["angle_deg"].as_f64().unwrap() > 179.0, "{found}");
    assert_eq!(known["inputs"]["saddle/truth_curve.csv"].as_str().map(str::len), Some(64));
    assert_eq!(known["options"]["seam_cad"], "saddle/truth_curve.csv");
    assert!(free["curves"][0]["cad"].is_null());
    let output = trueline(folder, &[&["calibrate"][..], &ideal, &cad].concat());
    assert!(String::from_utf8_lossy(&output.stdout).contains("CAD"), "{}", words(&output));
}

/// A drawing in DXF with the points of a curve, times a factor.
fn dxf(csv: &str, factor: f64, unit: u8) -> String {
    let points = csv.lines().skip(1).map(|line| {
        let mm: Vec<f64> = line.split(',').map(|field| field.parse::<f64>().unwrap() * factor).collect();
        format!("0\nVERTEX\n10\n{}\n20\n{}\n30\n{}\n70\n32\n", mm[0], mm[1], mm[2])
    });
    format!(
        "0\nSECTION\n2\nHEADER\n9\n$INSUNITS\n70\n{unit}\n0\nENDSEC\n0\nSECTION\n2\nENTITIES\n0\nPOLYLINE\n66\n1\n70\n8\n{}0\nSEQEND\n0\nENDSEC\n0\nEOF\n",
        points.collect::<String>()
    )
}

#[test]
fn drawings_in_dxf_are_read_and_those_of_no_use_refused_with_their_cause() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path();
    cast(folder, &["wavy", "--seed", "5"], "wavy");
    let csv = fs::read_to_string(folder.join("wavy/truth_curve.csv")).unwrap();
    let write = |name: &str, text: &str| fs::write(folder.join(name), text).unwrap();
    write("mm.dxf", &dxf(&csv, 1.0, 4));
    write("inch.dxf", &dxf(&csv, 1.0 / 25.4, 1));
    let [by_mm, by_inch] =
        ["mm.dxf", "inch.dxf"].map(|file| calibrated(folder, &["wavy", "--seam-cad", file], 0));
    let offset_s = |result: &Value| result["time_offset_s"].as_f64().unwrap();
    // An inch has no finite number of binary digits.
    assert!((offset_s(&by_mm) - offset_s(&by_inch)).abs() < 1e-7, "{by_mm} {by_inch}");
    let cad = &by_mm["curves"][0]["cad"];
    assert_eq!((&cad["tolerance_mm"], &cad["used"]), (&0.2.into(), &false.into()));

    write("wrong_unit.dxf", &dxf(&csv, 1.0 / 25.4, 4));
    write("metres.csv", &csv.replace("_mm", "_m"));
    write("straight.csv", "x_mm,y_mm,z_mm\n0,0,0\n100,0,0.01\n200,0,0\n");
    write("other.csv", "x_mm,y_mm,z_mm\n0,0,0\n100,20,0\n200,60,0\n300,160,20\n400,0,0\n");
    write(
        "two.dxf",
        &dxf(&csv, 1.0, 4)
            .replace("0\nENDSEC\n0\nEOF", "0\nLINE\n10\n0\n20\n0\n11\n1\n21\n1\n0\nENDSEC\n0\nEOF"),
    );
    write("part.step", "ISO-10303-21;");
    write("broken.csv", "x_mm,y_mm,z_mm\n1,2,3\n1,two,3\n");
    for (options, said) in [
        (&["wavy", "--seam-cad", "wrong_unit.dxf"][..], "inches"),
        (&["wavy", "--seam-cad", "metres.csv"], "metres"),
        (&["wavy", "--seam-cad", "straight.csv"], "straight"),
        (&["wavy", "--seam-cad", "other.csv"], "mm off"),
        (&["wavy", "--seam-cad", "two.dxf"], "several curves"),
        (&["wavy", "--seam-cad", "part.step"], "DXF"),
        (&["wavy", "--seam-cad", "broken.csv"], "line 3, column `y_mm`"),
        (&["wavy", "--seam-cad", "nowhere.csv"], "nowhere.csv"),
        (&["wavy", "--seam-cad", "mm.dxf", "--target", "line"], "--target line"),
        (&["wavy", "--seam-cad", "mm.dxf", "--fix", "time-offset"], "held"),
        (&["wavy", "--cad-tolerance-mm", "0.1"], "--seam-cad"),
        (&["wavy", "--part-moves", "0.3", "--target", "line"], "--part-moves"),
        (&["wavy", "--part-moves", "4"], "up to 3 mm"),
    ] {
        let output = trueline(folder, &[&["calibrate"][..], options].concat());
        assert_eq!(code(&output), 2, "{options:?}: {}", words(&output));
        assert!(words(&output).contains(said), "{options:?}: {}", words(&output));
    }
}

#[test]
fn the_curve_is_exported_and_measured_from() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path();
    cast(folder, &["saddle", "--seed", "3"], "saddle");
    let result = calibrated(folder, &["saddle"], 0);
    let points = result["curves"][0]["points_mm"].as_array().unwrap().len();
    let exported = |form: &str| {
        let output = trueline(folder, &["export", "result.json", "--as", form, "--quiet"]);
        assert_eq!(code(&output), 0, "{form}: {}", words(&output));
        String::from_utf8(output.stdout).unwrap()
    };
    let csv = exported("curve-csv");
    assert_eq!(csv.lines().next(), Some("x_mm,y_mm,z_mm,sigma_mm"));
    assert_eq!(csv.lines().count(), points + 1);
    fs::write(folder.join("curve.csv"), &csv).unwrap();
    let ply = exported("curve-ply");
    assert!(ply.contains(&format!("element vertex {points}\n")) && ply.contains("element edge"));
    fs::write(folder.join("curve.dxf"), exported("curve-dxf")).unwrap();

    // From the curve itself, and from the same as a file.
    let distances = |options: &[&str]| -> Value {
        let all =
            [&["evaluate", "saddle", "--calibration", "result.json", "--json", "e.json", "--quiet"], options];
        let output = trueline(folder, &all.concat());
        assert_eq!(code(&output), 0, "{options:?}: {}", words(&output));
        serde_json::from_slice(&fs::read(folder.join("e.json")).unwrap()).unwrap()
    };
    let own = distances(&[]);
    assert_eq!(own["reference"]["seams"][0]["form"], "curve", "{own:#}");
    let by_file = distances(&["--reference", "curve.csv"]);
    let median = |of: &Value| {
        of["figures"]["calibrated"]["median_mm"].as_f64().unwrap_or_else(|| unreachable!("{of:#}"))
    };
    // Written to a nanometre.
    assert!((median(&own) - median(&by_file)).abs() < 1e-5, "{own:#} {by_file:#}");
    // Noise of 0.04 mm in two directions has a median of 0.047 mm.
    assert!((0.03..0.08).contains(&median(&own)), "{own:#}");
    assert_eq!(distances(&["--fit", "plane"])["reference"]["seams"][0]["form"], "plane");

    // The exported curve is a drawing: the part is where it was measured.
    let again = calibrated(folder, &["saddle", "--seam-cad", "curve.dxf"], 0);
    assert!(again["curves"][0]["cad"]["rms_mm"].as_f64().unwrap() < 0.05);

    // Points by apply are on the curve.
    let output =
        trueline(folder, &["apply", "saddle", "--calibration", "result.json", "--out", "points.csv"]);
    assert_eq!(code(&output), 0, "{}", words(&output));
    let applied = fs::read_to_string(folder.join("points.csv")).unwrap();
    assert!(applied.lines().count() > 600, "{applied}");

    cast(folder, &["straight"], "straight");
    calibrated(folder, &["straight"], 0);
    for (options, said) in
        [(&["--as", "curve-csv"][..], "straight"), (&["--as", "curve-dxf", "--child", "laser2"], "--child")]
    {
        let output = trueline(folder, &[&["export", "result.json"][..], options].concat());
        assert_eq!(code(&output), 2, "{options:?}: {}", words(&output));
        assert!(words(&output).contains(said), "{}", words(&output));
    }
    let list = trueline(folder, &["export", "--list"]);
    assert!(String::from_utf8_lossy(&list.stdout).contains("curve-ply"));
}

/// Data that cannot be a curve are refused with the cause: too few frames, seams that cross, a curve shorter than its
/// knots.
#[test]
fn scans_that_show_no_curve_are_refused_with_their_cause() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path();
    cast(folder, &["arc", "--seed", "2"], "arc");
    let features = fs::read_to_string(folder.join("arc/features.csv")).unwrap();
    // A frame a second: 20 of them.
    let header = features.lines().next().unwrap();
    let few: Vec<&str> = std::iter::once(header).chain(features.lines().skip(1).step_by(33)).collect();
    fs::write(folder.join("arc/features.csv"), few.join("\n") + "\n").unwrap();
    let output = trueline(folder, &["calibrate", "arc", "--target", "curve"]);
    assert_eq!(code(&output), 2, "{}", words(&output));
    assert!(words(&output).contains("five seam points for each"), "{}", words(&output));
}

/// A curved weld is watched: against its own calibration nothing has changed, and a second weld of the part is one of the same part.
#[test]
fn a_curved_weld_is_watched() {
    let dir = tempfile::tempdir().unwrap();
    cast(dir.path(), &["arc"], "weld");
    calibrated(dir.path(), &["weld"], 0);
    let watched = ["watch", "weld", "--state", "cell.sqlite", "--calibration", "result.json"];
    let output = trueline(dir.path(), &watched);
    let words = words(&output);
    assert!(code(&output) == 0 && words.contains("no change seen in"), "{words}");
}

/// A part that is clamped again between passes is answered right with the scatter of its fixture.
#[test]
fn a_part_that_is_clamped_again_is_calibrated_with_the_scatter_of_its_fixture() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path();
    cast(folder, &["free", "--seed", "4", "--seam-part-moves", "0.3,0.1"], "clamped");
    let ideal = ["clamped", "--robot-accuracy-mm", "0"];
    let unknown = calibrated(folder, &ideal, 1);
    assert_eq!(unknown["reasons"][0]["code"], "part-moved");
    let known = calibrated(folder, &[&ideal[..], &["--part-moves", "0.3,0.1"]].concat(), 0);
    // Four numbers beyond four standard deviations: one run in 4,000.
    assert!(off_in_sigmas(&known, &truth(&folder.join("clamped"))) < 4.0, "{known:#}");
    assert_eq!(known["options"]["part_moves"]["shift_mm"], 0.3);
}

/// A straight part that is clamped again between two passes is refused with its cause, and the same part at rest is accepted.
#[test]
fn a_straight_part_that_is_clamped_again_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path();
    let scan = ["straight", "--seed", "112", "--seam-passes", "2"];
    cast(folder, &[&scan[..], &["--seam-part-moves", "0.3,0.1"]].concat(), "clamped");
    cast(folder, &scan, "rest");
    let moved = calibrated(folder, &["clamped", "--robot-accuracy-mm", "0"], 1);
    assert_eq!(moved["reasons"][0]["code"], "part-moved", "{moved:#}");
    calibrated(folder, &["rest", "--robot-accuracy-mm", "0"], 0);
    // The robot's errors, a wavy seam and lasting noise do not hide the moves.
    let wavy = calibrated(folder, &["clamped", "--waviness-mm", "0.1"], 1);
    assert_eq!(wavy["reasons"][0]["code"], "part-moved", "{wavy:#}");
}
