//! `profiles.parquet`: the columns of the long form of [`profiles_csv`](crate::profiles_csv) as a Parquet file, for scans of many points.
//!
//! `time_s` (or `_ms`, `_us`, `_ns`), `x_mm`, `z_mm` (or `_m`); optional `frame`, `intensity`. Numbers of any width,
//! compressed by Snappy, Zstandard or not at all. A row with x or z null or NaN is a column without a return.

use crate::error::{Error, Problem};
use crate::parquet_pages;
use crate::profile::{Profile, ProfilePoint};
use crate::profile_stream::{Assembly, EachProfile};
use crate::profiles_csv::{FIRST, FRAME, LONG, SHARED, TIME};
use crate::stamp;
use crate::table::{LARGEST, identify};
use crate::unit::MM_PER_M;
use bytes::Bytes;
use parquet::basic::{Compression, Repetition, Type, ZstdLevel};
use parquet::column::reader::{ColumnReader, ColumnReaderImpl};
use parquet::data_type::{DataType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::metadata::ParquetMetaData;
use parquet::file::properties::WriterProperties;
use parquet::file::reader::{ChunkReader, FileReader, SerializedFileReader};
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::Type as SchemaType;
use std::ops::ControlFlow;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::Arc;

/// Rows that a file of any size may have, ...
const FEW_ROWS: u64 = 1 << 18;
/// ... and rows for each of its bytes: a measured point has more than two bits.
const ROWS_PER_BYTE: u64 = 4;
/// Largest uncompressed size of a row's numbers, bytes.
const BYTES_PER_ROW: u64 = 64;
/// Rows that are read at a time.
const BATCH: usize = 1 << 15;
/// How a file is made that can be read.
const HINT: &str =
    "columns of numbers time_s, x_mm and z_mm, one row a point: df.to_parquet('profiles.parquet')";

/// A number as the file has it.
#[derive(Clone, Copy)]
enum Number {
    Whole(i64),
    Real(f64),
}

impl Number {
    fn real(self) -> f64 {
        match self {
            Self::Whole(value) => value as f64,
            Self::Real(value) => value,
        }
    }
}

/// A column of the file, by the place of its specification.
struct Column {
    index: usize,
    name: String,
    scale: f64,
}

/// Reads profiles.
///
/// # Errors
/// A file that is not Parquet or damaged; columns that are missing, unknown or not numbers; stamps that run backwards.
pub fn read(file: &Path, bytes: Vec<u8>) -> Result<Vec<Profile>, Error> {
    let mut profiles = Vec::new();
    let bytes = Bytes::from(bytes);
    each(file, [bytes.clone(), bytes], &mut |profile| {
        profiles.push(profile);
        ControlFlow::Continue(())
    })?;
    Ok(profiles)
}

/// Hands over the profiles of a file, opened twice, of which some thousand rows are in memory.
///
/// # Errors
/// As [`read`].
pub(crate) fn each<R: ChunkReader + 'static>(
    file: &Path,
    opened: [R; 2],
    each: &mut EachProfile<'_>,
) -> Result<(), Error> {
    // The format's library indexes past the end of some damaged pages.
    catch_unwind(AssertUnwindSafe(|| each_sound(file, opened, each)))
        .unwrap_or_else(|_| Err(Error::unreadable(file, "a Parquet file that is damaged", HINT)))
}

fn each_sound<R: ChunkReader + 'static>(
    file: &Path,
    [pages, source]: [R; 2],
    each: &mut EachProfile<'_>,
) -> Result<(), Error> {
    let unreadable = |error: ParquetError| Error::unreadable(file, format!("a Parquet file: {error}"), HINT);
    let reader = SerializedFileReader::new(source).map_err(unreadable)?;
    check_claims(file, &pages, reader.metadata())?;
    let columns = columns(file, reader.metadata())?;
    let mut all = Assembly::new(each);
    for group in 0..reader.num_row_groups() {
        let group = reader.get_row_group(group).map_err(unreadable)?;
        let mut readers = [const { None }; FIRST + LONG.len()];
        for (column, opened) in columns.iter().zip(&mut readers) {
            let Some(column) = column else { continue };
            let described = group.metadata().column(column.index).column_descr_ptr();
            if described.max_rep_level() > 0 {
                return Err(no_numbers(file, &column.name));
            }
            let reader = group.get_column_reader(column.index).map_err(unreadable)?;
            *opened = Some((reader, described.max_def_level()));
        }
        let mut values: [Vec<Option<Number>>; FIRST + LONG.len()] = Default::default();
        loop {
            for ((column, opened), values) in columns.iter().zip(&mut readers).zip(&mut values) {
                let (Some(column), Some((reader, defined))) = (column, opened) else { continue };
                values.clear();
                if !read_numbers(reader, *defined, values).map_err(unreadable)? {
                    return Err(no_numbers(file, &column.name));
                }
            }
            if values.iter().all(Vec::is_empty) {
                break;
            }
            if (Rows { file, columns: &columns, values: &values }).append_to(&mut all)?.is_break() {
                return Ok(());
            }
        }
    }
    if all.profiles == 0 {
        return Err(Error::in_file(file, Problem::NoRows));
    }
    let _has_points = all.end();
    Ok(())
}

/// Refuses data that would fill the memory: pages that claim more than a file of this size can hold.
fn check_claims(file: &Path, source: &impl ChunkReader, metadata: &ParquetMetaData) -> Result<(), Error> {
    let refused = |what: String| Err(Error::unreadable(file, what, HINT));
    let Some(claimed) = parquet_pages::claimed(source, metadata) else {
        return refused("a Parquet file that is damaged: its pages do not follow each other".to_owned());
    };
    let length = source.len();
    let most_rows = FEW_ROWS.max(ROWS_PER_BYTE * length);
    if claimed.rows > most_rows || claimed.bytes > BYTES_PER_ROW * most_rows {
        return refused(format!(
            "a Parquet file of {length} bytes that claims {} rows and {} bytes of numbers, too many for measured profiles",
            claimed.rows, claimed.bytes
        ));
    }
    Ok(())
}

fn no_numbers(file: &Path, name: &str) -> Error {
    Error::unreadable(file, format!("a Parquet file without numbers in the column {name}"), HINT)
}

/// Place of each column of the long form.
fn columns(file: &Path, metadata: &ParquetMetaData) -> Result<[Option<Column>; FIRST + LONG.len()], Error> {
    let specs: Vec<_> = SHARED.into_iter().chain(LONG).collect();
    let schema = metadata.file_metadata().schema_descr();
    let names: Vec<String> = schema.columns().iter().map(|column| column.path().string()).collect();
    let mut columns = [const { None }; FIRST + LONG.len()];
    for (index, name) in names.iter().enumerate() {
        let (spec, scale) =
            identify(name, &specs).map_err(|problem| Error::in_file(file, problem).in_column(name))?;
        if columns[spec].is_some() {
            return Err(Error::in_file(file, Problem::DuplicateColumn).in_column(name));
        }
        columns[spec] = Some(Column { index, name: name.clone(), scale });
    }
    for (spec, column) in specs.iter().zip(&columns) {
        if spec.required && column.is_none() {
            let name = format!("{}{}", spec.name, spec.quantity.usual_suffix());
            return Err(Error::in_file(file, Problem::MissingColumn { name, found: names.join(", ") }));
        }
    }
    Ok(columns)
}

/// The next numbers of a column; `false` if it has none.
fn read_numbers(
    reader: &mut ColumnReader,
    defined: i16,
    into: &mut Vec<Option<Number>>,
) -> Result<bool, ParquetError> {
    match reader {
        ColumnReader::DoubleColumnReader(reader) => read_some(reader, defined, into, Number::Real)?,
        ColumnReader::FloatColumnReader(reader) => {
            read_some(reader, defined, into, |value| Number::Real(f64::from(value)))?;
        }
        ColumnReader::Int64ColumnReader(reader) => read_some(reader, defined, into, Number::Whole)?,
        ColumnReader::Int32ColumnReader(reader) => {
            read_some(reader, defined, into, |value| Number::Whole(i64::from(value)))?;
        }
        _ => return Ok(false),
    }
    Ok(true)
}

fn read_some<T: DataType>(
    reader: &mut ColumnReaderImpl<T>,
    defined: i16,
    into: &mut Vec<Option<Number>>,
    number: impl Fn(T::T) -> Number,
) -> Result<(), ParquetError> {
    let (mut known, mut levels) = (Vec::new(), Vec::new());
    reader.read_records(BATCH, Some(&mut levels), None, &mut known)?;
    let mut known = known.into_iter().map(number);
    if defined == 0 {
        into.extend(known.map(Some));
    } else {
        into.extend(levels.iter().map(|level| if *level == defined { known.next() } else { None }));
    }
    Ok(())
}

/// Some rows of a group.
struct Rows<'a> {
    file: &'a Path,
    columns: &'a [Option<Column>],
    values: &'a [Vec<Option<Number>>],
}

impl Rows<'_> {
    fn append_to(&self, all: &mut Assembly<'_, '_>) -> Result<ControlFlow<()>, Error> {
        let rows = self.values[TIME].len();
        let differs = |(column, values): (&Option<Column>, &Vec<_>)| column.is_some() && values.len() != rows;
        if self.columns.iter().zip(self.values).any(differs) {
            return Err(Error::unreadable(self.file, "a Parquet file: its columns differ in length", HINT));
        }
        for row in 0..rows {
            let (stamp_ns, frame) = (self.stamp_ns(row)?, self.frame(row)?);
            let last_ns = all.last().map(|last| last.stamp_ns);
            if let Some(previous_ns) = last_ns.filter(|previous_ns| stamp_ns < *previous_ns) {
                let (previous_s, this_s) = (stamp::seconds(previous_ns), stamp::seconds(stamp_ns));
                return Err(self.error(TIME, Problem::TimeRunsBackwards { previous_s, this_s }));
            }
            let ControlFlow::Continue(profile) = all.of_row(stamp_ns, frame) else {
                return Ok(ControlFlow::Break(()));
            };
            if let (Some(x_m), Some(z_m)) = (self.measured(FIRST, row)?, self.measured(FIRST + 1, row)?) {
                profile.points.push(ProfilePoint { x_m, z_m, intensity: self.measured(FIRST + 2, row)? });
            }
        }
        Ok(ControlFlow::Continue(()))
    }

    fn error(&self, column: usize, problem: Problem) -> Error {
        let name = self.columns[column].as_ref().map_or("", |column| column.name.as_str());
        Error::in_file(self.file, problem).in_column(name)
    }

    /// Value and unit of a field that is there.
    fn field(&self, column: usize, row: usize) -> Option<(Number, f64)> {
        let found = self.columns[column].as_ref()?;
        self.values[column][row].map(|number| (number, found.scale))
    }

    /// A number in SI; `None` for no return.
    fn measured(&self, column: usize, row: usize) -> Result<Option<f64>, Error> {
        let value = self.field(column, row).map(|(number, scale)| number.real() * scale);
        match value.filter(|value| !value.is_nan()) {
            Some(value) if value.abs() > LARGEST => {
                Err(self.error(column, Problem::NotMeasured { text: value.to_string() }))
            }
            value => Ok(value),
        }
    }

    fn stamp_ns(&self, row: usize) -> Result<i64, Error> {
        let not_a_time = |text: String| self.error(TIME, Problem::NotANumber { text });
        let (number, scale) = self.field(TIME, row).ok_or_else(|| not_a_time(String::new()))?;
        let ns = match number {
            Number::Whole(value) => i128::from(value) * (scale * 1e9).round() as i128,
            // NaN, and numbers beyond 64 bits, become the largest, which is refused.
            Number::Real(value) if value.is_finite() => (value * scale * 1e9).round() as i128,
            Number::Real(value) => return Err(not_a_time(value.to_string())),
        };
        let ns = i64::try_from(ns).ok().filter(|ns| stamp::is_in_range(*ns));
        ns.ok_or_else(|| self.error(TIME, Problem::NotAStamp { text: number.real().to_string() }))
    }

    fn frame(&self, row: usize) -> Result<Option<u64>, Error> {
        let Some((number, _)) = self.field(FRAME, row) else { return Ok(None) };
        let count = match number {
            Number::Whole(value) => u64::try_from(value).ok(),
            Number::Real(value) => {
                (value >= 0.0 && value.fract() == 0.0 && value < 9e15).then_some(value as u64)
            }
        };
        count
            .map(Some)
            .ok_or_else(|| self.error(FRAME, Problem::NotACount { text: number.real().to_string() }))
    }
}

/// The bytes of a file with `time_ns`, `frame` where all profiles have one, `x_mm`, `z_mm`, and `intensity` where all points have one;
/// profiles without a point leave no row.
///
/// # Errors
/// Error of the format's library.
pub fn bytes(profiles: &[Profile]) -> Result<Vec<u8>, ParquetError> {
    let points =
        || profiles.iter().flat_map(|profile| profile.points.iter().map(move |point| (profile, point)));
    let whole =
        |of: &dyn Fn(&Profile) -> i64| Values::Whole(points().map(|(profile, _)| of(profile)).collect());
    let real =
        |of: &dyn Fn(&ProfilePoint) -> f64| Values::Real(points().map(|(_, point)| of(point)).collect());
    let mut table = vec![("time_ns", whole(&|profile| profile.stamp_ns))];
    if profiles.iter().all(|profile| profile.frame.is_some()) {
        table.push(("frame", whole(&|profile| profile.frame.unwrap_or_default() as i64)));
    }
    table.push(("x_mm", real(&|point| point.x_m * MM_PER_M)));
    table.push(("z_mm", real(&|point| point.z_m * MM_PER_M)));
    if points().all(|(_, point)| point.intensity.is_some()) {
        table.push(("intensity", real(&|point| point.intensity.unwrap_or_default())));
    }
    write(&table)
}

enum Values {
    Whole(Vec<i64>),
    Real(Vec<f64>),
}

fn write(table: &[(&str, Values)]) -> Result<Vec<u8>, ParquetError> {
    let field = |(name, values): &(&str, Values)| {
        let physical = match values {
            Values::Whole(_) => Type::INT64,
            Values::Real(_) => Type::DOUBLE,
        };
        let builder = SchemaType::primitive_type_builder(name, physical);
        builder.with_repetition(Repetition::REQUIRED).build().map(Arc::new)
    };
    let fields = table.iter().map(field).collect::<Result<Vec<_>, _>>()?;
    let schema = SchemaType::group_type_builder("profiles").with_fields(fields).build()?;
    let settings =
        WriterProperties::builder().set_compression(Compression::ZSTD(ZstdLevel::default())).build();
    let mut out = Vec::new();
    let mut writer = SerializedFileWriter::new(&mut out, Arc::new(schema), Arc::new(settings))?;
    let mut group = writer.next_row_group()?;
    for (_, values) in table {
        let Some(mut column) = group.next_column()? else { break };
        match values {
            Values::Whole(list) => column.typed::<Int64Type>().write_batch(list, None, None)?,
            Values::Real(list) => column.typed::<DoubleType>().write_batch(list, None, None)?,
        };
        column.close()?;
    }
    group.close()?;
    writer.close()?;
    Ok(out)
}
