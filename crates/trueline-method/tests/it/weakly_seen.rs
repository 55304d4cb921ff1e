//! Tests scans that determine a rotation of the sensor only to half a degree or worse. Their uncertainties come from the likelihood profile.

use nalgebra::DVector;
use trueline_method::{Calibration, Config, Reason, Warning, calibrate};
use trueline_sim::{Preset, random_cell, simulate, simulate_with_faults};

/// A scan of 6 s with tilts of 2°, and its normalised error squared per unknown.
fn weak(seed: u64) -> (Calibration, f64) {
    let mut scenario = Preset::Weak.scenario();
    scenario.timing.duration_s = 6.0;
    let recording = simulate(&random_cell(&scenario, seed, 0.1), seed).unwrap();
    let truth = recording.truth.as_ref().unwrap().parameters;
    let c = calibrate(&recording, Some(&truth), &Config::noise_only()).unwrap();
    let error = DVector::from_column_slice(c.best_fit().minus(&truth).as_slice());
    let covariance = c.best_fit_covariance().view((0, 0), (7, 7)).into_owned();
    let squared = error.dot(&covariance.cholesky().unwrap().solve(&error)) / 7.0;
    (c, squared)
}

#[test]
fn a_curved_valley_gets_a_wider_uncertainty() {
    let cells: Vec<_> = (0..8).map(weak).collect();
    let widened: Vec<f64> = cells.iter().filter_map(|(c, _)| c.findings.fit.widened_by).collect();
    println!("{widened:?}");
    // The cost is not quadratic there, but nearly.
    assert!(!widened.is_empty() && widened.iter().all(|by| (1.1..1.5).contains(by)), "{widened:?}");
    for (c, _) in &cells {
        let is_told = c.warnings().iter().any(|warning| matches!(warning, Warning::WidenedByProfile { .. }));
        assert_eq!(is_told, c.findings.fit.widened_by.is_some());
    }
    // χ² with 56 degrees of freedom, normalised: ± 0.19, three times.
    let mean = cells.iter().map(|(_, squared)| squared).sum::<f64>() / cells.len() as f64;
    assert!((0.43..1.57).contains(&mean), "{mean}");
}

#[test]
fn a_scan_that_shows_its_turns_well_is_left_as_it_is() {
    let recording = simulate(&Preset::Good.scenario(), 1).unwrap();
    let c = calibrate(&recording, None, &Config::noise_only()).unwrap();
    assert_eq!(c.findings.fit.widened_by, None);
}

/// Backlash of the robot hides the little information of an S-scan on one rotation. Its uncertainty would be a guess.
#[test]
fn a_turn_without_a_bound_is_refused() {
    let recording =
        simulate_with_faults(&Preset::Paper.scenario(), &["backlash=0.1".parse().unwrap()], 1).unwrap();
    let c = calibrate(&recording, None, &Config::default()).unwrap();
    assert!(c.reasons().contains(&Reason::UndeterminedTurn), "{:?}", c.reasons());
    let codes: Vec<&str> = c.warnings().iter().map(Warning::code).collect();
    assert!(codes.contains(&"robot-backlash") && !codes.contains(&"widened"), "{codes:?}");
}
