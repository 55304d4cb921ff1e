//! Every bad input has its own message, with file, line, column and a hint.

use std::fs;
use std::path::Path;
use trueline_dataset::{Error, FrameFile, Reference, folder, images, reference_file, robot_csv};

const SENSOR: &str = "kind = \"camera_laser\"\n[camera]\nwidth = 2448\nheight = 2000\nfx = 3598.0\nfy = 3597.0\ncx = 1211.0\ncy = 1007.0\ndistortion = [0.0, 0.0, 0.0, 0.0, 0.0]\n[laser_plane]\nnormal = [0.0, -0.9, 0.4358898943540673]\noffset_mm = 55.0\n";
const ROBOT: &str = "time_s,x_mm,y_mm,z_mm,qw,qx,qy,qz\n0.000,1,2,3,1,0,0,0\n0.004,1,2,3,1,0,0,0\n";
const FEATURES: &str = "time_s,u_px,v_px\n0.001,100,200\n0.002,101,201\n";

fn read_with(name: &str, text: &str) -> Result<trueline_dataset::Recording, Error> {
    let dir = tempfile::tempdir().unwrap();
    for (file, good) in [("sensor.toml", SENSOR), ("robot.csv", ROBOT), ("features.csv", FEATURES)] {
        fs::write(dir.path().join(file), if file == name { text } else { good }).unwrap();
    }
    if !["sensor.toml", "robot.csv", "features.csv"].contains(&name) {
        fs::write(dir.path().join(name), text).unwrap();
    }
    folder::read(dir.path())
}

/// The message without the folder, and whether there is a hint.
fn refusal(name: &str, text: &str) -> String {
    let error = read_with(name, text).unwrap_err();
    assert!(!error.hint().is_empty());
    let message = error.to_string();
    message[message.find(name).expect("the message names the file")..].to_owned()
}

#[test]
fn the_good_folder_is_read() {
    let recording = read_with("robot.csv", ROBOT).unwrap();
    assert_eq!((recording.robot.len(), recording.features.len()), (2, 2));
    assert_eq!(recording.inputs.len(), 3);
    // sha256 of the text, as any other program computes it.
    assert_eq!(recording.inputs["features.csv"], folder::sha256(FEATURES.as_bytes()));
    assert_eq!(folder::sha256(b""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
}

#[test]
fn columns() {
    let header = |h: &str| refusal("robot.csv", &format!("{h}\n0,1,2,3,1,0,0,0\n"));
    assert_eq!(
        header("time,x_mm,y_mm,z_mm,qw,qx,qy,qz"),
        "robot.csv, line 1, column `time`: the column has no unit in its name; expected for example `time_s`"
    );
    assert_eq!(
        header("time_s,x_inch,y_mm,z_mm,qw,qx,qy,qz"),
        "robot.csv, line 1, column `x_inch`: unknown column; known columns: time_s, x_mm, y_mm, z_mm, device_time_s, qw, qx, qy, qz"
    );
    assert_eq!(
        header("time_s,x_mm,x_m,z_mm,qw,qx,qy,qz"),
        "robot.csv, line 1, column `x_m`: duplicate column"
    );
    assert_eq!(
        refusal("robot.csv", "time_s,x_mm,y_mm,z_mm,qw,qx,qy\n0,1,2,3,1,0,0\n"),
        "robot.csv, line 1: column `qz` is missing; the header has: time_s, x_mm, y_mm, z_mm, qw, qx, qy"
    );
}

#[test]
fn numbers() {
    let row = |r: &str| refusal("robot.csv", &format!("{ROBOT}{r}\n"));
    assert_eq!(row("0.008,1,2,x,1,0,0,0"), "robot.csv, line 4, column `z_mm`: expected a number, found `x`");
    assert_eq!(
        row("0.008,1,nan,3,1,0,0,0"),
        "robot.csv, line 4, column `y_mm`: expected a finite number, found `nan`"
    );
    assert_eq!(
        row("inf,1,2,3,1,0,0,0"),
        "robot.csv, line 4, column `time_s`: expected a finite number, found `inf`"
    );
    assert_eq!(row("0.008,1,2,3,1,0,0"), "robot.csv, line 4: expected 8 fields, found 7");
    assert_eq!(
        row("0.003,1,2,3,1,0,0,0"),
        "robot.csv, line 4, column `time_s`: time runs backwards: 0.003 s after 0.004 s"
    );
    assert_eq!(
        row("0.008,1,2,3,2,0,0,0"),
        "robot.csv, line 4, column `qw`: expected a quaternion of length 1, found length 2"
    );
    assert_eq!(
        refusal("features.csv", "time_s,u_px,v_px,frame\n0.001,1,2,-1\n"),
        "features.csv, line 2, column `frame`: expected a whole number of 0 or more, found `-1`"
    );
    assert_eq!(
        refusal("features.csv", "time_s,u_px,v_px,sigma_u_px,sigma_v_px\n0.001,1,2,0,1\n"),
        "features.csv, line 2, column `sigma_u_px`: expected a standard deviation above zero, found `0`"
    );
    // One of a covariance in px², or of two coordinates of which one says all about the other.
    for found in ["1", "-1", "1.5"] {
        let table = format!("time_s,u_px,v_px,sigma_u_px,sigma_v_px,correlation\n0.001,1,2,1,1,{found}\n");
        assert_eq!(
            refusal("features.csv", &table),
            format!(
                "features.csv, line 2, column `correlation`: expected a correlation of at most ±0.9999, found `{found}`"
            )
        );
    }
}

/// Sums of stamps, and a row for every line, end where whole numbers and memory do.
#[test]
fn stamps_and_lines_beyond_any_recording() {
    for far in ["9223372036.854775807", "-9223372036.854775807", "1e12", "99999999999999999999"] {
        assert_eq!(
            refusal("robot.csv", &format!("{ROBOT}{far},1,2,3,1,0,0,0\n")),
            format!(
                "robot.csv, line 4, column `time_s`: expected a stamp within 95 years of the clock's zero, found `{far}`"
            )
        );
    }
    let of_line = |line: u64| format!("time_s,u_px,v_px,line\n0.001,1,2,{line}\n");
    for line in [1024, u64::from(u32::MAX), u64::MAX] {
        assert_eq!(
            refusal("features.csv", &of_line(line)),
            format!("features.csv, line 2, column `line`: expected a line from 0 to 1023, found {line}")
        );
    }
    assert_eq!(read_with("features.csv", &of_line(1023)).unwrap().features[0].line, 1023);
}

/// The same table, however it was written, wherever it is named.
#[test]
fn every_table_is_read_as_other_programs_write_it() {
    let dir = tempfile::tempdir().unwrap();
    let written = |name: &str, text: &str| {
        let file = dir.path().join(name);
        fs::write(&file, text).unwrap();
        file
    };
    for (name, robot) in [
        ("semicolons", ROBOT.replace('.', "+").replace(',', ";").replace('+', ",")),
        ("trailing", ROBOT.replace('\n', ",\n")),
        ("comments", format!("# log of cell 7\n\n# mm, wxyz\n{ROBOT}")),
    ] {
        assert_eq!(read_with("robot.csv", &robot).unwrap().robot.len(), 2, "{name}");
        let path = robot_csv::read_file(&written("path.csv", &robot)).unwrap();
        assert_eq!(path, read_with("robot.csv", ROBOT).unwrap().robot, "{name}");
    }
    let curve = written("curve.csv", "# drawn\nx_mm;y_mm;z_mm;\n0;0,5;0;\n1;0,5;0;\n");
    assert!(matches!(reference_file::read(&curve).unwrap(), Reference::Curve(_)));
    fs::create_dir(dir.path().join("images")).unwrap();
    written("images/index.csv", "time_s;file\n0,5;a.png\n");
    assert_eq!(images::read_index(dir.path()).unwrap()[0].stamp_ns, 500_000_000);
}

/// Words before the header are skipped, and lines keep their numbers.
#[test]
fn comments_before_the_header() {
    let commented = |rest: &str| refusal("robot.csv", &format!("# a\n# b, c\n{rest}"));
    assert_eq!(
        commented(&format!("{ROBOT}0.008,1,2,x,1,0,0,0\n")),
        "robot.csv, line 6, column `z_mm`: expected a number, found `x`"
    );
    assert!(commented("time,x_mm\n0,1\n").starts_with("robot.csv, line 3"));
    assert!(commented("0,1,2,3,1,0,0,0\n").contains("line 3: there is no header"));
    // Between rows there are no words.
    assert!(refusal("robot.csv", &format!("{ROBOT}# stop\n")).contains("line 4: expected 8 fields, found 1"));
}

#[test]
fn pictures_whose_names_have_commas_and_quotes_are_found_again() {
    let dir = tempfile::tempdir().unwrap();
    fs::create_dir(dir.path().join("images")).unwrap();
    let named = |name: &str| FrameFile {
        stamp_ns: 5,
        frame: 7,
        device_ns: None,
        path: dir.path().join("images").join(name),
    };
    let frames = ["a,1.png", "b\"2.png", "c 3.png"].map(named);
    images::write_index(dir.path(), &frames).unwrap();
    assert_eq!(images::read_index(dir.path()).unwrap(), frames.to_vec());
    fs::remove_file(images::index_of(dir.path())).unwrap();
    // A blank at an end is not read.
    let error = images::write_index(dir.path(), &[named(" d.png")]).unwrap_err();
    assert!(
        error.to_string().contains("expected the name of a file beside the index, found ` d.png`"),
        "{error}"
    );
    assert!(!images::index_of(dir.path()).exists());
}

/// The replaced folder is moved aside to a free name.
#[test]
fn a_folder_that_is_named_as_a_replaced_one_stays() {
    let dir = tempfile::tempdir().unwrap();
    let recording = read_with("robot.csv", ROBOT).unwrap();
    let out = dir.path().join("out");
    folder::write_whole(&out, &recording, false).unwrap();
    for name in ["out.replaced", "out.replaced-1"] {
        fs::create_dir(dir.path().join(name)).unwrap();
        fs::write(dir.path().join(name).join("thesis.tex"), "years of work").unwrap();
    }
    folder::write_whole(&out, &recording, true).unwrap();
    let mut left: Vec<_> = fs::read_dir(dir.path())
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    left.sort();
    assert_eq!(left, ["out", "out.replaced", "out.replaced-1"]);
    assert!(
        dir.path().join("out.replaced/thesis.tex").exists()
            && dir.path().join("out.replaced-1/thesis.tex").exists()
    );
}

/// Names do not tell what trueline wrote from what somebody recorded.
#[test]
fn a_folder_that_is_replaced_is_kept_unless_it_is_the_same() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("out");
    fs::create_dir(&out).unwrap();
    let log = "X1,Y1,Z1,A1,B1,C1\n1,2,3,4,5,6\n";
    fs::write(out.join("robot.csv"), log).unwrap();
    let recording = read_with("robot.csv", ROBOT).unwrap();
    fs::write(out.join("sensor.toml"), "kind = \"my own\"\n").unwrap();
    let former = folder::write_whole(&out, &recording, true).unwrap().unwrap();
    assert_eq!(former, dir.path().join("out.replaced-1"));
    assert_eq!(fs::read_to_string(former.join("robot.csv")).unwrap(), log);
    // The same again: nothing is lost that is not there.
    assert_eq!(folder::write_whole(&out, &recording, true).unwrap(), None);
    assert!(!dir.path().join("out.replaced-2").exists());
    // One other byte, and the same length.
    let mut sensor = fs::read(out.join("sensor.toml")).unwrap();
    *sensor.last_mut().unwrap() = b' ';
    fs::write(out.join("sensor.toml"), &sensor).unwrap();
    let former = folder::write_whole(&out, &recording, true).unwrap().unwrap();
    assert_eq!(former, dir.path().join("out.replaced-2"));
    assert_eq!(fs::read(former.join("sensor.toml")).unwrap(), sensor);
}

#[test]
fn empty_and_missing_files() {
    assert_eq!(refusal("robot.csv", ""), "robot.csv: there are no data rows");
    assert_eq!(refusal("features.csv", "time_s,u_px,v_px\n"), "features.csv: there are no data rows");
    let empty = tempfile::tempdir().unwrap();
    let message = folder::read(empty.path()).unwrap_err().to_string();
    assert!(message.ends_with("sensor.toml: the file is missing"), "{message}");
    assert!(folder::read(Path::new("/nowhere/at/all")).is_err());
}

#[test]
fn sensor_files() {
    let error = |text: &str| refusal("sensor.toml", text);
    assert!(error("kind = \"radar\"\n").contains("unknown variant `radar`"));
    assert!(error(&SENSOR.replace("fx = 3598.0\n", "")).contains("missing field `fx`"));
    assert!(
        error(&SENSOR.replace("fx = 3598.0", "fx = 0.0"))
            .contains("`camera.fx`: expected a number above zero")
    );
    assert!(error(&SENSOR.replace("[0.0, -0.9", "[0.0, -9.0")).contains("expected a vector of length 1"));
    assert!(error(&SENSOR.replace("cx =", "c_x =")).contains("unknown field `c_x`"));
    let in_mm = error(&SENSOR.replace("fx = 3598.0", "fx = 8.0"));
    assert!(in_mm.contains("`camera.fx`: expected a focal length in px"), "{in_mm}");
    assert!(error("kind = ").starts_with("sensor.toml, line 1: "));
}

#[test]
fn guesses() {
    let text = "time_offset_s = 0.01\n[tool_from_camera]\ntranslation_mm = [1.0, 2.0, 3.0]\nrotation_wxyz = [0.5, 0.0, 0.0, 0.0]\n";
    assert_eq!(
        refusal("initial.toml", text),
        "initial.toml, line 4: expected a quaternion of length 1, found length 0.5"
    );
    assert!(refusal("initial.toml", &text.replace("time_offset_s", "offset_s")).contains("unknown field"));
}

#[test]
fn whole_numbers_may_have_a_fraction_of_zero() {
    let features = read_with("features.csv", "time_s,u_px,v_px,frame\n0.001,1,2,3.0\n").unwrap().features;
    assert_eq!(features[0].frame, Some(3));
    assert!(refusal("features.csv", "time_s,u_px,v_px,frame\n0.001,1,2,3.5\n").contains("found `3.5`"));
    assert!(refusal("features.csv", "time_s,u_px,v_px,frame\n0.001,1,2,.0\n").contains("found `.0`"));
}

#[test]
fn nothing_is_overwritten() {
    let dir = tempfile::tempdir().unwrap();
    let recording = read_with("robot.csv", ROBOT).unwrap();
    folder::write(dir.path(), &recording).unwrap();
    let error = folder::write(dir.path(), &recording).unwrap_err();
    assert!(error.to_string().ends_with("already exists; it is not overwritten"), "{error}");
}
