//! Robot and pictures by their own synchronised clocks.

use crate::common;

use common::{about, frame, robot, unpack};
use trueline_dataset::{images, robot_csv};
use trueline_mcap::{Choice, Entry, ImportError, Recorder, StampClock};

const PTP_NS: i64 = 1_800_000_037_000_000_000;

/// Records 50 poses, each 4 ms, and 5 pictures, each 33 ms; what came when was anything but regular.
fn record(file: &std::path::Path, robot_ptp_ns: impl Fn(u32) -> Option<i64>, camera_ns: i64) {
    let recorder = Recorder::create(file, &about()).unwrap();
    for k in 0..50 {
        let mut entry = robot(k);
        entry.steady_ns += i64::from(k * k % 13) * 100_000;
        entry.ptp_ns = robot_ptp_ns(k);
        assert!(recorder.handle().offer(Entry::Robot(entry)));
    }
    for k in 0..5 {
        let mut entry = frame(k);
        entry.device_ns = Some(camera_ns + 33_000_000 * i64::from(k));
        assert!(recorder.handle().offer(Entry::Frame(entry)));
    }
    recorder.finish().unwrap();
}

fn choice() -> Choice {
    Choice { clock: StampClock::Ptp, ..Choice::default() }
}

#[test]
fn their_own_stamps_are_the_stamps() {
    let dir = tempfile::tempdir().unwrap();
    let (file, out) = (dir.path().join("r.mcap"), dir.path().join("out"));
    record(&file, |k| Some(PTP_NS + 4_000_000 * i64::from(k)), PTP_NS + 1_500_000);
    unpack(&file, &choice(), &out).unwrap();
    let poses =
        robot_csv::read(&out.join("robot.csv"), std::fs::read(out.join("robot.csv")).unwrap().as_slice());
    for (k, pose) in poses.unwrap().iter().enumerate() {
        assert_eq!(pose.stamp_ns, PTP_NS + 4_000_000 * k as i64);
    }
    for (k, frame) in images::read_index(&out).unwrap().iter().enumerate() {
        assert_eq!(frame.stamp_ns, PTP_NS + 1_500_000 + 33_000_000 * k as i64);
    }
}

#[test]
fn a_clock_that_is_missing_or_another_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let (file, out) = (dir.path().join("r.mcap"), dir.path().join("out"));
    record(&file, |k| (k != 7).then_some(PTP_NS), PTP_NS);
    let refused = unpack(&file, &choice(), &out).unwrap_err();
    assert!(matches!(refused, ImportError::NoPtp { count: 1, .. }), "{refused}");
    assert!(!out.exists());
    let file = dir.path().join("utc.mcap");
    record(&file, |k| Some(PTP_NS + 4_000_000 * i64::from(k)), PTP_NS - 37_000_000_000);
    let refused = unpack(&file, &choice(), &out).unwrap_err();
    assert!(
        matches!(refused, ImportError::ClocksApart { apart_s } if (apart_s + 37.0).abs() < 0.2),
        "{refused}"
    );
    assert!(!refused.hint().is_empty());
    // By the stamps that were recorded it is a recording like any other.
    unpack(&file, &Choice::default(), &out).unwrap();
}
