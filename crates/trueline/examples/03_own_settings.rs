//! Settings of your own: what is required, what is held, what noise to expect.

use std::error::Error;
use trueline::{Config, Guess, Hold, Reason, Recording, Requirement};
use trueline_sim::{Preset, simulate};

fn main() -> Result<(), Box<dyn Error>> {
    let scan = simulate(&Preset::Quick.scenario(), 3).ok_or("no seam in view")?;
    let truth = scan.truth.as_ref().ok_or("a simulation has a truth")?.parameters;
    let recording = Recording::from(scan);

    // More than any scan of 20 s can give: the reason says by how much.
    let require = Requirement { translation_m: Some(1e-9), ..Requirement::default() };
    let strict = recording.calibrate_with(&Config { require, ..Config::default() })?;
    assert!(matches!(strict.reasons(), [Reason::RequirementMissed { .. }]), "{:?}", strict.reasons());

    // A time offset that is known from elsewhere is held, and has no sigma.
    let guess = Guess { time_offset_s: truth.time_offset_s, ..truth };
    let config = Config { hold: vec![Hold::TimeOffset], ..Config::default() };
    let held = recording.with_guess(guess).calibrate_with(&config)?;
    let offset = held.time_offset()?;
    assert_eq!((offset.value_s, offset.sigma_s), (truth.time_offset_s, None));
    Ok(())
}
