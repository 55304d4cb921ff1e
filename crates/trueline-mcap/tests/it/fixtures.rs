//! Recordings of other programs, against the formulas that they were made from (`fixtures/make_fixtures.py`).
#![cfg(feature = "rosbag2")]

use crate::common;

use common::{T0, Unpacked, profiler, unpack};
use nalgebra::Vector3;
use std::f64::consts::PI;
use std::fs;
use std::path::{Path, PathBuf};
use trueline_dataset::{FrameFile, PictureSource, Pixels, RobotSample, gray_png, images, robot_csv};
use trueline_geometry::{Pose, se3, so3};
use trueline_mcap::{Choice, ImportError, Kind, import, survey};

const SAMPLES: i64 = 60;
const IMAGES: i64 = 6;

fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures").join(name)
}

fn tool_pose(t: f64) -> Pose {
    let position =
        Vector3::new(0.50 + 0.10 * (PI * t).sin(), -0.20 + 0.05 * (1.6 * PI * t).cos(), 0.40 + 0.08 * t);
    let angle = 0.3 + 0.5 * (0.8 * PI * t).sin();
    se3::from_parts(so3::exp(&(Vector3::new(1.0, 2.0, 2.0) / 3.0 * angle)), position)
}

fn choice() -> Choice {
    Choice { sensor: profiler(), ..Choice::default() }
}

fn framed(base: &str, tool: &str) -> Choice {
    Choice { base_frame: Some(base.to_owned()), tool_frame: Some(tool.to_owned()), ..choice() }
}

fn robot_of(folder: &Path) -> Vec<RobotSample> {
    let file = folder.join("robot.csv");
    robot_csv::read(&file, fs::read(&file).unwrap().as_slice()).unwrap()
}

/// Sums of up to four numbers of size one, products with quaternions of two to four links and the decimal text in millimetres
/// each lose a few times 2⁻⁵²: 1e-12 is thousands of them, and a nanometre is a thousand times more.
const TOLERANCE: f64 = 1e-12;

fn check_robot(folder: &Path) {
    let robot = robot_of(folder);
    assert_eq!(robot.len() as i64, SAMPLES);
    for (k, sample) in (0..SAMPLES).zip(&robot) {
        assert_eq!(sample.stamp_ns, T0 + 10_000_000 * k);
        assert_eq!(sample.device_ns, None);
        let truth = tool_pose(k as f64 / 100.0);
        let (rotation, translation) = se3::difference_decoupled(&sample.base_from_tool, &truth);
        assert!(
            rotation.norm() < TOLERANCE && translation.norm() < TOLERANCE,
            "{k}: {rotation} {translation}"
        );
    }
}

fn check_pictures(folder: &Path, dark: u16, bright: u16) {
    let frames = images::read_index(folder).unwrap();
    assert_eq!(frames.len() as i64, IMAGES);
    for (j, FrameFile { stamp_ns, frame, device_ns, path }) in (0..IMAGES).zip(frames) {
        assert_eq!((stamp_ns, frame, device_ns), (T0 + 53_000_000 + 100_000_000 * j, j as u64, None));
        let image = gray_png::read(&path, &mut Vec::new()).unwrap();
        assert_eq!((image.width, image.height), (32, 24));
        let pixels: Vec<u16> = match image.pixels {
            Pixels::Eight(pixels) => pixels.into_iter().map(u16::from).collect(),
            Pixels::Sixteen(pixels) => pixels,
        };
        let mut expected = vec![dark; 32 * 24];
        expected[((4 + 2 * j) * 32 + 5 + 3 * j) as usize] = bright;
        assert_eq!(pixels, expected, "picture {j}");
    }
}

fn unpacked(name: &str, choice: &Choice) -> (tempfile::TempDir, PathBuf, Unpacked) {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("scan");
    let unpacked = unpack(&fixture(name), choice, &out).unwrap();
    assert!(unpacked.damages.is_empty(), "{:?}", unpacked.damages);
    assert_eq!((unpacked.robot, unpacked.frames, unpacked.features), (60, 6, 0));
    assert!(!out.with_file_name("scan.unfinished").exists());
    (folder, out, unpacked)
}

#[test]
fn poses_and_bytes_come_out_of_every_container() {
    for name in ["pose_mono8", "pose_mono8_mcap", "pose_mono8_zstd_file", "pose_mono8_ros1.mcap"] {
        let (_keep, out, unpacked) = unpacked(name, &choice());
        check_robot(&out);
        check_pictures(&out, 10, 250);
        assert!(unpacked.notes.is_empty(), "{name}: {:?}", unpacked.notes);
    }
}

#[test]
fn a_file_of_a_folder_is_a_recording_too() {
    for name in ["pose_mono8/pose_mono8.db3", "pose_mono8_zstd_file/pose_mono8_zstd_file.db3.zstd"] {
        let (_keep, out, _) = unpacked(name, &choice());
        check_robot(&out);
        check_pictures(&out, 10, 250);
    }
}

#[test]
fn pixels_of_two_bytes_come_in_both_orders_and_with_padding() {
    for name in ["transform_mono16", "transform_mono16_mcap", "transform_mono16_be"] {
        let (_keep, out, _) = unpacked(name, &choice());
        check_robot(&out);
        check_pictures(&out, 272, 60000);
    }
}

#[test]
fn a_chain_of_transforms_is_composed() {
    for name in ["tf_compressed", "tf_compressed_mcap"] {
        let (_keep, out, unpacked) = unpacked(name, &framed("base_link", "tool0"));
        check_robot(&out);
        check_pictures(&out, 10, 250);
        assert_eq!(unpacked.notes, ["60 robot poses were composed of 4 transforms"]);
    }
}

/// The way may lead up the tree as well as down.
#[test]
fn a_chain_of_transforms_is_composed_backwards() {
    let (_keep, out, _) = unpacked("tf_compressed", &framed("/tool0", "base_link"));
    for (k, sample) in (0..SAMPLES).zip(robot_of(&out)) {
        let truth = tool_pose(k as f64 / 100.0).inverse();
        let (rotation, translation) = se3::difference_decoupled(&sample.base_from_tool, &truth);
        assert!(rotation.norm() < TOLERANCE && translation.norm() < TOLERANCE);
    }
}

fn refusal(name: &str, choice: &Choice) -> ImportError {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("scan");
    let error = unpack(&fixture(name), choice, &out).unwrap_err();
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0, "a dataset appears as a whole or not at all");
    error
}

#[test]
fn what_is_not_said_is_not_guessed() {
    let error = refusal("tf_compressed", &choice());
    let ImportError::FramesNeeded { links, .. } = &error else { panic!("{error}") };
    assert!(links.contains(&"link2 → flange".to_owned()) && links.len() == 6, "{links:?}");
    assert!(error.hint().contains("--base"));

    let error = refusal("tf_compressed", &framed("base_link", "tool1"));
    let ImportError::UnknownFrame { frame, known } = &error else { panic!("{error}") };
    assert!(frame == "tool1" && known.contains(&"tool0".to_owned()));

    let error = refusal("tf_compressed", &framed("base_link", "table"));
    assert!(matches!(error, ImportError::NothingMoves { .. }), "{error}");

    let error = refusal("pose_mono8", &Choice { base_frame: Some("world".to_owned()), ..choice() });
    assert_eq!(error.to_string(), "the poses of `/robot/pose` are in frame `base_link`, not in `world`");

    let error = refusal("pose_mono8", &Choice { pose_topic: Some("/pose".to_owned()), ..choice() });
    assert_eq!(error.to_string(), "no topic `/pose` with robot poses; there are: /robot/pose");

    let error = refusal("pose_mono8", &Choice { image_topic: Some("/robot/pose".to_owned()), ..choice() });
    assert!(
        error.to_string().ends_with("with pictures or profiles; there are: /camera/image_raw"),
        "{error}"
    );

    assert!(matches!(refusal("pose_mono8", &Choice::default()), ImportError::NoSensor));
}

/// Six joints in a row: 1 m along z to each, turning about z, y, z, y, z, y; the tool 0.5 m further.
fn six_joints() -> String {
    let joint = |k: usize| {
        let axis = if k % 2 == 1 { "0 0 1" } else { "0 2 0" };
        format!(
            r#"<joint name="joint_{k}" type="revolute"><parent link="link_{}"/><child link="link_{k}"/>
               <origin xyz="0 0 1" rpy="0 0 0"/><axis xyz="{axis}"/></joint>"#,
            k - 1
        )
    };
    let joints: String = (1..=6).map(joint).collect();
    format!(
        r#"<?xml version="1.0"?><robot name="six"><link name="link_0"/>{joints}<joint name="flange" type="fixed">
           <parent link="link_6"/><child link="tool0"/><origin xyz="0 0 0.5" rpy="0.1 0.2 0.3"/></joint></robot>"#
    )
}

#[test]
fn joint_angles_become_poses_with_the_urdf() {
    use nalgebra::{Matrix4, Rotation3, Vector3};
    let urdf = Choice { urdf: Some(six_joints()), ..choice() };
    for name in ["joint_states", "joint_states_mcap", "joint_states_zstd_message"] {
        let imported = import(&fixture(name), &urdf).unwrap();
        let robot = &imported.recording.robot;
        assert!(robot.len() > 10 && imported.notes.iter().any(|note| note.contains("`tool0` in `link_0`")));
        // The same by matrices, from the positions that make_fixtures.py writes.
        for sample in robot {
            let t = (sample.stamp_ns - T0) as f64 * 1e-9;
            let angle = |joint: usize| {
                let rate = 2.0 * PI * (0.2 + 0.05 * joint as f64);
                0.1 * joint as f64 + 0.2 * (rate * t).sin()
            };
            let up = |z_m: f64| Matrix4::<f64>::new_translation(&Vector3::new(0.0, 0.0, z_m));
            let mut expected = Matrix4::<f64>::identity();
            for joint in 1..=6 {
                let axis = if joint % 2 == 1 { Vector3::z_axis() } else { Vector3::y_axis() };
                let turned: Matrix4<f64> = Rotation3::from_axis_angle(&axis, angle(joint)).to_homogeneous();
                expected = expected * up(1.0) * turned;
            }
            let [x, y, z] = [Vector3::x_axis(), Vector3::y_axis(), Vector3::z_axis()];
            let fixed = Rotation3::from_axis_angle(&z, 0.3)
                * Rotation3::from_axis_angle(&y, 0.2)
                * Rotation3::from_axis_angle(&x, 0.1);
            let fixed: Matrix4<f64> = fixed.to_homogeneous();
            expected = expected * up(0.5) * fixed;
            let error = (sample.base_from_tool.to_homogeneous() - expected).abs().max();
            // Stamps are whole nanoseconds, joints turn at 0.7 rad/s at most, and the arm is 6.5 m long.
            assert!(error < 1e-8, "{name}, {t} s: {error}");
        }
    }
}

#[test]
fn a_urdf_that_does_not_fit_is_refused_with_the_reason() {
    let with = |urdf: &str| Choice { urdf: Some(urdf.to_owned()), ..choice() };
    let six = six_joints();
    for (choice, words) in [
        (with("<robot"), "the URDF cannot be used"),
        (with("<robot/>"), "there is no joint in it"),
        (with(&six.replace("joint_4", "elbow")), "some joints of the arm, but not `elbow`"),
        (with(&six.replace("0 2 0", "0 0 0")), "has an axis of length zero"),
        (with(&six.replace("\"revolute\"", "\"planar\"")), "is neither fixed, revolute, continuous nor prismatic"),
        (Choice { tool_frame: Some("gun".to_owned()), ..with(&six) }, "gun"),
        (
            Choice { base_frame: Some("tool0".to_owned()), tool_frame: Some("link_2".to_owned()), ..with(&six) },
            "frame `link_2` is not mounted on `tool0`",
        ),
        (with(&six.replace("</robot>", r#"<joint name="c" type="fixed"><parent link="link_3"/><child link="cable"/></joint></robot>"#)), "several frames that nothing is mounted on: tool0, cable"),
    ] {
        let error = refusal("joint_states", &choice);
        assert!(error.to_string().contains(words), "{words}: {error}");
    }
    assert!(matches!(refusal("pose_mono8", &with(&six)), ImportError::NoJointAngles));
}

#[test]
fn joint_angles_alone_are_refused_with_the_reason() {
    for name in ["joint_states", "joint_states_mcap", "joint_states_zstd_message"] {
        let error = refusal(name, &choice());
        assert!(
            matches!(&error, ImportError::OnlyJointAngles { topic } if topic == "/joint_states"),
            "{error}"
        );
        assert!(error.to_string().contains("need the robot's kinematics"));
    }
}

#[test]
fn joint_states_are_understood() {
    for name in ["joint_states", "joint_states_mcap", "joint_states_zstd_message"] {
        let mut k = 0;
        let bag = trueline_mcap::Bag::open(&fixture(name)).unwrap();
        let damages = bag.read(&mut |item| {
            let trueline_mcap::BagItem::Message(m) = item else { return Ok(()) };
            let content = trueline_mcap::message::decode(m.schema, m.encoding, m.bytes).unwrap();
            let trueline_mcap::Content::JointStates(joints) = content else { panic!("{content:?}") };
            assert_eq!(joints.stamp_ns, T0 + 10_000_000 * k);
            assert_eq!(joints.names[0], "joint_3");
            // Computed by another program, with the same rounding to within a few units in the last place.
            let angle = 0.3 + 0.2 * (2.0 * PI * (0.2 + 0.05 * 3.0) * k as f64 / 100.0).sin();
            assert!((joints.positions[0] - angle).abs() < 1e-15);
            k += 1;
            Ok(())
        });
        assert_eq!((damages.unwrap(), k), (vec![], SAMPLES));
    }
}

#[test]
fn a_survey_tells_what_there_is() {
    let survey = survey(&fixture("tf_compressed")).unwrap();
    assert!(!survey.is_own && survey.damages.is_empty());
    let topics: Vec<_> = survey.topics.iter().map(|t| (t.name.as_str(), t.kind, t.messages)).collect();
    assert_eq!(
        topics,
        [
            ("/camera/image_raw/compressed", Kind::Picture, 6),
            ("/tf", Kind::Transforms, 60),
            ("/tf_static", Kind::Transforms, 1)
        ]
    );
    assert_eq!(survey.topics[1].first_ns as i64, T0 + 2_000_000);
    let statics: Vec<_> = survey.links.iter().filter(|l| l.is_static()).map(|l| l.child.as_str()).collect();
    assert_eq!(statics, ["table", "tool0"]);
}

/// Copies a fixture's file under another name.
fn copy(name: &str, to: PathBuf) {
    fs::copy(fixture(name), to).unwrap();
}

#[test]
fn a_folder_without_its_list_is_read_by_the_numbers_of_its_files() {
    let bag = tempfile::tempdir().unwrap();
    let file = "pose_mono8/pose_mono8.db3";
    copy(file, bag.path().join("bag_0.db3"));
    copy("transform_mono16/transform_mono16.db3", bag.path().join("bag_1.db3"));
    let out = bag.path().join("out");
    // Two recordings in one: transforms and poses, and pictures of one topic twice.
    let error = unpack(bag.path(), &choice(), &out).unwrap_err();
    assert!(
        matches!(&error, ImportError::SeveralTopics { candidates, .. }
        if *candidates == ["/robot/pose", "/robot/transform"]),
        "{error}"
    );
    let choice = Choice { pose_topic: Some("/robot/pose".to_owned()), ..choice() };
    let unpacked = unpack(bag.path(), &choice, &out).unwrap();
    assert_eq!((unpacked.robot, unpacked.frames), (60, 12));
    assert_eq!(
        unpacked.notes,
        [
            "5 pictures were recorded behind later ones and have been sorted by stamp",
            "6 pictures have the stamp of the one before"
        ]
    );
}

#[test]
fn a_list_that_does_not_fit_the_folder_is_told() {
    let bag = tempfile::tempdir().unwrap();
    copy("pose_mono8/pose_mono8.db3", bag.path().join("pose_mono8.db3"));
    copy("pose_mono8/pose_mono8.db3", bag.path().join("other.db3"));
    let list = "relative_file_paths:\n  - pose_mono8.db3\n  - pose_mono8_1.db3\n";
    fs::write(bag.path().join("metadata.yaml"), list).unwrap();
    let unpacked = unpack(bag.path(), &choice(), &bag.path().join("out")).unwrap();
    let told: Vec<String> = unpacked.damages.iter().map(ToString::to_string).collect();
    assert!(
        told[0].ends_with("pose_mono8_1.db3: the file is missing, though metadata.yaml names it"),
        "{told:?}"
    );
    assert!(told[1].ends_with("other.db3: was not read, because metadata.yaml does not name it"), "{told:?}");
    assert_eq!(unpacked.robot, 60);
}

#[test]
fn a_data_base_that_is_cut_off_is_no_silent_loss() {
    let whole = fs::read(fixture("pose_mono8/pose_mono8.db3")).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("cut.db3");
    for cut in (0..whole.len()).step_by(509) {
        fs::write(&file, &whole[..cut]).unwrap();
        if let Ok(survey) = survey(&file) {
            let messages: u64 = survey.topics.iter().map(|t| t.messages).sum();
            assert!(messages == 66 || !survey.damages.is_empty(), "cut at {cut}: {messages} messages");
        }
    }
    let compressed = fs::read(fixture("pose_mono8_zstd_file/pose_mono8_zstd_file.db3.zstd")).unwrap();
    fs::write(&file, &compressed[..compressed.len() - 400]).unwrap();
    if let Ok(survey) = survey(&file) {
        assert!(!survey.damages.is_empty());
    }
}

#[test]
fn what_is_no_recording_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("a");
    let refusal = |bytes: &[u8]| {
        fs::write(&file, bytes).unwrap();
        survey(&file).unwrap_err()
    };
    assert!(matches!(refusal(b"#ROSBAG V2.0\n"), ImportError::RosBag1 { .. }));
    assert!(matches!(refusal(b"time_s,x_mm"), ImportError::NotARecording { .. }));
    assert!(matches!(refusal(b"SQLite format 3\0"), ImportError::Database { .. }));
    assert!(matches!(survey(folder.path()).unwrap_err(), ImportError::NotARecording { .. }));
    assert!(matches!(survey(Path::new("/nowhere")).unwrap_err(), ImportError::Io { .. }));
}

/// From chunks, from rows of a data base, from a compressed file: each picture alone, and in any order.
#[test]
fn pictures_that_are_read_on_demand_are_those_of_the_folder() {
    for name in ["pose_mono8", "pose_mono8_mcap", "pose_mono8_zstd_file", "pose_mono8_ros1.mcap"] {
        let (_keep, out, _) = unpacked(name, &choice());
        let frames = images::read_index(&out).unwrap();
        let pictures = import(&fixture(name), &choice()).unwrap().pictures.unwrap();
        assert_eq!(pictures.count(), frames.len());
        for (number, frame) in frames.iter().enumerate().rev() {
            let stamp = pictures.stamp(number);
            assert_eq!((stamp.stamp_ns, stamp.frame, stamp.device_ns), (frame.stamp_ns, frame.frame, None));
            let written = gray_png::read(&frame.path, &mut Vec::new()).unwrap();
            assert!(pictures.read(number, &mut Vec::new()).unwrap() == written, "{name}, picture {number}");
        }
    }
}
