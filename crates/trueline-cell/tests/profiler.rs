//! A profiler next to a robot, without any hardware: frames of several profiles are recorded, read back and calibrated to
//! the truth.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

use std::path::Path;
use std::sync::Arc;
use std::time::Duration;
use trueline_camera::{CameraError, CameraFrame, FrameSource, FrameStatus, RangeProfile, SourceAbout};
use trueline_cell::{CameraRecorder, Cell, LiveEstimate, Progress, StampChoice};
use trueline_dataset::{FrameSignals, Profile, Recording, RobotSample};
use trueline_mcap::{About, Choice, Entry, Imported, Recorder, RobotEntry, import};
use trueline_method::Config;
use trueline_sim::{Plates, Preset, ProfileLook, scan_profiles};
use trueline_vision::{Joint, profile};

/// Profiles in a frame.
const ROWS: usize = 3;
const SENSOR: &str = "kind = \"profiler\"\n";

/// Gives the frames of a list.
struct Frames(std::vec::IntoIter<CameraFrame>, SourceAbout);

impl FrameSource for Frames {
    fn next(&mut self, _: Duration) -> Result<Option<CameraFrame>, CameraError> {
        Ok(self.0.next())
    }

    fn about(&self) -> &SourceAbout {
        &self.1
    }

    fn has_ended(&self) -> bool {
        self.0.as_slice().is_empty()
    }
}

/// Frames whose last profile was taken when they came; every profile has one more column, which saw nothing.
fn frames(profiles: &[Profile]) -> Vec<CameraFrame> {
    let frame = |(number, rows): (usize, &[Profile])| {
        let [first, last] = [&rows[0], &rows[ROWS - 1]].map(|row| row.stamp_ns);
        let columns = |row: &Profile| {
            row.points.iter().map(|point| Some([point.x_m, point.z_m])).chain([None]).collect()
        };
        let profile =
            |row: &Profile| RangeProfile { after_first_ns: row.stamp_ns - first, columns: columns(row) };
        CameraFrame {
            image: None,
            profiles: rows.iter().map(profile).collect(),
            frame: 7 + number as u64,
            device_ns: None,
            first_packet_ns: Some(last),
            complete_ns: last + 1_000_000,
            exposure_us: None,
            signals: FrameSignals::default(),
            status: FrameStatus::Complete,
        }
    };
    profiles.chunks_exact(ROWS).enumerate().map(frame).collect()
}

fn packet(sample: &RobotSample, sequence: u32) -> Entry {
    Entry::Robot(RobotEntry {
        is_egm: false,
        datagram: Vec::new(),
        from: "127.0.0.1:1".parse().unwrap(),
        steady_ns: sample.stamp_ns,
        kernel_wall_ns: None,
        read_wall_ns: 0,
        sequence,
        device_ns: sample.device_ns.unwrap_or(sample.stamp_ns),
        ptp_ns: None,
        base_from_tool: sample.base_from_tool,
    })
}

fn recorded(folder: &Path, scan: &Recording, profiles: &[Profile], estimate: &Arc<LiveEstimate>) -> Cell {
    let (name, stamp_meaning) = ("a list".to_owned(), String::new());
    let about = SourceAbout { name, width: 1, height: ROWS, tick_hz: None, stamp_meaning, trigger: None };
    let source = Box::new(Frames(frames(profiles).into_iter(), about));
    let camera =
        CameraRecorder::with_source(source, StampChoice::FirstPacket, Joint::Fillet, Some(&scan.sensor))
            .unwrap();
    let about = About { sensor_toml: Some(SENSOR.to_owned()), ..About::default() };
    let recorder = Recorder::create(&folder.join("recording.mcap"), &about).unwrap();
    let (mut cell, handle) = (Cell::new(Some(camera), Some(Arc::clone(estimate))), recorder.handle());
    estimate.offer_poses(&mut scan.robot.clone());
    cell.run(
        &handle,
        |_| {
            // No more at once than the recorder takes in.
            for (sample, sequence) in scan.robot.iter().zip(0..) {
                while !handle.offer(packet(sample, sequence)) {
                    std::thread::sleep(Duration::from_millis(1));
                }
            }
            std::thread::sleep(Duration::from_millis(300));
        },
        |_| {},
    );
    recorder.finish().unwrap();
    cell
}

#[test]
fn whole_profiles_of_frames_are_recorded_and_calibrate_to_what_was_put_in() {
    let folder = tempfile::tempdir().unwrap();
    let scenario = Preset::Profiler.scenario();
    let (scan, profiles) = scan_profiles(&scenario, &Plates::default(), &ProfileLook::default(), 3).unwrap();
    let estimate = Arc::new(LiveEstimate::new(scan.sensor.clone(), None));
    let cell = recorded(folder.path(), &scan, &profiles, &estimate);
    let put_in = &profiles[..profiles.len() / ROWS * ROWS];

    let counts = cell.state().camera.unwrap();
    let points: usize = put_in.iter().map(|profile| profile.points.len()).sum();
    assert_eq!((counts.profiles, counts.no_return), (put_in.len() as u64, put_in.len() as u64));
    assert_eq!(counts.columns, (points + put_in.len()) as u64);
    let Imported { mut recording, profiles: found, .. } =
        import(&folder.path().join("recording.mcap"), &Choice::default()).unwrap();
    assert_eq!(found.len(), put_in.len());
    for (number, (found, put_in)) in found.iter().zip(put_in).enumerate() {
        // Seven frames came before the first.
        assert_eq!((found.stamp_ns, found.frame), (put_in.stamp_ns, Some((7 * ROWS + number) as u64)));
        assert_eq!(found.points, put_in.points);
    }

    let seen = profile::seams(&found, None).found;
    assert_eq!(counts.seams, seen.features.len() as u64, "the same is found while it is recorded");
    (recording.features, recording.stripes) = (seen.features, seen.stripes);
    let calibration = trueline_method::calibrate(&recording, None, &Config::default()).unwrap();
    let (truth, found) = (scan.truth.unwrap().parameters, calibration.best_fit());
    let error_s = found.time_offset_s - truth.time_offset_s;
    assert!(error_s.abs() < 4.0 * calibration.noise_sigma(0).unwrap(), "{error_s} s");
    let error = found.tool_from_camera.translation.vector - truth.tool_from_camera.translation.vector;
    for axis in 0..3 {
        let sigma_m = calibration.sigma(trueline_method::problem::parameters::TRANSLATION + axis).unwrap();
        assert!(error[axis].abs() < 4.0 * sigma_m, "axis {axis}: {} ± {sigma_m} m", error[axis]);
    }
    assert!(matches!(estimate.progress(), Progress::Estimated(_)), "{:?}", estimate.progress());
}
