//! Estimate while poses and seam points still arrive; here from a simulated cell.

use std::error::Error;
use std::sync::atomic::AtomicBool;
use trueline_cell::{LiveEstimate, Progress};
use trueline_sim::{Preset, simulate};

fn main() -> Result<(), Box<dyn Error>> {
    let scan = simulate(&Preset::Quick.scenario(), 6).ok_or("no seam in view")?;
    let estimate = LiveEstimate::new(scan.sensor, None);
    estimate.offer_poses(&mut scan.robot.clone()); // from the thread that receives them
    scan.features.into_iter().for_each(|feature| estimate.add_feature(feature)); // from the camera's
    let over = AtomicBool::new(true); // `run` has a thread of its own until this is set, and estimates once more then
    estimate.run(&over);

    let Progress::Estimated(estimated) = estimate.progress() else { return Err("no estimate".into()) };
    let [offset_s, sigma_s] = estimated.time_offset_s.ok_or("not observable")?;
    let truth_s = scan.truth.ok_or("a simulation has a truth")?.parameters.time_offset_s;
    assert!((offset_s - truth_s).abs() < 5.0 * sigma_s, "{offset_s} {sigma_s} {truth_s}");
    Ok(())
}
