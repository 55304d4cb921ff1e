//! `stripes.csv`: the laser's stripe on each of two plates, picture by picture, as two support points of it.

use crate::error::{Error, Problem};
use crate::stamp;
use crate::table::{ColumnSpec, Table, required};
use crate::unit::Quantity;
use std::io::{Read, Write};
use std::path::Path;

const TIME: usize = 0;
const FRAME: usize = 1;
const PLATE: usize = 2;
/// Where the coordinates begin; their standard deviation follows them.
const FIRST: usize = 3;
const SIGMA: usize = 7;

const COLUMNS: [ColumnSpec; 8] = [
    required("time", Quantity::Time),
    required("frame", Quantity::Count),
    required("plate", Quantity::Count),
    required("u1", Quantity::Pixel),
    required("v1", Quantity::Pixel),
    required("u2", Quantity::Pixel),
    required("v2", Quantity::Pixel),
    required("sigma", Quantity::Pixel),
];

/// The stripe on one plate in one picture. Its line in the picture is known by two points, whose errors square to it are
/// independent of each other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlateStripe {
    /// Stamp on arrival, ns.
    pub stamp_ns: i64,
    /// Frame counter.
    pub frame: u64,
    /// Which plate, 0 or 1.
    pub plate: u32,
    /// Two points of the stripe, distorted pixels (u, v).
    pub points_px: [[f64; 2]; 2],
    /// Standard deviation of each point square to the stripe, px.
    pub sigma_px: f64,
}

/// Reads the stripes.
///
/// # Errors
/// Anything that is not a clean table of these columns with rising stamps, plates 0 and 1 and positive sigmas.
pub fn read(file: &Path, input: impl Read) -> Result<Vec<PlateStripe>, Error> {
    let mut table = Table::open(file, input, &COLUMNS)?;
    let mut stripes: Vec<PlateStripe> = Vec::new();
    while table.next_row()? {
        let at = |k: usize| table.required_number(FIRST + k);
        let plate = table.count(PLATE)?.unwrap_or_default();
        let stripe = PlateStripe {
            stamp_ns: table.stamp_ns(TIME)?,
            frame: table.count(FRAME)?.unwrap_or_default(),
            plate: u32::from(plate == 1),
            points_px: [[at(0)?, at(1)?], [at(2)?, at(3)?]],
            sigma_px: table.sigma(SIGMA)?.unwrap_or(f64::NAN),
        };
        if plate > 1 {
            return Err(table.error_in(PLATE, Problem::NotAPlate { plate }));
        }
        if let Some(last) = stripes.last()
            && stripe.stamp_ns < last.stamp_ns
        {
            let (previous_s, this_s) = (stamp::seconds(last.stamp_ns), stamp::seconds(stripe.stamp_ns));
            return Err(table.error_in(TIME, Problem::TimeRunsBackwards { previous_s, this_s }));
        }
        stripes.push(stripe);
    }
    if stripes.is_empty() {
        return Err(Error::in_file(file, Problem::NoRows));
    }
    Ok(stripes)
}

/// Writes stripes.
///
/// # Errors
/// What the writer says.
pub fn write(mut out: impl Write, stripes: &[PlateStripe]) -> std::io::Result<()> {
    writeln!(out, "time_s,frame,plate,u1_px,v1_px,u2_px,v2_px,sigma_px")?;
    for PlateStripe { stamp_ns, frame, plate, points_px: [[u1, v1], [u2, v2]], sigma_px } in stripes {
        let time_s = stamp::format_seconds(*stamp_ns);
        writeln!(out, "{time_s},{frame},{plate},{u1},{v1},{u2},{v2},{sigma_px}")?;
    }
    Ok(())
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::{PlateStripe, read, write};
    use std::path::Path;

    const HEADER: &str = "time_s,frame,plate,u1_px,v1_px,u2_px,v2_px,sigma_px";

    fn refusal(rows: &str) -> String {
        let text = format!("{HEADER}\n{rows}");
        read(Path::new("stripes.csv"), text.as_bytes()).unwrap_err().to_string()
    }

    #[test]
    fn what_is_written_is_read_again() {
        let stripe = |plate: u32| PlateStripe {
            stamp_ns: 1_700_000_000_123_456_789,
            frame: 7,
            plate,
            points_px: [[1.25, 2.5], [300.1, 40.7]],
            sigma_px: 0.031,
        };
        let mut text = Vec::new();
        write(&mut text, &[stripe(0), stripe(1)]).unwrap();
        assert!(text.starts_with(HEADER.as_bytes()));
        assert_eq!(read(Path::new("stripes.csv"), text.as_slice()).unwrap(), [stripe(0), stripe(1)]);
    }

    #[test]
    fn what_is_no_stripe_is_refused_with_its_place() {
        assert!(refusal("").contains("no data rows"));
        assert!(
            refusal("0,0,2,1,1,2,2,0.1\n").contains("line 2, column `plate`: expected plate 0 or 1, found 2")
        );
        assert!(refusal("0,0,0,1,1,2,2,0\n").contains("expected a standard deviation above zero"));
        assert!(refusal("1,0,0,1,1,2,2,1\n0,1,0,1,1,2,2,1\n").contains("time runs backwards"));
    }
}
