//! A folder of CSV files that another program wrote: robot poses, features, the sensor.

use super::axis_columns::{AskedAxes, AxisColumn};
use super::clock::{Clock, to_common};
use super::foreign_csv::{self, ColumnMapping, ForeignTable, Renaming, TableForm};
use super::profiles::{self, EvenColumns, ProfileFormat, Timing};
use super::reach;
use super::robot_layout::RobotLayout;
use super::table_text::{TableText, file_line};
use super::tables_of_programs::as_text;
use crate::axes::AxisRecord;
use crate::axes_folder;
use crate::dialect;
use crate::encoder_log::EncoderFile;
use crate::error::{Error, Problem};
use crate::images::{self, FrameFile};
use crate::log_problem::LogProblem;
use crate::no_return;
use crate::picture_names::{self, NameStamps, NamedFrames, PictureStamps};
use crate::profile::Profile;
use crate::recording::{Feature, PlateStripe, Recording, RobotSample, Sensor};
use crate::sensor_setup::SensorSetup;
use crate::sensor_toml::{CameraFile, SensorFile};
use crate::source_file;
use crate::stop_poses::Pairing;
use crate::{features_csv, folder, profile_file, profiles_csv, robot_csv, sensor_toml, stripes_csv};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Places of the files and meaning of their columns.
#[derive(Clone, Debug, Default)]
pub struct CsvFolder {
    /// Robot poses.
    pub robot: PathBuf,
    /// Features; not read if there are profiles.
    pub features: PathBuf,
    /// Whole profiles in place of features.
    pub profiles: Option<ProfileSource>,
    /// `sensor.toml`.
    pub sensor: PathBuf,
    /// Names of the robot's columns.
    pub robot_map: Vec<ColumnMapping>,
    /// Names of the features' columns.
    pub features_map: Vec<ColumnMapping>,
    /// How the robot's maker writes a pose.
    pub layout: Option<RobotLayout>,
    /// Properties that the robot's log does not state.
    pub robot_form: TableForm,
    /// Properties that the table of features does not state.
    pub features_form: TableForm,
    /// A folder of pictures, used if there are neither features nor profiles.
    pub images: Option<PathBuf>,
    /// Source of the pictures' times, if they have no index. A rate starts at the robot's first pose.
    pub picture_stamps: Option<PictureStamps>,
    /// External axes in columns of the robot's log.
    pub axes: Vec<AxisColumn>,
}

/// A file of profiles.
#[derive(Clone, Debug, Default)]
pub struct ProfileSource {
    /// The file.
    pub file: PathBuf,
    /// Its format; `None` for `profiles.csv`, long or wide, or a format that the content shows beyond doubt.
    pub format: Option<ProfileFormat>,
    /// Places of its columns, if the file does not state them.
    pub columns: Option<EvenColumns>,
    /// When its profiles were taken, if the file does not tell.
    pub timing: Option<Timing>,
    /// Origin of the stamps of `timing`.
    pub clock: Clock,
    /// The code for no return, m, if the user states one.
    pub no_return_m: Option<f64>,
}

/// The imported data, and remarks on them.
#[derive(Clone, Debug)]
pub struct Imported {
    /// The recording; without features if there are profiles or pictures. Its sensor is a placeholder if `camera` is one.
    pub recording: Recording,
    /// The camera of pictures without a known laser plane: a board does not need it.
    pub camera: Option<CameraFile>,
    /// Whole profiles.
    pub profiles: Vec<Profile>,
    /// Pictures with their stamps, at their present places.
    pub pictures: Vec<FrameFile>,
    /// Remarks: recognised, assumed or ignored data.
    pub notes: Vec<String>,
}

/// The sensor's readings, and the origin of their stamps.
#[derive(Default)]
struct Seen {
    features: Vec<Feature>,
    profiles: Vec<Profile>,
    pictures: Vec<FrameFile>,
    clock: Clock,
}

impl CsvFolder {
    /// Reads the files.
    ///
    /// # Errors
    /// The first file, line and column that cannot be used.
    pub fn read(&self) -> Result<Imported, Error> {
        let mut notes = Vec::new();
        let (SensorFile { sensor, setup }, camera) = self.read_sensor_or_camera(&mut notes)?;
        let (robot, robot_clock, axes) = self.read_robot(&mut notes)?;
        // The log of an encoder is by the robot's clock.
        let encoder = self.robot.parent().and_then(EncoderFile::of);
        let pairing = Pairing { encoder: encoder.as_ref(), stops: None };
        let mut seen = match &self.profiles {
            Some(source) => {
                let (mut profiles, clock) = self.read_profiles(source, pairing, &mut notes)?;
                if let Some(range_m) = source.no_return_m {
                    let taken = no_return::take_out(&mut profiles, range_m);
                    notes.push(format!(
                        "{}: {taken} points have no return, by your statement",
                        source.file.display()
                    ));
                }
                let origins = no_return::take_out_origins(&mut profiles);
                notes.extend(origins.map(|said| format!("{}: {said}", source.file.display())));
                no_return::check(&profiles).map_err(|problem| Error::in_file(&source.file, problem))?;
                Seen { profiles, clock, ..Seen::default() }
            }
            None if self.has_pictures() => {
                self.read_pictures((robot[0].stamp_ns, robot_clock), &mut notes)?
            }
            None => self.read_features(&sensor, pairing, &mut notes)?,
        };
        let mut stripes = self.read_stripes(&sensor, pairing, &mut notes)?;
        notes.extend(encoder.as_ref().and_then(|file| file.noted(&mut BTreeMap::new())));
        let robot_span = (robot[0].stamp_ns, robot[robot.len() - 1].stamp_ns);
        if let Some(span) = seen.span() {
            let (later_ns, said) = to_common([robot_clock, seen.clock], [robot_span, span]);
            seen.shift(later_ns);
            stripes.iter_mut().for_each(|stripe| stripe.stamp_ns += later_ns);
            notes.extend(said);
        }
        let Seen { features, profiles, pictures, .. } = seen;
        let recording = Recording { stripes, axes, ..Recording::new(sensor, setup, robot, features) };
        Ok(Imported { recording, camera, profiles, pictures, notes })
    }

    /// External axes in files beside the robot's table, by the robot's clock.
    fn axes_beside(&self, notes: &mut Vec<String>) -> Result<Vec<AxisRecord>, Error> {
        let Some(folder) = self.robot.parent() else { return Ok(Vec::new()) };
        let axes = axes_folder::of_folder(folder, None, &mut BTreeMap::new())?;
        let names: Vec<&str> = axes.iter().map(|axis| axis.name.as_str()).collect();
        if !names.is_empty() {
            notes.push(format!("external axes by the robot's clock: {}", names.join(", ")));
        }
        Ok(axes)
    }

    /// The descriptions, beside the robot's table, of the axes that are its columns.
    ///
    /// # Errors
    /// A description that cannot be used, or values of axes beside the table as well.
    pub(super) fn described_axes(&self) -> Result<Vec<AxisRecord>, Error> {
        let folder = self.robot.parent().filter(|_| !self.axes.is_empty());
        let Some(folder) = folder else { return Ok(Vec::new()) };
        let values = folder.join(axes_folder::VALUES_FILE);
        if values.exists() {
            return Err(Error::in_file(&values, LogProblem::AxesTwice.into()));
        }
        axes_folder::described(folder, &mut BTreeMap::new())
    }

    /// The axes that are columns of the robot's table.
    pub(super) fn asked_axes<'a>(&'a self, described: &'a [AxisRecord]) -> AskedAxes<'a> {
        // A log in metres has its angles in radians.
        let units = |layout: &RobotLayout| {
            if layout.is_in_metres() { ["_rad", "_m"] } else { ["_deg", "_mm"] }
        };
        AskedAxes { columns: &self.axes, described, usual_units: self.layout.as_ref().map(units) }
    }

    /// The names of the robot's columns, with those of the axes first.
    pub(super) fn robot_names(&self) -> Vec<ColumnMapping> {
        self.axes.iter().map(AxisColumn::mapping).chain(self.robot_map.iter().cloned()).collect()
    }

    /// Whether there are pictures in place of features.
    pub(super) fn has_pictures(&self) -> bool {
        self.images.is_some() && !self.features.exists()
    }

    /// The sensor, or for pictures a camera alone; its place is then taken by a sensor without a camera.
    pub(super) fn read_sensor_or_camera(
        &self,
        notes: &mut Vec<String>,
    ) -> Result<(SensorFile, Option<CameraFile>), Error> {
        if self.profiles.is_none() && self.has_pictures() {
            let text = folder::utf8(&self.sensor, bytes_of(&self.sensor)?)?;
            let camera = sensor_toml::parse_camera(&self.sensor, &text).ok();
            if let Some(camera) = camera.filter(|camera| camera.laser_plane_in_camera.is_none()) {
                notes.push(format!(
                    "{}: a camera without its laser plane: sufficient for pictures of a board (calibrate \
                        --target board), not for a seam",
                    self.sensor.display()
                ));
                let sensor = Sensor::Points { laser_plane_in_camera: None };
                return Ok((SensorFile { sensor, setup: camera.setup.clone() }, Some(camera)));
            }
        }
        Ok((self.read_sensor(notes)?, None))
    }

    fn read_sensor(&self, notes: &mut Vec<String>) -> Result<SensorFile, Error> {
        if self.profiles.is_some() && !self.sensor.exists() {
            notes.push(format!("{} is missing: profiles need a profiler", self.sensor.display()));
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

    fn read_profiles(
        &self,
        source: &ProfileSource,
        pairing: Pairing<'_>,
        notes: &mut Vec<String>,
    ) -> Result<(Vec<Profile>, Clock), Error> {
        let bytes = bytes_of(&source.file)?;
        if source.format.is_none() && bytes.starts_with(b"PAR1") {
            return Ok((profile_file::from_parquet(&source.file, bytes)?, Clock::Seconds));
        }
        let wanted = |name: &str| usize::from(profiles_csv::is_column(name));
        let bytes = as_text(&source.file, bytes, &wanted, notes)?.bytes;
        let Some(format) = source.format.or_else(|| ProfileFormat::recognised(&bytes)) else {
            if begins_with_numbers(&bytes) {
                return Err(Error::in_file(&source.file, Problem::UnknownProfileFormat));
            }
            let renaming =
                Renaming { map: &self.features_map, layout: None, is_ours: &profiles_csv::is_column };
            let table = self.table(&source.file, &self.features_form, &renaming, notes)?;
            let profiles = profiles_csv::read_at(&source.file, table.csv.as_slice(), pairing)
                .map_err(|error| in_their_words(error, &table))?;
            return Ok((profiles, table.clock));
        };
        let raw = profiles::read(&source.file, bytes, format, source.columns)?;
        let left_out = profiles::left_out_words(&raw.profiles);
        let clock = if source.timing.is_some() { source.clock } else { raw.clock };
        let said = raw.notes;
        let stamped = profiles::stamped(&source.file, raw.profiles, source.timing.as_ref())?;
        notes.push(format!("{}: read as {}", source.file.display(), format.words()));
        notes.extend(
            said.into_iter().chain(left_out).map(|words| format!("{}: {words}", source.file.display())),
        );
        if let Some(Timing::Rate { .. }) = source.timing {
            notes.push(
                "the profiles' stamps come from the stated start and rate: the time offset holds for this \
                    recording only"
                    .to_owned(),
            );
        }
        Ok((stamped, clock))
    }

    fn read_robot(
        &self,
        notes: &mut Vec<String>,
    ) -> Result<(Vec<RobotSample>, Clock, Vec<AxisRecord>), Error> {
        let (described, map) = (self.described_axes()?, self.robot_names());
        let renaming = Renaming { map: &map, layout: self.layout.as_ref(), is_ours: &robot_csv::is_column };
        let mut table = self.table(&self.robot, &self.robot_form, &renaming, notes)?;
        let axes = self.asked_axes(&described).taken_out(&self.robot, &mut table, None, notes);
        let axes = axes.map_err(|error| in_their_words(error, &table))?;
        let robot = robot_csv::read(&self.robot, table.csv.as_slice())
            .map_err(|error| in_their_words(error, &table))?;
        reach::check(&robot).map_err(|problem| Error::in_file(&self.robot, problem.into()))?;
        let axes = if self.axes.is_empty() { self.axes_beside(notes)? } else { axes };
        Ok((robot, table.clock, axes))
    }

    /// `stripes.csv` beside the features, if present; for whole profiles the stripes are found in them.
    fn read_stripes(
        &self,
        sensor: &Sensor,
        pairing: Pairing<'_>,
        notes: &mut Vec<String>,
    ) -> Result<Vec<PlateStripe>, Error> {
        let file = self.features.with_file_name("stripes.csv");
        if self.profiles.is_some() || self.has_pictures() || !file.exists() {
            return Ok(Vec::new());
        }
        let (csv, dialect) = dialect::plain_csv(&file, bytes_of(&file)?, self.features_form.separator)?;
        if !dialect.is_plain() {
            notes.push(format!("{}: {dialect}", file.display()));
        }
        stripes_csv::read_of_lines(&file, csv.as_slice(), sensor, 1, pairing)
    }

    fn read_features(
        &self,
        sensor: &Sensor,
        pairing: Pairing<'_>,
        notes: &mut Vec<String>,
    ) -> Result<Seen, Error> {
        let is_ours = |name: &str| features_csv::is_column(name, sensor);
        let renaming = Renaming { map: &self.features_map, layout: None, is_ours: &is_ours };
        let table = self.table(&self.features, &self.features_form, &renaming, notes)?;
        let features = features_csv::read_at(&self.features, table.csv.as_slice(), sensor, pairing)
            .map_err(|error| in_their_words(error, &table))?;
        Ok(Seen { features, clock: table.clock, ..Seen::default() })
    }

    /// The pictures that an index names, in the words of any program.
    fn read_pictures(
        &self,
        (first_robot_ns, robot_clock): (i64, Clock),
        notes: &mut Vec<String>,
    ) -> Result<Seen, Error> {
        let folder = self.images.clone().unwrap_or_default();
        let file = folder.join("index.csv");
        if let (Some(stamps), false) = (self.picture_stamps, file.exists()) {
            let NamedFrames { frames, names } =
                picture_names::frames_in(&folder, stamps.beginning_at(first_robot_ns))?;
            notes.push(format!("{}: {}", folder.display(), names.words(stamps)));
            let clock = match (stamps, names) {
                (PictureStamps::Rate { .. }, _) => robot_clock,
                (_, NameStamps::Dates) => Clock::Date,
                _ => Clock::Seconds,
            };
            return Ok(Seen { pictures: frames, clock, ..Seen::default() });
        }
        let renaming = Renaming {
            map: &self.features_map,
            layout: Some(&RobotLayout::of_pictures()),
            is_ours: &images::is_column,
        };
        let table = self.table(&file, &self.features_form, &renaming, notes)?;
        let pictures = images::read_rows(&file, table.csv.as_slice(), &folder)
            .map_err(|error| in_their_words(error, &table))?;
        Ok(Seen { pictures, clock: table.clock, ..Seen::default() })
    }

    pub(super) fn table(
        &self,
        file: &Path,
        form: &TableForm,
        renaming: &Renaming<'_>,
        notes: &mut Vec<String>,
    ) -> Result<ForeignTable, Error> {
        let bytes = bytes_of(file)?;
        profiles::expect_none(file, &bytes)?;
        let TableText { bytes, row_lines } = as_text(file, bytes, &|theirs| renaming.weight(theirs), notes)?;
        let in_file = |mut error: Error| {
            error.line = error.line.map(|line| file_line(&row_lines, line));
            error
        };
        let table = foreign_csv::read(file, bytes, form, renaming).map_err(in_file)?;
        let table = ForeignTable { row_lines, ..table };
        let mut said = Vec::new();
        if !table.dialect.is_plain() {
            said.push(table.dialect.to_string());
        }
        let read_as: Vec<&str> =
            [&table.layout_words, &table.unit_words].into_iter().flatten().map(String::as_str).collect();
        said.extend((!read_as.is_empty()).then(|| format!("read as {}", read_as.join("; "))));
        said.extend(table.time_words.clone());
        if !table.left_out.is_empty() {
            said.push(format!("not used: {}", table.left_out.join(", ")));
        }
        if let Some(decimals @ ..=2) = table.angle_decimals {
            said.push(format!(
                "angles have at most {decimals} decimals: 0.01° means 0.05 mm at a distance of 300 mm; log \
                    more if possible"
            ));
        }
        notes.extend(said.iter().map(|words| format!("{}: {words}", file.display())));
        Ok(table)
    }
}

impl Imported {
    /// The text of the dataset's `sensor.toml`.
    #[must_use]
    pub fn sensor_text(&self) -> String {
        let (sensor, setup) = (self.recording.sensor.clone(), self.recording.setup.clone());
        sensor_text(SensorFile { sensor, setup }, self.camera.as_ref())
    }
}

/// The text of a sensor's file, or of the camera in its place.
pub(super) fn sensor_text(sensor: SensorFile, camera: Option<&CameraFile>) -> String {
    camera.map_or_else(|| sensor_toml::format_file(&sensor), sensor_toml::format_camera)
}

impl Seen {
    /// First and last stamp, ns.
    fn span(&self) -> Option<(i64, i64)> {
        let features = self.features.iter().map(|feature| feature.stamp_ns);
        let profiles = self.profiles.iter().map(|profile| profile.stamp_ns);
        let pictures = self.pictures.iter().map(|picture| picture.stamp_ns);
        let stamps = || features.clone().chain(profiles.clone()).chain(pictures.clone());
        Some((stamps().min()?, stamps().max()?))
    }

    fn shift(&mut self, later_ns: i64) {
        self.features.iter_mut().for_each(|feature| feature.stamp_ns += later_ns);
        self.profiles.iter_mut().for_each(|profile| profile.stamp_ns += later_ns);
        self.pictures.iter_mut().for_each(|picture| picture.stamp_ns += later_ns);
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

/// The error with the header that the user's file has, at its line in it.
pub(super) fn in_their_words(mut error: Error, table: &ForeignTable) -> Error {
    if let Problem::MissingColumn { found, .. } | Problem::NoRotation { found } = &mut error.problem {
        *found = table.header.join(", ");
    }
    let line = error.line.map(|line| line.saturating_sub(table.added_lines).max(1));
    error.line = line.map(|line| file_line(&table.row_lines, line));
    error
}

/// The bytes of a file.
///
/// # Errors
/// A file that is missing or cannot be read.
pub fn bytes_of(file: &Path) -> Result<Vec<u8>, Error> {
    source_file::named(source_file::bytes(file))
}
