//! Parquet: a row a point, in groups of rows.

use super::point::{CloudColumns, CloudPoint, CloudSink};
use parquet::basic::{Compression, Repetition, Type, ZstdLevel};
use parquet::data_type::{DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::Type as SchemaType;
use std::fs::File;
use std::io;
use std::sync::Arc;

/// Rows of a group.
const GROUP: usize = 1 << 17;
/// Millimetres in a metre.
const MM_PER_M: f64 = 1e3;

struct Sink<'a> {
    writer: SerializedFileWriter<&'a File>,
    columns: CloudColumns,
    waiting: Vec<CloudPoint>,
}

impl CloudSink for Sink<'_> {
    fn take(&mut self, points: &[CloudPoint]) -> io::Result<()> {
        for part in points.chunks(GROUP) {
            self.waiting.extend_from_slice(part);
            if self.waiting.len() >= GROUP {
                self.flush().map_err(io::Error::other)?;
            }
        }
        Ok(())
    }
}

impl Sink<'_> {
    fn flush(&mut self) -> Result<(), ParquetError> {
        let points = std::mem::take(&mut self.waiting);
        let mut group = self.writer.next_row_group()?;
        let real = |of: &dyn Fn(&CloudPoint) -> f64| points.iter().map(of).collect::<Vec<f64>>();
        let mut reals = Vec::new();
        for axis in 0..3 {
            reals.push(real(&|point| point.in_base_m[axis] * MM_PER_M));
        }
        if self.columns.intensity {
            reals.push(real(&|point| point.intensity.unwrap_or(f64::NAN)));
        }
        if self.columns.sigma {
            reals.push(real(&|point| point.sigma_m.unwrap_or(f64::NAN) * MM_PER_M));
        }
        let whole = |of: &dyn Fn(&CloudPoint) -> i64| points.iter().map(of).collect::<Vec<i64>>();
        let mut wholes = vec![whole(&|point| point.exposed_ns)];
        if self.columns.frame {
            wholes.push(whole(&|point| point.frame as i64));
        }
        for values in &wholes {
            let Some(mut column) = group.next_column()? else { break };
            column.typed::<Int64Type>().write_batch(values, None, None)?;
            column.close()?;
        }
        for values in &reals {
            let Some(mut column) = group.next_column()? else { break };
            column.typed::<DoubleType>().write_batch(values, None, None)?;
            column.close()?;
        }
        group.close()?;
        Ok(())
    }
}

/// `time_ns`, `frame`, `x_mm`, `y_mm`, `z_mm`, `intensity`, `sigma_mm`.
fn schema(columns: CloudColumns) -> Result<SchemaType, ParquetError> {
    let names = [
        (true, "time_ns", Type::INT64),
        (columns.frame, "frame", Type::INT64),
        (true, "x_mm", Type::DOUBLE),
        (true, "y_mm", Type::DOUBLE),
        (true, "z_mm", Type::DOUBLE),
        (columns.intensity, "intensity", Type::DOUBLE),
        (columns.sigma, "sigma_mm", Type::DOUBLE),
    ];
    let fields = names.into_iter().filter(|(is_there, ..)| *is_there).map(|(_, name, physical)| {
        SchemaType::primitive_type_builder(name, physical)
            .with_repetition(Repetition::REQUIRED)
            .build()
            .map(Arc::new)
    });
    SchemaType::group_type_builder("cloud").with_fields(fields.collect::<Result<_, _>>()?).build()
}

pub(super) fn write<E: From<io::Error>>(
    file: &File,
    columns: CloudColumns,
    fill: &mut dyn FnMut(&mut dyn CloudSink) -> Result<(), E>,
) -> Result<(), E> {
    let settings =
        WriterProperties::builder().set_compression(Compression::ZSTD(ZstdLevel::default())).build();
    let schema = schema(columns).map_err(io::Error::other)?;
    let writer = SerializedFileWriter::new(file, Arc::new(schema), Arc::new(settings));
    let mut sink =
        Sink { writer: writer.map_err(io::Error::other)?, columns, waiting: Vec::with_capacity(GROUP) };
    fill(&mut sink)?;
    if !sink.waiting.is_empty() {
        sink.flush().map_err(io::Error::other)?;
    }
    sink.writer.close().map(drop).map_err(|error| io::Error::other(error).into())
}
