//! `axes.csv`: values of external axes over time, `time_s,NAME_deg,NAME_mm`, or at stops, `stop,NAME_deg,NAME_mm`.

use crate::axes::{AxisRecord, AxisValue};
use crate::axis_problem::AxisProblem;
use crate::dialect::plain_csv;
use crate::error::{Error, Problem};
use crate::stamp;
use crate::stop_poses::{RowKey, StopPoses};
use crate::table::{ColumnSpec, Header, Table, required};
use crate::unit::{MM_PER_M, Quantity};
use std::io::Write;
use std::path::Path;
use trueline_geometry::AxisKind;

const TIME: usize = 0;
/// From one value to the next an axis turns less than this, rad: half a turn.
const LARGEST_TURN_RAD: f64 = std::f64::consts::PI;
/// … or moves less than this, m.
const LARGEST_SHIFT_M: f64 = 0.5;

/// Reads the values of some axes; if the robot stood at stops, those of each stop.
///
/// # Errors
/// Anything that is not a clean table of these axes with rising stamps, an axis that jumps, a stop without a value or with two.
pub(crate) fn read(
    file: &Path,
    bytes: &[u8],
    mut axes: Vec<AxisRecord>,
    stops: Option<&StopPoses>,
) -> Result<Vec<AxisRecord>, Error> {
    let (csv, _) = plain_csv(file, bytes.to_vec(), None)?;
    let names: Vec<String> = axes.iter().map(|axis| axis.name.clone()).collect();
    let header = Header::read(file, &csv)?;
    let key = RowKey::of(&header, stops)?;
    let mut specs: Vec<ColumnSpec<'_>> = vec![key.spec()];
    specs.extend(names.iter().zip(&axes).map(|(name, axis)| required(name, quantity(axis.kind))));
    let mut table = header.find(&specs)?;
    let mut last_ns = None;
    while table.next_row()? {
        let stamp_ns = key.stamp_ns(&table, TIME, last_ns)?;
        last_ns = Some(stamp_ns);
        for (k, axis) in axes.iter_mut().enumerate() {
            let value = table.required_number(TIME + 1 + k)?;
            if let Some(last) = axis.values.last().filter(|_| key.rises()) {
                check_step(&table, (TIME + 1 + k, axis.kind), last, AxisValue { stamp_ns, value })?;
            }
            axis.values.push(AxisValue { stamp_ns, value });
        }
    }
    if axes.iter().any(|axis| axis.values.len() < 2) {
        return Err(Error::in_file(file, Problem::NoRows));
    }
    if let Some(stops) = stops {
        for axis in &mut axes {
            axis.values.sort_by_key(|value| value.stamp_ns);
            stops.check_each_has_one(file, axis.values.iter().map(|value| value.stamp_ns))?;
        }
    }
    Ok(axes)
}

fn quantity(kind: AxisKind) -> Quantity {
    match kind {
        AxisKind::Rotary => Quantity::Angle,
        AxisKind::Linear => Quantity::Length,
    }
}

fn check_step(
    table: &Table<'_>,
    (column, kind): (usize, AxisKind),
    last: &AxisValue,
    next: AxisValue,
) -> Result<(), Error> {
    let step = (next.value - last.value).abs();
    let jumps = match kind {
        AxisKind::Rotary => step >= LARGEST_TURN_RAD,
        AxisKind::Linear => step >= LARGEST_SHIFT_M,
    };
    // Between two scans it may go anywhere.
    if !jumps || next.stamp_ns - last.stamp_ns > LONGEST_STEP_NS {
        return Ok(());
    }
    let step = match kind {
        AxisKind::Rotary => format!("{:.0}°", step.to_degrees()),
        AxisKind::Linear => format!("{:.0} mm", step * MM_PER_M),
    };
    Err(table.error_in(
        column,
        AxisProblem::Jumps { step, in_s: stamp::seconds(next.stamp_ns - last.stamp_ns) }.into(),
    ))
}

/// Values further apart than this are not of one motion, ns.
const LONGEST_STEP_NS: i64 = 1_000_000_000;

/// Writes the values of axes that were recorded together.
///
/// # Errors
/// Error of the writer.
pub fn write(mut out: impl Write, axes: &[AxisRecord]) -> std::io::Result<()> {
    let unit = |kind| if kind == AxisKind::Rotary { "deg" } else { "mm" };
    let names: Vec<String> = axes.iter().map(|axis| format!("{}_{}", axis.name, unit(axis.kind))).collect();
    writeln!(out, "time_s,{}", names.join(","))?;
    let rows = axes.iter().map(|axis| axis.values.len()).min().unwrap_or(0);
    for row in 0..rows {
        write!(out, "{}", stamp::format_seconds(axes[0].values[row].stamp_ns))?;
        for axis in axes {
            let value = axis.values[row].value;
            let shown = if axis.kind == AxisKind::Rotary { value.to_degrees() } else { value * MM_PER_M };
            write!(out, ",{shown}")?;
        }
        writeln!(out)?;
    }
    Ok(())
}
