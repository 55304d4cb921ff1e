//! Simulate a scan that goes wrong, and see that the result says so.

use std::error::Error;
use trueline::{Recording, Status, Warning};
use trueline_sim::{Preset, simulate};

fn main() -> Result<(), Box<dyn Error>> {
    let mut scenario = Preset::Quick.scenario();
    scenario.disturbance.outlier_fraction = 0.3;
    let recording = Recording::from(simulate(&scenario, 5).ok_or("no seam in view")?);
    let result = recording.calibrate()?;
    assert_eq!(result.status(), Status::Accepted, "{:?}", result.reasons());
    let many = |warning: &Warning| matches!(warning, Warning::ManyOutliers { .. });
    assert!(result.warnings().iter().any(many), "{:?}", result.warnings());

    // Along the line the time offset cannot be seen: there is no number to read, but advice.
    let blind = simulate(&Preset::AlongLine.scenario(), 5).ok_or("no seam in view")?;
    let missing = Recording::from(blind).calibrate()?.time_offset().err().ok_or("it was observable")?;
    assert!(missing.to_string().contains("Sweep the sensor across the line"), "{missing}");
    Ok(())
}
