//! `sightings.csv`: camera_from_target over time or at stops, as a detector of markers or boards, or a tracker, reports it. Rotations
//! are in any form of `rotation_columns`.

use crate::error::{Error, Problem};
use crate::rotation_columns::RotationColumns;
use crate::stamp;
use crate::stop_poses::{Pairing, RowKey};
use crate::table::{ColumnSpec, Header, Table, optional, required};
use crate::unit::{MM_PER_M, Quantity};
use nalgebra::Vector3;
use std::io::Write;
use std::path::Path;
use trueline_geometry::{Pose, se3};

/// Its name in a dataset folder.
pub const FILE: &str = "sightings.csv";

const KEY: usize = 0;
const POSITION: [usize; 3] = [1, 2, 3];
const SIGMA_SHIFT: usize = 4;
const SIGMA_TURN: usize = 5;
/// First column of the rotation.
const ROTATION: usize = 6;

const PLACE: [ColumnSpec<'static>; 5] = [
    required("x", Quantity::Length),
    required("y", Quantity::Length),
    required("z", Quantity::Length),
    optional("sigma", Quantity::Length),
    optional("sigma", Quantity::Angle),
];

/// One sighting of the target.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sighting {
    /// Stamp on arrival, ns.
    pub stamp_ns: i64,
    /// Pose of the target in the camera's frame.
    pub camera_from_target: Pose,
    /// Standard deviation per axis of its rotation (rad) and of its translation (m), where recorded.
    pub sigma: Option<[f64; 2]>,
}

/// Reads sightings, by rising stamp; rows may name a stop, or the count of an encoder, in place of a stamp.
///
/// # Errors
/// Anything that is not a clean table with rising stamps and one rotation, a stop without a pose, a count beyond the encoder's log, one sigma of the
/// two.
pub(crate) fn read_at(file: &Path, bytes: &[u8], pairing: Pairing<'_>) -> Result<Vec<Sighting>, Error> {
    let header = Header::read(file, bytes)?;
    let key = RowKey::of(&header, pairing)?;
    let rotation_columns = RotationColumns::find(header.names()).map_err(|problem| header.error(problem))?;
    let specs: Vec<ColumnSpec<'_>> =
        [key.spec()].into_iter().chain(PLACE).chain(rotation_columns.specs()).collect();
    let mut table = header.find(&specs)?;
    let mut sightings: Vec<Sighting> = table.room();
    while table.next_row()? {
        let stamp_ns = key.stamp_ns(&table, KEY, sightings.last().map(|last| last.stamp_ns))?;
        let mut position = Vector3::zeros();
        for (value, column) in position.iter_mut().zip(POSITION) {
            *value = table.required_number(column)?;
        }
        let rotation = rotation_columns.read(&table, ROTATION)?;
        let camera_from_target = se3::from_parts(rotation, position);
        sightings.push(Sighting { stamp_ns, camera_from_target, sigma: read_sigma(&table)? });
    }
    sightings.sort_by_key(|sighting| sighting.stamp_ns);
    if sightings.is_empty() {
        return Err(Error::in_file(file, Problem::NoRows));
    }
    Ok(sightings)
}

fn read_sigma(table: &Table<'_>) -> Result<Option<[f64; 2]>, Error> {
    match (table.sigma(SIGMA_TURN)?, table.sigma(SIGMA_SHIFT)?) {
        (Some(turn), Some(shift)) => Ok(Some([turn, shift])),
        (None, None) => Ok(None),
        _ => Err(table.error(Problem::MissingColumn {
            name: "sigma_mm and sigma_deg, both or none,".to_owned(),
            found: "one of them".to_owned(),
        })),
    }
}

/// Writes sightings so that reading gives them back to the last nanosecond and 1e-15; standard deviations if all have them.
///
/// # Errors
/// Error of the writer.
pub fn write(mut out: impl Write, sightings: &[Sighting]) -> std::io::Result<()> {
    let keyed = sightings.iter().map(|sighting| (stamp::format_seconds(sighting.stamp_ns), sighting));
    write_rows(&mut out, "time_s", keyed, sightings.iter().all(|sighting| sighting.sigma.is_some()))
}

/// Writes sightings at stops: row k is that of stop k + 1.
///
/// # Errors
/// Error of the writer.
pub fn write_at_stops(mut out: impl Write, sightings: &[Sighting]) -> std::io::Result<()> {
    let keyed = sightings.iter().enumerate().map(|(k, sighting)| ((k + 1).to_string(), sighting));
    write_rows(&mut out, "stop", keyed, sightings.iter().all(|sighting| sighting.sigma.is_some()))
}

fn write_rows<'a>(
    out: &mut impl Write,
    key: &str,
    rows: impl Iterator<Item = (String, &'a Sighting)>,
    sigmas: bool,
) -> std::io::Result<()> {
    let names = if sigmas { ",sigma_mm,sigma_deg" } else { "" };
    writeln!(out, "{key},x_mm,y_mm,z_mm,qw,qx,qy,qz{names}")?;
    for (key, sighting) in rows {
        let p = sighting.camera_from_target.translation.vector * MM_PER_M;
        let q = sighting.camera_from_target.rotation.quaternion();
        write!(out, "{key},{},{},{},{},{},{},{}", p.x, p.y, p.z, q.w, q.i, q.j, q.k)?;
        if let (true, Some([turn, shift])) = (sigmas, sighting.sigma) {
            write!(out, ",{},{}", shift * MM_PER_M, turn.to_degrees())?;
        }
        writeln!(out)?;
    }
    Ok(())
}
