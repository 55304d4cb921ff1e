//! Every robot's log and every form of a rotation comes in as the same pose.

use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use std::fs;
use std::path::Path;
use trueline_dataset::import::csv_folder::{CsvFolder, Imported};
use trueline_dataset::import::foreign_csv::ColumnMapping;
use trueline_dataset::import::robot_layout::RobotLayout;
use trueline_dataset::{Error, robot_csv};

/// A transform, and its angles as scipy's `Rotation` computed them.
const TRANSLATION_MM: [f64; 3] = [61.97, -17.996, 145.008];
const WXYZ: [f64; 4] = [0.729383791, 0.150630140, 0.166590790, 0.646186781];

fn assert_is_the_pose(sample: &trueline_dataset::RobotSample, what: &str) {
    let [w, x, y, z] = WXYZ;
    let rotation = UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z));
    // Angles are printed to 1e-6°, 1.7e-8 rad; three of them, and 1e-9 of the quaternion.
    assert!(sample.base_from_tool.rotation.angle_to(&rotation) < 5e-8, "{what}");
    let off = sample.base_from_tool.translation.vector * 1e3 - Vector3::from(TRANSLATION_MM);
    assert!(off.norm() < 1e-9, "{what}");
}

fn import(robot: &str, layout: Option<RobotLayout>, map: &[(&str, &str)]) -> Result<Imported, Error> {
    let dir = tempfile::tempdir().unwrap();
    import_in(dir.path(), robot, layout, map)
}

fn import_in(
    dir: &Path,
    robot: &str,
    layout: Option<RobotLayout>,
    map: &[(&str, &str)],
) -> Result<Imported, Error> {
    let path = |name: &str| dir.join(name);
    fs::write(path("robot.csv"), robot).unwrap();
    fs::write(path("sensor.toml"), "kind = \"profiler\"\n").unwrap();
    fs::write(path("features.csv"), "t,x_mm,z_mm\n0.5,1,2\n").unwrap();
    let mapping = |&(ours, theirs): &(&str, &str)| ColumnMapping { ours: ours.into(), theirs: theirs.into() };
    CsvFolder {
        robot: path("robot.csv"),
        features: path("features.csv"),
        profiles: None,
        sensor: path("sensor.toml"),
        robot_map: map.iter().map(mapping).collect(),
        features_map: Vec::new(),
        layout,
        ..CsvFolder::default()
    }
    .read()
}

#[test]
fn robot_csv_takes_every_form_of_a_rotation() {
    for (header, rotation) in [
        ("qw,qx,qy,qz", "0.729383791,0.150630140,0.166590790,0.646186781"),
        ("qx,qy,qz,qw", "0.150630140,0.166590790,0.646186781,0.729383791"),
        ("q1,q2,q3,q4", "0.729383791,0.150630140,0.166590790,0.646186781"),
        ("a_deg,b_deg,c_deg", "83.713024,2.771150,25.819737"),
        ("w_deg,p_deg,r_deg", "25.819737,2.771150,83.713024"),
        ("yaw_rad,pitch_rad,roll_rad", "1.461067900,0.048365688,0.450639428"),
        (
            "euler_xyz_intrinsic_1_deg,euler_xyz_intrinsic_2_deg,euler_xyz_intrinsic_3_deg",
            "0.282733,25.956437,83.012566",
        ),
        (
            "euler_zyz_intrinsic_1_deg,euler_zyz_intrinsic_2_deg,euler_zyz_intrinsic_3_deg",
            "-0.580786,25.957870,83.658513",
        ),
        ("rx_rad,ry_rad,rz_rad", "0.331765184,0.366918760,1.423236255"),
        (
            "r11,r12,r13,r21,r22,r23,r31,r32,r33",
            "0.109380306,-0.892449139,0.437687655,0.992823515,0.119506411,-0.004436832,-0.048346833,0.435031898,0.899116139",
        ),
    ] {
        let text = format!("time_s,x_mm,y_mm,z_mm,{header}\n0,61.97,-17.996,145.008,{rotation}\n");
        let samples = robot_csv::read(Path::new("robot.csv"), text.as_bytes()).unwrap();
        assert_is_the_pose(&samples[0], header);
    }
}

#[test]
fn what_is_no_rotation_or_could_be_two_is_refused() {
    let refusal = |columns: &str, numbers: &str| {
        let text = format!("time_s,x_mm,y_mm,z_mm,{columns}\n0,1,2,3,{numbers}\n");
        robot_csv::read(Path::new("robot.csv"), text.as_bytes()).unwrap_err().to_string()
    };
    assert!(refusal("rx_deg,ry_deg,rz_deg", "1,2,3").contains("robots define them differently"));
    assert!(refusal("j1_deg", "1").contains("there is no rotation"));
    assert!(
        refusal("a_deg,b_deg,c_deg,w_deg,p_deg,r_deg", "1,2,3,1,2,3")
            .contains("two rotations: a, b, c and w, p, r")
    );
    assert!(refusal("a_deg,b_deg", "1,2").contains("column `c_deg` is missing"));
    assert!(refusal("a,b,c", "1,2,3").contains("has no unit in its name; expected for example `a_deg`"));
    let matrix = "r11,r12,r13,r21,r22,r23,r31,r32,r33";
    // Mirrored, and stretched.
    assert!(refusal(matrix, "1,0,0,0,1,0,0,0,-1").contains("expected a rotation matrix"));
    assert!(refusal(matrix, "1,0,0,0,1,0,0,0,1.01").contains("expected a rotation matrix"));
}

#[test]
fn every_maker_by_name() {
    let q = "0.729383791,0.150630140,0.166590790,0.646186781";
    let mm = "61.97,-17.996,145.008";
    for (robot, text) in [
        ("kuka", format!("t,X,Y,Z,A,B,C,S,T\n0,{mm},83.713024,2.771150,25.819737,2,35\n")),
        ("kuka", format!("t,$POS_ACT_MES.X,$POS_ACT_MES.Y,$POS_ACT_MES.Z,$POS_ACT_MES.A,$POS_ACT_MES.B,$POS_ACT_MES.C\n0,{mm},83.713024,2.771150,25.819737\n")),
        ("kuka", "t;X [mm];Y [mm];Z [mm];A [°];B [°];C [°]\n0;61,97;-17,996;145,008;83,713024;2,771150;25,819737\n".into()),
        ("fanuc", format!("time_s,X,Y,Z,W,P,R\n0,{mm},25.819737,2.771150,83.713024\n")),
        ("yaskawa", format!("t,X,Y,Z,Rx,Ry,Rz\n0,{mm},25.819737,2.771150,83.713024\n")),
        ("staubli", format!("t,x,y,z,rx,ry,rz\n0,{mm},0.282733,25.956437,83.012566\n")),
        ("ur", "t,x,y,z,rx,ry,rz\n0,0.06197,-0.017996,0.145008,0.331765184,0.366918760,1.423236255\n".into()),
        (
            "ur",
            "timestamp actual_TCP_pose_0 actual_TCP_pose_1 actual_TCP_pose_2 actual_TCP_pose_3 actual_TCP_pose_4 actual_TCP_pose_5 actual_q_0\n\
             0 0.06197 -0.017996 0.145008 0.331765184 0.366918760 1.423236255 1.1\n"
                .into(),
        ),
        ("abb", format!("t,x,y,z,q1,q2,q3,q4\n0,{mm},{q}\n")),
        ("ros", "t,x,y,z,qx,qy,qz,qw\n0,0.06197,-0.017996,0.145008,0.150630140,0.166590790,0.646186781,0.729383791\n".into()),
        (
            "matrix",
            format!(
                "t\tr11\tr12\tr13\tr21\tr22\tr23\tr31\tr32\tr33\tx\ty\tz\n\
                 0\t0.109380306\t-0.892449139\t0.437687655\t0.992823515\t0.119506411\t-0.004436832\t-0.048346833\t0.435031898\t0.899116139\t{}\n",
                mm.replace(',', "\t")
            ),
        ),
    ] {
        let imported = import(&text, RobotLayout::named(robot), &[]).unwrap();
        assert_is_the_pose(&imported.recording.robot[0], robot);
        // Assumptions are reported.
        assert!(imported.notes.iter().any(|note| note.contains("read as ")), "{:?}", imported.notes);
    }
    assert!(RobotLayout::named("acme").is_none());
}

#[test]
fn what_was_recognised_and_what_is_not_used_is_said() {
    let text = "t;X;Y;Z;A;B;C;S\n0;61,97;-17,996;145,008;83,71;2,77;25,82;2\n";
    let notes = import(text, RobotLayout::named("kuka"), &[]).unwrap().notes;
    for words in
        ["semicolons between columns, decimal commas", "read as KUKA", "not used: S", "at most 2 decimals"]
    {
        assert!(notes.iter().any(|note| note.contains(words)), "{words}: {notes:?}");
    }
}

/// A maker's unit is not taken in the place of another one that the header names.
#[test]
fn a_unit_in_the_header_counts_and_one_that_is_not_known_is_refused() {
    let row = |scale: f64, angles: &str| {
        let [x, y, z] = TRANSLATION_MM.map(|mm| mm * scale);
        format!("0,{x},{y},{z},{angles}\n")
    };
    // scipy's angles of the pose, in degrees; a full turn has 360 of them, 2000 π mrad and 400 gon.
    let degrees = [83.713024, 2.771150, 25.819737];
    let angles = |per_degree: f64| degrees.map(|angle| (angle * per_degree).to_string()).join(",");
    for (length, scale) in [("mm", 1.0), ("m", 1e-3), ("cm", 0.1), ("in", 1.0 / 25.4), ("µm", 1e3)] {
        for (angle, per_degree) in [
            ("°", 1.0),
            ("rad", 0.0174532925199),
            ("mrad", 17.4532925199),
            ("gon", 10.0 / 9.0),
            // German for degrees.
            ("grad", 1.0),
            ("Grad", 1.0),
        ] {
            let header =
                format!("t,X [{length}],Y ({length}),Z[{length}],A [{angle}],B [{angle}],C [{angle}]\n");
            let text = header + &row(scale, &angles(per_degree));
            let imported = import(&text, RobotLayout::named("kuka"), &[]).unwrap();
            assert_is_the_pose(&imported.recording.robot[0], &text);
            let said = imported.notes.iter().any(|note| note.contains("; `Grad` is degrees"));
            assert_eq!(said, angle.eq_ignore_ascii_case("grad"), "{:?}", imported.notes);
        }
    }
    for (column, named) in [("X [ft]", "ft"), ("Y (actual)", "actual"), ("B [quarter]", "quarter")] {
        let header = "t,X,Y,Z,A,B,C\n".replace(&column[..1], column);
        let error = import(&(header + &row(1.0, &angles(1.0))), RobotLayout::named("kuka"), &[]).unwrap_err();
        let expected = format!("robot.csv, line 1, column `{column}`: `{named}` is not a known unit");
        assert!(error.to_string().ends_with(&expected), "{error}");
        assert!(error.hint().contains("gon"), "{}", error.hint());
    }
    // The user's statement about a column counts; columns outside the pose are ignored.
    let text =
        "t,X (actual),Y,Z,A,B,C,torque [Nm]\n".to_owned() + &row(1.0, &angles(1.0)).replace('\n', ",7\n");
    let imported = import(&text, RobotLayout::named("kuka"), &[("x_mm", "X (actual)")]).unwrap();
    assert_is_the_pose(&imported.recording.robot[0], "mapped");
    // Numbers of a quaternion have none.
    let [w, x, y, z] = WXYZ;
    let text = format!("t,x,y,z,q1 [-],q2 [],q3 [1],q4\n{}", row(1.0, &format!("{w},{x},{y},{z}")));
    assert_is_the_pose(&import(&text, RobotLayout::named("abb"), &[]).unwrap().recording.robot[0], "abb");
}

#[test]
fn a_map_renames_and_leaves_the_rest() {
    let text = "stamp,x_mm,y_mm,z_mm,qw,qx,qy,qz,gripper\n250,61.97,-17.996,145.008,0.729383791,0.150630140,0.166590790,0.646186781,1\n";
    let imported = import(text, None, &[("time_ms", "stamp")]).unwrap();
    assert_is_the_pose(&imported.recording.robot[0], "renamed");
    assert_eq!(imported.recording.robot[0].stamp_ns, 250_000_000);
    assert!(imported.notes.iter().any(|note| note.ends_with("not used: gripper")), "{:?}", imported.notes);
    let missing = import(text, None, &[("time_ms", "when")]).unwrap_err().to_string();
    assert!(
        missing.contains("no column `when`, which the map names for time_ms; the header has: stamp, x_mm"),
        "{missing}"
    );
}

#[test]
fn a_sequence_that_the_user_names() {
    let sequence = "zyz-intrinsic".parse().unwrap();
    let text =
        "t,x_mm,y_mm,z_mm,e1_deg,e2_deg,e3_deg\n0,61.97,-17.996,145.008,-0.580786,25.957870,83.658513\n";
    let imported = import(text, Some(RobotLayout::with_sequence(None, sequence)), &[]).unwrap();
    assert_is_the_pose(&imported.recording.robot[0], "zyz");
    // Kawasaki's O, A, T: what the user names, the layout turns into the sequence.
    let kawasaki = text.replace("e1_deg,e2_deg,e3_deg", "O,A,T");
    let map = [("e1_deg", "O"), ("e2_deg", "A"), ("e3_deg", "T")];
    let imported = import(&kawasaki, Some(RobotLayout::with_sequence(None, sequence)), &map).unwrap();
    assert_is_the_pose(&imported.recording.robot[0], "O, A, T");
    // Without a maker the unit must be told.
    let bare = import(&text.replace("e1_deg", "e1"), Some(RobotLayout::with_sequence(None, sequence)), &[]);
    assert!(bare.unwrap_err().to_string().contains("has no unit in its name"));
}

#[test]
fn errors_point_into_the_foreign_file() {
    let text = "t;X;Y;Z;A;B;C\n0;1,5;2;3;1;2;3\n1;1,5;x;3;1;2;3\n";
    let error = import(text, RobotLayout::named("kuka"), &[]).unwrap_err().to_string();
    assert!(error.ends_with("robot.csv, line 3, column `y_mm`: expected a number, found `x`"), "{error}");
}

/// Nothing that was recorded is lost on the way.
#[test]
fn stripes_beside_the_features_come_in_as_well() {
    let dir = tempfile::tempdir().unwrap();
    let robot = "time_s,x_mm,y_mm,z_mm,qw,qx,qy,qz\n0,1,2,3,1,0,0,0\n";
    let stripes =
        "time_s;frame;plate;x1_mm;z1_mm;x2_mm;z2_mm;sigma_mm\n0,5;0;1;-10,0;200,0;-2,0;201,0;0,01\n";
    fs::write(dir.path().join("stripes.csv"), stripes).unwrap();
    let imported = import_in(dir.path(), robot, None, &[]).unwrap();
    let [stripe] = imported.recording.stripes.as_slice() else { panic!("{:?}", imported.recording.stripes) };
    assert_eq!((stripe.stamp_ns, stripe.plate), (500_000_000, 1));
    assert!(
        imported.notes.iter().any(|note| note.contains("stripes.csv: semicolons")),
        "{:?}",
        imported.notes
    );
    fs::write(dir.path().join("stripes.csv"), stripes.replace("0,01", "-1")).unwrap();
    let refused = import_in(dir.path(), robot, None, &[]).unwrap_err().to_string();
    assert!(refused.contains("stripes.csv, line 2"), "{refused}");
}
