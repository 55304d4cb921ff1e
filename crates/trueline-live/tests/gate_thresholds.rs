//! The gate's thresholds: just below each it goes on, just above it does not.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

mod common;

use common::liar::{Liar, shifted};
use common::{PERIOD_NS, PERIOD_S, limits};
use nalgebra::Vector3;
use trueline_geometry::{Pose, so3};
use trueline_live::egm::MciState;
use trueline_live::motion::{EndReason, OperatorCommand, Phase};

/// A robot in the midst of the path that did as it was told so far.
fn travelling() -> Liar {
    let mut robot = Liar::new();
    robot.obeys(500);
    assert!(is_travelling(&robot) && robot.state.pauses + robot.state.jumps == 0);
    robot
}

/// A robot unheard for this many periods, and therefore at rest on the path.
fn interrupted(periods: i64) -> Liar {
    let mut robot = travelling();
    for _ in 0..periods {
        robot.now_ns += PERIOD_NS;
        robot.step(None, OperatorCommand::Go);
    }
    assert!(matches!(robot.state.phase, Phase::Interrupted { .. }), "{:?}", robot.state.phase);
    robot
}

fn is_travelling(robot: &Liar) -> bool {
    matches!(robot.state.phase, Phase::Travelling { .. })
}

fn turned(pose: &Pose, radians: f64) -> Pose {
    Pose::from_parts(pose.translation, pose.rotation * so3::exp(&(Vector3::x() * radians)))
}

/// States another pose than before, this many periods later; returns whether the gate believed it.
fn is_believed(mut robot: Liar, periods: f64, elsewhere: impl Fn(&Pose) -> Pose) -> bool {
    let pose = elsewhere(&robot.said);
    robot.says((periods * PERIOD_NS as f64) as i64, pose, |_| {});
    robot.state.jumps == 0
}

#[test]
fn a_robot_is_believed_to_move_three_times_as_fast_as_its_limit_and_2_mm() {
    let l = limits();
    for periods in [1.0, 2.5, 4.0] {
        let [way_m, angle_rad] = [(l.speed_m_s, 0.002), (l.turn_rad_s, 0.01)]
            .map(|(rate, slack)| 3.0 * rate * periods * PERIOD_S + slack);
        for (share, believed) in [(0.99, true), (1.01, false)] {
            let moved = is_believed(travelling(), periods, |pose| shifted(pose, share * way_m));
            assert_eq!(moved, believed, "{share} of {way_m} m in {periods} periods");
            let leaned = is_believed(travelling(), periods, |pose| turned(pose, share * angle_rad));
            assert_eq!(leaned, believed, "{share} of {angle_rad} rad in {periods} periods");
        }
    }
}

/// For as long as is no silence, five periods; for the rest of the time no faster than the limit.
#[test]
fn after_a_silence_it_is_believed_to_have_caught_up_for_five_periods() {
    // Interrupted after the sixth; 20 periods from the last frame when it is heard again.
    let way_m = 0.12 * (20.0 + 2.0 * 5.0) * PERIOD_S + 0.002;
    for (share, believed) in [(0.99, true), (1.01, false)] {
        let mut robot = interrupted(19);
        let pose = shifted(&robot.said, share * way_m);
        robot.k += 19;
        robot.says(PERIOD_NS, pose, |_| {});
        assert_eq!(
            (robot.state.jumps == 0, is_travelling(&robot)),
            (believed, believed),
            "{share} of {way_m} m"
        );
    }
}

#[test]
fn five_periods_are_a_silence_and_the_controllers_patience_is_the_end() {
    // Heard again, or looked for.
    for (periods, goes_on) in [(4.9, true), (5.1, false)] {
        let after_ns = (periods * PERIOD_NS as f64) as i64;
        let mut robot = travelling();
        robot.says(after_ns, robot.obedient(), |_| {});
        assert_eq!(is_travelling(&robot), goes_on, "{periods} periods: {:?}", robot.state.phase);
        let mut robot = travelling();
        robot.now_ns += after_ns;
        robot.step(None, OperatorCommand::Go);
        assert_eq!(is_travelling(&robot), goes_on, "{periods} periods: {:?}", robot.state.phase);
    }
    for (ms, is_over) in [(199, false), (201, true)] {
        let mut robot = interrupted(6);
        robot.now_ns += ms * 1_000_000 - 6 * PERIOD_NS;
        robot.step(None, OperatorCommand::Go);
        match robot.state.phase {
            Phase::Interrupted { .. } => assert!(!is_over, "{ms} ms"),
            Phase::Silent { why: EndReason::RobotSilent { silent_s } } => {
                assert!(is_over && (silent_s - ms as f64 * 1e-3).abs() < 1e-9, "{ms} ms: {silent_s} s");
            }
            other => panic!("{ms} ms: {other:?}"),
        }
    }
}

#[test]
fn a_frame_that_is_late_by_more_than_three_periods_pauses_for_25() {
    for (periods, pauses) in [(2.9, 0), (3.1, 1)] {
        let mut robot = travelling();
        let speed = robot.sent.last().unwrap().1.velocity_m_s.norm();
        robot.says((periods * PERIOD_NS as f64) as i64, robot.obedient(), |_| {});
        assert_eq!(robot.state.pauses, pauses, "{periods} periods");
        let paused = |robot: &Liar| match robot.state.phase {
            Phase::Travelling { paused_for, .. } => paused_for,
            other => panic!("{other:?}"),
        };
        for left in (0..=if pauses == 0 { 0 } else { 25 }).rev() {
            assert_eq!(paused(&robot), left);
            robot.obeys(1);
        }
        let after = robot.sent.last().unwrap().1.velocity_m_s.norm();
        // 0.1 s of braking at 1.2 to 2 a second, with a lag of 0.1 s.
        assert_eq!(after < 0.97 * speed, pauses == 1, "{after} after {speed} m/s");
    }
}

/// After a hold-up frames come that had waited on the way: they say where the robot was.
#[test]
fn motion_is_taken_up_with_a_frame_that_is_fresh() {
    let mut robot = interrupted(15);
    let at = robot.obedient();
    for waited in 1..=20 {
        robot.says(1_000, at, |_| {});
        // It was made `waited` periods after the last that was heard, and is 15 after it.
        let is_fresh = waited >= 13;
        assert_eq!(is_travelling(&robot), is_fresh, "frame {waited}: {:?}", robot.state.phase);
        if is_fresh {
            return;
        }
    }
}

#[test]
fn a_controller_whose_clock_ran_ahead_meanwhile_is_another_one() {
    for (ahead, goes_on) in [(4.9, true), (5.1, false)] {
        let mut robot = interrupted(9);
        robot.k += 9;
        robot.says(PERIOD_NS, robot.obedient(), |received| {
            received.frame.device_ns += (ahead * PERIOD_NS as f64) as i64;
        });
        assert_eq!(is_travelling(&robot), goes_on, "{ahead} periods: {:?}", robot.state.phase);
    }
}

#[test]
fn a_leap_while_it_rests_is_the_end_when_no_time_is_left_for_another_frame() {
    // 200 ms of patience less five periods: 44.6 periods from the last frame that was believed.
    for (periods, is_over) in [(44, false), (45, true)] {
        let mut robot = interrupted(periods - 1);
        let away = shifted(&robot.said, 0.1);
        robot.k += periods - 1;
        robot.says(PERIOD_NS, away, |_| {});
        match robot.state.phase {
            Phase::Interrupted { .. } => assert!(!is_over),
            Phase::Silent { why: EndReason::NotBelieved { distance_m, angle_rad } } => {
                assert!(is_over && (distance_m - 0.1).abs() < 1e-9 && angle_rad < 1e-7, "{distance_m} m");
            }
            other => panic!("{other:?}"),
        }
        assert_eq!(robot.state.jumps, 1);
    }
}

#[test]
fn a_scan_begins_within_the_start_and_goes_on_within_the_deviation() {
    type Elsewhere = fn(&Pose, f64) -> Pose;
    let both: [(Elsewhere, f64, f64); 2] = [(shifted, 0.01, 0.03), (turned, 0.05, 0.2)];
    for (elsewhere, start, deviation) in both {
        for (share, within) in [(0.999, true), (1.001, false)] {
            let mut robot = Liar::new();
            let first = elsewhere(&robot.start(), share * start);
            for _ in 0..40 {
                robot.says(PERIOD_NS, first, |_| {});
            }
            assert_eq!(is_travelling(&robot), within, "{:?}", robot.state.phase);

            // Away from its reference by a tenth a frame, as it may be.
            let mut robot = travelling();
            for tenth in 1..10 {
                let share = f64::from(tenth) / 20.0 * 1.998;
                robot.says(3 * PERIOD_NS, elsewhere(&robot.obedient(), share * deviation), |_| {});
            }
            assert!(is_travelling(&robot) && robot.state.jumps == 0, "{:?}", robot.state);
            for _ in 0..2 {
                robot.says(4 * PERIOD_NS, elsewhere(&robot.obedient(), share * deviation), |_| {});
            }
            assert_eq!(is_travelling(&robot), within, "{share}: {:?}", robot.state.phase);
        }
    }
}

#[test]
fn a_robot_that_is_held_and_yet_elsewhere_is_left_to_its_controller() {
    type Elsewhere = fn(&Pose, f64) -> Pose;
    let both: [(Elsewhere, f64); 2] = [(shifted, 0.03), (turned, 0.2)];
    for (elsewhere, deviation) in both {
        for (share, held) in [(0.999, true), (1.001, false)] {
            let mut robot = travelling();
            // Held, and then for a second there.
            robot.says(PERIOD_NS, robot.obedient(), |received| received.frame.collided = true);
            for _ in 0..250 {
                robot.says(PERIOD_NS, robot.obedient(), |_| {});
            }
            let at = robot.obedient();
            for twentieth in 1..20 {
                let away = elsewhere(&at, f64::from(twentieth) / 20.0 * deviation);
                robot.says(4 * PERIOD_NS, away, |_| {});
            }
            let is_held = |robot: &Liar| matches!(robot.state.phase, Phase::Holding { .. });
            assert!(is_held(&robot) && robot.state.jumps == 0, "{:?}", robot.state);
            robot.says(4 * PERIOD_NS, elsewhere(&at, share * deviation), |_| {});
            assert_eq!(is_held(&robot), held, "{share}: {:?}", robot.state.phase);
            assert!(
                (robot.obedient().translation.vector - at.translation.vector).norm() < 1e-12,
                "it did not follow"
            );
        }
    }
}

#[test]
fn a_robot_that_is_not_guided_is_echoed_where_there_was_time_to_follow() {
    let mut robot = Liar::new();
    robot.obeys(10);
    let unguided = |robot: &mut Liar, pose: Pose| {
        let before = robot.sent.len();
        robot.says(PERIOD_NS, pose, |received| received.frame.mci = MciState::Stopped);
        robot.sent.len() > before
    };
    // 12 ms and a step were saved up; 0.12 m/s of that are 1.9 mm, and 2 mm off is near enough.
    let there = shifted(&robot.obedient(), 0.0033);
    assert!(unguided(&mut robot, there));
    assert!((robot.obedient().translation.vector - there.translation.vector).norm() < 0.002);
    // As far again, with 0.5 mm to spare.
    let there = shifted(&there, 0.0033);
    assert!(!unguided(&mut robot, there), "{:?}", robot.state.phase);
    // It stands, and is followed.
    for _ in 0..20 {
        unguided(&mut robot, there);
    }
    assert!((robot.obedient().translation.vector - there.translation.vector).norm() < 1e-9);
}

#[test]
fn a_robot_that_speaks_every_20_ms_is_guided_and_at_101_percent_it_is_stopped() {
    for (every_ns, guided) in [(19_900_000, true), (20_100_000, false)] {
        let mut robot = Liar::new();
        for _ in 0..60 {
            let k = robot.k;
            robot.says(every_ns, robot.obedient(), |received| received.frame.device_ns = (k + 1) * every_ns);
        }
        match robot.state.phase {
            Phase::Travelling { .. } => assert!(guided, "{every_ns} ns"),
            Phase::Holding { why: EndReason::TooSlow { period_s }, .. } => {
                assert!(
                    !guided && (period_s - every_ns as f64 * 1e-9).abs() < 1e-9,
                    "{every_ns} ns: {period_s} s"
                );
            }
            other => panic!("{other:?}"),
        }
    }
    for (percent, stops) in [(100.0, false), (100.1, true)] {
        let mut robot = travelling();
        robot
            .says(PERIOD_NS, robot.obedient(), |received| received.frame.utilization_percent = Some(percent));
        let why = robot.state.phase;
        assert_eq!(matches!(why, Phase::Stopping { why: EndReason::Overload { .. }, .. }), stops, "{why:?}");
    }
}

#[test]
fn whether_the_controller_called_it_converged_is_that_of_the_frame_that_was_heard_last() {
    let mut robot = Liar::new();
    assert!(!robot.state.was_converged(), "nothing was heard");
    robot.obeys(3);
    for converged in [false, true, false] {
        robot.says(PERIOD_NS, robot.obedient(), |received| received.frame.converged = converged);
        assert_eq!(robot.state.was_converged(), converged);
    }
}
