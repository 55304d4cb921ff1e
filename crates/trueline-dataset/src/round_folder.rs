//! Writes the dataset folder of a simulated scan of a sphere or a cylinder: whole profiles, and the target's pose as the truth.

use crate::error::{Error, Problem};
use crate::pose_folder::{PoseTruth, write_stops};
use crate::profile::Profile;
use crate::recording::{RobotSample, Sensor};
use crate::sensor_setup::SensorSetup;
use crate::sensor_toml::{self, SensorFile};
use crate::unit::MM_PER_M;
use crate::{known_toml, profiles_csv, robot_csv, stop_poses};
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;

/// Writes such a folder into one that exists. With stops there is one robot pose for each profile, and no stamps are written.
///
/// # Errors
/// Files that cannot be written.
pub fn write(
    folder: &Path,
    setup: &SensorSetup,
    (robot, at_stops): (&[RobotSample], bool),
    profiles: &[Profile],
    truth: &PoseTruth,
) -> Result<(), Error> {
    let put = |name: &str, write: &dyn Fn(&mut dyn Write) -> std::io::Result<()>| {
        let file = folder.join(name);
        let written = File::create(&file).and_then(|out| {
            let mut out = BufWriter::new(out);
            write(&mut out)?;
            out.flush()
        });
        written.map_err(|error| Error::in_file(&file, Problem::Io(error)))
    };
    let sensor = sensor_toml::format_file(&SensorFile { sensor: Sensor::Profiler, setup: setup.clone() });
    put("sensor.toml", &|out| out.write_all(sensor.as_bytes()))?;
    let known = known_toml::format_poses(&truth.parameters, &truth.base_from_target);
    put("truth.toml", &|out| out.write_all(known.as_bytes()))?;
    if at_stops {
        put(stop_poses::FILE, &|out| write_stops(out, robot))?;
        return put("profiles.csv", &|out| write_at_stops(out, profiles));
    }
    put("robot.csv", &|out| robot_csv::write(out, robot))?;
    put("profiles.csv", &|out| profiles_csv::write(out, profiles))
}

/// The points of profiles at stops, numbered from 1.
fn write_at_stops(out: &mut dyn Write, profiles: &[Profile]) -> std::io::Result<()> {
    writeln!(out, "stop,x_mm,z_mm")?;
    for (k, profile) in profiles.iter().enumerate() {
        for point in &profile.points {
            writeln!(out, "{},{},{}", k + 1, point.x_m * MM_PER_M, point.z_m * MM_PER_M)?;
        }
    }
    Ok(())
}
