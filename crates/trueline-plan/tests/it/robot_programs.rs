//! A path in every language of robots reads back as the path.

use nalgebra::{Rotation3, UnitQuaternion, Vector3};
use std::path::Path;
use trueline_dataset::{RobotSample, robot_csv};
use trueline_geometry::Pose;
use trueline_plan::robot_program::krl_rsi::{self, RsiContext};
use trueline_plan::robot_program::waypoints::SHORTEST_S;
use trueline_plan::robot_program::{Language, ProgramFile, Waypoints};

/// 12 s from rest to rest: it weaves, and turns about all axes, through W = 180° and past it.
fn path() -> Vec<RobotSample> {
    let pose = |time_s: f64| {
        let part = (time_s / 12.0).clamp(0.0, 1.0);
        let s = 12.0 * part.powi(3) * (10.0 - 15.0 * part + 6.0 * part * part);
        let at = Vector3::new(1.0 + 0.02 * s, -0.3 + 0.03 * (1.7 * s).sin(), 0.4 + 0.02 * (1.1 * s).cos());
        let turn = Rotation3::from_axis_angle(&Vector3::x_axis(), 3.1 + 0.2 * (0.9 * s).sin())
            * Rotation3::from_axis_angle(&Vector3::y_axis(), 0.3 * (1.3 * s).sin())
            * Rotation3::from_axis_angle(&Vector3::z_axis(), 0.5 + 0.3 * (0.7 * s).cos());
        Pose::from_parts(at.into(), UnitQuaternion::from_rotation_matrix(&turn))
    };
    (0..=3000_i64)
        .map(|k| RobotSample {
            stamp_ns: 4_000_000 * k,
            device_ns: None,
            base_from_tool: pose(k as f64 * 0.004),
        })
        .collect()
}

/// Poses in m and when the tool is to be there, s.
type Read = Vec<(f64, Vector3<f64>, Rotation3<f64>)>;
type Reader = fn(&str) -> Read;

fn numbers(text: &str) -> Vec<f64> {
    text.split(|c: char| !(c.is_ascii_digit() || "+-.eE".contains(c)))
        .filter_map(|w| w.parse().ok())
        .collect()
}

fn about(axis: usize, degrees: f64) -> Rotation3<f64> {
    Rotation3::from_axis_angle(
        &[Vector3::x_axis(), Vector3::y_axis(), Vector3::z_axis()][axis],
        degrees.to_radians(),
    )
}

fn read_rapid(text: &str) -> Read {
    let mut time_s = 0.0;
    let moves =
        text.lines().map(str::trim).filter(|line| line.starts_with("MoveJ") || line.starts_with("MoveL"));
    moves
        .map(|line| {
            let n = numbers(line.split_once('[').unwrap().1);
            time_s += line.split_once("\\T:=").map_or(0.0, |(_, after)| numbers(after)[0]);
            let q = nalgebra::Quaternion::new(n[3], n[4], n[5], n[6]);
            assert!((q.norm() - 1.0).abs() < 1e-6);
            let turn = UnitQuaternion::from_quaternion(q).to_rotation_matrix();
            (time_s, Vector3::new(n[0], n[1], n[2]) * 1e-3, turn)
        })
        .collect()
}

fn read_krl(text: &str) -> Read {
    let end = text.lines().find_map(|line| line.trim().strip_prefix("TIME_BLOCK END = ")).unwrap();
    let total_s: f64 = end.parse().unwrap();
    let frame = |line: &str| {
        let value = |name: &str| {
            let after = line.split_once(&format!("{name} ")).unwrap().1;
            after.split([',', '}']).next().unwrap().trim().parse::<f64>().unwrap()
        };
        let line_turn = about(2, value("A")) * about(1, value("B")) * about(0, value(" C"));
        (Vector3::new(value("X"), value("Y"), value("Z")) * 1e-3, line_turn)
    };
    let mut read = Vec::new();
    let mut time_s = 0.0;
    let mut waiting = None;
    for line in text.lines().map(str::trim) {
        if line.starts_with("PTP {") {
            let (at, turn) = frame(line);
            read.push((0.0, at, turn));
        } else if line.starts_with("SPL {") {
            assert!(waiting.replace(frame(line)).is_none(), "a part without its time");
        } else if let Some(part) = line.strip_prefix("TIME_BLOCK PART = ") {
            time_s += part.parse::<f64>().unwrap() / 100.0 * total_s;
            let (at, turn) = waiting.take().unwrap();
            read.push((time_s, at, turn));
        }
    }
    read
}

fn read_urscript(text: &str) -> Read {
    let step_s = 0.008;
    let mut time_s = 0.0;
    let poses = text.lines().filter(|line| line.contains("p["));
    poses
        .map(|line| {
            let (inside, after) = line.split_once("p[").unwrap().1.split_once(']').unwrap();
            let n = numbers(inside);
            time_s += numbers(after).first().map_or(0.0, |steps| steps * step_s);
            let turn = Rotation3::from_scaled_axis(Vector3::new(n[3], n[4], n[5]));
            (time_s, Vector3::new(n[0], n[1], n[2]), turn)
        })
        .collect()
}

fn read_ls(text: &str) -> Read {
    let (program, positions) = text.split_once("/POS\n").unwrap();
    let mut time_s = 0.0;
    let mut order = vec![(1, 0.0)];
    for line in program.lines().filter(|line| line.contains(":L P[")) {
        let n = numbers(line.split_once("P[").unwrap().1.replace("msec", " ").as_str());
        time_s += n[1] * 1e-3;
        order.push((n[0] as usize, time_s));
    }
    let blocks: Vec<&str> = positions.split("};").collect();
    order
        .into_iter()
        .map(|(number, time_s)| {
            let block = blocks[number - 1].trim();
            assert!(block.starts_with(&format!("P[{number}]{{")));
            let value = |name: &str| {
                let after = block.split_once(&format!("\t{name} =")).unwrap().1;
                after.split_whitespace().next().unwrap().parse::<f64>().unwrap()
            };
            let turn = about(2, value("R")) * about(1, value("P")) * about(0, value("W"));
            (time_s, Vector3::new(value("X"), value("Y"), value("Z")) * 1e-3, turn)
        })
        .collect()
}

fn read_csv(text: &str) -> Read {
    let samples = robot_csv::read(Path::new("waypoints.csv"), text.as_ref()).unwrap();
    let read = samples.iter().map(|sample| {
        let Pose { rotation, translation } = sample.base_from_tool;
        (sample.stamp_ns as f64 * 1e-9, translation.vector, rotation.to_rotation_matrix())
    });
    read.collect()
}

#[test]
fn every_program_reads_back_as_the_path() {
    let waypoints = Waypoints::of(&path()).unwrap();
    // Half of the last digit that each writes: m, rad, and of times s. KRL's shares of 100 % have five digits.
    let readers: [(Language, Reader, [f64; 3]); 5] = [
        (Language::Rapid, read_rapid, [5e-7, 3e-7, 1e-9]),
        (Language::Krl, read_krl, [5e-8, 1e-8, 1e-4]),
        (Language::UrScript, read_urscript, [5e-8, 5e-8, 4e-3]),
        (Language::Ls, read_ls, [5e-7, 2e-6, 5e-4]),
        (Language::Csv, read_csv, [5e-9, 5e-9, 5e-5]),
    ];
    for (language, read, [m, rad, s]) in readers {
        let text = language.program(&waypoints);
        let found = read(&text);
        assert_eq!(found.len(), waypoints.list.len(), "{}", language.name());
        for (waypoint, (time_s, at, turn)) in waypoints.list.iter().zip(found) {
            let name = language.name();
            let off = at - waypoint.pose.translation.vector;
            let angle = UnitQuaternion::from_rotation_matrix(&turn).angle_to(&waypoint.pose.rotation);
            assert!((time_s - waypoint.time_s).abs() <= s + 1e-9, "{name}: {time_s} {}", waypoint.time_s);
            // Three coordinates are rounded each; an angle of matrices is only known to the root of rounding, 2e-8.
            assert!(off.norm() <= 1.8 * m + 1e-12, "{name}: {off}");
            assert!(angle <= 1.8 * rad + 3e-8, "{name}: {angle}");
        }
    }
}

#[test]
fn no_move_is_short_or_empty_and_the_path_is_left_by_what_is_said() {
    let path = path();
    let waypoints = Waypoints::of(&path).unwrap();
    assert_eq!(waypoints.list[0].pose, path[0].base_from_tool);
    assert_eq!(waypoints.list.last().unwrap().pose, path.last().unwrap().base_from_tool);
    assert!((waypoints.duration_s() - 12.0).abs() < 1e-9);
    for pair in waypoints.list.windows(2) {
        assert!(pair[1].time_s - pair[0].time_s >= SHORTEST_S - 1e-6);
        let way_m = (pair[1].pose.translation.vector - pair[0].pose.translation.vector).norm();
        assert!(way_m >= 1e-4 || pair[0].pose.rotation.angle_to(&pair[1].pose.rotation) >= 1e-3);
    }
    let mut most = [0.0_f64; 2];
    for sample in &path {
        let time_s = sample.stamp_ns as f64 * 1e-9;
        let after = waypoints.list.iter().position(|w| w.time_s >= time_s - 1e-9).unwrap().max(1);
        let [from, to] = [waypoints.list[after - 1], waypoints.list[after]];
        let share = (time_s - from.time_s) / (to.time_s - from.time_s);
        let [a, b] = [from, to].map(|w| w.pose.translation.vector);
        let turn = from.pose.rotation.slerp(&to.pose.rotation, share);
        most[0] = most[0].max((a + (b - a) * share - sample.base_from_tool.translation.vector).norm());
        most[1] = most[1].max(turn.angle_to(&sample.base_from_tool.rotation));
    }
    assert!((most[0] - waypoints.chord_m).abs() < 1e-9, "{most:?} {}", waypoints.chord_m);
    assert!((most[1] - waypoints.chord_rad).abs() < 1e-7, "{most:?} {}", waypoints.chord_rad);
    // 0.1 s on a curve of 0.2 m/s² leaves it by 0.25 mm.
    assert!(waypoints.chord_m < 1e-3, "{}", waypoints.chord_m);
}

#[test]
fn a_path_that_does_not_move_has_no_program() {
    let still: Vec<RobotSample> =
        path().into_iter().map(|s| RobotSample { base_from_tool: Pose::identity(), ..s }).collect();
    assert_eq!(Waypoints::of(&still), None);
    assert_eq!(Waypoints::of(&[]), None);
    let mut backwards = path();
    backwards[7].stamp_ns = 0;
    assert_eq!(Waypoints::of(&backwards), None);
}

#[test]
fn programs_keep_to_what_their_controllers_take() {
    let waypoints = Waypoints::of(&path()).unwrap();
    let program = |language: Language| language.program(&waypoints);
    for language in Language::ALL {
        let text = program(language);
        if language != Language::Csv {
            let said = text.contains("NOT TRIED") && text.to_lowercase().contains("collisions");
            assert!(said, "{}", language.name());
        }
        assert!(text.is_ascii(), "controllers read ASCII: {}", language.name());
    }
    let ls = program(Language::Ls);
    for remark in ls.lines().filter_map(|line| line.split_once(":  !").map(|(_, after)| after)) {
        assert!(remark.trim_end_matches(';').trim_end().len() <= 32, "{remark}");
    }
    let count = ls.split_once("LINE_COUNT\t= ").map(|(_, after)| numbers(after)[0]).unwrap();
    let (moves, _) = ls.split_once("/POS").unwrap();
    assert_eq!(count as usize, moves.lines().filter(|l| l.get(4..5) == Some(":")).count());
    let krl = program(Language::Krl);
    let shares = krl.lines().filter_map(|l| l.trim().strip_prefix("TIME_BLOCK PART = "));
    let total: f64 = shares.map(|share| share.parse::<f64>().unwrap()).sum();
    assert!((total - 100.0).abs() < 1e-3, "{total}");
    let ur = program(Language::UrScript);
    let opened =
        ur.lines().filter(|l| l.trim().starts_with("def ") || l.trim().starts_with("while ")).count();
    assert_eq!(opened, ur.lines().filter(|l| l.trim() == "end").count());
}

/// An element's name and its attributes, each with its value.
type Element = (String, Vec<[String; 2]>);

/// Every element of an XML text, and the texts between them.
fn elements(text: &str) -> (Vec<Element>, Vec<String>) {
    let mut reader = quick_xml::Reader::from_str(text);
    let (mut found, mut words) = (Vec::new(), Vec::new());
    loop {
        match reader.read_event().unwrap() {
            quick_xml::events::Event::Start(tag) | quick_xml::events::Event::Empty(tag) => {
                let attributes = tag
                    .attributes()
                    .map(Result::unwrap)
                    .map(|a| [a.key.as_ref(), a.value.as_ref()].map(str::to_owned));
                let name = tag.name().as_ref().to_owned();
                found.push((name, attributes.collect()));
            }
            quick_xml::events::Event::Text(text) => words.push(text.trim().to_owned()),
            quick_xml::events::Event::Eof => return (found, words),
            _ => {}
        }
    }
}

#[test]
fn kukas_program_streams_around_the_path_by_a_context_that_cannot_move_the_robot() {
    let waypoints = Waypoints::of(&path()).unwrap();
    let pc = "192.168.1.20:49152".parse().unwrap();
    for (form, created) in [(RsiContext::Rsix, "\"trueline_rsi\""), (RsiContext::Rsi, "\"trueline_rsi.rsi\"")]
    {
        let files = krl_rsi::files(&waypoints, pc, form, None);
        let text = |ending: &str| {
            let found: Vec<&ProgramFile> = files.iter().filter(|f| f.name.ends_with(ending)).collect();
            found[0].text.clone()
        };
        let program = text(".src");
        let place = |words: &str| program.find(words).unwrap_or_else(|| panic!("{words}"));
        // KRL wants declarations before the first instruction; a stop is a fault that nobody should drive over.
        let order = [
            "DECL INT ret",
            "BAS (#INITMOV",
            "PTP {",
            "RSI_CREATE",
            "RSI_ON",
            "SPLINE",
            "ENDSPLINE",
            "RSI_OFF",
        ];
        assert!(order.windows(2).all(|pair| place(pair[0]) < place(pair[1])));
        assert!(program.contains(&format!("RSI_CREATE ({created}")));
        assert_eq!(program.matches("IF (ret <> RSIOK) THEN\r\n  HALT").count(), 3);
        assert!(!program.contains("RSI_MOVECORR"), "the PC would lead the robot");
        assert_eq!(read_krl(&program), read_krl(&Language::Krl.program(&waypoints)));
        // Contents of the context: one object, which talks, corrects nothing, and finds its configuration.
        let context = if form == RsiContext::Rsix { text(".rsix") } else { text(".rsi.xml") };
        let (found, _) = elements(&context);
        let attribute = |element: &Element, name: &str| {
            element.1.iter().find(|[key, _]| key.eq_ignore_ascii_case(name)).map(|[_, value]| value.clone())
        };
        let objects: Vec<_> = found.iter().filter_map(|e| attribute(e, "ObjType")).collect();
        assert_eq!(objects.iter().map(|o| o.to_uppercase()).collect::<Vec<_>>(), ["ETHERNET"]);
        let file = found.iter().find(|e| attribute(e, "Name").as_deref() == Some("ConfigFile")).unwrap();
        let configuration = attribute(file, "ParamValue").unwrap();
        let (sent, words) = elements(&text(&configuration));
        assert!(["192.168.1.20", "49152", "TRUE"].iter().all(|word| words.iter().any(|w| w == word)));
        let tags: Vec<_> = sent.iter().filter_map(|e| attribute(e, "TAG")).collect();
        assert_eq!(tags, ["DEF_RIst", "DEF_AIPos", "DEF_Delay"], "nothing is received");
        assert!(
            files.iter().all(|file| file.text.is_ascii() && !file.text.replace("\r\n", "").contains('\n'))
        );
    }
}

#[test]
fn kukas_context_sends_the_input_of_a_camera_along_and_still_moves_nothing() {
    let waypoints = Waypoints::of(&path()).unwrap();
    let pc = "192.168.1.20:49152".parse().unwrap();
    for form in [RsiContext::Rsix, RsiContext::Rsi] {
        let files = krl_rsi::files(&waypoints, pc, form, Some(26));
        let text =
            |name: &str| files.iter().find(|file| file.name == name).map(|file| file.text.clone()).unwrap();
        let attribute = |element: &Element, name: &str| {
            element.1.iter().find(|[key, _]| key.eq_ignore_ascii_case(name)).map(|[_, value]| value.clone())
        };
        let (sent, _) = elements(&text("trueline_ethernet.xml"));
        let of_input = sent.iter().find(|e| attribute(e, "TAG").as_deref() == Some("DiL")).unwrap();
        let channel: u32 = attribute(of_input, "INDX").unwrap().parse().unwrap();
        assert_eq!(attribute(of_input, "TYPE").as_deref(), Some("BOOL"));
        // The newer form counts from 0, the older one from 1.
        let (context, begins) = match form {
            RsiContext::Rsix => (text("trueline_rsi.rsix"), 0),
            RsiContext::Rsi => (text("trueline_rsi.rsi.xml"), 1),
        };
        let (found, _) = elements(&context);
        let objects: Vec<_> =
            found.iter().filter_map(|e| attribute(e, "ObjType")).map(|o| o.to_uppercase()).collect();
        assert_eq!(objects, ["DIGIN", "ETHERNET"]);
        let wire = found.iter().find(|(name, _)| name == "Input").unwrap();
        assert_eq!(attribute(wire, "InIdx").unwrap(), (channel - 1 + begins).to_string());
        assert_eq!(attribute(wire, "OutObjId"), found.iter().find_map(|e| attribute(e, "ObjId")));
        let index = found.iter().find(|e| attribute(e, "Name").as_deref() == Some("Index")).unwrap();
        assert_eq!(attribute(index, "ParamValue").as_deref(), Some("26"));
        if form == RsiContext::Rsi {
            let (model, _) = elements(&text("trueline_rsi.rsi"));
            let moniker = model.iter().find(|(name, _)| name == "rSIOutPortMoniker").unwrap();
            assert_eq!(attribute(moniker, "name").as_deref(), Some("//DIGIN1/Out1"));
        }
    }
}
