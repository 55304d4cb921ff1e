//! Open a dataset folder (or a `recording.mcap`, or a rosbag2) and calibrate.
#![allow(clippy::print_stdout, reason = "an example prints")]

use std::error::Error;
use trueline::{Recording, Status};
use trueline_sim::{Preset, simulate};

fn main() -> Result<(), Box<dyn Error>> {
    let place = std::env::temp_dir().join(format!("trueline-example-01-{}", std::process::id()));
    let simulated = simulate(&Preset::Quick.scenario(), 1).ok_or("no seam in view")?;
    trueline_dataset::folder::write(&place, &simulated)?;

    let recording = Recording::open(&place)?;
    let result = recording.calibrate()?;
    println!("{result}");
    let offset = result.time_offset()?;
    result.save(place.join("result.json"))?;
    let saved = trueline::load(place.join("result.json"))?;
    let seam = recording.seam_points(&result)?;

    assert_eq!(result.status(), Status::Accepted);
    assert_eq!(saved.time_offset_s, Some(offset.value_s));
    // The points lie on the estimated line to within the noise of the simulated features: 0.04 mm, 5 σ of it.
    let line = result.line(0)?.line_in_base;
    let within = seam.list.iter().filter(|p| line.distance(&p.point_in_base) < 0.2e-3).count();
    assert!(within * 100 > seam.list.len() * 99, "{within} of {}", seam.list.len());
    Ok(std::fs::remove_dir_all(place)?)
}
