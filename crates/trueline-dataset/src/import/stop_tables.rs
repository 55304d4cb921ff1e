//! Stops with their readings as another program wrote them: poses without times, in the names of a robot's maker.

use super::csv_folder::{CsvFolder, in_their_words};
use super::foreign_csv::{ForeignTable, Renaming};
use crate::error::{Error, Problem};
use crate::picture_poses_csv::COLUMNS_OF_NAMES;
use crate::recording::Sensor;
use crate::stop_poses::{self, StopPoses};
use crate::{axes_folder, axes_toml, features_csv, robot_csv, source_file};
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// The tables of a dataset at stops.
#[derive(Clone, Debug)]
pub struct StopTables {
    /// The text of `sensor.toml`.
    pub sensor: String,
    /// The text of `poses.csv`.
    pub poses: Vec<u8>,
    /// How many stops it has.
    pub stops: usize,
    /// The text of `features.csv` and how many it has; without it there are pictures.
    pub features: Option<(Vec<u8>, usize)>,
    /// The pictures, at their present places.
    pub pictures: Vec<PathBuf>,
    /// The texts of `axes.csv` and `cell.toml`, if external axes were requested.
    pub axes: Option<(Vec<u8>, String)>,
    /// Remarks: recognised, assumed or ignored data.
    pub notes: Vec<String>,
}

impl CsvFolder {
    /// The tables of a robot that stood at stops; `None` if its log has no column `stop` or `picture` in place of a time.
    ///
    /// # Errors
    /// The first file, line and column that cannot be used.
    pub fn read_stops(&self) -> Result<Option<StopTables>, Error> {
        if self.robot_form.rate.is_some() || !begins_with_stops(&self.robot)? {
            return Ok(None);
        }
        let mut notes = Vec::new();
        let is_ours = |name: &str| robot_csv::is_column(name) || COLUMNS_OF_NAMES.contains(&name);
        let (described, map) = (self.described_axes()?, self.robot_names());
        let renaming = Renaming { map: &map, layout: self.layout.as_ref(), is_ours: &is_ours };
        let mut poses = self.table(&self.robot, &self.robot_form, &renaming, &mut notes)?;
        let names = first_line(&poses.csv);
        let has = |name: &str| names.split(',').any(|column| column == name);
        if !COLUMNS_OF_NAMES.into_iter().any(has) || names.split(',').any(|name| name.starts_with("time_")) {
            return Ok(None);
        }
        let axes = self.asked_axes(&described).text(&self.robot, &mut poses, &mut notes)?;
        let stops = StopPoses::of_table(&self.robot, &poses.csv).map_err(|e| in_their_words(e, &poses))?;
        if self.profiles.is_some() {
            let hint = "give the seam points as --features with a column `stop`; or write a dataset by hand: poses.csv, and profiles.csv with stop,x_mm,z_mm";
            return Err(Error::unreadable(&self.robot, "a table of stops, beside whole profiles", hint));
        }
        let has_pictures = self.has_pictures();
        let (sensor, camera) = self.read_sensor_or_camera(&mut notes)?;
        let (mut features, mut pictures, mut unread) = (None, Vec::new(), BTreeSet::new());
        if has_pictures {
            pictures.extend(stops.pictures()?.unwrap_or_default().into_iter().map(|(_, path)| path));
        } else {
            let (text, stamps_ns) = self.features_at(&stops, &sensor.sensor, &mut notes)?;
            unread = stops.unread_lines(&stamps_ns.iter().copied().collect());
            features = Some((text, stamps_ns.len()));
        }
        if !unread.is_empty() {
            notes.push(format!(
                "{}: {} stops without a reading are ignored",
                self.robot.display(),
                unread.len()
            ));
        }
        let sensor = super::csv_folder::sensor_text(sensor, camera.as_ref());
        let axes = axes.map(|table| (without_lines(&table.csv, &unread), axes_toml::text(&table.axes)));
        Ok(Some(StopTables {
            sensor,
            poses: without_lines(&poses.csv, &unread),
            stops: stops.robot().len() - unread.len(),
            features,
            pictures,
            axes,
            notes,
        }))
    }

    /// Features that name their stop, and the stamps of these.
    fn features_at(
        &self,
        stops: &StopPoses,
        sensor: &Sensor,
        notes: &mut Vec<String>,
    ) -> Result<(Vec<u8>, Vec<i64>), Error> {
        let is_ours = |name: &str| features_csv::is_column(name, sensor) || COLUMNS_OF_NAMES.contains(&name);
        let renaming = Renaming { map: &self.features_map, layout: None, is_ours: &is_ours };
        let table: ForeignTable = self.table(&self.features, &self.features_form, &renaming, notes)?;
        let features = features_csv::read_at(&self.features, &table.csv, sensor, Some(stops).into())
            .map_err(|error| in_their_words(error, &table))?;
        let stamps_ns = features.iter().map(|feature| feature.stamp_ns).collect();
        Ok((without_lines(&table.csv, &BTreeSet::new()), stamps_ns))
    }
}

impl StopTables {
    /// Writes the dataset into a folder.
    ///
    /// # Errors
    /// Error of the operating system.
    pub fn write(&self, folder: &Path) -> Result<(), Error> {
        let features = self.features.iter().map(|(text, _)| ("features.csv", text.as_slice()));
        let tables = [("sensor.toml", self.sensor.as_bytes()), (stop_poses::FILE, &self.poses)];
        let axes = self.axes.iter().flat_map(|(values, cell)| {
            [(axes_folder::VALUES_FILE, values.as_slice()), (axes_folder::CELL_FILE, cell.as_bytes())]
        });
        for (name, text) in tables.into_iter().chain(features).chain(axes) {
            let file = folder.join(name);
            fs::write(&file, text).map_err(|error| Error::in_file(&file, Problem::Io(error)))?;
        }
        Ok(())
    }
}

/// Whether a table has a column for stops; the log of a moving robot is not read twice for it.
fn begins_with_stops(file: &Path) -> Result<bool, Error> {
    let Some(bytes) = source_file::bytes_if_there(file)? else { return Ok(false) };
    let start = String::from_utf8_lossy(&bytes[..bytes.len().min(1 << 16)]).to_lowercase();
    Ok(COLUMNS_OF_NAMES.iter().any(|name| start.contains(name)))
}

fn first_line(csv: &[u8]) -> String {
    let text = String::from_utf8_lossy(csv);
    text.lines().find(|line| !line.is_empty()).unwrap_or_default().to_owned()
}

/// A table without its empty lines, and without others by their numbers.
fn without_lines(csv: &[u8], left_out: &BTreeSet<u64>) -> Vec<u8> {
    let text = String::from_utf8_lossy(csv);
    let kept =
        (1..).zip(text.lines()).filter(|(number, line)| !line.is_empty() && !left_out.contains(number));
    kept.flat_map(|(_, line)| [line, "\n"]).collect::<String>().into_bytes()
}
