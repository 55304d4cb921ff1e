//! Logs as other programs write them, with whatever they put around, before and into their tables.
#![allow(clippy::print_stderr, reason = "a skipped test says so")]

use std::fs;
use std::path::{Path, PathBuf};
use trueline_dataset::Error;
use trueline_dataset::import::csv_folder::{CsvFolder, Imported, ProfileSource};
use trueline_dataset::import::foreign_csv::{Rate, TableForm};
use trueline_dataset::import::profiles::{EvenColumns, ProfileFormat, Timing, times};
use trueline_dataset::import::robot_layout::RobotLayout;

/// A folder of `shared/data/cases`, or `None` with a word where it is not.
fn case(name: &str) -> Option<PathBuf> {
    let folder = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/data/cases")).join(name);
    if folder.exists() {
        return Some(folder);
    }
    eprintln!("SKIPPED: cases_log_formats: {} is not there", folder.display());
    None
}

fn read_case(name: &str, robot: Option<&str>, columns: &str) -> Option<Result<Imported, Error>> {
    let folder = case("log-formats")?.join(name);
    let columns = columns.split(',').filter(|name| !name.is_empty()).map(str::to_owned).collect();
    Some(
        CsvFolder {
            robot: folder.join("robot.csv"),
            features: folder.join("features.csv"),
            sensor: folder.join("sensor.toml"),
            layout: robot.and_then(RobotLayout::named),
            robot_form: TableForm { columns, ..TableForm::default() },
            ..CsvFolder::default()
        }
        .read(),
    )
}

/// The files of `shared` are one log in six writings.
#[test]
fn one_log_in_six_writings_is_one_motion() {
    const NO_HEADER: &str = "time_s,x_mm,y_mm,z_mm,qw,qx,qy,qz";
    // The reference prints stamps of nine digits, to half of 1e-8 s. The rounding of the others is added: the last printed
    // digit of stamps, positions and angles.
    let reference_s = 5e-9;
    for (name, robot, columns, (stamp_s, position_mm, angle_rad), starts_s) in [
        ("no-header", None, NO_HEADER, (1e-8, 1e-5, 1e-6), 0.0),
        ("hash-header", None, "", (1e-9, 1e-3, 1e-6), 0.0),
        ("hash-header", Some("ros"), "", (1e-9, 1e-3, 1e-6), 0.0),
        ("plain-names", Some("xarm"), "", (1e-4, 1e-3, 1e-5), 0.0),
        ("pose-string", Some("ur"), "", (1e-4, 1e-3, 1e-5), 0.0),
        // `date -u -d "2026-03-04 09:15:00" +%s`.
        ("date-stamps", None, "", (1e-6, 1e-5, 1e-6), 1_772_615_700.0),
        // The cycle is that of the controller, exactly 4 ms; the poses are the same ones.
        ("rsi-xml", Some("kuka"), "", (f64::INFINITY, 1e-3, 1e-5), 0.0),
        ("rsi-xml", None, "", (f64::INFINITY, 1e-3, 1e-5), 0.0),
    ] {
        let Some(imported) = read_case(name, robot, columns) else { return };
        let Some(reference) = read_case("no-header", None, NO_HEADER) else { return };
        let robot = imported.unwrap_or_else(|error| panic!("{name}: {error}")).recording.robot;
        let reference = reference.unwrap().recording.robot;
        assert!(robot.len() >= 100 && robot.len() <= reference.len(), "{name}: {}", robot.len());
        for (found, expected) in robot.iter().zip(&reference) {
            let late_s = (found.stamp_ns - expected.stamp_ns) as f64 * 1e-9 - starts_s;
            assert!(late_s.abs() <= stamp_s + reference_s, "{name}: {late_s}");
            let [a, b] = [found, expected].map(|sample| sample.base_from_tool);
            assert!((a.translation.vector - b.translation.vector).amax() * 1e3 <= position_mm, "{name}");
            assert!(a.rotation.angle_to(&b.rotation) <= 2.0 * angle_rad, "{name}");
        }
    }
    let rsi = read_case("rsi-xml", Some("kuka"), "").unwrap().unwrap();
    assert!(rsi.recording.robot.windows(2).all(|two| two[1].stamp_ns - two[0].stamp_ns == 4_000_000));
}

#[test]
fn what_cannot_be_read_is_named_for_what_it_is() {
    let Some(Err(error)) = read_case("no-header", Some("abb"), "") else { return };
    assert!(error.to_string().ends_with("no header line: the file begins with a row of 8"), "{error}");
    assert!(error.hint().contains("--columns"), "{}", error.hint());
    let Some(folder) = case("log-formats") else { return };
    let file = folder.join("gocator-surface/surface.csv");
    let surface = |format| Some(ProfileSource { file: file.clone(), format, ..ProfileSource::default() });
    let logs = CsvFolder {
        robot: folder.join("pose-string/robot.csv"),
        layout: RobotLayout::named("ur"),
        sensor: folder.join("pose-string/sensor.toml"),
        ..CsvFolder::default()
    };
    // In the place of profiles, whatever their format is called, of features and of the robot's poses.
    for folder in [
        CsvFolder { profiles: surface(None), sensor: PathBuf::new(), ..logs.clone() },
        CsvFolder { profiles: surface(Some(ProfileFormat::Rows)), sensor: PathBuf::new(), ..logs.clone() },
        CsvFolder { features: file.clone(), ..logs.clone() },
        CsvFolder { robot: file.clone(), ..logs.clone() },
    ] {
        let error = folder.read().unwrap_err();
        assert!(error.to_string().contains("a Gocator surface (section `Part`)"), "{error}");
    }
}

/// A log of RSI whose 3rd cycle is broken: errors name the line of the file, however the elements stand in it.
#[cfg(feature = "foreign-tables")]
#[test]
fn errors_of_rsi_are_at_the_line_of_the_pose() {
    let cycle = |k: usize, x: &str| {
        format!(
            "<Rob Type=\"KUKA\"><RIst X=\"{x}\" Y=\"0\" Z=\"1\" A=\"0\" B=\"0\" C=\"0\"/><IPOC>{}</IPOC></Rob>",
            1000 + 4 * k
        )
    };
    let cycles =
        |third: &str| (1..=4).map(|k| cycle(k, if k == 3 { third } else { "0" })).collect::<Vec<_>>();
    let features = "time_s,x_mm,z_mm\n1.006,0,100\n1.012,0,100\n";
    let lines = |robot: &str| import(robot, features, |_| {}).unwrap_err().to_string();
    let bad = cycles("abc");
    for (robot, line) in [
        (bad.join("\n"), 3),
        (bad.join("\n\n"), 5),
        (format!("<?xml version=\"1.0\"?>\n<Log>\n{}\n</Log>\n", bad.join("\n")), 5),
        (bad.join("\n").replace("><", ">\n<"), 10),
        (bad.join(""), 1),
        (format!("# recorded by x\n{}", bad.join("\n")), 4),
    ] {
        let expected = format!("line {line}, column `x_mm`: expected a number, found `abc`");
        assert!(lines(&robot).ends_with(&expected), "{}", lines(&robot));
    }
    let mut cut = cycles("0");
    cut[2].truncate(50);
    let cut = lines(&cut.join("\n"));
    assert!(cut.contains("robot.csv, line 3: is broken XML"), "{cut}");
    let back = cycles("0").join("\n").replace("1012", "12");
    assert!(lines(&back).contains("line 3, column `time_ms`: time runs backwards"), "{}", lines(&back));
    let dated = cycles("0").join("\n").replace("<Rob", "2026-11-28 14:03:11;<Rob");
    let notes = import(&dated, features, |_| {}).unwrap().notes;
    assert!(notes.iter().any(|note| note.ends_with("between the elements of RSI is ignored")), "{notes:?}");
}

/// A folder with a robot's log and the features of a profiler.
fn import(robot: &str, features: &str, change: impl FnOnce(&mut CsvFolder)) -> Result<Imported, Error> {
    let dir = tempfile::tempdir().unwrap();
    let path = |name: &str| dir.path().join(name);
    fs::write(path("robot.csv"), robot).unwrap();
    fs::write(path("features.csv"), features).unwrap();
    fs::write(path("sensor.toml"), "kind = \"profiler\"\n").unwrap();
    let mut folder = CsvFolder {
        robot: path("robot.csv"),
        features: path("features.csv"),
        sensor: path("sensor.toml"),
        ..CsvFolder::default()
    };
    change(&mut folder);
    folder.read()
}

fn kuka(folder: &mut CsvFolder) {
    folder.layout = RobotLayout::named("kuka");
}

const FEATURES: &str = "time_s,x_mm,z_mm\n0.5,1,2\n";

fn stamps_s(imported: &Imported) -> Vec<f64> {
    imported.recording.robot.iter().map(|sample| sample.stamp_ns as f64 * 1e-9).collect()
}

#[test]
fn a_trace_of_kuka_with_its_block_its_clock_and_its_commas() {
    let trace = "KRC Trace;V8.6\nProgramm;/R1/scan.src\nKanal;Faktor\nX;1\n\n\
        Zeit [s];$POS_ACT_MES.X;$POS_ACT_MES.Y;$POS_ACT_MES.Z;$POS_ACT_MES.A;$POS_ACT_MES.B;$POS_ACT_MES.C\n\
        23:59:59,9960;1130,684;12,854;382,619;-173,3834;-0,0614;164,0947\n\
        00:00:00.0000;1130,700;12,860;382,620;-173,3840;-0,0620;164,0950\n";
    let features = "Timestamp,x_mm,z_mm\n23:59:59.998,1,2\n00:00:00.002,1,2\n";
    let imported = import(trace, features, kuka).unwrap();
    let near = |found: f64, expected: f64| (found - expected).abs() < 1e-9;
    let times = stamps_s(&imported);
    assert!(near(times[0], 86_399.996) && near(times[1], 86_400.0), "{times:?}");
    let seen: Vec<f64> = imported.recording.features.iter().map(|f| f.stamp_ns as f64 * 1e-9).collect();
    assert!(near(seen[0], 86_399.998) && near(seen[1], 86_400.002), "{seen:?}");
    for words in ["columns named in line 6", "decimal commas", "times of day", "read as KUKA"] {
        assert!(imported.notes.iter().any(|note| note.contains(words)), "{words}: {:?}", imported.notes);
    }
    // The sensor began after midnight.
    let late = import(trace, "Timestamp,x_mm,z_mm\n00:00:00.002,1,2\n", kuka).unwrap();
    assert!(near(late.recording.features[0].stamp_ns as f64 * 1e-9, 86_400.002));
    // Dates of one log, and times of day of the other.
    let dated = import(trace, "Timestamp,x_mm,z_mm\n2026-03-05 00:00:00.002,1,2\n", kuka).unwrap();
    assert!(near(dated.recording.features[0].stamp_ns as f64 * 1e-9, 86_400.002), "{:?}", dated.notes);
    // The place of a mistake is that in the file.
    let error = import(&trace.replace("1130,700", "none"), features, kuka).unwrap_err();
    assert!(error.to_string().ends_with("line 8, column `x_mm`: expected a number, found `none`"), "{error}");
    let error = import(&trace.replace("00:00:00.0000", "0,5"), features, kuka).unwrap_err();
    assert!(error.to_string().contains("line 8") && error.to_string().contains("a time of day"), "{error}");
}

#[test]
fn units_in_a_row_names_behind_a_hash_and_poses_in_one_cell() {
    let t = "0,1,0,0,0\n0.004,2,0,0,0\n0.008,3,0,0,0\n";
    let rows = t.replace(",0,0,0\n", ",0,0,90,0,0\n");
    for log in [
        format!("Zeit,X,Y,Z,A,B,C\ns,mm,mm,mm,°,°,°\n{rows}"),
        format!("# Zeit,X,Y,Z,A,B,C\n{rows}"),
        format!("t X Y Z A B C\n{}", rows.replace(',', " ")),
        format!("Zeit,X,Y,Z,A,B,C\n{rows}"),
        rows.lines().fold("t;$POS_ACT_MES\n".to_owned(), |log, row| {
            let [t, x, y, z, a, b, c] = row.split(',').collect::<Vec<_>>()[..] else { panic!() };
            log + &format!("{t};{{E6POS: X {x}, Y {y}, Z {z}, A {a}, B {b}, C {c}, S 2, T 35}}\n")
        }),
    ] {
        let imported = import(&log, FEATURES, kuka).unwrap_or_else(|error| panic!("{log}{error}"));
        assert_eq!(stamps_s(&imported), [0.0, 0.004, 0.008], "{log}");
        let last = imported.recording.robot[2].base_from_tool;
        assert!(
            (last.translation.vector.x - 3e-3).abs() < 1e-15
                && (last.rotation.angle() - std::f64::consts::FRAC_PI_2).abs() < 1e-4
        );
    }
}

#[test]
fn a_log_without_a_clock_has_a_rate_and_lines_that_are_skipped() {
    let log = "1;2;3\n4;5;6\nX;Y;Z;A;B;C\n1;0;0;90;0;0\n2;0;0;90;0;0\n";
    let missing = import("X,Y,Z,A,B,C\n1,0,0,90,0,0\n", FEATURES, kuka).unwrap_err();
    assert!(missing.to_string().contains("column `time_s` is missing"), "{missing}");
    let with = |folder: &mut CsvFolder| {
        kuka(folder);
        folder.robot_form.rate = Some(Rate { hz: 250.0, start_s: 1.5 });
        folder.robot_form.skipped_lines = 2;
    };
    assert_eq!(stamps_s(&import(log, FEATURES, with).unwrap()), [1.5, 1.504]);
    // Names of a file without, and a column that is not used.
    let named = |folder: &mut CsvFolder| {
        kuka(folder);
        folder.robot_form.columns = "t,-,X,Y,Z,A,B,C".split(',').map(str::to_owned).collect();
    };
    let rows = "0,7,1,0,0,90,0,0\n0.1,7,2,0,0,90,0,x\n";
    let error = import(rows, FEATURES, named).unwrap_err();
    assert!(error.to_string().ends_with("line 2, column `c_deg`: expected a number, found `x`"), "{error}");
    let error = import("0,1,0,0,90,0,0\n", FEATURES, named).unwrap_err();
    assert!(error.to_string().contains("`--columns` names 8 columns, and the rows have 7"), "{error}");
}

#[test]
fn a_map_finds_a_name_without_its_unit_and_offers_the_nearest() {
    let log = "Zeit [s],Px [mm],Y,Z,A,B,C\n0,1,0,0,90,0,0\n";
    let map = |ours: &str, theirs: &str| {
        let item =
            trueline_dataset::import::foreign_csv::ColumnMapping { ours: ours.into(), theirs: theirs.into() };
        move |folder: &mut CsvFolder| {
            kuka(folder);
            folder.robot_map = vec![item];
        }
    };
    for theirs in ["Px [mm]", "Px", "px"] {
        assert_eq!(stamps_s(&import(log, FEATURES, map("x_mm", theirs)).unwrap()), [0.0], "{theirs}");
    }
    let error = import(log, FEATURES, map("time_s", "Zeitt")).unwrap_err();
    assert!(error.to_string().contains("no column `Zeitt`"), "{error}");
    assert!(error.hint().contains("--robot-map 'time_s=Zeit [s]'"), "{}", error.hint());
}

/// Scipy's angles of one pose (see robots.rs), in the orders of the makers.
#[test]
fn makers_by_name_have_their_own_order_of_angles() {
    let xyz = "61.97,-17.996,145.008";
    let zyz = "-0.580786,25.957870,83.658513";
    let fixed = "25.819737,2.771150,83.713024";
    let zyx = "83.713024,2.771150,25.819737";
    let franka = "0.109380306,0.992823515,-0.048346833,0,-0.892449139,0.119506411,0.435031898,0,0.437687655,-0.004436832,0.899116139,0,0.06197,-0.017996,0.145008,1";
    let elements: Vec<String> = (0..16).map(|k| format!("O_T_EE[{k}]")).collect();
    let named = elements.join(",");
    for (robot, names, numbers) in [
        ("kawasaki", "X,Y,Z,O,A,T", format!("{xyz},{zyz}")),
        ("doosan", "x,y,z,a,b,c", format!("{xyz},{zyz}")),
        ("comau", "X,Y,Z,A,E,R", format!("{xyz},{zyz}")),
        ("mitsubishi", "X,Y,Z,A,B,C", format!("{xyz},{fixed}")),
        ("xarm", "x,y,z,roll,pitch,yaw", format!("{xyz},{fixed}")),
        ("denso", "X,Y,Z,RX,RY,RZ", format!("{xyz},{fixed}")),
        ("omron", "x,y,z,rx,ry,rz", format!("{xyz},{fixed}")),
        ("epson", "X,Y,Z,U,V,W", format!("{xyz},{zyx}")),
        ("nachi", "X,Y,Z,roll,pitch,yaw", format!("{xyz},{zyx}")),
        ("franka", &named, franka.to_owned()),
    ] {
        let log = format!("t,{names}\n0,{numbers}\n");
        let layout = |folder: &mut CsvFolder| folder.layout = RobotLayout::named(robot);
        let imported = import(&log, FEATURES, layout).unwrap_or_else(|error| panic!("{robot}: {error}"));
        let pose = imported.recording.robot[0].base_from_tool;
        let wxyz = nalgebra::Quaternion::new(0.729383791, 0.150630140, 0.166590790, 0.646186781);
        let rotation = nalgebra::UnitQuaternion::new_normalize(wxyz);
        // Angles are printed to 1e-6°, elements to 1e-9.
        assert!(pose.rotation.angle_to(&rotation) < 5e-8, "{robot}");
        let off_mm = pose.translation.vector * 1e3 - nalgebra::Vector3::new(61.97, -17.996, 145.008);
        assert!(off_mm.norm() < 1e-9, "{robot}");
    }
    // Franka's names are nobody else's.
    let log = format!("time,{named}\n0,{franka}\n0.002,{franka}\n");
    let imported = import(&log, FEATURES, |_| {}).unwrap();
    assert!(imported.notes.iter().any(|note| note.contains("read as Franka")), "{:?}", imported.notes);
}

fn profiles(text: &str, format: &str, timing: Option<Timing>) -> Result<Imported, Error> {
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join("p.csv"), text).unwrap();
    fs::write(dir.path().join("robot.csv"), "t,X,Y,Z,A,B,C\n0,1,2,3,0,0,0\n").unwrap();
    CsvFolder {
        robot: dir.path().join("robot.csv"),
        profiles: Some(ProfileSource {
            file: dir.path().join("p.csv"),
            format: ProfileFormat::named(format),
            columns: Some(EvenColumns { first_mm: -0.15, step_mm: 0.1 }),
            timing,
            ..ProfileSource::default()
        }),
        layout: RobotLayout::named("kuka"),
        ..CsvFolder::default()
    }
    .read()
}

const RATE: Option<Timing> = Some(Timing::Rate { first_ns: 0, hz: 10.0 });

/// x of the first point of each profile, mm.
fn first_x_mm(imported: &Imported) -> Vec<f64> {
    imported.profiles.iter().map(|profile| (profile.points[0].x_m * 1e6).round() / 1e3).collect()
}

#[test]
fn a_counter_before_the_heights_is_none_of_them() {
    let block = "\"LJ-X Navigator\",\"2.1\"\nDate,2026/03/04\nX pitch,0.1\n\nNo.,0,1,2,3\n";
    let rows = "0,10.0,10.1,10.2,10.3\n1,10.0,10.1,-99999.9999,10.3\n3,-99.9999,10.1,10.2,10.3\n";
    for text in
        [format!("{block}{rows}"), rows.to_owned(), format!("Counter;0;1;2;3\n{}", rows.replace(',', ";"))]
    {
        let imported = profiles(&text, "keyence-lj-x", RATE).unwrap_or_else(|error| panic!("{text}{error}"));
        assert_eq!(first_x_mm(&imported), [-0.15, -0.15, -0.05], "{text}");
        let frames: Vec<_> = imported.profiles.iter().map(|profile| profile.frame).collect();
        assert_eq!(frames, [Some(0), Some(1), Some(3)]);
        let said = |words: &str| imported.notes.iter().any(|note| note.contains(words));
        assert!(
            said("counts the profiles and is not a height; 1 profiles are missing"),
            "{:?}",
            imported.notes
        );
    }
    // No counter, and one value more than there is room for.
    let text = "10.5,10.0,10.1,10.2,10.3\n10.5,10.0,10.1,10.2,10.3\n10.5,10.0,10.1,10.2,10.3\n";
    let error = profiles(text, "keyence-lj-x", RATE).unwrap_err().to_string();
    assert!(
        error.ends_with("line 1: 5 values, but a start of -0.15 mm and a pitch of 0.1 mm require 4"),
        "{error}"
    );
    // The first column saw nothing in the first profile.
    let empty = profiles(",10.1,10.2,10.3\n10.0,10.1,10.2,10.3\n", "rows", RATE).unwrap();
    assert_eq!(first_x_mm(&empty), [-0.05, -0.15]);
}

#[test]
fn times_of_profiles_and_points_are_read_by_name() {
    let at = |text: &str, format: &str| -> Vec<i64> {
        let imported = profiles(text, format, None).unwrap_or_else(|error| panic!("{text}{error}"));
        imported.profiles.iter().map(|profile| profile.stamp_ns).collect()
    };
    let rows = "10.0,10.1,10.2,10.3";
    assert_eq!(
        at(&format!("Timestamp,z0,z1,z2,z3\n0.1,{rows}\n0.11,{rows}\n"), "rows"),
        [100_000_000, 110_000_000]
    );
    assert_eq!(
        at(&format!("No.,Time [ms],z0,z1,z2,z3\n7,100,{rows}\n8,110,{rows}\n"), "rows"),
        [100_000_000, 110_000_000]
    );
    assert_eq!(
        at(&format!("Time,z0,z1,z2,z3\n00:00:01.5,{rows}\n00:00:02.5,{rows}\n"), "rows"),
        [1_500_000_000, 2_500_000_000]
    );
    let counted = format!("No.,Time,z0,z1,z2,z3\n7,00:00:01.5,{rows}\n8,00:00:02.5,{rows}\n");
    assert_eq!(at(&counted, "keyence-lj-x"), [1_500_000_000, 2_500_000_000]);
    let points = "Timestamp,X,Z\n0.1,-1,100\n0.1,1,100\n0.12,-1,100\n0.12,1,100\n";
    assert_eq!(at(points, "points"), [100_000_000, 120_000_000]);
    assert_eq!(at(points, "scancontrol"), [100_000_000, 120_000_000]);
    assert_eq!(
        at(&points.replace("Timestamp", "Zeit [ms]").replace("0.1", "1"), "points"),
        [1_000_000, 12_000_000]
    );
    let clock = "Timestamp,X,Z\n00:00:01.1,-1,100\n00:00:01.1,1,100\n00:00:01.2,-1,100\n";
    assert_eq!(at(clock, "points"), [1_100_000_000, 1_200_000_000]);
}

#[test]
fn a_list_of_times_has_a_unit_a_clock_and_a_rate() {
    let dir = tempfile::tempdir().unwrap();
    let read = |text: &str| {
        fs::write(dir.path().join("times.txt"), text).unwrap();
        times::read(&dir.path().join("times.txt")).unwrap()
    };
    let expected = [1_000_000_000, 1_010_000_000, 1_020_000_000];
    for text in [
        "1\n1.01\n1.02\n",
        "# s\n1,0\n1,01\n1,02\n",
        "time_ms\n1000\n1010\n1020\n",
        "00:00:01\n00:00:01.01\n00:00:01,02\n",
    ] {
        assert_eq!(read(text).stamps_ns, expected, "{text}");
    }
    assert_eq!(read("1\n1.01\n1.02\n").words(), "3 stamps, 100.000 a second");
}
