//! Plan a scan before the robot moves, and calibrate from a simulation of the planned path.

use std::error::Error;
use std::path::Path;
use trueline_plan::{PlanRequest, Shape, cell_toml, plan};

fn main() -> Result<(), Box<dyn Error>> {
    let sensor = trueline_dataset::sensor_toml::parse(Path::new("sensor.toml"), cell_toml::EXAMPLE_SENSOR)?;
    let cell = cell_toml::parse(Path::new("cell.toml"), cell_toml::EXAMPLE, sensor)?;
    let request = PlanRequest { shapes: vec![Shape::TwoPasses], evaluations: 300, ..PlanRequest::default() };
    let planned = plan(&cell, &request, &|| ())?;

    // Everything is observable on the planned path, and the path lasts as long as was asked for.
    assert!(planned.prediction.shows_all());
    assert!((planned.motion.design().duration_s - request.duration_s).abs() < 1e-9);
    assert!(planned.path().len() > 1000);
    Ok(())
}
