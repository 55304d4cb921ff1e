//! `features.csv`: seam features in pixels, in points or from a profiler.

use crate::encoder_log;
use crate::error::{Error, Problem};
use crate::recording::{Feature, LAST_LINE, MOST_CORRELATION, Measured, Sensor};
use crate::stamp;
use crate::stop_poses::{Pairing, RowKey};
use crate::table::{self, ColumnSpec, Header, Table, optional, required};
use crate::unit::{MM_PER_M, Quantity};
use std::io::Write;
use std::path::Path;

const TIME: usize = 0;
const LINE: usize = 1;
const FRAME: usize = 2;
const DEVICE_TIME: usize = 3;
/// First column of the coordinates; their standard deviations follow them.
const FIRST: usize = 4;

const SHARED: [ColumnSpec<'static>; 3] = [
    optional("line", Quantity::Count),
    optional("frame", Quantity::Count),
    optional("device_time", Quantity::Time),
];

const PIXEL: [ColumnSpec<'static>; 5] = [
    required("u", Quantity::Pixel),
    required("v", Quantity::Pixel),
    optional("sigma_u", Quantity::Pixel),
    optional("sigma_v", Quantity::Pixel),
    optional("correlation", Quantity::Plain),
];

const PROFILE: [ColumnSpec<'static>; 5] = [
    required("x", Quantity::Length),
    required("z", Quantity::Length),
    optional("sigma_x", Quantity::Length),
    optional("sigma_z", Quantity::Length),
    optional("correlation", Quantity::Plain),
];

const POINT: [ColumnSpec<'static>; 3] =
    [required("x", Quantity::Length), required("y", Quantity::Length), required("z", Quantity::Length)];

fn columns(sensor: &Sensor, key: RowKey<'_>) -> Vec<ColumnSpec<'static>> {
    let own: &[ColumnSpec<'static>] = match sensor {
        Sensor::CameraLaser { .. } => &PIXEL,
        Sensor::Profiler => &PROFILE,
        Sensor::Points { .. } => &POINT,
    };
    [key.spec()].iter().chain(&SHARED).chain(own).copied().collect()
}

/// Whether a name is that of a column of a sensor's file.
#[must_use]
pub(crate) fn is_column(name: &str, sensor: &Sensor) -> bool {
    name == encoder_log::COLUMN || table::is_one_of(name, &columns(sensor, RowKey::Stamp))
}

/// Reads the features of a sensor.
///
/// # Errors
/// Any text but a clean table of that sensor's columns with rising stamps.
pub fn read(file: &Path, bytes: &[u8], sensor: &Sensor) -> Result<Vec<Feature>, Error> {
    read_at(file, bytes, sensor, Pairing::default())
}

/// The same if rows name a stop, or the count of an encoder, in place of a stamp.
///
/// # Errors
/// As [`read`], and a stop without a pose, or a count beyond the encoder's log.
pub(crate) fn read_at(
    file: &Path,
    bytes: &[u8],
    sensor: &Sensor,
    pairing: Pairing<'_>,
) -> Result<Vec<Feature>, Error> {
    let header = Header::read(file, bytes)?;
    let key = RowKey::of(&header, pairing)?;
    let mut table = header.find(&columns(sensor, key))?;
    let mut features: Vec<Feature> = table.room();
    while table.next_row()? {
        let last_ns = features.last().map(|last| last.stamp_ns);
        features.push(read_row(&table, sensor, key.stamp_ns(&table, TIME, last_ns)?)?);
    }
    features.sort_by_key(|feature| feature.stamp_ns);
    if features.is_empty() {
        return Err(Error::in_file(file, Problem::NoRows));
    }
    Ok(features)
}

fn read_row(table: &Table<'_>, sensor: &Sensor, stamp_ns: i64) -> Result<Feature, Error> {
    let at = |k: usize| table.required_number(FIRST + k);
    let measured = match sensor {
        Sensor::CameraLaser { .. } => Measured::Pixel([at(0)?, at(1)?]),
        Sensor::Profiler => Measured::Profile([at(0)?, at(1)?]),
        Sensor::Points { .. } => Measured::Point([at(0)?, at(1)?, at(2)?]),
    };
    let number = table.count(LINE)?.unwrap_or(0);
    let line = u32::try_from(number).ok().filter(|line| *line <= LAST_LINE);
    let line =
        line.ok_or_else(|| table.error_in(LINE, Problem::NotALine { line: number, last: LAST_LINE }))?;
    let sigma = read_sigma(table, sensor)?;
    Ok(Feature {
        stamp_ns,
        line,
        frame: table.count(FRAME)?,
        device_ns: table.optional_stamp_ns(DEVICE_TIME)?,
        measured,
        sigma,
        correlation: if sigma.is_some() { read_correlation(table)? } else { 0.0 },
    })
}

fn read_sigma(table: &Table<'_>, sensor: &Sensor) -> Result<Option<[f64; 2]>, Error> {
    if matches!(sensor, Sensor::Points { .. }) {
        return Ok(None);
    }
    let (first, second) = (FIRST + 2, FIRST + 3);
    match (table.sigma(first)?, table.sigma(second)?) {
        (Some(a), Some(b)) => Ok(Some([a, b])),
        (None, None) => Ok(None),
        _ => {
            let suffix = if matches!(sensor, Sensor::Profiler) {
                "sigma_x and sigma_z"
            } else {
                "sigma_u and sigma_v"
            };
            Err(table.error(Problem::MissingColumn {
                name: format!("{suffix}, both or none,"),
                found: "one of them".to_owned(),
            }))
        }
    }
}

fn read_correlation(table: &Table<'_>) -> Result<f64, Error> {
    let column = FIRST + 4;
    match table.number(column)? {
        Some(value) if value.abs() <= MOST_CORRELATION => Ok(value),
        Some(_) => {
            let text = table.text(column).unwrap_or_default().to_owned();
            Err(table.error_in(column, Problem::NotACorrelation { text }))
        }
        None => Ok(0.0),
    }
}

/// Writes features; the columns follow from the first one.
///
/// # Errors
/// Error of the writer.
pub fn write(mut out: impl Write, features: &[Feature]) -> std::io::Result<()> {
    let Some(first) = features.first() else {
        return Ok(());
    };
    let several_lines = features.iter().any(|f| f.line != 0);
    let frames = features.iter().all(|f| f.frame.is_some());
    let device = features.iter().all(|f| f.device_ns.is_some());
    let sigmas = features.iter().all(|f| f.sigma.is_some());
    let correlations = sigmas && features.iter().any(|f| f.correlation != 0.0);
    let (names, sigma_names, scale) = match first.measured {
        Measured::Pixel(_) => ("u_px,v_px", "sigma_u_px,sigma_v_px", 1.0),
        Measured::Profile(_) => ("x_mm,z_mm", "sigma_x_mm,sigma_z_mm", MM_PER_M),
        Measured::Point(_) => ("x_mm,y_mm,z_mm", "", MM_PER_M),
    };
    write!(out, "time_s,{names}")?;
    for (present, name) in [
        (several_lines, "line"),
        (frames, "frame"),
        (device, "device_time_s"),
        (sigmas, sigma_names),
        (correlations, "correlation"),
    ] {
        if present {
            write!(out, ",{name}")?;
        }
    }
    writeln!(out)?;
    for feature in features {
        write!(out, "{}", stamp::format_seconds(feature.stamp_ns))?;
        let numbers: &[f64] = match &feature.measured {
            Measured::Pixel(p) | Measured::Profile(p) => p,
            Measured::Point(p) => p,
        };
        for number in numbers {
            write!(out, ",{}", number * scale)?;
        }
        if several_lines {
            write!(out, ",{}", feature.line)?;
        }
        if let (true, Some(frame)) = (frames, feature.frame) {
            write!(out, ",{frame}")?;
        }
        if let (true, Some(device_ns)) = (device, feature.device_ns) {
            write!(out, ",{}", stamp::format_seconds(device_ns))?;
        }
        if let (true, Some([a, b])) = (sigmas, feature.sigma) {
            write!(out, ",{},{}", a * scale, b * scale)?;
        }
        if correlations {
            write!(out, ",{}", feature.correlation)?;
        }
        writeln!(out)?;
    }
    Ok(())
}
