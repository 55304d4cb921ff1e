//! A folder of CSV files that another program wrote: robot poses, features, the sensor.

use super::foreign_csv::{self, ColumnMapping, ForeignTable, Renaming};
use super::profiles::{self, EvenColumns, ProfileFormat, Timing};
use super::robot_layout::RobotLayout;
use super::tables_of_programs::as_text;
use crate::dialect::{self, Separator};
use crate::error::{Error, Problem};
use crate::profile::Profile;
use crate::recording::{Feature, PlateStripe, Recording, RobotSample, Sensor};
use crate::sensor_setup::SensorSetup;
use crate::sensor_toml::SensorFile;
use crate::source_file;
use crate::{features_csv, folder, profile_file, profiles_csv, robot_csv, sensor_toml, stripes_csv};
use std::path::{Path, PathBuf};

/// Where the files are and what their columns mean.
#[derive(Clone, Debug)]
pub struct CsvFolder {
    /// Robot poses.
    pub robot: PathBuf,
    /// Features; not read where there are profiles.
    pub features: PathBuf,
    /// Whole profiles in the place of features.
    pub profiles: Option<ProfileSource>,
    /// `sensor.toml`.
    pub sensor: PathBuf,
    /// Names of the robot's columns.
    pub robot_map: Vec<ColumnMapping>,
    /// Names of the features' columns.
    pub features_map: Vec<ColumnMapping>,
    /// How the robot's maker writes a pose.
    pub layout: Option<RobotLayout>,
    /// What separates columns; recognised where it is not named.
    pub separator: Option<Separator>,
}

/// A file of profiles.
#[derive(Clone, Debug)]
pub struct ProfileSource {
    /// The file.
    pub file: PathBuf,
    /// Its format; `None` for `profiles.csv`, long or wide, or what the content shows beyond doubt.
    pub format: Option<ProfileFormat>,
    /// Where its columns lie, if the file does not tell.
    pub columns: Option<EvenColumns>,
    /// When its profiles were taken, if the file does not tell.
    pub timing: Option<Timing>,
}

/// What came in, and what was recognised.
#[derive(Clone, Debug)]
pub struct Imported {
    /// The recording; without features where there are profiles.
    pub recording: Recording,
    /// Whole profiles.
    pub profiles: Vec<Profile>,
    /// What was recognised, assumed or left out: to be said.
    pub notes: Vec<String>,
}

impl CsvFolder {
    /// Reads the files.
    ///
    /// # Errors
    /// The first file, line and column that cannot be used.
    pub fn read(&self) -> Result<Imported, Error> {
        let mut notes = Vec::new();
        let SensorFile { sensor, setup } = self.read_sensor(&mut notes)?;
        let robot = self.read_robot(&mut notes)?;
        let (features, profiles) = match &self.profiles {
            Some(source) => (Vec::new(), self.read_profiles(source, &mut notes)?),
            None => (self.read_features(&sensor, &mut notes)?, Vec::new()),
        };
        let stripes = self.read_stripes(&sensor, &mut notes)?;
        let recording = Recording { stripes, ..Recording::new(sensor, setup, robot, features) };
        Ok(Imported { recording, profiles, notes })
    }

    fn read_sensor(&self, notes: &mut Vec<String>) -> Result<SensorFile, Error> {
        if self.profiles.is_some() && !self.sensor.exists() {
            notes.push(format!("{} is not there: profiles are those of a profiler", self.sensor.display()));
            return Ok(SensorFile { sensor: Sensor::Profiler, setup: SensorSetup::default() });
        }
        let read =
            sensor_toml::parse_file(&self.sensor, &folder::utf8(&self.sensor, bytes_of(&self.sensor)?)?)?;
        if self.profiles.is_some() && read.sensor != Sensor::Profiler {
            let expected = "\"profiler\" for profiles";
            let problem = Problem::Value { key: "kind", expected, found: read.sensor.kind().to_owned() };
            return Err(Error::in_file(&self.sensor, problem));
        }
        Ok(read)
    }

    fn read_profiles(&self, source: &ProfileSource, notes: &mut Vec<String>) -> Result<Vec<Profile>, Error> {
        let bytes = bytes_of(&source.file)?;
        if source.format.is_none() && bytes.starts_with(b"PAR1") {
            return profile_file::from_parquet(&source.file, bytes);
        }
        let bytes = as_text(&source.file, bytes, &|name| usize::from(profiles_csv::is_column(name)), notes)?;
        let Some(format) = source.format.or_else(|| ProfileFormat::recognised(&bytes)) else {
            if begins_with_numbers(&bytes) {
                return Err(Error::in_file(&source.file, Problem::UnknownProfileFormat));
            }
            let renaming =
                Renaming { map: &self.features_map, layout: None, is_ours: &profiles_csv::is_column };
            let table = self.table(&source.file, &renaming, notes)?;
            return profiles_csv::read(&source.file, table.csv.as_slice())
                .map_err(|error| in_their_words(error, &table));
        };
        let raw = profiles::read(&source.file, bytes, format, source.columns)?;
        let left_out = profiles::left_out_words(&raw);
        let stamped = profiles::stamped(&source.file, raw, source.timing.as_ref())?;
        notes.push(format!("{}: read as {}", source.file.display(), format.words()));
        notes.extend(left_out.map(|words| format!("{}: {words}", source.file.display())));
        if let Some(Timing::Rate { .. }) = source.timing {
            notes.push(
                "the profiles' stamps are the start and rate that you stated: the time offset holds for this recording only"
                    .to_owned(),
            );
        }
        Ok(stamped)
    }

    fn read_robot(&self, notes: &mut Vec<String>) -> Result<Vec<RobotSample>, Error> {
        let renaming =
            Renaming { map: &self.robot_map, layout: self.layout.as_ref(), is_ours: &robot_csv::is_column };
        let table = self.table(&self.robot, &renaming, notes)?;
        robot_csv::read(&self.robot, table.csv.as_slice()).map_err(|error| in_their_words(error, &table))
    }

    /// `stripes.csv` beside the features, where it is; of whole profiles the stripes are found in them.
    fn read_stripes(&self, sensor: &Sensor, notes: &mut Vec<String>) -> Result<Vec<PlateStripe>, Error> {
        let file = self.features.with_file_name("stripes.csv");
        if self.profiles.is_some() || !file.exists() {
            return Ok(Vec::new());
        }
        let (csv, dialect) = dialect::plain_csv(&file, bytes_of(&file)?, self.separator)?;
        if !dialect.is_plain() {
            notes.push(format!("{}: {dialect}", file.display()));
        }
        stripes_csv::read(&file, csv.as_slice(), sensor)
    }

    fn read_features(&self, sensor: &Sensor, notes: &mut Vec<String>) -> Result<Vec<Feature>, Error> {
        let is_ours = |name: &str| features_csv::is_column(name, sensor);
        let renaming = Renaming { map: &self.features_map, layout: None, is_ours: &is_ours };
        let table = self.table(&self.features, &renaming, notes)?;
        features_csv::read(&self.features, table.csv.as_slice(), sensor)
            .map_err(|error| in_their_words(error, &table))
    }

    fn table(
        &self,
        file: &Path,
        renaming: &Renaming<'_>,
        notes: &mut Vec<String>,
    ) -> Result<ForeignTable, Error> {
        let bytes = as_text(file, bytes_of(file)?, &|theirs| renaming.weight(theirs), notes)?;
        let table = foreign_csv::read(file, bytes, self.separator, renaming)?;
        let mut said = Vec::new();
        if !table.dialect.is_plain() {
            said.push(table.dialect.to_string());
        }
        if let Some(layout) = renaming.layout {
            said.push(format!("read as {}", layout.words));
        }
        if !table.left_out.is_empty() {
            said.push(format!("not used: {}", table.left_out.join(", ")));
        }
        if let Some(decimals @ ..=2) = table.angle_decimals {
            said.push(format!(
                "angles have at most {decimals} decimals: 0.01° is 0.05 mm at a distance of 300 mm; log more if the robot can"
            ));
        }
        notes.extend(said.iter().map(|words| format!("{}: {words}", file.display())));
        Ok(table)
    }
}

/// Whether the first line has no names.
fn begins_with_numbers(bytes: &[u8]) -> bool {
    let line = bytes.split(|byte| *byte == b'\n').next().unwrap_or_default();
    let line = String::from_utf8_lossy(line);
    let mut fields =
        line.split([',', ';', '\t', ' ']).map(str::trim).filter(|field| !field.is_empty()).peekable();
    fields.peek().is_some() && fields.all(|field| field.parse::<f64>().is_ok())
}

/// The error with the header that the user's file has.
fn in_their_words(mut error: Error, table: &ForeignTable) -> Error {
    if let Problem::MissingColumn { found, .. } | Problem::NoRotation { found } = &mut error.problem {
        *found = table.header.join(", ");
    }
    error
}

/// The bytes of a file.
///
/// # Errors
/// A file that is missing or cannot be read.
pub fn bytes_of(file: &Path) -> Result<Vec<u8>, Error> {
    source_file::named(source_file::bytes(file))
}
