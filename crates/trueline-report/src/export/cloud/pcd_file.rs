//! Binary PCD 0.7, as PCL reads it: coordinates in single precision (0.06 µm at 1 m), the time in double.

use super::point::{CloudColumns, CloudPoint, CloudSink};
use super::rows::{Layout, Row, padded};
use std::fs::File;
use std::io;

/// Nanoseconds in a second.
const NS_PER_S: f64 = 1e9;

pub(super) fn write<E: From<io::Error>>(
    file: &File,
    columns: CloudColumns,
    fill: &mut dyn FnMut(&mut dyn CloudSink) -> Result<(), E>,
) -> Result<(), E> {
    super::rows::write(file, Layout { header, row }, columns, fill)
}

fn header(count: u64, columns: CloudColumns) -> String {
    let (count, blanks) = padded(count);
    // The number stands twice, so the blanks do.
    let mut lines = ["FIELDS x y z t", "SIZE 4 4 4 8", "TYPE F F F F", "COUNT 1 1 1 1"].map(str::to_owned);
    let optional = [
        (columns.intensity, [" intensity", " 4", " F", " 1"]),
        (columns.sigma, [" sigma", " 4", " F", " 1"]),
        (columns.frame, [" frame", " 4", " U", " 1"]),
    ];
    for (_, parts) in optional.into_iter().filter(|(is_there, _)| *is_there) {
        lines.iter_mut().zip(parts).for_each(|(line, part)| line.push_str(part));
    }
    format!(
        "# .PCD v0.7 - points in base, metres; t in s at the exposure{blanks}{blanks}\nVERSION 0.7\n{}\nWIDTH {count}\nHEIGHT 1\n\
         VIEWPOINT 0 0 0 1 0 0 0\nPOINTS {count}\nDATA binary\n",
        lines.join("\n")
    )
}

fn row(row: &mut Row, point: &CloudPoint, columns: CloudColumns) {
    point.in_base_m.iter().for_each(|number| row.put((*number as f32).to_le_bytes()));
    row.put((point.exposed_ns as f64 / NS_PER_S).to_le_bytes());
    row.put_optional(point, columns);
}
