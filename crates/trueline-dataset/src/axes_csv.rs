//! `axes.csv`: values of external axes over time, `time_s,NAME_deg,NAME_mm`.

use crate::axes::{AxisRecord, AxisValue};
use crate::dialect::plain_csv;
use crate::error::{Error, Problem};
use crate::stamp;
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

/// Reads the values of some axes.
///
/// # Errors
/// Anything that is not a clean table of these axes with rising stamps, and an axis that jumps.
pub(crate) fn read(file: &Path, bytes: &[u8], mut axes: Vec<AxisRecord>) -> Result<Vec<AxisRecord>, Error> {
    let (csv, _) = plain_csv(file, bytes.to_vec(), None)?;
    let names: Vec<String> = axes.iter().map(|axis| axis.name.clone()).collect();
    let mut specs: Vec<ColumnSpec<'_>> = vec![required("time", Quantity::Time)];
    specs.extend(names.iter().zip(&axes).map(|(name, axis)| required(name, quantity(axis.kind))));
    let mut table = Header::read(file, &csv)?.find(&specs)?;
    while table.next_row()? {
        let stamp_ns = table.stamp_ns(TIME)?;
        for (k, axis) in axes.iter_mut().enumerate() {
            let value = table.required_number(TIME + 1 + k)?;
            if let Some(last) = axis.values.last() {
                check_step(&table, (TIME + 1 + k, axis.kind), last, AxisValue { stamp_ns, value })?;
            }
            axis.values.push(AxisValue { stamp_ns, value });
        }
    }
    if axes.iter().any(|axis| axis.values.len() < 2) {
        return Err(Error::in_file(file, Problem::NoRows));
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
    if next.stamp_ns < last.stamp_ns {
        let (previous_s, this_s) = (stamp::seconds(last.stamp_ns), stamp::seconds(next.stamp_ns));
        return Err(table.error_in(TIME, Problem::TimeRunsBackwards { previous_s, this_s }));
    }
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
    Err(table
        .error_in(column, Problem::AxisJumps { step, in_s: stamp::seconds(next.stamp_ns - last.stamp_ns) }))
}

/// Values further apart than this are not of one motion, ns.
const LONGEST_STEP_NS: i64 = 1_000_000_000;

/// Writes the values of axes that were recorded together.
///
/// # Errors
/// What the writer says.
pub(crate) fn write(mut out: impl Write, axes: &[AxisRecord]) -> std::io::Result<()> {
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
