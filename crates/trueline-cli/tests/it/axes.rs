//! Cells with external axes as users calibrate them: cast, answered, used, refused.

use crate::common;

use common::{code, trueline, words};
use serde_json::Value;
use std::fs;
use std::path::Path;

fn cast(folder: &Path, axis: &str, seed: &str, out: &str) {
    let all = [
        "simulate",
        "--preset",
        "good",
        "--random-cell",
        "--time-offset-ms",
        "35",
        "--axis",
        axis,
        "--seed",
        seed,
        "--out",
        out,
    ];
    let output = trueline(folder, &all);
    assert_eq!(code(&output), 0, "{}", words(&output));
}

/// The text of a calibration that ends with this code.
fn calibrated(folder: &Path, scans: &[&str], expected: i32) -> String {
    let output = trueline(folder, &[&["calibrate"][..], scans, &["--json", "result.json"]].concat());
    assert_eq!(code(&output), expected, "{}", words(&output));
    let said = format!("{}{}", String::from_utf8_lossy(&output.stdout), words(&output));
    said.split_whitespace().collect::<Vec<_>>().join(" ")
}

fn result(folder: &Path) -> Value {
    serde_json::from_slice(&fs::read(folder.join("result.json")).unwrap()).unwrap()
}

fn numbers(of: &Value) -> Vec<f64> {
    of.as_array().unwrap().iter().map(|number| number.as_f64().unwrap()).collect()
}

#[test]
fn a_swinging_table_is_calibrated_and_used() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path();
    cast(folder, "table=rotary,part,swing:30@0.1", "3", "table");
    let said = calibrated(folder, &["table"], 0);
    assert!(said.contains("axis table"), "{said}");
    let result = result(folder);
    let axis = &result["axes"][0];
    assert_eq!([&axis["name"], &axis["kind"], &axis["carries"]], ["table", "rotary", "part"]);
    let truth: toml::Table =
        toml::from_str(&fs::read_to_string(folder.join("table/truth.toml")).unwrap()).unwrap();
    let truth = &truth["axes"].as_array().unwrap()[0];
    let direction = truth["direction"].as_array().unwrap();
    let cosine: f64 = numbers(&axis["direction"])
        .iter()
        .zip(direction)
        .map(|(found, truth)| found * truth.as_float().unwrap())
        .sum();
    let sigma_deg = axis["sigma"]["direction_deg"].as_f64().unwrap();
    assert!(cosine.min(1.0).acos().to_degrees() < 5.7 * sigma_deg, "{cosine}");
    let late_s = axis["time_offset_s"].as_f64().unwrap() - truth["time_offset_s"].as_float().unwrap();
    assert!(late_s.abs() < 4.5 * axis["sigma"]["time_offset_s"].as_f64().unwrap(), "{late_s}");
    assert_eq!(result["models_tried"][0]["roles"]["axes"], "estimated");

    let applied = trueline(folder, &["apply", "table", "--calibration", "result.json", "--out", "seam.csv"]);
    assert_eq!(code(&applied), 0, "{}", words(&applied));
    // The seam stands still in the part, though the part swings: points are off a line by noise alone, 0.04 mm.
    let judged = trueline(folder, &["evaluate", "table", "--calibration", "result.json", "--json", "e.json"]);
    assert_eq!(code(&judged), 0, "{}", words(&judged));
    let judged: Value = serde_json::from_slice(&fs::read(folder.join("e.json")).unwrap()).unwrap();
    assert!(judged.to_string().contains("rmse"), "{judged}");

    // Nor is the table forgotten: without its files the scan is refused.
    fs::create_dir(folder.join("bare")).unwrap();
    for file in ["robot.csv", "features.csv", "sensor.toml"] {
        fs::copy(folder.join("table").join(file), folder.join("bare").join(file)).unwrap();
    }
    let bare = trueline(folder, &["apply", "bare", "--calibration", "result.json", "--out", "b.csv"]);
    assert_eq!(code(&bare), 2, "{}", words(&bare));
    assert!(words(&bare).contains("axis `table`"), "{}", words(&bare));

    // A calibration that knows no table cannot place this scan.
    let guess = trueline(folder, &["apply", "table", "--calibration", "table/truth.toml", "--out", "x.csv"]);
    assert_eq!(code(&guess), 2, "{}", words(&guess));
    assert!(words(&guess).contains("axis `table` moves"), "{}", words(&guess));
}

/// Three scans, the table at another angle in each: the seam stays on the table.
#[test]
fn scans_at_three_angles_are_of_one_seam() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path();
    cast(folder, "table=rotary,part,stand:0/60/120", "5", "whole");
    // The same scan in three folders, without the readings while the table moves.
    let third = |name: &str, from_s: f64, to_s: f64| {
        fs::create_dir(folder.join(name)).unwrap();
        fs::copy(folder.join("whole/sensor.toml"), folder.join(name).join("sensor.toml")).unwrap();
        fs::copy(folder.join("whole/cell.toml"), folder.join(name).join("cell.toml")).unwrap();
        for table in ["robot.csv", "features.csv", "axes.csv"] {
            let text = fs::read_to_string(folder.join("whole").join(table)).unwrap();
            let (head, rows) = text.split_once('\n').unwrap();
            let wide = if table == "features.csv" { 0.0 } else { 0.4 };
            let kept = rows.lines().filter(|row| {
                let time_s: f64 = row.split(',').next().unwrap().parse().unwrap();
                (from_s - wide..=to_s + wide).contains(&time_s)
            });
            let kept: String = kept.map(|row| format!("{row}\n")).collect();
            fs::write(folder.join(name).join(table), format!("{head}\n{kept}")).unwrap();
        }
    };
    let start_s = 1.0;
    third("a", start_s + 0.5, start_s + 5.3);
    third("b", start_s + 7.2, start_s + 12.0);
    third("c", start_s + 13.9, start_s + 19.4);
    calibrated(folder, &["a", "b", "c"], 0);
    let result = result(folder);
    assert_eq!(result["lines"].as_array().unwrap().len(), 1);
    let sigma = &result["axes"][0]["sigma"];
    assert!(sigma["direction_deg"].as_f64().unwrap() < 0.1, "{sigma}");
    assert!(sigma["point_mm"].as_f64().unwrap() < 0.5, "{sigma}");
}

#[test]
fn what_hides_an_axis_is_said_with_its_cure() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path();
    cast(folder, "table=rotary,part,run:6", "4", "even");
    let said = calibrated(folder, &["even"], 0);
    let cure = "does not determine the time offset of axis table";
    assert!(said.contains(cure), "{said}");
    let result = result(folder);
    assert!(result["axes"][0]["time_offset_s"].is_null());
    // In use, the hidden offset is the same as for the line.
    let applied = trueline(folder, &["apply", "even", "--calibration", "result.json", "--out", "even.csv"]);
    assert_eq!(code(&applied), 0, "{}", words(&applied));
    let (point, direction) =
        (numbers(&result["lines"][0]["point_mm"]), numbers(&result["lines"][0]["direction"]));
    let text = fs::read_to_string(folder.join("even.csv")).unwrap();
    let off_mm = text.lines().skip(1).map(|row| {
        let place: Vec<f64> = row.split(',').skip(3).map(|field| field.parse().unwrap()).collect();
        let from: Vec<f64> = place.iter().zip(&point).map(|(p, q)| p - q).collect();
        let along: f64 = from.iter().zip(&direction).map(|(f, d)| f * d).sum();
        (from.iter().map(|f| f * f).sum::<f64>() - along * along).max(0.0).sqrt()
    });
    let largest_mm = off_mm.fold(0.0, f64::max);
    // Noise of 0.04 mm, and a bow.
    assert!(largest_mm < 0.5, "{largest_mm}");
    assert_eq!(result["warnings"][0]["code"], "axis-not-shown");
    assert_eq!(result["warnings"][0]["part"], "time_offset");
}

#[test]
fn files_of_axes_are_refused_with_file_and_line() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path();
    cast(folder, "table=rotary,part,swing:30@0.1", "3", "good");
    let axes = fs::read_to_string(folder.join("good/axes.csv")).unwrap();
    let cell = fs::read_to_string(folder.join("good/cell.toml")).unwrap();
    let line = |k: usize, row: &str| -> String {
        axes.lines()
            .enumerate()
            .map(|(i, own)| if i == k { format!("{row}\n") } else { format!("{own}\n") })
            .collect()
    };
    let first_s = axes.lines().nth(1).unwrap().split(',').next().unwrap();
    let cases: [(&str, String, &str); 10] = [
        ("axes.csv", axes.replace("table_deg", "table"), "table_deg"),
        ("axes.csv", axes.replace("table_deg", "desk_deg"), "unknown column"),
        ("axes.csv", line(5, &format!("{first_s},1.0")), "line 6"),
        (
            "axes.csv",
            line(5, &format!("{},-300", axes.lines().nth(5).unwrap().split(',').next().unwrap())),
            "jumps by",
        ),
        ("axes.csv", axes.lines().take(400).map(|row| format!("{row}\n")).collect(), "there is a reading at"),
        ("cell.toml", String::new(), "[[axis]]"),
        ("cell.toml", cell.replace("rotary", "round"), "round"),
        ("cell.toml", cell.replace("[[axis]]", "[[axes]]"), "`axes`"),
        ("cell.toml", format!("{cell}direction = [0, 0, 0]\n"), "axis.direction"),
        ("cell.toml", format!("{cell}in_pose = true\n"), "axis.in_pose"),
    ];
    for (file, text, expected) in cases {
        fs::write(folder.join("good").join(file), &text).unwrap();
        let output = trueline(folder, &["calibrate", "good"]);
        let said = words(&output);
        assert_eq!(code(&output), 2, "{expected}: {said}");
        assert!(said.contains(file) && said.contains(expected), "{expected}: {said}");
        fs::write(folder.join("good/axes.csv"), &axes).unwrap();
        fs::write(folder.join("good/cell.toml"), &cell).unwrap();
    }
    for option in [&["--target", "curve"][..], &["--use", "stripe"], &["--residual", "point-to-line"]] {
        let output = trueline(folder, &[&["calibrate", "good"][..], option].concat());
        assert_eq!(code(&output), 2, "{option:?}: {}", words(&output));
        assert!(words(&output).contains("external axes cannot be calibrated"), "{}", words(&output));
    }
}

/// The cells of a table by name of their column, as numbers.
fn column(folder: &Path, table: &str, name: &str) -> Vec<f64> {
    let text = fs::read_to_string(folder.join(table)).unwrap();
    let (head, rows) = text.split_once('\n').unwrap();
    let at = head.split(',').position(|own| own == name).unwrap();
    rows.lines().map(|row| row.split(',').nth(at).unwrap().parse().unwrap()).collect()
}

/// The value at a time between two rows.
fn between(times: &[f64], values: &[f64], at: f64) -> f64 {
    let next = times.partition_point(|time| *time <= at).clamp(1, times.len() - 1);
    let part = (at - times[next - 1]) / (times[next] - times[next - 1]);
    values[next - 1] + part * (values[next] - values[next - 1])
}

/// A robot's log with the values of its table in a column of their own.
fn log_with_axis(folder: &Path, from: &str, to: &str, head: &str) {
    fs::create_dir(folder.join(to)).unwrap();
    for file in ["features.csv", "sensor.toml"] {
        fs::copy(folder.join(from).join(file), folder.join(to).join(file)).unwrap();
    }
    let [times, angles] = ["time_s", "table_deg"].map(|name| column(&folder.join(from), "axes.csv", name));
    let robot = fs::read_to_string(folder.join(from).join("robot.csv")).unwrap();
    let mut log = format!("{head}\n");
    for row in robot.lines().skip(1) {
        let cells: Vec<&str> = row.split(',').take(8).collect();
        let angle = between(&times, &angles, cells[0].parse().unwrap());
        log += &format!("{},{angle:.6}\n", cells.join(","));
    }
    fs::write(folder.join(to).join("robot.csv"), log).unwrap();
}

#[test]
fn an_axis_comes_in_with_the_log_of_the_robot() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path();
    cast(folder, "table=rotary,part,swing:30@0.1", "3", "table");
    log_with_axis(folder, "table", "log", "t,x,y,z,q1,q2,q3,q4,eax_a");
    let import = |axis: &str, out: &str| {
        trueline(folder, &["import", "csv", "log", "--robot", "abb", "--axis", axis, "--out", out])
    };
    let output = import("table_deg=eax_a", "scan");
    assert_eq!(code(&output), 0, "{}", words(&output));
    assert!(words(&output).contains("taken to carry the part"), "{}", words(&output));
    let cell = fs::read_to_string(folder.join("scan/cell.toml")).unwrap();
    assert!(cell.contains("\"table\"") && cell.contains("\"rotary\"") && cell.contains("\"part\""), "{cell}");
    let [times, angles] = ["time_s", "table_deg"].map(|name| column(&folder.join("table"), "axes.csv", name));
    let scan = folder.join("scan");
    for (at, angle) in column(&scan, "axes.csv", "time_s").iter().zip(column(&scan, "axes.csv", "table_deg"))
    {
        // Written with six decimals.
        assert!((angle - between(&times, &angles, *at)).abs() < 1e-6);
    }
    assert_eq!(column(&scan, "axes.csv", "time_s"), column(&scan, "robot.csv", "time_s"));

    // Its load and its unit are stated, or asked for.
    let output = import("table_deg=eax_a,robot", "robot");
    assert_eq!(code(&output), 0, "{}", words(&output));
    assert!(fs::read_to_string(folder.join("robot/cell.toml")).unwrap().contains("\"robot\""));
    for (axis, expected) in [("table=eax_a", "names no unit"), ("table_deg=E1", "there is no column `E1`")] {
        let output = import(axis, "none");
        assert_eq!(code(&output), 2, "{}", words(&output));
        assert!(
            words(&output).contains(expected) && words(&output).contains("--axis table"),
            "{}",
            words(&output)
        );
    }
    fs::write(folder.join("log/cell.toml"), cell.replace("\"part\"", "\"sensor\"")).unwrap();
    let output = import("table=eax_a", "described");
    assert_eq!(code(&output), 0, "{}", words(&output));
    assert!(fs::read_to_string(folder.join("described/cell.toml")).unwrap().contains("\"sensor\""));
    let output = import("table_mm=eax_a", "shift");
    assert!(code(&output) == 2 && words(&output).contains("kind = \"rotary\""), "{}", words(&output));
}

#[test]
fn external_axes_of_a_log_of_rsi_are_its_columns() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path();
    fs::create_dir(folder.join("log")).unwrap();
    let cycle = |k: u32| {
        format!(
            "<Rob Type=\"KUKA\"><RIst X=\"{}\" Y=\"0\" Z=\"500\" A=\"0\" B=\"0\" C=\"180\"/><EIPos E1=\"{}\" E2=\"0\"/><IPOC>{}</IPOC></Rob>\n",
            1000 + k,
            2 * k,
            1000 + 4 * k
        )
    };
    fs::write(folder.join("log/robot.csv"), (0..5).map(cycle).collect::<String>()).unwrap();
    fs::write(folder.join("log/features.csv"), "time_s,x_mm,z_mm\n1.008,0.4,120\n").unwrap();
    fs::write(folder.join("log/sensor.toml"), "kind = \"profiler\"\n").unwrap();
    let output = trueline(
        folder,
        &["import", "csv", "log", "--robot", "kuka", "--axis", "table_deg=E1", "--out", "scan"],
    );
    assert_eq!(code(&output), 0, "{}", words(&output));
    assert!(words(&output).contains("not used: E2"), "{}", words(&output));
    let found = column(&folder.join("scan"), "axes.csv", "table_deg");
    assert!(found.iter().zip(0..).all(|(angle, k)| (angle - 2.0 * f64::from(k)).abs() < 1e-9), "{found:?}");
    assert_eq!(column(&folder.join("scan"), "axes.csv", "time_s")[1], 1.004);
}

/// The robot stands at each reading, with the table at another angle.
#[test]
fn an_axis_is_found_at_stops() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path();
    cast(folder, "table=rotary,part,swing:40@0.07", "6", "moving");
    let moving = folder.join("moving");
    let truth: toml::Table = toml::from_str(&fs::read_to_string(moving.join("truth.toml")).unwrap()).unwrap();
    let axis = &truth["axes"].as_array().unwrap()[0];
    let (late_s, axis_late_s) =
        (truth["time_offset_s"].as_float().unwrap(), axis["time_offset_s"].as_float().unwrap());
    let names = ["x_mm", "y_mm", "z_mm", "qw", "qx", "qy", "qz"];
    let (robot_s, poses) =
        (column(&moving, "robot.csv", "time_s"), names.map(|name| column(&moving, "robot.csv", name)));
    let [axis_s, angles] = ["time_s", "table_deg"].map(|name| column(&moving, "axes.csv", name));
    let (mut stops, mut values, mut features) =
        (format!("stop,{}\n", names.join(",")), "stop,table_deg\n".to_owned(), String::new());
    let text = fs::read_to_string(moving.join("features.csv")).unwrap();
    let (head, rows) = text.split_once('\n').unwrap();
    features += &format!("{}\n", head.replacen("time_s", "stop", 1));
    for (stop, row) in rows.lines().step_by(10).enumerate() {
        let (stamp, rest) = row.split_once(',').unwrap();
        let exposed_s = stamp.parse::<f64>().unwrap() - late_s;
        let mut pose = poses.each_ref().map(|values| between(&robot_s, values, exposed_s));
        let norm = pose[3..].iter().map(|q| q * q).sum::<f64>().sqrt();
        pose[3..].iter_mut().for_each(|q| *q /= norm);
        stops += &format!("{stop},{}\n", pose.map(|number| number.to_string()).join(","));
        features += &format!("{stop},{rest}\n");
        let angle = between(&axis_s, &angles, exposed_s + axis_late_s);
        values.insert_str("stop,table_deg\n".len(), &format!("{stop},{angle}\n"));
    }
    fs::create_dir(folder.join("stops")).unwrap();
    for (name, text) in [("poses.csv", &stops), ("features.csv", &features), ("axes.csv", &values)] {
        fs::write(folder.join("stops").join(name), text).unwrap();
    }
    for name in ["sensor.toml", "cell.toml"] {
        fs::copy(moving.join(name), folder.join("stops").join(name)).unwrap();
    }
    let said = calibrated(folder, &["stops"], 0);
    assert!(!said.contains("time offset of axis"), "{said}");
    let result = result(folder);
    let found = &result["axes"][0];
    assert!(result["time_offset_s"].is_null() && found["time_offset_s"].is_null(), "{found}");
    let direction = axis["direction"].as_array().unwrap();
    let pairs = numbers(&found["direction"]).into_iter().zip(direction);
    let cosine: f64 = pairs.map(|(found, truth)| found * truth.as_float().unwrap()).sum();
    let sigma_deg = found["sigma"]["direction_deg"].as_f64().unwrap();
    // Two directions square to the axis, four sigmas each.
    assert!(cosine.min(1.0).acos().to_degrees() < 5.7 * sigma_deg && sigma_deg < 0.3, "{cosine} {sigma_deg}");
    let applied = trueline(folder, &["apply", "stops", "--calibration", "result.json", "--out", "seam.csv"]);
    assert_eq!(code(&applied), 0, "{}", words(&applied));

    let (kept, _) = values.trim_end().rsplit_once('\n').unwrap();
    fs::write(folder.join("stops/axes.csv"), format!("{kept}\n")).unwrap();
    let output = trueline(folder, &["calibrate", "stops"]);
    assert!(code(&output) == 2 && words(&output).contains("0 rows of stop 0"), "{}", words(&output));
}

#[test]
fn files_of_axes_that_would_be_ignored_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path();
    cast(folder, "table=rotary,part,swing:30@0.1", "3", "good");
    let refused = |expected: &str| {
        let output = trueline(folder, &["calibrate", "good"]);
        let said = words(&output);
        assert!(
            code(&output) == 2 && said.contains(expected) && said.contains("hint:"),
            "{expected}: {said}"
        );
    };
    let good = |name: &str| folder.join("good").join(name);
    fs::copy(good("axes.csv"), good("axis-table.csv")).unwrap();
    refused("axis-table.csv: has values of an axis, and axes.csv is there as well");
    fs::rename(good("axes.csv"), good("axis-desk.csv")).unwrap();
    refused("axis-desk.csv: has values of an axis that cell.toml does not name");
    fs::remove_file(good("axis-desk.csv")).unwrap();
    fs::remove_file(good("axis-table.csv")).unwrap();
    refused("cell.toml has axis `table`");

    // Of several sensors the axes are beside the robot.
    let cell = fs::read(good("cell.toml")).unwrap();
    let output = trueline(folder, &["simulate", "--quiet", "--sensors", "2", "--out", "pair"]);
    assert_eq!(code(&output), 0, "{}", words(&output));
    fs::write(folder.join("pair/sensors/a/cell.toml"), cell).unwrap();
    let output = trueline(folder, &["calibrate", "pair"]);
    let said = words(&output);
    assert!(
        code(&output) == 2 && said.contains("a/cell.toml") && said.contains("beside robot.csv"),
        "{said}"
    );
    fs::remove_file(folder.join("pair/sensors/a/cell.toml")).unwrap();

    // Commands for one sensor list the available ones.
    for command in [&["doctor", "pair"][..], &["evaluate", "pair", "--calibration", "r.json"]] {
        let output = trueline(folder, command);
        let said = words(&output);
        assert!(code(&output) == 2 && said.contains("2 sensors (a, b)"), "{command:?}: {said}");
        assert!(said.contains("pair/sensors/a"), "{said}");
    }
}

/// Poses of one attitude, with a table that swings: the answer names the axis and the cure.
#[test]
fn a_robot_that_keeps_its_attitude_hides_the_axis_by_name() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path();
    let attitude = folder.join("attitude");
    fs::create_dir(&attitude).unwrap();
    // A straight seam along y of the part at x = 0.8 m, z = 0; the sensor looks down on it from 0.2 m and 50 mm beside the tool. The table turns about
    // the vertical axis through (0.8, 0.3) m. Everything is exact.
    let (mut robot, mut features, mut axes) = (
        "time_s,x_mm,y_mm,z_mm,qw,qx,qy,qz\n".to_owned(),
        "time_s,x_mm,z_mm\n".to_owned(),
        "time_s,table_deg\n".to_owned(),
    );
    for k in 0..4000_u32 {
        let t = f64::from(k) * 0.005;
        let angle = 20.0 * (0.6 * t).sin();
        let sway =
            [30.0 * (2.1 * t).sin() + 12.0 * (3.7 * t).sin(), 15.0 * t - 150.0, 25.0 * (1.3 * t).cos()];
        robot += &format!("{t},{},{},{},0,1,0,0\n", 800.0 + sway[0], 300.0 + sway[1], 250.0 + sway[2]);
        axes += &format!("{t},{angle}\n");
        if k % 10 == 5 {
            // Sheet through y of the tool: where the seam, turned about (800, 300), crosses it.
            let turn = angle.to_radians();
            let x_mm = 800.0 - (sway[1]) * turn.tan();
            features += &format!("{t},{},{}\n", x_mm - (800.0 + sway[0]) - 50.0, 250.0 + sway[2]);
        }
    }
    for (name, text) in [("robot.csv", robot), ("features.csv", features), ("axes.csv", axes)] {
        fs::write(attitude.join(name), text).unwrap();
    }
    fs::write(attitude.join("sensor.toml"), "kind = \"profiler\"\n").unwrap();
    fs::write(
        attitude.join("cell.toml"),
        "[[axis]]\nname = \"table\"\nkind = \"rotary\"\ncarries = \"part\"\n",
    )
    .unwrap();
    let said = calibrated(folder, &["attitude"], 1);
    assert!(said.contains("axis table") && said.contains("tilt the sensor by ±10°"), "{said}");
    assert!(!said.contains("no solution"), "{said}");
}
