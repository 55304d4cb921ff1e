//! Plans in cells with external axes: predictions, limits, hidden parts, refusals.

use crate::cells;

use cells::axes::{TABLE, TRACK, WRIST, cell, planned, scanned};
use cells::example_with;
use trueline_dataset::AxisMotion;
use trueline_method::axes::finding::{AxisFinding, AxisPart};
use trueline_method::problem::parameters::LINES;
use trueline_method::{Config, Status, Warning, calibrate};
use trueline_plan::expected_axes::{expected_axes, hidden};
use trueline_plan::{Cell, Plan, PlanError};

fn promised(cell: &Cell, plan: &Plan) -> Vec<AxisFinding> {
    expected_axes(cell, &plan.motion, &plan.prediction)
}

/// The ± of a calibration of the plan's own scan are those promised, for the hand-eye and for each part of the axis. A part that one
/// straight seam hides is hidden in both.
#[test]
fn a_calibration_states_what_the_plan_promised() {
    for (axis, limits) in [
        (TABLE, "range_deg = [-30, 30]"),
        (TABLE, "stand_deg = [0, 50, 100]"),
        (TRACK, "range_mm = [-100, 200]"),
        (WRIST, "range_deg = [-20, 20]"),
    ] {
        let cell = cell(axis, limits);
        let plan = planned(&cell).unwrap_or_else(|why| panic!("{limits}: {why}"));
        let recording = scanned(&cell, &plan, 7);
        let found = calibrate(&recording, None, &Config::noise_only()).unwrap();
        assert_eq!(found.status(), Status::Accepted, "{limits}: {:?}", found.reasons());
        // The estimator sees noise of one draw: its ± are 3 % uncertain. It knows nothing of attitude noise. Which way a track goes along
        // its seam is open by 0.3 rad, and the ± of the hand-eye depend on it: 0.78 to 1.04 in two scans.
        let least = if axis == TRACK { 0.7 } else { 0.8 };
        for k in 0..LINES {
            let ratio = found.sigma(k).unwrap() / plan.prediction.sigma(k);
            assert!((least..1.25).contains(&ratio), "{limits}, unknown {k}: {ratio}");
        }
        let (own, said) = (&found.findings.axes[0], &promised(&cell, &plan)[0]);
        for part in AxisPart::ALL.into_iter().filter(|part| said.has(*part)) {
            match (own.sigma(part), said.sigma(part)) {
                (Some(own), Some(said)) => {
                    let ratio = own / said;
                    assert!((0.8..1.25).contains(&ratio), "{limits}, {part:?}: {ratio}");
                }
                (own, said) => assert_eq!(own, said, "{limits}, {part:?}"),
            }
        }
    }
}

/// Parts of an axis that a plan leaves hidden, each with its cure.
fn left(cell: &Cell, plan: &Plan) -> Vec<(AxisPart, &'static str)> {
    let of = |warning: Warning| match warning {
        Warning::AxisNotShown { part, cure, .. } => (part, cure),
        other => panic!("{other}"),
    };
    hidden(&promised(cell, plan), &plan.prediction).into_iter().map(of).collect()
}

#[test]
fn hidden_parts_are_named_with_their_cure() {
    let of = |axis: &str, limits: &str| {
        let cell = cell(axis, limits);
        let plan = planned(&cell).unwrap();
        (left(&cell, &plan), promised(&cell, &plan).remove(0))
    };
    let (nothing, swings) = of(TABLE, "range_deg = [-30, 30]");
    assert_eq!(nothing, []);
    let (nothing, three) = of(TABLE, "stand_deg = [0, 60, 120]");
    assert_eq!(nothing, []);
    let (_, two) = of(TABLE, "stand_deg = [0, 60]");
    let place = |axis: &AxisFinding| axis.sigma(AxisPart::Place).unwrap_or(f64::INFINITY);
    assert!(place(&two) > 2.0 * place(&three) && place(&two) > 2.0 * place(&swings), "{}", place(&two));
    let (one, stands) = of(TABLE, "stand_deg = [30]");
    assert_eq!(one, [(AxisPart::Direction, "move it while scanning")]);
    assert!(!stands.moves);
    let (along, _) = of(TRACK, "range_mm = [-100, 100]");
    assert!(
        matches!(along[..], [(AxisPart::Direction, cure)] if cure.contains("seams in two directions")),
        "{along:?}"
    );
}

/// A sensor that keeps its attitude at the part: the plan is refused, and names the links that hide each other. The table's place is not
/// among them, for the robot goes round with it.
#[test]
fn a_sensor_that_keeps_its_attitude_hides_links_by_name() {
    let mut cell = cell(TABLE, "range_deg = [-30, 30]");
    cell.limits.tilt_rad = [0.0; 3];
    let Err(PlanError::NotShown { hidden, .. }) = planned(&cell) else { panic!("not hidden") };
    for link in ["the hand-eye translation", "the line"] {
        assert!(hidden.iter().any(|own| own == link), "{link}: {hidden:?}");
    }
}

#[test]
fn an_axis_keeps_its_limits() {
    for limits in [
        "range_deg = [-40, 10]\nspeed_deg_s = 6\nacceleration_deg_s2 = 5",
        "range_deg = [-40, 10]\nspeed_deg_s = 6\nmotion = \"run\"",
        "stand_deg = [-20, 10, -5]\nspeed_deg_s = 12\nacceleration_deg_s2 = 10",
    ] {
        let cell = cell(TABLE, limits);
        let plan = planned(&cell).unwrap();
        let period_s = 4e-3;
        let record = plan.motion.axis_records(&cell, period_s, 0.1).remove(0);
        let values: Vec<f64> = record.values.iter().map(|value| value.value.to_degrees()).collect();
        // A cubic piece before the first step of a run dips by a part of that step.
        assert!(values.iter().all(|value| (-40.0 - 1e-6..=10.0 + 1e-6).contains(value)), "{limits}");
        let most = |steps: &[f64]| steps.iter().fold(0.0_f64, |most, step| most.max(step.abs()));
        let rates: Vec<f64> = values.windows(2).map(|pair| (pair[1] - pair[0]) / period_s).collect();
        let changes: Vec<f64> = rates.windows(2).map(|pair| (pair[1] - pair[0]) / period_s).collect();
        let own = &cell.axes[0].limits;
        let [speed, acceleration] = [own.speed, own.acceleration].map(f64::to_degrees);
        // Differences see less than the course itself.
        assert!(most(&rates) <= speed * 1.001, "{limits}: {}", most(&rates));
        assert!(most(&changes) <= acceleration * 1.001, "{limits}: {}", most(&changes));
        // It begins and ends at rest.
        assert!(rates[0] == 0.0 && rates[rates.len() - 1] == 0.0, "{limits}");
        assert!(most(&rates) > 0.1, "{limits}: it moves");
    }
}

#[test]
fn axes_that_cannot_be_planned_are_refused_with_their_key() {
    let table = |limits: &str| format!("[[axis]]\n{TABLE}[axis.limits]\n{limits}");
    for (axes, said) in [
        (table("range_deg = [10, 10.5]"), "axis.limits.range_deg"),
        (table("range_deg = [30, -30]"), "axis.limits.range_deg"),
        (table("range_deg = [nan, 30]"), "axis.limits.range_deg"),
        (table("range_mm = [-30, 30]"), "axis.limits.range_mm"),
        (table("range = [-30, 30]"), "unknown field `range`"),
        (table("speed_deg_s = 0"), "axis.limits.speed_deg_s"),
        (table("acceleration_deg_s2 = -1"), "axis.limits.acceleration_deg_s2"),
        (table("motion = \"waltz\""), "axis.limits.motion"),
        (table("motion = \"stand\""), "axis.limits.stand_deg"),
        (table("stand_deg = []"), "axis.limits.stand_deg"),
        (table("stand_deg = [0, 60]\nrange_deg = [-30, 30]"), "axis.limits.stand_deg"),
        (table("stand_deg = [0, 60]\nmotion = \"swing\""), "axis.limits.motion"),
        (format!("[[axis]]\n{TRACK}[axis.limits]\nrange_mm = [0, 2]"), "axis.limits.range_mm"),
        (format!("[[axis]]\n{TRACK}[axis.limits]\nrange_deg = [0, 20]"), "axis.limits.range_deg"),
        (format!("[[axis]]\n{TABLE}in_pose = true"), "axis.in_pose"),
        (format!("[[axis]]\n{TABLE}[[axis]]\n{TABLE}"), "axis.name"),
        ("[[axis]]\nname = \"t\"\nkind = \"rotary\"\ncarries = \"part\"".to_owned(), "axis.direction"),
        (format!("[[axis]]\n{}", TABLE.replace("point_mm", "# ")), "axis.point_mm"),
        (format!("[[axis]]\n{}", TABLE.replace("part", "roof")), "axis.carries"),
    ] {
        let message = example_with(&axes).map(|_| ()).unwrap_err().to_string();
        assert!(message.contains(said), "{axes}: {message}");
    }
    let usual = example_with(&format!("[[axis]]\n{TABLE}")).unwrap();
    assert_eq!(usual.axes[0].limits.motion, AxisMotion::Swings);
    assert!((usual.axes[0].limits.range[1].to_degrees() - 30.0).abs() < 1e-12);
}
