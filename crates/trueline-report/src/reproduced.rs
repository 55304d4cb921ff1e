//! The paper's experiments as tables: markdown for reading, CSV for other programs.

use std::fmt::Write;
use trueline::evaluate::Figures;
use trueline_dataset::unit::MM_PER_M;
use trueline_experiments::published::{self, TABLE_I};
use trueline_experiments::{Reproduction, Step, Track, WeldErrors};

/// All tables as markdown.
#[must_use]
pub fn markdown(r: &Reproduction) -> String {
    let mut out = String::from("# The paper's experiments, simulated\n\n");
    // Writing to a String cannot fail.
    let _ = writeln!(
        out,
        "Made by `trueline reproduce` {}, seed {}, {} repeats. Everything here is simulated with known truth, except rows \
         marked *published*, which are Yang et al. 2025.\n",
        env!("CARGO_PKG_VERSION"),
        r.settings.seed,
        r.settings.repeats
    );
    convergence(&mut out, r);
    for weld in &r.welds {
        weld_table(&mut out, r, weld);
    }
    speeds(&mut out, r);
    out
}

fn convergence(out: &mut String, r: &Reproduction) {
    let _ = writeln!(out, "## Straight-weld calibration (Figs. 6 to 8)\n");
    let _ = writeln!(
        out,
        "From the paper's start: time offset 0, hand-eye 3.7 mm and 1.7° off. True offset {:.2} ms.\n",
        r.truth.time_offset_s * 1e3
    );
    let _ = writeln!(
        out,
        "| method | steps | time offset, ms | RMS from the line, mm | hand-eye translation off by, mm | rotation off by, ° |"
    );
    let _ = writeln!(out, "|---|---|---|---|---|---|");
    for track in &r.convergence {
        let Some(end) = track.steps.last() else { continue };
        let (shift_mm, turn_deg) = off_by(end, &r.truth);
        let _ = writeln!(
            out,
            "| {} | {} | {:.3} | {} | {shift_mm:.3} | {turn_deg:.3} |",
            track.name,
            track.steps.len() - 1,
            end.time_offset_s * 1e3,
            rms(end)
        );
    }
    let _ = writeln!(
        out,
        "| *published* (Fig. 6, real scan) | about 45 | {:.2} | {:.5} | < {:.2} | – |\n",
        published::TIME_OFFSET_S * 1e3,
        published::RMSE_M * MM_PER_M,
        published::TRANSLATION_ERROR_M * MM_PER_M
    );
}

/// How far a step is from the truth: mm and degrees.
#[must_use]
pub fn off_by(step: &Step, truth: &Step) -> (f64, f64) {
    let (a, b) = (&step.tool_from_camera, &truth.tool_from_camera);
    let shift = (a.translation.vector - b.translation.vector).norm() * MM_PER_M;
    (shift, a.rotation.angle_to(&b.rotation).to_degrees())
}

fn rms(step: &Step) -> String {
    step.rms_m.map_or_else(|| "no point left".to_owned(), |m| format!("{:.4}", m * MM_PER_M))
}

fn weld_table(out: &mut String, r: &Reproduction, weld: &WeldErrors) {
    let round = weld.kind == trueline_experiments::WeldKind::Round;
    let title =
        if round { "C-type weld, radius 600 mm (Fig. 10, Table I)" } else { "Straight weld (Fig. 9)" };
    let _ = writeln!(out, "## {title}\n");
    let _ = writeln!(
        out,
        "Scanned at {:.0} mm/s{}, offset {:.2} ms. *Position*: measured point against where it truly is (the paper's static \
         ground truth). *From the weld*: distance from its curve, which an error along the weld does not change. RMSE / MAE / \
         largest, mm, over {} repeats; in brackets the RMSE of the best and of the worst repeat.\n",
        weld.speed_m_s * MM_PER_M,
        if round {
            " (not published; the speed at which 17.73 ms make Table I's error)"
        } else {
            ", weaving ± 20 mm at 0.75 Hz"
        },
        r.truth.time_offset_s * 1e3,
        r.settings.repeats
    );
    let _ = writeln!(out, "| | position | | from the weld |");
    let _ = writeln!(out, "|---|---|---|---|");
    for row in &weld.rows {
        let [low, high] = row.position_range_m.map(|m| m * MM_PER_M);
        let _ = writeln!(
            out,
            "| {} | {} | [{low:.3} … {high:.3}] | {} |",
            row.name,
            three(&row.position),
            three(&row.from_curve)
        );
    }
    if round {
        for row in TABLE_I {
            let remark = if row.remark.is_empty() { String::new() } else { format!(" ({})", row.remark) };
            let _ = writeln!(
                out,
                "| *published*: {}{remark} | {:.3} / {:.3} / – | | |",
                row.method,
                row.rmse_m * MM_PER_M,
                row.mae_m * MM_PER_M
            );
        }
    }
    let _ = writeln!(out);
}

fn three(f: &Figures) -> String {
    format!("{:.3} / {:.3} / {:.3}", f.rmse_m * MM_PER_M, f.mae_m * MM_PER_M, f.max_m * MM_PER_M)
}

fn speeds(out: &mut String, r: &Reproduction) {
    let _ = writeln!(out, "## Speed and time offset\n");
    let _ = writeln!(
        out,
        "RMSE of positions on a straight weld of 300 mm, mm: without temporal calibration → with trueline's.\n"
    );
    let mut header = String::from("| speed |");
    for offset_s in &r.settings.offsets_s {
        let _ = write!(header, " {:.0} ms |", offset_s * 1e3);
    }
    let _ = writeln!(out, "{header}\n|---|{}", "---|".repeat(r.settings.offsets_s.len()));
    for row in r.speeds.cells.chunks(r.settings.offsets_s.len()) {
        let _ = write!(out, "| {:.0} mm/s |", row[0].speed_m_s * MM_PER_M);
        for cell in row {
            let _ = write!(out, " {:.3} → {:.3} |", cell.without_m * MM_PER_M, cell.with_m * MM_PER_M);
        }
        let _ = writeln!(out);
    }
}

/// Every step of every method, as CSV.
#[must_use]
pub fn convergence_csv(tracks: &[Track]) -> String {
    let mut out = String::from(
        "method,step,time_offset_ms,rms_mm,x_mm,y_mm,z_mm,qw,qx,qy,qz,moment_x_mm,moment_y_mm,moment_z_mm,direction_x,direction_y,direction_z\n",
    );
    for track in tracks {
        for (k, step) in track.steps.iter().enumerate() {
            let t = step.tool_from_camera.translation.vector * MM_PER_M;
            let q = crate::number::positive_w(&step.tool_from_camera.rotation);
            let (n, v) = (step.line.moment * MM_PER_M, step.line.direction);
            let rms = step.rms_m.map_or_else(String::new, |m| (m * MM_PER_M).to_string());
            let _ = writeln!(
                out,
                "\"{}\",{k},{},{rms},{},{},{},{},{},{},{},{},{},{},{},{},{}",
                track.name,
                step.time_offset_s * 1e3,
                t.x,
                t.y,
                t.z,
                q[0],
                q[1],
                q[2],
                q[3],
                n.x,
                n.y,
                n.z,
                v.x,
                v.y,
                v.z
            );
        }
    }
    out
}

/// Every row of every weld's table, published ones too, as CSV.
#[must_use]
pub fn welds_csv(welds: &[WeldErrors]) -> String {
    let mut out = String::from("weld,method,source,error,rmse_mm,mae_mm,max_mm\n");
    for weld in welds {
        for row in &weld.rows {
            for (error, f) in [("position", &row.position), ("from the weld", &row.from_curve)] {
                let _ = writeln!(
                    out,
                    "{},\"{}\",simulated,{error},{},{},{}",
                    weld.kind.name(),
                    row.name,
                    f.rmse_m * MM_PER_M,
                    f.mae_m * MM_PER_M,
                    f.max_m * MM_PER_M
                );
            }
        }
    }
    for row in TABLE_I {
        let (rmse, mae) = (row.rmse_m * MM_PER_M, row.mae_m * MM_PER_M);
        let _ = writeln!(out, "C-type weld,\"{}\",published,position,{rmse:.3},{mae:.3},", row.method);
    }
    out
}

/// The first repeat's points of a weld, as CSV.
#[must_use]
pub fn points_csv(weld: &WeldErrors) -> String {
    let mut out = String::from(
        "along_mm,x_mm,y_mm,z_mm,with_x_mm,with_y_mm,with_z_mm,without_x_mm,without_y_mm,without_z_mm\n",
    );
    for point in &weld.points {
        let numbers = [point.truth_m, point.with_offset_m, point.without_offset_m];
        let _ = write!(out, "{}", point.along_m * MM_PER_M);
        for v in numbers.iter().map(|v| v * MM_PER_M) {
            let _ = write!(out, ",{},{},{}", v.x, v.y, v.z);
        }
        out.push('\n');
    }
    out
}

/// The table of speeds and offsets as CSV.
#[must_use]
pub fn speeds_csv(r: &Reproduction) -> String {
    let mut out = String::from("speed_mm_s,time_offset_ms,without_rmse_mm,with_rmse_mm\n");
    for c in &r.speeds.cells {
        let _ = writeln!(
            out,
            "{},{},{},{}",
            c.speed_m_s * MM_PER_M,
            c.offset_s * 1e3,
            c.without_m * MM_PER_M,
            c.with_m * MM_PER_M
        );
    }
    out
}
