//! Binary PLY, little endian.

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
    let mut text = format!(
        "ply\nformat binary_little_endian 1.0\ncomment points in base, metres; time in s at the exposure{blanks}\n\
         element vertex {count}\nproperty double x\nproperty double y\nproperty double z\nproperty double time\n"
    );
    let optional = [
        (columns.intensity, "property float intensity\n"),
        (columns.sigma, "property float sigma\n"),
        (columns.frame, "property uint frame\n"),
    ];
    optional.into_iter().filter(|(is_there, _)| *is_there).for_each(|(_, line)| text.push_str(line));
    text.push_str("end_header\n");
    text
}

fn row(row: &mut Row, point: &CloudPoint, columns: CloudColumns) {
    point.in_base_m.iter().for_each(|number| row.put(number.to_le_bytes()));
    row.put((point.exposed_ns as f64 / NS_PER_S).to_le_bytes());
    row.put_optional(point, columns);
}
