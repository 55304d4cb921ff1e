//! Faults of a file.

use crate::axis_problem::AxisProblem;
use crate::log_problem::LogProblem;
use std::path::PathBuf;

/// Fault of a file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Problem {
    /// The file is not there.
    #[error("the file is missing")]
    Missing,
    /// The operating system refused.
    #[error("cannot be read or written: {0}")]
    Io(std::io::Error),
    /// Output would land on something that exists.
    #[error("already exists; it is not overwritten")]
    AlreadyExists,
    /// An output is one of the inputs.
    #[error("is read, and would be overwritten")]
    OutputIsInput,
    /// Two outputs would land on each other.
    #[error("is named for two outputs, and one would replace the other")]
    OutputTwice,
    /// A file in place of a log, one JSON object a line.
    #[error("is not a log of JSON lines; nothing is added to it")]
    NotJsonLines,
    /// A folder that cannot be moved away as a whole, being the one in which all happens or its parent.
    #[error("has no name for a folder")]
    FolderWithoutName,
    /// A calibration of a sensor that something else carries.
    #[error("belongs to a sensor {calibrated}, but the recording to one {recorded}")]
    OtherMounting {
        /// Carrier of the calibrated sensor, in words.
        calibrated: &'static str,
        /// Carrier of the recording's sensor.
        recorded: &'static str,
    },
    /// A calibration of a sensor whose frame is another.
    #[error("is the calibration of a `{calibrated}` sensor, but the recording is of a `{recorded}` sensor")]
    OtherSensor {
        /// The kind that was calibrated, as in `sensor.toml`.
        calibrated: String,
        /// That of the recording.
        recorded: &'static str,
    },
    /// A folder that is to be replaced has something else in it.
    #[error("`{other}` in this folder would be lost")]
    NotOurs {
        /// The item of a kind that is not replaced.
        other: String,
    },
    /// A folder in place of a file.
    #[error("is a folder; a file is needed")]
    IsFolder,
    /// A folder where a file is to be written.
    #[error("is a folder; the name of a file is needed")]
    OutputIsFolder,
    /// A file that is to be written, or read, in a folder that is not there.
    #[error("there is no folder `{}`", folder.display())]
    NoFolder {
        /// The folder.
        folder: PathBuf,
    },
    /// Pictures are needed, but there are none.
    #[error("there are no pictures")]
    NoPictures {
        /// Whether the seam is known without them.
        has_features: bool,
    },
    /// A file that was named is not there.
    #[error("this file does not exist")]
    NoSuchFile,
    /// Bytes that are not text.
    #[error("is not UTF-8 text")]
    NotUtf8,
    /// A table that begins with its numbers.
    #[error("there is no header: the first line has numbers only")]
    NoHeader,
    /// A separator that was named is not there.
    #[error("the columns are not separated by {named}, but by {found}")]
    OtherSeparator {
        /// The stated value.
        named: String,
        /// The value found.
        found: String,
    },
    /// Of the log of another program.
    #[error(transparent)]
    Log(Box<LogProblem>),
    /// A table in place of another one.
    #[error("has the columns of {looks_like}")]
    OtherTable {
        /// The kind it resembles.
        looks_like: &'static str,
    },
    /// No header, or a header without rows.
    #[error("there are no data rows")]
    NoRows,
    /// A header without a needed column.
    #[error("column `{name}` is missing; the header has: {found}")]
    MissingColumn {
        /// The column with its usual unit.
        name: String,
        /// The header as found.
        found: String,
    },
    /// A column that means nothing here.
    #[error("unknown column; known columns: {known}")]
    UnknownColumn {
        /// The known column that is most likely meant.
        meant: Option<String>,
        /// The understood forms.
        known: String,
    },
    /// An axis that was calibrated and is not in a scan.
    #[error(
        "needs axis `{name}`, which the scan does not have: put its axes.csv and cell.toml beside robot.csv"
    )]
    AxisNotRecorded {
        /// Its name.
        name: String,
    },
    /// A result of several sensors, but one is needed.
    #[error(
        "has several sensors ({names}); calibrate one of them: `trueline calibrate DATASET/sensors/NAME`"
    )]
    SeveralSensors {
        /// Their names.
        names: String,
    },
    /// A dataset of several sensors, but one is needed.
    #[error("is a dataset of {} sensors ({}), and one is needed here", names.len(), names.join(", "))]
    DatasetOfSensors {
        /// Their names.
        names: Vec<String>,
        /// The folder of the first.
        first: String,
    },
    /// A sensor beside the folder of several sensors.
    #[error("exists beside a folder `sensors`: use one sensor, or several in `sensors/NAME`")]
    SensorBesideSensors,
    /// A folder of several sensors with fewer than two.
    #[error("has {found} sensor folder(s); several sensors need at least two, each in `sensors/NAME`")]
    TooFewSensors {
        /// Their number.
        found: usize,
    },
    /// Of the files of external axes.
    #[error(transparent)]
    Axis(#[from] AxisProblem),
    /// The same quantity twice.
    #[error("duplicate column")]
    DuplicateColumn,
    /// A length or time without its unit.
    #[error("the column has no unit in its name; expected for example `{example}`")]
    NoUnit {
        /// The name with a unit.
        example: String,
    },
    /// An unknown unit in a header of another program.
    #[error("`{unit}` is not a known unit")]
    UnknownUnit {
        /// Content of its brackets.
        unit: String,
    },
    /// Too many or too few fields.
    #[error("expected {expected} fields, found {found}")]
    FieldCount {
        /// Columns of the header.
        expected: usize,
        /// Fields of the row.
        found: usize,
    },
    /// Text where a number should be.
    #[error("expected a number, found `{text}`")]
    NotANumber {
        /// The field.
        text: String,
    },
    /// NaN or infinity.
    #[error("expected a finite number, found `{text}`")]
    NotFinite {
        /// The field.
        text: String,
    },
    /// A number that means "nothing measured".
    #[error("expected a measured number, found `{text}`")]
    NotMeasured {
        /// The field.
        text: String,
    },
    /// A time further from its clock's zero than any clock is.
    #[error("expected a stamp within 95 years of the clock's zero, found `{text}`")]
    NotAStamp {
        /// The field.
        text: String,
    },
    /// A line number above the largest possible one.
    #[error("expected a line from 0 to {last}, found {line}")]
    NotALine {
        /// The number.
        line: u64,
        /// The last one that there may be.
        last: u32,
    },
    /// A negative or fractional number where a count belongs.
    #[error("expected a whole number of 0 or more, found `{text}`")]
    NotACount {
        /// The field.
        text: String,
    },
    /// A picture whose name contains no stamp.
    #[error("the name has no number, or one that is too large")]
    NoNumberInName,
    /// Two pictures with one number.
    #[error("another picture also has the number {number}")]
    NumberTwice {
        /// The number.
        number: i64,
    },
    /// A plate of no line.
    #[error("expected plate {}, found {plate}", if *last == 1 { "0 or 1".to_owned() } else { format!("0 to {last}") })]
    NotAPlate {
        /// The number.
        plate: u64,
        /// The last one that there may be.
        last: u64,
    },
    /// Two stripes of one plate at one stamp.
    #[error("plate {plate} twice at one stamp")]
    PlateTwice {
        /// The number.
        plate: u32,
    },
    /// A stripe between a point and itself.
    #[error("the two points are the same")]
    StripeWithoutLength,
    /// A stripe with an uncertainty larger than its length.
    #[error("the standard deviation {sigma} is not smaller than the distance of the two points, {length}")]
    StripeWithoutDirection {
        /// In the unit of the table.
        sigma: f64,
        /// Likewise.
        length: f64,
    },
    /// Stripes of a sensor with a laser plane that does not give y from x and z.
    #[error("x and z of a stripe cannot be used: the laser plane must be inclined to the y axis")]
    StripesWithoutLaserPlane,
    /// A standard deviation of zero or less.
    #[error("expected a standard deviation above zero, found `{text}`")]
    NotPositive {
        /// The field.
        text: String,
    },
    /// An invalid correlation of two errors.
    #[error("expected a correlation of at most ±0.9999, found `{text}`")]
    NotACorrelation {
        /// The field.
        text: String,
    },
    /// A picture's name that leads out of the folder of the index.
    #[error("expected the name of a file beside the index, found `{text}`")]
    NotAFileName {
        /// The field.
        text: String,
    },
    /// A picture that is not a PNG, or is cut off.
    #[error("the picture cannot be read: {why}")]
    Picture {
        /// Error of the decoder.
        why: String,
    },
    /// A picture in colour or of another depth.
    #[error("expected a gray picture of 8 or 16 bits, found {found}")]
    NotGray {
        /// Depth and colours.
        found: String,
    },
    /// Numbers of two kinds.
    #[error("decimal commas (`{comma}`) and decimal points (`{point}`) in one file")]
    MixedDecimals {
        /// A number with a comma.
        comma: String,
        /// A number with a point.
        point: String,
    },
    /// A table of poses without a rotation.
    #[error("there is no rotation; the header has: {found}")]
    NoRotation {
        /// The header as found.
        found: String,
    },
    /// A table of poses with two rotations.
    #[error("there are two rotations: {first} and {second}")]
    TwoRotations {
        /// The columns of one.
        first: String,
        /// The columns of the other.
        second: String,
    },
    /// Angles that mean different rotations on different robots.
    #[error("rx, ry, rz in degrees are ambiguous: robots define them differently")]
    AmbiguousAngles,
    /// Nine numbers that are not a rotation.
    #[error("expected a rotation matrix, found one that is {error:.4} away from its nearest rotation")]
    NoRotationMatrix {
        /// Largest distance of an element from that of the nearest rotation.
        error: f64,
    },
    /// A folder with profiles and no features, in a reader that needs features.
    #[error("there are only profiles: the seam has not been detected yet")]
    OnlyProfiles,
    /// Profiles without stamps in their file.
    #[error("the file has no time stamps of the profiles")]
    NoProfileTimes,
    /// Profiles of a program that neither they nor the user name.
    #[error("rows of numbers without a header: the format cannot be recognised")]
    UnknownProfileFormat,
    /// Profiles in which nothing was measured.
    #[error("none of the {profiles} profiles has a point")]
    NoPoints {
        /// Their number.
        profiles: usize,
    },
    /// A range that means no return.
    #[error(
        "{points} of {of} points have a range of exactly {range_mm} mm, far from all others: probably a code \
            for no return"
    )]
    NoReturn {
        /// The range, mm.
        range_mm: f64,
        /// How many points have it.
        points: usize,
        /// Of how many.
        of: usize,
    },
    /// Rows of heights with unknown positions along the stripe.
    #[error("the file does not state the positions of the columns along the stripe")]
    NoColumnPositions,
    /// A PLY file that cannot be used.
    #[error("not readable as PLY: {0}")]
    Ply(String),
    /// Stamps that fall.
    #[error("time runs backwards: {} s after {} s", trimmed(*this_s), trimmed(*previous_s))]
    TimeRunsBackwards {
        /// The stamp before, s.
        previous_s: f64,
        /// This stamp, s.
        this_s: f64,
    },
    /// A quaternion with another length than one.
    #[error("expected a quaternion of length 1, found length {norm}")]
    QuaternionNotUnit {
        /// Its length.
        norm: f64,
    },
    /// A CSV or text file that is broken as such.
    #[error("not readable as a table: {0}")]
    Csv(String),
    /// A file of another program that cannot be read as its kind.
    #[error("is {what}; this format is not supported")]
    Unreadable {
        /// The item, and its fault.
        what: String,
        /// How to make it readable.
        hint: &'static str,
    },
    /// A TOML file that is broken or has wrong keys.
    #[error("{0}")]
    Toml(String),
    /// A value in a TOML file that cannot be.
    #[error("`{key}`: expected {expected}, found {found}")]
    Value {
        /// The key.
        key: &'static str,
        /// The right form.
        expected: &'static str,
        /// The value found.
        found: String,
    },
    /// A calibration file that is not there.
    #[error("this calibration does not exist")]
    MissingCalibration,
    /// A reference file that is not there.
    #[error("this reference does not exist")]
    MissingReference,
    /// A point of a curve that is the one before.
    #[error("the point repeats the previous one")]
    PointRepeated,
    /// A JSON file that is not a result.
    #[error("not readable as a result of `calibrate --json`: {0}")]
    NoResult(String),
    /// A result of a later schema.
    #[error("this result has schema version {found}; this program supports versions up to {known}")]
    NewerResult {
        /// Its version.
        found: u32,
        /// The latest known one.
        known: u32,
    },
    /// A result in which something was not seen.
    #[error("`{key}` is null: the scan did not determine it")]
    NotCalibrated {
        /// The key.
        key: &'static str,
    },
    /// A text table row of a foreign format with the wrong number of values.
    #[error("expected {expected} values in a row of {format}, found {found}")]
    ForeignRow {
        /// The format.
        format: &'static str,
        /// The number of values it has.
        expected: String,
        /// The number found.
        found: usize,
    },
    /// Two files of a foreign format that do not fit together.
    #[error("has {found} rows where {other} has {expected}")]
    RowsDiffer {
        /// The other file.
        other: String,
        /// Its rows.
        expected: usize,
        /// The rows here.
        found: usize,
    },
}

impl From<LogProblem> for Problem {
    fn from(problem: LogProblem) -> Self {
        // An error is as large as its largest variant.
        Self::Log(Box::new(problem))
    }
}

/// Seconds to the nanosecond, without the zeros and the rounding that follow.
fn trimmed(seconds: f64) -> String {
    format!("{seconds:.9}").trim_end_matches('0').trim_end_matches('.').to_owned()
}
