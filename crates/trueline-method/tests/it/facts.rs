//! Tests reasons and warnings: stable codes, and sentences that agree with their values.

use std::collections::BTreeMap;
use trueline_method::assess::observability::{Group, Unobservable};
use trueline_method::assess::outliers::Outliers;
use trueline_method::input::skip::Skip;
use trueline_method::verdict::{Axis, Quantity, Reason, StreamName, Warning};

fn hidden(group: Group, directions: &[[f64; 3]]) -> Unobservable {
    Unobservable { group, directions: directions.to_vec() }
}

#[test]
fn all_axes_of_a_group_make_one_sentence() {
    let [x, y, z] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, -1.0]];
    let begins = |group, directions: &[[f64; 3]], words: &str| {
        let text = hidden(group, directions).to_string();
        assert!(text.starts_with(words), "{text}");
    };
    begins(
        Group::Translation,
        &[x, y, z],
        "translation along the tool's x, y and z axes cannot be determined from this scan. Tilt",
    );
    begins(
        Group::Rotation,
        &[x, z],
        "rotation about the tool's x and z axes cannot be determined from this scan. Sweep the seam",
    );
    begins(Group::Rotation, &[y], "rotation about the tool's y axis cannot be determined from this scan");
    let oblique = [0.6, 0.8, 0.0];
    begins(
        Group::Translation,
        &[oblique],
        "translation along the tool's direction (0.60, 0.80, 0.00) cannot",
    );
    begins(Group::Translation, &[], "the hand-eye translation cannot be determined independently");
    assert_eq!(hidden(Group::Translation, &[x, oblique]).one_by_one().len(), 2);
    assert_eq!(hidden(Group::TimeOffset, &[]).one_by_one().len(), 1);
}

#[test]
fn sentences_give_values_in_the_units_of_a_person() {
    let missed = Reason::RequirementMissed {
        quantity: Quantity::Translation,
        sigma_si: 0.000_123_4,
        required_si: 1e-6,
    };
    assert!(
        missed.to_string().starts_with("translation: ± 0.123 mm exceeds the required 0.001 mm"),
        "{missed}"
    );
    let step = Reason::ClockStep { at_s: 12.3456, step_s: -0.0123, sigma_s: 0.0004, pictures: None };
    assert_eq!(
        step.to_string(),
        "the time offset changes by -12.300 ± 0.400 ms at about 12.346 s: one of the clocks stepped or is adjusted by network time. \
         With arrival stamps a small change may also be load on the recording PC"
    );
    let moved = Warning::CrossValidationShift {
        span_s: [1.0, 2.5],
        quantity: Quantity::Rotation,
        axis: Some(Axis::Y),
        moved_si: 0.01_f64.to_radians(),
        sigmas: 7.0,
    };
    assert!(
        moved.to_string().contains("without 1.00 to 2.50 s the rotation about y moves by 0.0100°, 7.0 times")
    );
    let steps = (0..5).map(|k| (f64::from(k), 0.001)).collect();
    let stepping = Warning::StampSteps { stream: StreamName::Robot, steps, period_s: 0.004 };
    assert!(stepping.to_string().contains("+1.00 ms at 2.000 s and 2 more steps (up"), "{stepping}");
}

#[test]
fn the_question_on_clocks_is_asked_where_features_lie_outside_the_robot_recording() {
    let too_few = |mostly| Reason::TooFewUsed { used: 1, features: 9, mostly, mostly_count: 8 }.to_string();
    assert!(too_few(Skip::Outside).ends_with("do both streams cover the scan, stamped by one clock?"));
    assert!(too_few(Skip::Gap).ends_with("8: exposed in a gap of the robot stream"));
    let skipped = BTreeMap::from([(Skip::NoRay, 2), (Skip::Gap, 3)]);
    assert_eq!(
        Warning::FeaturesSkipped { skipped }.to_string(),
        "5 features could not be used; 3: exposed in a gap of the robot stream; 2: pixel outside the image or the lens \
         model"
    );
}

/// Other programs depend on these codes: a change is a change of the schema.
#[test]
fn codes_are_those_of_the_schema() {
    assert_eq!(Reason::MirrorAmbiguity.code(), "mirror-ambiguity");
    assert_eq!(Reason::Unobservable(hidden(Group::TimeOffset, &[])).code(), "unobservable");
    assert_eq!(
        Reason::ClockStep { at_s: 0.0, step_s: 0.0, sigma_s: 0.0, pictures: None }.code(),
        "clock-step"
    );
    let outliers = Outliers { count: 6, of: 10 };
    assert_eq!(Reason::TooManyOutliers { outliers }.code(), "too-many-outliers");
    assert_eq!(Warning::ManyOutliers { share: 0.3 }.code(), "many-outliers");
    assert_eq!(Warning::ClockDrift { ppm: 1.0, sigma_ppm: 0.1, about_s: 2.0 }.code(), "clock-drift");
    assert_eq!(Skip::Outside.code(), "outside-robot-recording");
}

#[test]
fn a_stated_uncertainty_is_applied_or_reported() {
    let mut recording = trueline_sim::simulate(&trueline_sim::Preset::Quick.scenario(), 1).unwrap();
    let calibrated = |recording: &trueline_dataset::Recording, residual| {
        let config = trueline_method::Config { residual, ..trueline_method::Config::default() };
        trueline_method::calibrate(recording, None, &config).unwrap()
    };
    let [sheet, papers] = [trueline_method::ResidualKind::Sheet, trueline_method::ResidualKind::PointToLine];
    let warned = |c: &trueline_method::Calibration| c.warnings().contains(&Warning::UncertaintyNotApplied);
    assert!(!warned(&calibrated(&recording, papers)));
    recording.setup.uncertainty = Some(trueline_dataset::sensor_setup::SensorUncertainty {
        plane_offset_m: Some(0.1e-3),
        ..Default::default()
    });
    assert!(warned(&calibrated(&recording, papers)));
    assert!(!warned(&calibrated(&recording, sheet)));
    // The robot's accuracy is applied with either residual.
    recording.setup.uncertainty = None;
    let sigma_with = |accuracy_m: f64| {
        let mut recording = recording.clone();
        recording.setup.robot_accuracy_m = Some(accuracy_m);
        calibrated(&recording, papers).sigma(4).unwrap()
    };
    assert!(sigma_with(0.6e-3) > 1.5 * sigma_with(0.1e-3));
}
