//! Tests insufficient motions: rank and reported direction of each (theory of observability).

use trueline_dataset::Sensor;
use trueline_geometry::Plane;
use trueline_method::assess::observability::Group;
use trueline_method::verdict::Axis;
use trueline_method::{Calibration, Config, Error, Reason, Status, calibrate};
use trueline_sim::scenario::Sine;
use trueline_sim::{Preset, Scenario, SensorModel, simulate};

fn calibrated(scenario: &Scenario) -> Calibration {
    calibrate(&simulate(scenario, 1).unwrap(), None, &Config::default()).unwrap()
}

fn groups(calibration: &Calibration) -> Vec<Group> {
    calibration.findings.unknowns.observability.unobservable.iter().map(|u| u.group).collect()
}

#[test]
fn along_the_line_nothing_usable_is_seen() {
    let calibration = calibrated(&Preset::AlongLine.scenario());
    assert_eq!(calibration.status(), Status::NotAccepted);
    assert!(groups(&calibration).contains(&Group::TimeOffset));
    assert_eq!(calibration.sigma(0), None);
    assert_eq!(calibration.findings.unknowns.observability.rank, 4);
    // Every other time offset fits as well, so none is an answer.
    assert!(calibration.findings.checks.ambiguity.rivals.is_empty());
    assert!(calibration.findings.unknowns.corrected.is_none());
}

#[test]
fn points_off_the_plane_that_the_sensors_file_states_are_refused() {
    let mut scenario = Preset::Quick.scenario();
    let SensorModel::CameraLaser { camera, laser_plane_in_camera } = scenario.cell.sensor.clone() else {
        unreachable!()
    };
    scenario.cell.sensor = SensorModel::Points { camera, laser_plane_in_camera };
    let mut recording = simulate(&scenario, 1).unwrap();
    let mut with_plane_moved_by = |moved_m: f64| {
        let normal = laser_plane_in_camera.normal().into_inner();
        let moved = Plane::new(normal, laser_plane_in_camera.offset() + moved_m);
        recording.sensor = Sensor::Points { laser_plane_in_camera: moved };
        calibrate(&recording, None, &Config::default())
    };
    assert_eq!(with_plane_moved_by(0.0).unwrap().status(), Status::Accepted);
    for moved_m in [30e-3, -30e-3] {
        let refused = with_plane_moved_by(moved_m);
        let Err(Error::PointsOffStatedPlane { median_m }) = refused else { panic!("{refused:?}") };
        // Points are in the plane within a tenth of a millimetre.
        assert!((median_m - 30e-3).abs() < 1e-4, "{median_m}");
    }
}

/// Two poses 20 s apart, and two pairs of poses 20 s apart. The sensor's motion in between is unknown.
#[test]
fn without_usable_features_nothing_is_known() {
    let mut recording = simulate(&Preset::Quick.scenario(), 1).unwrap();
    let robot = recording.robot.clone();
    let last = robot.len() - 1;
    recording.robot = vec![robot[0], robot[last]];
    let refused = calibrate(&recording, None, &Config::default()).unwrap_err();
    assert!(matches!(refused, Error::RobotTooSlow { period_s, .. } if period_s > 19.0), "{refused}");
    recording.robot = [0, 1, last - 1, last].map(|k| robot[k]).to_vec();
    let refused = calibrate(&recording, None, &Config::default()).unwrap_err();
    assert!(matches!(refused, Error::NoStart), "{refused}");
}

#[test]
fn constant_attitude_hides_the_translation_and_nothing_else() {
    let calibration = calibrated(&Preset::ConstantAttitude.scenario());
    assert_eq!(calibration.status(), Status::NotAccepted);
    assert_eq!(calibration.findings.unknowns.observability.rank, 8);
    assert_eq!(groups(&calibration), [Group::Translation, Group::Line(0)]);
    assert!(calibration.sigma(0).is_some());
    assert!((4..7).all(|k| calibration.sigma(k).is_none()));
    // None of the three is observable: one fact, one sentence.
    let hidden = calibration.tool_from_camera().unwrap_err();
    assert_eq!((hidden.group, hidden.directions.len()), (Group::Translation, 3));
    assert_eq!(calibration.translation(Axis::X).unwrap_err(), hidden);
    let unobservable = |r: &&Reason| matches!(r, Reason::Unobservable(u) if u.group == Group::Translation);
    assert_eq!(calibration.reasons().iter().filter(unobservable).count(), 1);
    // Without tilt the mirrored attitude fits as well, so no rotation is claimed without a guess …
    assert!((1..4).all(|k| calibration.sigma(k).is_none()));
    assert!(
        calibration.reasons().iter().any(|reason| matches!(reason, Reason::MirrorAmbiguity)),
        "{:?}",
        calibration.reasons()
    );
    // The other attitude is a rival of this one.
    let rivals = &calibration.findings.checks.ambiguity.rivals;
    assert!(matches!(&rivals[..], [only] if only.is_mirror), "{rivals:?}");
    assert!(!calibration.findings.checks.ambiguity.is_open(), "it is at the same time offset");
}

#[test]
fn a_guess_chooses_between_mirrored_attitudes() {
    let recording = simulate(&Preset::ConstantAttitude.scenario(), 1).unwrap();
    let truth = recording.truth.as_ref().unwrap().parameters;
    let calibration = calibrate(&recording, Some(&truth), &Config::default()).unwrap();
    let turn = trueline_geometry::se3::difference_decoupled(
        &calibration.best_fit().tool_from_camera,
        &truth.tool_from_camera,
    )
    .0;
    for k in 0..3 {
        assert!(turn[k].abs() < 4.0 * calibration.sigma(1 + k).unwrap(), "{turn}");
    }
}

#[test]
fn rotation_about_one_axis_hides_the_translation_along_it() {
    let mut scenario = Preset::Quick.scenario();
    // Spin alone, about the sheet's range axis.
    scenario.scan.attitude_rad = [0.0, 0.0, 8.0_f64.to_radians()];
    scenario.scan.tilts[0] = Sine::default();
    scenario.scan.tilts[1] = Sine::default();
    let calibration = calibrated(&scenario);
    assert_eq!(calibration.findings.unknowns.observability.rank, 10);
    let hidden = calibration.tool_from_camera().unwrap_err();
    assert_eq!((hidden.group, hidden.directions.len()), (Group::Translation, 1));
    // The axis in the tool frame: range axis of the sheet through the hand-eye rotation.
    let sheet = trueline_sim::capture::SheetAxes::of(&scenario.cell.sensor);
    let range_in_tool =
        scenario.cell.tool_from_camera.rotation * sheet.camera_from_sheet * nalgebra::Vector3::z();
    let direction = nalgebra::Vector3::from(hidden.directions[0]);
    // The columns are scaled by each axis's information, which rotates the reported direction slightly.
    assert!(direction.dot(&range_in_tool).abs() > 0.9, "{direction} {range_in_tool}");
}

#[test]
fn a_seam_held_at_one_image_point_hides_offset_and_rotation() {
    let mut scenario = Preset::Quick.scenario();
    scenario.scan.lateral = Sine::default();
    scenario.scan.range = Sine::default();
    let calibration = calibrated(&scenario);
    assert_eq!(calibration.status(), Status::NotAccepted);
    let groups = groups(&calibration);
    assert!(groups.contains(&Group::Rotation), "{groups:?}");
    assert_eq!(calibration.findings.unknowns.observability.rank, 7);
    assert!(groups.contains(&Group::TimeOffset), "{groups:?}");
    assert!((0..4).all(|k| calibration.sigma(k).is_none()));
}

#[test]
fn rotations_about_two_axes_show_everything() {
    let calibration = calibrated(&Preset::Quick.scenario());
    assert_eq!(
        (calibration.findings.unknowns.observability.rank, calibration.findings.unknowns.observability.size),
        (11, 11)
    );
    assert!(calibration.findings.unknowns.observability.unobservable.is_empty());
}

/// A second line adds its own four unknowns and determines them, but no rotation axis.
#[test]
fn a_second_line_does_not_replace_a_rotation() {
    let mut scenario = Preset::TwoLines.scenario();
    scenario.scan.tilts = [Sine::default(); 3];
    let calibration = calibrated(&scenario);
    assert_eq!(calibration.findings.unknowns.observability.size, 15);
    assert!(groups(&calibration).contains(&Group::Translation));
    assert_eq!(calibration.status(), Status::NotAccepted);
}

#[test]
fn advice_is_given_for_everything_unseen() {
    for preset in [Preset::AlongLine, Preset::ConstantAttitude] {
        let calibration = calibrated(&preset.scenario());
        assert!(!calibration.reasons().is_empty());
        assert!(
            calibration.findings.unknowns.observability.unobservable.iter().all(|u| u.to_string().len() > 20)
        );
    }
}

/// For any residual: along the line there is only noise in the column of the time offset.
#[test]
fn the_papers_residual_shows_no_more() {
    let recording = simulate(&Preset::AlongLine.scenario(), 3).unwrap();
    let config = Config { residual: trueline_method::ResidualKind::PointToLine, ..Config::default() };
    let calibration = calibrate(&recording, None, &config).unwrap();
    assert_eq!(calibration.status(), Status::NotAccepted);
    assert!((0..7).all(|k| calibration.sigma(k).is_none()));
}
