//! Effect of an offset at a speed, and the rest of it after calibration.

use crate::settings::Settings;
use nalgebra::Vector3;
use trueline_dataset::Guess;
use trueline_method::evaluate::evaluation::Figures;
use trueline_method::{Config, Error, calibrate, evaluate::seam_points};
use trueline_sim::scenario::Sine;
use trueline_sim::{KnownScan, Weld, WeldScan, scan_weld, simulate};

/// RMSE of positions at one speed and offset.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cell {
    /// Speed along the weld, m/s.
    pub speed_m_s: f64,
    /// Time offset, s.
    pub offset_s: f64,
    /// Without temporal calibration, m.
    pub without_m: f64,
    /// With it, m.
    pub with_m: f64,
}

/// All of them, speed by speed.
#[derive(Clone, Debug, PartialEq)]
pub struct SpeedTable {
    /// Cells, offsets running fastest.
    pub cells: Vec<Cell>,
}

/// Length of the weld, m.
const LENGTH_M: f64 = 0.3;

/// Calibrates once for each offset, and scans a straight weld at each speed.
///
/// # Errors
/// Error of a calibration.
pub fn run(settings: &Settings) -> Result<SpeedTable, Error> {
    let mut scenario = settings.scenario();
    let weld = Weld::Straight(*scenario.cell.lines.first().ok_or(Error::NoStart)?);
    let mut cells = Vec::new();
    for &offset_s in &settings.offsets_s {
        scenario.timing.time_offset_s = offset_s;
        let recording = simulate(&scenario, settings.seed).ok_or(Error::NoStart)?;
        let calibration = calibrate(&recording, None, &Config::default())?;
        let found = calibration.best_fit();
        let calibrated =
            Guess { time_offset_s: found.time_offset_s, tool_from_camera: found.tool_from_camera };
        for &speed_m_s in &settings.speeds_m_s {
            let scan = WeldScan { weld: weld.clone(), length_m: LENGTH_M, speed_m_s, weave: Sine::default() };
            let known = scan_weld(&scenario, &scan, settings.seed + 2000);
            cells.push(Cell {
                speed_m_s,
                offset_s,
                with_m: rmse_m(&known, &calibrated)?,
                without_m: rmse_m(&known, &Guess { time_offset_s: 0.0, ..calibrated })?,
            });
        }
    }
    cells.sort_by(|a, b| a.speed_m_s.total_cmp(&b.speed_m_s).then(a.offset_s.total_cmp(&b.offset_s)));
    Ok(SpeedTable { cells })
}

fn rmse_m(known: &KnownScan, by: &Guess) -> Result<f64, Error> {
    let placed = seam_points::place(&known.recording, by, &Config::default())?;
    let error =
        |p: &seam_points::SeamPoint| -> Vector3<f64> { p.point_in_base - known.truth[p.row as usize] };
    Ok(Figures::of(placed.list.iter().map(error)).rmse_m)
}
