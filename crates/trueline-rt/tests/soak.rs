//! An hour of a cell in virtual time: `cargo test -p trueline-rt --test soak -- --ignored`. Memory stays what it was, and so does the truth.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod cell;

use cell::{Noise, Path, TIME_OFFSET_S, ns};
use nalgebra::Vector3;
use trueline_geometry::{Pose, se3};
use trueline_rt::{Placer, Points, SeamTrack, Settings, TrackSettings};

const HOUR_S: f64 = 3600.0;
/// Time between poses, s.
const POSE_S: f64 = 0.004;
/// Poses from one frame to the next.
const EACH: u64 = 5;
const COLUMNS: usize = 64;
/// Noise of a pose along each axis, m and rad.
const POSE_NOISE: f64 = 20e-6;

/// Resident memory of this process, bytes; zero where the system does not tell.
fn resident() -> usize {
    let told = std::fs::read_to_string("/proc/self/statm").unwrap_or_default();
    let pages: usize = told.split(' ').nth(1).and_then(|pages| pages.parse().ok()).unwrap_or(0);
    pages * 4096
}

#[test]
#[ignore = "a minute: run in the nightly checks"]
fn an_hour_takes_no_more_memory_than_a_minute_and_stays_true() {
    let path = Path { speed_m_s: 0.05 };
    let mut placer = Placer::new(&cell::calibration(TIME_OFFSET_S), &Settings::default()).unwrap();
    let mut track = SeamTrack::new(&TrackSettings::default()).unwrap();
    let mut noise = Noise::new(3);
    let (mut base, mut sigmas) = (vec![[0.0; 3]; COLUMNS], vec![0.0; COLUMNS]);
    let (mut after_a_minute, mut placed, mut worst) = (0, 0_u64, 0.0_f64);
    for k in 0..(HOUR_S / POSE_S) as u64 {
        let time_s = k as f64 * POSE_S;
        let pose = se3::retract_decoupled(
            &path.pose(time_s),
            &(noise.vector() * POSE_NOISE),
            &(noise.vector() * POSE_NOISE),
        );
        placer.push_pose(ns(time_s), &pose).unwrap();
        if k % EACH == 0 && time_s > 1.0 {
            let exposed_s = time_s - TIME_OFFSET_S;
            let (readings, truth) = cell::seen(&path.pose(exposed_s), COLUMNS);
            placer.place(ns(time_s), Points::Profile(&readings), &mut base, &mut sigmas).unwrap();
            for ((point, sigma_m), truth) in base.iter().zip(&sigmas).zip(&truth) {
                worst = worst.max((Vector3::from(*point) - truth).norm() / sigma_m);
                placed += 1;
            }
            // A seam that goes on and on: 20 mm/s.
            let seam = Vector3::new(0.02 * time_s, 0.0, 0.1) + noise.vector() * 2e-5;
            track.push(&seam, 2e-5).unwrap();
            if time_s > 5.0 {
                let torch = Pose::translation(0.02 * time_s - 0.02, 0.0, 0.1);
                assert!(track.ahead(&torch, 0.02, 0.08).unwrap().sigma_m < 1e-4);
            }
        }
        if time_s > 60.0 && after_a_minute == 0 {
            after_a_minute = resident();
        }
    }
    assert!(placed > 11_000_000, "{placed}");
    // Of eleven million Gaussian vectors none is beyond 7 of its root mean squares.
    assert!(worst < 7.0, "{worst}");
    // The allocator of the test itself may keep a page or two.
    let grown = resident().saturating_sub(after_a_minute);
    assert!(grown < 1 << 20, "{grown} bytes in an hour");
}
