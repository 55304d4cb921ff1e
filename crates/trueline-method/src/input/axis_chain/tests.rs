#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use super::*;
use nalgebra::{SVector, UnitVector3};
use trueline_geometry::{AxisKind, se3, so3};

fn link(carries: Carries, kind: AxisKind, k: f64) -> Link {
    let direction = UnitVector3::new_normalize(Vector3::new(k.sin(), (2.0 * k).cos(), 0.4));
    let axis = Axis {
        scale: 1.01,
        time_offset_s: 0.02,
        ..Axis::new(kind, direction, Vector3::new(0.3 * k, -0.4, 0.2))
    };
    let times_s: Vec<f64> = (0..60).map(|i| 0.05 * f64::from(i)).collect();
    let values = times_s.iter().map(|t| (1.3 * t + k).sin()).collect();
    let values = Arc::new(Values { times_s, values });
    Link { axis, carries, in_pose: None, moves: true, values, holds_time_offset: false }
}

fn chain(mounted: Mounted) -> AxisChain {
    let kinds = [
        (Carries::Part, AxisKind::Rotary),
        (Carries::Robot, AxisKind::Linear),
        (Carries::Sensor, AxisKind::Rotary),
        (Carries::Part, AxisKind::Rotary),
        (Carries::Robot, AxisKind::Rotary),
        (Carries::Sensor, AxisKind::Linear),
    ];
    let links = (1..).zip(kinds).map(|(k, (carries, kind))| link(carries, kind, f64::from(k)));
    AxisChain { links: links.collect(), mounted }
}

fn pose() -> Pose {
    se3::from_parts(so3::exp(&Vector3::new(0.3, -0.8, 1.1)), Vector3::new(0.9, -0.2, 0.6))
}

const TIME_S: f64 = 1.234;

/// Central differences over 1e-6 leave 1e-12 of third derivatives and round to 1e-10.
#[test]
fn points_move_with_every_axis_as_differences_say() {
    let measured = Vector3::new(0.05, 0.01, 0.2);
    for chain in [Mounted::Tool, Mounted::Fixed].map(chain) {
        let place = |chain: &AxisChain| {
            (chain.lines_from_carrier(&pose(), TIME_S).unwrap() * Point3::from(measured)).coords
        };
        let whole = chain.lines_from_carrier(&pose(), TIME_S).unwrap();
        let again = chain.without_axes(&whole, TIME_S).unwrap();
        assert!((again.to_homogeneous() - pose().to_homogeneous()).amax() < 1e-14);
        let by = chain.d_point(&whole, &place(&chain), TIME_S).unwrap();
        for k in 0..by.ncols() {
            let moved = |step: f64| {
                let mut other = chain.clone();
                let mut delta = SVector::<f64, AXIS>::zeros();
                delta[k % AXIS] = step;
                let axis = &mut other.links[k / AXIS].axis;
                *axis = axis.retract(&delta);
                place(&other)
            };
            let slope = (moved(1e-6) - moved(-1e-6)) / 2e-6;
            // Cubic pieces have corners in their second derivative.
            assert!((slope - by.column(k)).norm() < 1e-6, "{k}: {slope} {}", by.column(k));
        }
    }
}

#[test]
fn a_link_and_its_surroundings_make_the_whole_chain() {
    for chain in [Mounted::Tool, Mounted::Fixed].map(chain) {
        let whole = chain.lines_from_carrier(&pose(), TIME_S).unwrap();
        for (k, link) in chain.links.iter().enumerate() {
            let around = chain.around(k, &pose(), TIME_S).unwrap();
            let again = around.before * link.axis.motion(around.value) * around.behind;
            assert!((again.to_homogeneous() - whole.to_homogeneous()).amax() < 1e-14, "{k}");
        }
    }
}

#[test]
fn a_correct_controller_axis_changes_nothing() {
    let mut chain = chain(Mounted::Tool);
    for link in &mut chain.links {
        link.in_pose = Some(link.axis);
    }
    let again = chain.lines_from_carrier(&pose(), TIME_S).unwrap();
    assert!((again.to_homogeneous() - pose().to_homogeneous()).amax() < 1e-14);
}

#[test]
fn values_and_rates_are_those_of_a_smooth_course() {
    let values = &link(Carries::Part, AxisKind::Rotary, 0.0).values;
    for k in 5..50 {
        let time_s = 0.05 * f64::from(k) + 0.017;
        let (value, rate) = values.at(time_s).unwrap();
        // Cubic pieces with slopes of differences: T³/12 of the third derivative, 2.2.
        assert!((value - (1.3 * time_s).sin()).abs() < 2e-5, "{value}");
        assert!((rate - 1.3 * (1.3 * time_s).cos()).abs() < 2e-3, "{rate}");
    }
    assert!(values.at(-0.01).is_none() && values.at(2.96).is_none());
}
