//! A line held at a drawing's place: its unique evidence, and the effect of its own ± on the answer.

use nalgebra::{DVector, Vector4};
use trueline_dataset::Recording;
use trueline_method::{Config, DrawnLine, Error, calibrate};
use trueline_sim::noise::Noise;
use trueline_sim::{Preset, random_cell, simulate};

// About as well as the scans show the line themselves: a worse drawing contradicts them.
const DIRECTION_SIGMA_RAD: f64 = 5e-5;
const OFFSET_SIGMA_M: f64 = 0.02e-3;

/// The true line with drawing errors as stated.
fn drawn(recording: &Recording, seed: u64) -> DrawnLine {
    let mut noise = Noise::new(seed, 91);
    let [turn, offset] = [DIRECTION_SIGMA_RAD, OFFSET_SIGMA_M];
    let step = Vector4::from([turn, turn, offset, offset].map(|sigma| noise.normal(sigma)));
    let truth = recording.truth.as_ref().unwrap().lines[0];
    // Its offsets are known at the middle of the scan.
    let amid = recording.robot[recording.robot.len() / 2].base_from_tool.translation.vector;
    DrawnLine {
        line: 0,
        line_in_base: truth.anchored_near(&amid).retract(&step),
        direction_sigma_rad: turn,
        offset_sigma_m: offset,
    }
}

#[test]
fn a_drawn_line_shows_the_translation_at_a_constant_attitude() {
    let recording = simulate(&Preset::ConstantAttitude.scenario(), 3).unwrap();
    let truth = recording.truth.as_ref().unwrap().parameters;
    let without = calibrate(&recording, Some(&truth), &Config::noise_only()).unwrap();
    let with = Config { drawn_lines: vec![drawn(&recording, 3)], ..Config::noise_only() };
    let with = calibrate(&recording, Some(&truth), &with).unwrap();
    let seen = |c: &trueline_method::Calibration| (4..7).filter(|k| c.sigma(*k).is_some()).count();
    // Along the line it is unobservable, whatever is known of the line.
    println!("{} {} {:?}", seen(&without), seen(&with), with.reasons());
    assert_eq!(seen(&without), 0);
    assert!(with.findings.unknowns.observability.rank > without.findings.unknowns.observability.rank - 4);
    let unseen =
        with.findings.unknowns.observability.unobservable.iter().map(|u| u.directions.len()).sum::<usize>();
    assert_eq!(unseen, 1, "{:?}", with.reasons());
}

#[test]
fn the_covariance_includes_the_drawn_lines_uncertainty() {
    let (mut sum, count) = (0.0, 12);
    for seed in 0..count {
        let scenario = random_cell(&Preset::Quick.scenario(), seed, 0.1);
        let recording = simulate(&scenario, seed).unwrap();
        let truth = recording.truth.as_ref().unwrap().parameters;
        let config = Config { drawn_lines: vec![drawn(&recording, seed)], ..Config::noise_only() };
        let c = calibrate(&recording, Some(&truth), &config).unwrap();
        let off = DVector::from_column_slice(c.best_fit().minus(&truth).as_slice());
        let covariance = c.best_fit_covariance().view((0, 0), (7, 7)).into_owned();
        sum += off.dot(&covariance.cholesky().unwrap().solve(&off)) / 7.0;
        assert!(c.findings.checks.seam_error.unwrap().budget_m.held > 0.0);
    }
    let mean = sum / f64::from(u32::try_from(count).unwrap());
    // χ² with 84 degrees of freedom, normalised: ± 0.15, three times.
    println!("{mean}");
    assert!((0.55..1.45).contains(&mean), "{mean}");
}

#[test]
fn a_line_that_the_scan_does_not_have_is_refused() {
    let recording = simulate(&Preset::Quick.scenario(), 3).unwrap();
    let truth = recording.truth.as_ref().unwrap().parameters;
    let config =
        Config { drawn_lines: vec![DrawnLine { line: 1, ..drawn(&recording, 3) }], ..Config::default() };
    let refused = calibrate(&recording, Some(&truth), &config).unwrap_err();
    assert_eq!(refused, Error::NoSuchLine { line: 1, lines: 1 });
}
