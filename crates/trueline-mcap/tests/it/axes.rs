//! External axes of recordings: joints by their names.

use crate::common;

use common::{T0, about, profiler, robot, unpack};
use std::f64::consts::PI;
use std::path::Path;
use trueline_dataset::{AxisRecord, Carries};
use trueline_geometry::AxisKind;
use trueline_live::egm::{EgmFeedBack, EgmRobot, Message};
use trueline_mcap::{Choice, Entry, ImportError, Recorder, RobotEntry, import};

fn with_axes(axes: &[&str]) -> Choice {
    Choice { axes: axes.iter().map(|axis| axis.parse().unwrap()).collect(), ..Choice::default() }
}

/// A recording of trueline of these entries.
fn own(file: &Path, entries: Vec<Entry>) {
    let recorder = Recorder::create(file, &about()).unwrap();
    entries.into_iter().for_each(|entry| assert!(recorder.handle().offer(entry)));
    recorder.finish().unwrap();
}

fn check(axis: &AxisRecord, value: impl Fn(u32) -> f64) {
    assert_eq!(axis.values.len(), 20);
    for (k, found) in (0..).zip(&axis.values) {
        // A pose and the values of the axes are of one packet.
        assert_eq!(found.stamp_ns, robot(k).steady_ns);
        assert!((found.value - value(k)).abs() < 1e-12, "{k}: {found:?}");
    }
}

#[test]
fn external_joints_of_egm_are_axes() {
    let dir = tempfile::tempdir().unwrap();
    let (file, out) = (dir.path().join("r.mcap"), dir.path().join("out"));
    let entry = |k: u32| {
        let external_joints = Some([0.5 * f64::from(k), 10.0 * f64::from(k), 0.0, 0.0, 0.0, 0.0].into());
        let feed_back = Some(EgmFeedBack { external_joints, ..EgmFeedBack::default() });
        let datagram = EgmRobot { feed_back, ..EgmRobot::default() }.encode_to_vec();
        Entry::Robot(RobotEntry { datagram, ..robot(k) })
    };
    own(&file, (0..20).map(entry).collect());
    let imported = import(&file, &with_axes(&["table_deg=eax_a", "track_mm=eax_b"])).unwrap();
    let [table, track] = &imported.recording.axes[..] else { panic!("two axes") };
    assert_eq!((table.kind, table.carries), (AxisKind::Rotary, Carries::Part));
    assert_eq!((track.kind, track.carries), (AxisKind::Linear, Carries::Robot));
    check(table, |k| (0.5 * f64::from(k)).to_radians());
    check(track, |k| 0.01 * f64::from(k));
    unpack(&file, &with_axes(&["table_deg=eax_a"]), &out).unwrap();
    assert!(out.join("axes.csv").exists() && out.join("cell.toml").exists());

    for (axis, words) in [
        ("table=eax_a", "is in deg or mm"),
        ("table_rad=eax_a", "is in deg or mm"),
        ("table_deg=E1", "eax_a, eax_b, eax_c"),
    ] {
        let error = import(&file, &with_axes(&[axis])).unwrap_err();
        assert!(error.to_string().contains(words), "{axis}: {error}");
    }
}

#[test]
fn external_axes_of_rsi_are_axes() {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("r.mcap");
    let entry = |k: u32| {
        let text = format!("<Rob Type=\"KUKA\"><EIPos E1=\"{}\" E2=\"0.0\"/><IPOC>{k}</IPOC></Rob>", 2 * k);
        Entry::Robot(RobotEntry { is_egm: false, datagram: text.into_bytes(), ..robot(k) })
    };
    own(&file, (0..20).map(entry).collect());
    let imported = import(&file, &with_axes(&["table_deg=E1,robot"])).unwrap();
    assert_eq!(imported.recording.axes[0].carries, Carries::Robot);
    check(&imported.recording.axes[0], |k| f64::from(2 * k).to_radians());
}

#[test]
fn joints_of_ros_are_axes_beside_any_poses() {
    let fixture = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/joint_states");
    let urdf = "<robot name=\"one\"><joint name=\"joint_1\" type=\"revolute\"><parent link=\"base\"/><child link=\"tool\"/>\
                <axis xyz=\"0 0 1\"/></joint></robot>";
    let choice =
        |axis: &str| Choice { sensor: profiler(), urdf: Some(urdf.to_owned()), ..with_axes(&[axis]) };
    let imported = import(&fixture, &choice("table_rad=joint_3,part")).unwrap();
    let axis = &imported.recording.axes[0];
    assert_eq!(axis.values.len(), imported.recording.robot.len());
    for value in &axis.values {
        // As make_fixtures.py writes it.
        let t = (value.stamp_ns - T0) as f64 * 1e-9;
        let expected = 0.3 + 0.2 * (2.0 * PI * 0.35 * t).sin();
        // Stamps are whole nanoseconds.
        assert!((value.value - expected).abs() < 1e-8, "{t}");
    }
    let error = import(&fixture, &choice("table_deg=joint_3")).unwrap_err();
    assert!(matches!(error, ImportError::AxisUnit { .. }), "{error}");
    let error = import(&fixture, &choice("table_rad=elbow")).unwrap_err();
    assert!(error.to_string().contains("joint_1"), "{error}");
}
