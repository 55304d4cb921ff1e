//! A torch that follows a seam along an arc.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod cell;

use cell::Noise;
use nalgebra::Vector3;
use std::collections::VecDeque;
use trueline_geometry::{Pose, se3, so3};
use trueline_rt::{AheadError, SeamPointError, SeamTrack, TrackSettings};

const RADIUS_M: f64 = 0.1;
const SPEED_M_S: f64 = 0.020;
const DELAY_S: f64 = 0.080;
const CONTROL_S: f64 = 0.004;
const SENSOR_AHEAD_M: f64 = 0.025;
const POINT_NOISE_M: f64 = 50e-6;

fn seam(along_m: f64) -> Vector3<f64> {
    let angle = along_m / RADIUS_M;
    Vector3::new(RADIUS_M * angle.sin(), RADIUS_M * (1.0 - angle.cos()), 0.2)
}

/// Off the arc: in its plane, and square to it.
fn off_seam(point: &Vector3<f64>) -> [f64; 2] {
    [(point - Vector3::new(0.0, RADIUS_M, point.z)).norm() - RADIUS_M, point.z - 0.2]
}

fn torch(along_m: f64) -> Pose {
    let turn = so3::exp(&(Vector3::z() * (along_m / RADIUS_M))) * so3::exp(&(Vector3::x() * 2.8));
    se3::from_parts(turn, seam(along_m))
}

/// The sensor sees a point every 20 ms, 25 mm ahead; a command acts 80 ms after the pose that it was computed from.
#[test]
fn a_torch_is_led_along_an_arc_within_the_uncertainty() {
    let mut noise = Noise::new(11);
    let mut track = SeamTrack::new(&TrackSettings::default()).unwrap();
    let mut commands: VecDeque<(Pose, f64)> = VecDeque::new();
    let steps = (DELAY_S / CONTROL_S) as usize;
    let (mut off, mut led, mut begun) = (Vec::new(), None, 0);
    for k in 0..3000 {
        // Before the first command acts the torch goes along by itself.
        let (now, sigma_m) = if commands.len() >= steps {
            commands.pop_front().map(|(pose, sigma_m)| (pose, Some(sigma_m))).unwrap()
        } else {
            (torch(SPEED_M_S * CONTROL_S * f64::from(k)), None)
        };
        let along_m = SPEED_M_S * CONTROL_S * f64::from(k);
        if k % 5 == 0 {
            let seen = seam(along_m + SENSOR_AHEAD_M) + noise.vector() * POINT_NOISE_M;
            track.push(&seen, POINT_NOISE_M).unwrap();
        }
        if let Some(sigma_m) = sigma_m {
            off.extend(off_seam(&now.translation.vector).map(|off_m| off_m / sigma_m));
            led = Some((now, along_m));
        }
        // The sensor's first points are ahead of the torch.
        if let Ok(target) = track.ahead(&now, SPEED_M_S, DELAY_S)
            && along_m > SENSOR_AHEAD_M + 0.002
        {
            begun += 1;
            commands.push_back((target.base_from_torch, target.sigma_m));
        }
    }
    assert!(begun > 2500 && off.len() > 4800, "{begun} {}", off.len());
    let rms = (off.iter().map(|z| z * z).sum::<f64>() / off.len() as f64).sqrt();
    // Neighbouring targets share points, so that these thousands are some hundred independent ones.
    assert!((0.7..1.3).contains(&rms), "{rms}");
    assert!(off.iter().all(|z| z.abs() < 5.0));
    // It keeps its speed to the noise of a place along the seam, 15 µm each 80 ms in a random walk of 140: 0.2 mm; and its attitude.
    let (now, along_m) = led.unwrap();
    let there = torch(along_m);
    assert!((now.translation.vector - there.translation.vector).norm() < 1e-3);
    assert!(now.rotation.angle_to(&there.rotation) < 0.02);
}

#[test]
fn what_is_not_known_of_a_seam_is_refused() {
    let mut track = SeamTrack::new(&TrackSettings::default()).unwrap();
    assert!(matches!(track.ahead(&torch(0.0), 0.02, 0.08), Err(AheadError::TooFewPoints { .. })));
    for k in 0..50 {
        track.push(&seam(0.0005 * f64::from(k)), 2e-5).unwrap();
    }
    let last_m = track.length_m();
    assert!((last_m - 0.0245).abs() < 1e-5);
    let there = torch(0.02);
    assert!(matches!(track.ahead(&there, 0.1, 0.1), Err(AheadError::BeyondSeam { .. })));
    // A little beyond the last point its ± rises.
    let [inside, beyond] = [0.0, 0.06].map(|delay_s| track.ahead(&there, 0.1, delay_s).unwrap().sigma_m);
    assert!(beyond > 3.0 * inside);
    for bad in [f64::NAN, -1.0, f64::INFINITY] {
        assert_eq!(track.ahead(&there, bad, 0.08), Err(AheadError::NotFinite));
    }
    assert_eq!(track.push(&Vector3::repeat(f64::NAN), 1e-5), Err(SeamPointError::NotFinite));
    assert_eq!(track.push(&seam(0.03), 0.0), Err(SeamPointError::NotFinite));
    assert!(matches!(track.push(&seam(0.02), 2e-5), Err(SeamPointError::NotAhead { .. })));
    // Off the seam: refused, until another seam is evident.
    let other = |k: i32| seam(0.025 + 0.0005 * f64::from(k)) + Vector3::z() * 0.02;
    for k in 0..7 {
        assert!(matches!(track.push(&other(k), 2e-5), Err(SeamPointError::OffSeam { .. })));
    }
    assert_eq!(track.push(&other(7), 2e-5), Err(SeamPointError::AnotherSeam));
    assert_eq!(track.length_m(), 0.0);
}
