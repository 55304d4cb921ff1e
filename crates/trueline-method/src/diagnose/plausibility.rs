//! Checks without undoing a mistake: of the poses alone, and of a guess against a result that fits.

use crate::Calibration;
use crate::diagnose::estimated_mistakes::Estimated;
use crate::diagnose::mistake::reordered;
use crate::input::stops;
use trueline_dataset::{Guess, Recording, RobotSample};
use trueline_geometry::{Pose, se3, so3};

/// Largest rotation rate of a robot's wrist, rad/s.
const FASTEST_TURN_RAD_S: f64 = 8.0;
/// Largest speed of a robot's tool, m/s.
const FASTEST_M_S: f64 = 10.0;
/// Largest shift of a tool between two samples, m …
const JUMP_M: f64 = 0.005;
/// … and largest rotation, rad, unless its frame was switched.
const JUMP_RAD: f64 = 0.03;

/// Least length of a jump in usual steps.
const USUAL_STEPS: f64 = 10.0;

/// Whether a robot can turn as the poses do. A jump is no such proof: a fast approach may look like one.
pub(super) fn turns_like_a_robot(recording: &Recording) -> bool {
    typical_turn_rad_s(recording) <= FASTEST_TURN_RAD_S
}

/// Median rotation rate of the tool, rad/s.
fn typical_turn_rad_s(recording: &Recording) -> f64 {
    typical_per_s(recording, |one, other| other.rotation.angle_to(&one.rotation))
}

/// Median speed of the tool, m/s.
fn typical_speed_m_s(recording: &Recording) -> f64 {
    typical_per_s(recording, |one, other| (other.translation.vector - one.translation.vector).norm())
}

/// Median rate of a distance between successive poses.
fn typical_per_s(recording: &Recording, distance: impl Fn(&Pose, &Pose) -> f64) -> f64 {
    let rate = |pair: &[RobotSample]| {
        let seconds = (pair[1].stamp_ns - pair[0].stamp_ns) as f64 * 1e-9;
        (seconds > 0.0).then(|| distance(&pair[0].base_from_tool, &pair[1].base_from_tool) / seconds)
    };
    crate::order_statistics::median(recording.robot.windows(2).filter_map(rate)).unwrap_or(0.0)
}

/// Problems visible in the poses alone.
pub(super) fn implausible(recording: &Recording) -> Vec<String> {
    let mut findings = Vec::new();
    let mut jumps = Vec::new();
    let mut shifts = Vec::new();
    for pair in recording.robot.windows(2) {
        let seconds = (pair[1].stamp_ns - pair[0].stamp_ns) as f64 * 1e-9;
        let (turn, shift) = se3::difference_decoupled(&pair[1].base_from_tool, &pair[0].base_from_tool);
        if seconds > 0.0 {
            // Across a gap any motion is possible. A tenth of a second is no gap.
            let jumped = shift.norm() > JUMP_M || turn.norm() > JUMP_RAD;
            if seconds < 0.1 && jumped && shift.norm() / seconds > 2.0 {
                jumps.push((pair[1].stamp_ns, shift.norm(), turn.norm()));
            }
            shifts.push(shift.norm());
        }
    }
    let typical = typical_turn_rad_s(recording);
    // Where the tool is too fast as well, the stamps are wrong and not the angles.
    if typical > FASTEST_TURN_RAD_S && typical_speed_m_s(recording) <= FASTEST_M_S {
        findings.push(format!(
            "the attitude turns at {typical:.0} rad/s, faster than any robot: the quaternions were made from \
             degrees read as radians"
        ));
    }
    // In another unit every step is large, and a jump still stands out.
    let usual_m = crate::order_statistics::median(shifts.into_iter()).unwrap_or(0.0);
    // Between its stops a robot recorded while standing may move anywhere.
    let between_stops = recording.at_stops || stops::stand_at_readings(recording);
    let jump = jumps
        .into_iter()
        .filter(|_| !between_stops)
        .find(|(_, shift_m, turn_rad)| *turn_rad > JUMP_RAD || *shift_m > USUAL_STEPS * usual_m);
    if let Some((stamp_ns, shift_m, turn_rad)) = jump {
        findings.push(format!(
            "the pose jumps by {:.1} mm and {:.1}° at {:.3} s: the active tool or work object was switched during the \
             recording",
            shift_m * 1e3,
            turn_rad.to_degrees(),
            stamp_ns as f64 * 1e-9
        ));
    }
    findings
}

/// Largest drift of any clock, parts per million.
const WORST_CLOCK_PPM: f64 = 1000.0;

/// Stamps that fit with an impossible drift were generated with a wrong rate.
pub(super) fn wrong_rate(c: &Calibration, stamped_hz: f64) -> Option<String> {
    let drift = c.findings.clock.drifted.filter(|drift| drift.ppm.abs() > WORST_CLOCK_PPM)?;
    Some(Estimated::StampRate { factor: 1.0 / (1.0 + drift.ppm * 1e-6), stamped_hz }.says())
}

/// Largest plausible error of a guess, m and rad.
const GUESS_OFF_M: f64 = 0.020;
const GUESS_OFF_RAD: f64 = 0.2;
/// Below this distance they are equal.
const SAME_M: f64 = 0.005;
const SAME_RAD: f64 = 0.03;
/// The same for the offset, s.
const SAME_S: f64 = 0.002;

/// Problems of a guess, compared with a result that fits.
pub(super) fn wrong_guess(c: &Calibration, guess: &Guess) -> Vec<String> {
    let mut findings = Vec::new();
    let found_s = c.best_fit().time_offset_s;
    let offset_seen = c.findings.unknowns.observability.observable_components[0];
    if offset_seen
        && (found_s - guess.time_offset_s).abs() > SAME_S
        && (found_s + guess.time_offset_s).abs() < SAME_S
    {
        findings.push(format!(
            "the initial time offset has the wrong sign: it is {:+.1} ms; positive means that images are stamped late",
            found_s * 1e3
        ));
    }
    if !c.findings.unknowns.observability.observable_components[1..7].iter().all(|seen| *seen) {
        return findings;
    }
    let found = c.best_fit().tool_from_camera;
    let off = |guess: &trueline_geometry::Pose| {
        let (turn, shift) = se3::difference_decoupled(&found, guess);
        (shift.norm(), turn.norm())
    };
    let is = |pose: &trueline_geometry::Pose| off(pose).0 < SAME_M && off(pose).1 < SAME_RAD;
    let given = guess.tool_from_camera;
    let (shift_m, turn_rad) = off(&given);
    if shift_m < GUESS_OFF_M && turn_rad < GUESS_OFF_RAD {
        return findings;
    }
    let with_translation = |scale: f64| se3::from_parts(given.rotation, given.translation.vector * scale);
    let with_rotation = |rotation| se3::from_parts(rotation, given.translation.vector);
    let explained = if is(&given.inverse()) {
        "the initial hand-eye transform is camera_from_tool; it must be tool_from_camera".to_owned()
    } else if is(&with_translation(1000.0)) || is(&with_translation(1e-3)) {
        "the initial translation has the wrong unit: it must be millimetres".to_owned()
    } else if is(&with_rotation(reordered(&given.rotation))) {
        "the initial quaternion is x, y, z, w; it must be w, x, y, z".to_owned()
    } else if is(&with_rotation(so3::exp(&(so3::log(&given.rotation) * 1f64.to_degrees())))) {
        "the initial rotation was made from radians read as degrees".to_owned()
    } else {
        format!(
            "the scan fits, but the hand-eye transform is {:.0} mm and {:.1}° from the initial one: the robot stream \
             reports another tool frame than the guess was made for, or the sensor has moved",
            shift_m * 1e3,
            turn_rad.to_degrees()
        )
    };
    findings.push(explained);
    findings
}
