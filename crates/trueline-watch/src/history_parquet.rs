//! The history as a Parquet file: the columns of [`history_table`](crate::history_table), compressed with Zstandard.

use crate::history_table::{Values, columns};
use crate::store::HistoryRow;
use parquet::basic::{Compression, LogicalType, Repetition, Type, ZstdLevel};
use parquet::data_type::{ByteArray, ByteArrayType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::Type as SchemaType;
use std::sync::Arc;

/// The bytes of the file.
///
/// # Errors
/// Error of the format's library.
pub fn bytes(history: &[HistoryRow]) -> Result<Vec<u8>, ParquetError> {
    let table = columns(history);
    let fields = table.iter().map(|(name, values)| field(name, values)).collect::<Result<Vec<_>, _>>()?;
    let schema = SchemaType::group_type_builder("history").with_fields(fields).build()?;
    let settings =
        WriterProperties::builder().set_compression(Compression::ZSTD(ZstdLevel::default())).build();
    let mut out = Vec::new();
    let mut writer = SerializedFileWriter::new(&mut out, Arc::new(schema), Arc::new(settings))?;
    let mut group = writer.next_row_group()?;
    for (_, values) in &table {
        let Some(mut column) = group.next_column()? else { break };
        match values {
            Values::Whole(list) => {
                let (known, levels) = parted(list, |value| *value);
                column.typed::<Int64Type>().write_batch(&known, Some(&levels), None)?;
            }
            Values::Number(list) => {
                let (known, levels) = parted(list, |value| *value);
                column.typed::<DoubleType>().write_batch(&known, Some(&levels), None)?;
            }
            Values::Text(list) => {
                let (known, levels) = parted(list, |text| ByteArray::from(text.as_str()));
                column.typed::<ByteArrayType>().write_batch(&known, Some(&levels), None)?;
            }
        }
        column.close()?;
    }
    group.close()?;
    writer.close()?;
    Ok(out)
}

fn field(name: &str, values: &Values) -> Result<Arc<SchemaType>, ParquetError> {
    let (physical, logical) = match values {
        Values::Whole(_) => (Type::INT64, None),
        Values::Number(_) => (Type::DOUBLE, None),
        Values::Text(_) => (Type::BYTE_ARRAY, Some(LogicalType::String)),
    };
    let builder = SchemaType::primitive_type_builder(name, physical);
    builder.with_repetition(Repetition::OPTIONAL).with_logical_type(logical).build().map(Arc::new)
}

/// The values that there are, and for each row whether there is one.
fn parted<T, U>(list: &[Option<T>], of: impl Fn(&T) -> U) -> (Vec<U>, Vec<i16>) {
    (list.iter().flatten().map(of).collect(), list.iter().map(|value| i16::from(value.is_some())).collect())
}
