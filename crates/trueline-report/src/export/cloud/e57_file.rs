//! E57: one cloud, coordinates in double precision, the time since the first point.

use super::point::{CloudColumns, CloudPoint, CloudSink};
use e57::{E57Writer, PointCloudWriter, Record, RecordDataType, RecordName, RecordValue};
use std::fs::File;
use std::io;

/// Nanoseconds in a second.
const NS_PER_S: f64 = 1e9;
/// Names of the file and of its only cloud: readers distinguish the clouds of several files by their place.
const FILE_NAME: &str = "{7472756c-696e-6520-636c-6f75642066696c}";
/// See [`FILE_NAME`].
const CLOUD_NAME: &str = "{7472756c-696e-6520-636c-6f7564000001}";

struct Sink<'a, 'b> {
    writer: PointCloudWriter<'a, &'b File>,
    columns: CloudColumns,
    first_ns: Option<i64>,
    /// Least and greatest intensity.
    intensity: [f64; 2],
}

impl CloudSink for Sink<'_, '_> {
    fn take(&mut self, points: &[CloudPoint]) -> io::Result<()> {
        for point in points {
            let first_ns = *self.first_ns.get_or_insert(point.exposed_ns);
            let mut values: Vec<RecordValue> = point.in_base_m.map(RecordValue::Double).into();
            // Times are not negative; scans that are put together may go back.
            let since_s = (point.exposed_ns.saturating_sub(first_ns) as f64 / NS_PER_S).max(0.0);
            values.push(RecordValue::Double(since_s));
            if self.columns.intensity {
                let intensity = point.intensity.unwrap_or(0.0);
                self.intensity = [self.intensity[0].min(intensity), self.intensity[1].max(intensity)];
                values.push(RecordValue::Double(intensity));
            }
            self.writer.add_point(values).map_err(io::Error::other)?;
        }
        Ok(())
    }
}

pub(super) fn write<E: From<io::Error>>(
    file: &File,
    columns: CloudColumns,
    fill: &mut dyn FnMut(&mut dyn CloudSink) -> Result<(), E>,
) -> Result<(), E> {
    let double = |name| Record { name, data_type: RecordDataType::Double { min: None, max: None } };
    let mut prototype =
        [RecordName::CartesianX, RecordName::CartesianY, RecordName::CartesianZ, RecordName::TimeStamp]
            .map(double)
            .to_vec();
    if columns.intensity {
        prototype.push(double(RecordName::Intensity));
    }
    let mut file_writer = E57Writer::new(file, FILE_NAME).map_err(io::Error::other)?;
    let writer = file_writer.add_pointcloud(CLOUD_NAME, prototype).map_err(io::Error::other)?;
    let mut sink = Sink { writer, columns, first_ns: None, intensity: [f64::INFINITY, f64::NEG_INFINITY] };
    fill(&mut sink)?;
    if columns.intensity && sink.intensity[0].is_finite() {
        let [least, most] = sink.intensity.map(|intensity| Some(RecordValue::Double(intensity)));
        let limits = e57::IntensityLimits { intensity_min: least, intensity_max: most };
        sink.writer.set_intensity_limits(Some(limits));
    }
    sink.writer.finalize().map_err(io::Error::other)?;
    file_writer.finalize().map_err(|error| io::Error::other(error).into())
}
