//! Tests residuals like those of a real weld: correlated from frame to frame, or with the place on the seam.

use nalgebra::DVector;
use trueline_geometry::se3;
use trueline_method::assess::correlated_noise::{Along, Structure};
use trueline_method::{Calibration, Config, Status, calibrate};
use trueline_sim::{Fault, Preset, random_cell, simulate_with_faults};

/// Each cell's calibration, and eᵀ C⁻¹ e over its seven unknowns.
fn cells(faults: &[&str], count: u64) -> Vec<(Calibration, f64)> {
    let faults: Vec<Fault> = faults.iter().map(|fault| fault.parse().unwrap()).collect();
    (0..count)
        .map(|seed| {
            let scenario = random_cell(&Preset::Good.scenario(), seed, 0.1);
            let recording = simulate_with_faults(&scenario, &faults, seed).unwrap();
            let truth = recording.truth.as_ref().unwrap().parameters;
            let c = calibrate(&recording, Some(&truth), &Config::noise_only()).unwrap();
            let (turn, shift) =
                se3::difference_decoupled(&c.best_fit().tool_from_camera, &truth.tool_from_camera);
            let offset = c.best_fit().time_offset_s - truth.time_offset_s;
            let error = DVector::from_vec(vec![offset, turn.x, turn.y, turn.z, shift.x, shift.y, shift.z]);
            let covariance = c.best_fit_covariance().view((0, 0), (7, 7)).into_owned();
            let squared = error.dot(&covariance.cholesky().unwrap().solve(&error));
            (c, squared)
        })
        .collect()
}

#[test]
fn a_real_welds_residuals_are_accepted_with_honest_sigmas() {
    let cells = cells(&["correlated-noise=0.2", "bow-across=0.2"], 40);
    for (c, _) in &cells {
        assert_eq!(c.status(), Status::Accepted, "{:?}", c.reasons());
        let Structure::Correlated(noise) = &c.findings.fit.structure else { panic!("white") };
        assert_eq!(noise.along, Along::Time);
    }
    let mean = cells.iter().map(|(_, squared)| squared / 7.0).sum::<f64>() / cells.len() as f64;
    // χ² with 280 degrees of freedom over this number: ± 0.085; the level of the noise is known to a few percent.
    assert!((0.8..1.3).contains(&mean), "{mean}");
}

/// One pass at constant speed: time and place are equivalent, and either may be chosen.
#[test]
fn a_wavy_seam_widens_the_uncertainty() {
    let cells = cells(&["wobble=0.1,5"], 16);
    for (c, _) in &cells {
        assert!(matches!(c.findings.fit.structure, Structure::Correlated(_)), "white");
        assert!(c.findings.fit.noise_factor > 2.0 && c.findings.fit.structure.may_be_noise());
    }
    let mean = cells.iter().map(|(_, squared)| squared / 7.0).sum::<f64>() / cells.len() as f64;
    // χ² with 112 degrees of freedom, normalised: ± 0.13, four times.
    assert!((0.5..1.6).contains(&mean), "{mean}");
}

#[test]
fn a_clean_scan_is_white() {
    for (c, _) in cells(&[], 5) {
        assert!(matches!(c.findings.fit.structure, Structure::White), "{:?}", c.findings.fit.structure);
    }
}
