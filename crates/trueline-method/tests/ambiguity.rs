//! Paths that repeat themselves: the scan does not decide, and nothing is chosen silently.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

use trueline_dataset::{Guess, Recording};
use trueline_method::hypotheses::choice::{DecidedBy, KnownOfCell, Statement, ToolAxis, statements_for};
use trueline_method::{Calibration, Config, Parameters, Status, calibrate};
use trueline_sim::{Preset, Weave, random_cell, simulate};

fn with(recording: &Recording, guess: Option<&Guess>, known: KnownOfCell) -> Calibration {
    calibrate(recording, guess, &Config { known, ..Config::default() }).unwrap()
}

fn is_right(result: &Calibration, truth: &Guess) -> bool {
    let turn_rad = result.best_fit().tool_from_camera.rotation.angle_to(&truth.tool_from_camera.rotation);
    // An alias is a period or half a turn off; noise makes errors a hundred times smaller than these limits.
    (result.best_fit().time_offset_s - truth.time_offset_s).abs() < 0.05 && turn_rad < 0.2
}

#[test]
fn a_path_that_repeats_itself_is_refused_with_its_rivals_as_complete_answers() {
    for weave in [Weave::SPath, Weave::Base2Hz] {
        let recording = simulate(&weave.scenario(1), 1).unwrap();
        let truth = recording.truth.as_ref().unwrap().parameters;
        let result = with(&recording, None, KnownOfCell::default());
        assert_eq!(result.status(), Status::NotAccepted, "{}", weave.name());
        assert!(result.findings.checks.ambiguity.is_open());
        let is_truth = |at: &Parameters| (at.time_offset_s - truth.time_offset_s).abs() < 0.05;
        let answers = result.findings.checks.ambiguity.rivals.iter().map(|rival| &rival.parameters);
        assert!(answers.chain([result.best_fit()]).any(is_truth), "the truth is among the answers");
        assert!(result.findings.checks.ambiguity.rivals.iter().all(|rival| rival.test.z.abs() <= 5.0));
    }
}

#[test]
fn a_statement_or_a_guess_decides_and_the_result_says_so() {
    let recording = simulate(&Weave::SPath.scenario(3), 3).unwrap();
    let truth = recording.truth.as_ref().unwrap().parameters;
    let within = |window_s: f64| KnownOfCell { offset_within_s: Some(window_s), looks: None };
    let stated = with(&recording, None, within(0.2));
    assert_eq!(stated.status(), Status::Accepted, "{:?}", stated.reasons());
    assert!(is_right(&stated, &truth));
    assert_eq!(stated.findings.checks.ambiguity.decided_by, Some(DecidedBy::Statement));
    let guessed = with(&recording, Some(&truth), KnownOfCell::default());
    assert!(is_right(&guessed, &truth));
    assert_eq!(guessed.findings.checks.ambiguity.decided_by, Some(DecidedBy::Guess));
    assert!(
        guessed.warnings().iter().any(|w| w.to_string().contains("guess decided")),
        "{:?}",
        guessed.warnings()
    );
    // The true offset is between 0 and 100 ms, and no answer is within a microsecond.
    let contradicted = with(&recording, None, within(1e-6));
    assert_eq!(contradicted.status(), Status::NotAccepted);
}

#[test]
fn an_ordinary_scan_is_decided_and_a_false_statement_is_refused() {
    let recording = simulate(&random_cell(&Preset::Quick.scenario(), 5, 0.1), 5).unwrap();
    let truth = recording.truth.as_ref().unwrap().parameters;
    let free = with(&recording, None, KnownOfCell::default());
    assert_eq!(free.status(), Status::Accepted, "{:?}", free.reasons());
    assert!(free.findings.checks.ambiguity.rivals.is_empty());
    // Ordinary scans of 20 s have z above 100; 5 decides.
    assert!(
        free.findings.checks.ambiguity.runner_up.is_none_or(|rival| rival.test.z > 20.0),
        "{:?}",
        free.findings.checks.ambiguity.runner_up
    );
    let view = truth.tool_from_camera.rotation * nalgebra::Vector3::z();
    for axis in ToolAxis::ALL {
        let known = KnownOfCell { offset_within_s: None, looks: Some(axis) };
        let accepted = with(&recording, None, known).status() == Status::Accepted;
        assert_eq!(accepted, view.dot(&axis.direction()) >= 0.5, "{}", axis.name());
    }
}

#[test]
fn statements_single_out_one_answer_and_no_other() {
    let recording = simulate(&Preset::Quick.scenario(), 1).unwrap();
    let truth = recording.truth.unwrap();
    let answer = |time_offset_s: f64, turn: nalgebra::Vector3<f64>| {
        Parameters::straight(
            &trueline_dataset::Guess {
                time_offset_s,
                tool_from_camera: nalgebra::Isometry3::new(nalgebra::Vector3::zeros(), turn),
            },
            truth.lines.clone(),
        )
    };
    let upright = nalgebra::Vector3::zeros();
    let over = nalgebra::Vector3::x() * std::f64::consts::PI;
    let answers = [answer(0.05, upright), answer(-0.45, over), answer(0.55, upright)];
    let answers: Vec<&Parameters> = answers.iter().collect();
    // Half way between 0.05 and 0.45.
    assert_eq!(statements_for(0, &answers), [Statement::OffsetWithin(0.25)]);
    assert_eq!(statements_for(1, &answers), [Statement::Looks(ToolAxis::MinusZ)]);
    assert!(statements_for(2, &answers).is_empty());
}
