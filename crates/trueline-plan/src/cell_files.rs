//! A cell with the files beside it: its sensor's, and its arm's URDF.

use crate::cell::Cell;
use crate::cell_toml;
use std::path::Path;
use trueline_dataset::sensor_toml::{SensorFile, parse_file};
use trueline_dataset::{Error, Problem, SensorSetup, source_file};

/// The files of a cell, and the cell.
#[derive(Clone, Debug)]
pub struct CellFiles {
    /// The text of its own file.
    pub cell_text: String,
    /// The text of its sensor's.
    pub sensor_text: String,
    /// Name and text of its arm's URDF, if it names one.
    pub urdf: Option<[String; 2]>,
    /// Mounting of the sensor, and the rest of its file.
    pub setup: SensorSetup,
    /// The cell.
    pub cell: Cell,
}

impl CellFiles {
    /// Makes a cell of the texts of its two files; a URDF is read from beside `file`.
    ///
    /// # Errors
    /// Texts that do not describe a cell, and a URDF that is missing or elsewhere: a plan's folder has a copy of its
    /// own.
    pub fn of(file: &Path, cell_text: String, sensor_text: String) -> Result<Self, Error> {
        let beside = file.with_file_name(cell_toml::sensor_name(file, &cell_text)?);
        let SensorFile { sensor, setup } = parse_file(&beside, &sensor_text)?;
        let urdf = urdf(file, &cell_text)?;
        let described = urdf.as_ref().map(|[_, text]| text.as_str());
        let cell = cell_toml::parse_with_urdf(file, &cell_text, sensor, described)?;
        Ok(Self { cell_text, sensor_text, urdf, setup, cell })
    }
}

fn urdf(file: &Path, cell_text: &str) -> Result<Option<[String; 2]>, Error> {
    let Some(name) = cell_toml::urdf_name(file, cell_text)? else { return Ok(None) };
    if Path::new(&name).components().count() != 1 {
        let problem =
            Problem::Value { key: "arm.urdf", expected: "the name of a file beside this one", found: name };
        return Err(Error::in_file(file, problem));
    }
    let beside = file.with_file_name(&name);
    Ok(Some([name, source_file::text(&beside)?]))
}
