//! The two tables.

use super::judge::Judged;
use std::collections::BTreeMap;
use trueline_method::order_statistics::quantile;
use trueline_sim::shop::{Level, Motion};

/// Levels with their cells.
type Columns = [(Level, Vec<Judged>)];

/// Answers that say more than this are counted apart, mm.
const SAYS_LITTLE_MM: f64 = 1.0;
/// An offset is wrong beyond this.
const WRONG_Z: f64 = 4.0;

pub(crate) fn print(columns: &Columns) {
    let head: Vec<&str> = columns.iter().map(|(level, _)| level.name()).collect();
    println!("| | {} |\n|---|{}", head.join(" | "), "---|".repeat(head.len()));
    row("cells", columns, |cells| cells.len().to_string());
    row("good scans accepted", columns, |cells| {
        let good: Vec<&Judged> = cells.iter().filter(|cell| cell.truth.is_good_scan()).collect();
        let accepted = good.iter().filter(|cell| cell.accepted).count();
        format!("{accepted} of {} ({:.0} %)", good.len(), 100.0 * accepted as f64 / good.len().max(1) as f64)
    });
    row("other scans accepted", columns, |cells| {
        let poor: Vec<&Judged> = cells.iter().filter(|cell| !cell.truth.is_good_scan()).collect();
        format!("{} of {}", poor.iter().filter(|cell| cell.accepted).count(), poor.len())
    });
    let ratio = |error: fn(&Judged) -> Option<f64>| {
        move |cells: &[Judged]| {
            let (of, said): (Vec<f64>, Vec<f64>) = clear(cells, error).into_iter().unzip();
            format!("{:.3} / {:.3} = {:.2}", rms(&of), rms(&said), rms(&of) / rms(&said))
        }
    };
    row("RMS true / said, mm (said < 1 mm)", columns, ratio(Judged::true_mm));
    row("strict / said", columns, ratio(|cell| cell.strict_mm));
    row("miss / said", columns, ratio(|cell| cell.miss_mm));
    row("said: 10, 50, 90 %, mm", columns, |cells| {
        let said: Vec<f64> = clear(cells, Judged::true_mm).into_iter().map(|(_, said)| said).collect();
        quantiles(&said)
    });
    row("above 2 ×, 3 × what is said", columns, |cells| {
        let pairs = accepted(cells, Judged::true_mm);
        let above = |factor: f64| pairs.iter().filter(|(of, said)| *of > factor * said).count();
        format!("{}, {} of {}", above(2.0), above(3.0), pairs.len())
    });
    row("accepted with ± of 1 mm and more (largest)", columns, |cells| {
        let vague: Vec<f64> = accepted(cells, Judged::true_mm)
            .into_iter()
            .filter_map(|(_, said)| (said >= SAYS_LITTLE_MM).then_some(said))
            .collect();
        format!("{} ({:.0} mm)", vague.len(), vague.iter().copied().fold(0.0, f64::max))
    });
    row("time offset beyond 4 of its ± (largest)", columns, |cells| {
        let z: Vec<f64> =
            cells.iter().filter(|cell| cell.accepted).filter_map(|cell| cell.offset_z).collect();
        format!(
            "{} ({:.1})",
            z.iter().filter(|z| **z > WRONG_Z).count(),
            z.iter().copied().fold(0.0, f64::max)
        )
    });
    row("95 % intervals that hold the truth: time offset, rotation, translation", columns, intervals);
    for motion in [Motion::Plan, Motion::S, Motion::Taught, Motion::Hand] {
        row(&format!("good scans accepted, motion `{}`", motion.name()), columns, |cells| {
            let of = |cell: &&Judged| cell.truth.is_good_scan() && cell.truth.motion == motion;
            let good: Vec<&Judged> = cells.iter().filter(of).collect();
            format!("{} of {}", good.iter().filter(|cell| cell.accepted).count(), good.len())
        });
    }
    println!();
    reasons(columns);
}

fn intervals(cells: &[Judged]) -> String {
    let accepted = || cells.iter().filter(|cell| cell.accepted);
    let offsets = accepted().filter_map(|cell| Some([cell.offset_z?]));
    let hand_eyes = || accepted().filter_map(|cell| cell.hand_eye_z);
    let rotations = hand_eyes().map(|z| [z[0], z[1], z[2]]);
    let translations = hand_eyes().map(|z| [z[3], z[4], z[5]]);
    format!("{}, {}, {} %", held(offsets), held(rotations), held(translations))
}

/// Half a 95 % interval in standard deviations.
const HALF_95: f64 = 1.96;

/// How many of all components are within their 95 % interval, %.
fn held<const N: usize>(of: impl Iterator<Item = [f64; N]>) -> String {
    let all: Vec<f64> = of.flatten().collect();
    let inside = all.iter().filter(|z| z.abs() < HALF_95).count();
    format!("{:.0}", 100.0 * inside as f64 / all.len().max(1) as f64)
}

/// Reasons of good scans that are refused, the most frequent first.
fn reasons(columns: &Columns) {
    let mut counts: BTreeMap<&str, Vec<usize>> = BTreeMap::new();
    for (k, (_, cells)) in columns.iter().enumerate() {
        for cell in cells.iter().filter(|cell| cell.truth.is_good_scan()) {
            for reason in &cell.reasons {
                counts.entry(reason).or_insert_with(|| vec![0; columns.len()])[k] += 1;
            }
        }
    }
    let mut sorted: Vec<(&str, Vec<usize>)> = counts.into_iter().collect();
    sorted.sort_by_key(|(_, counts)| std::cmp::Reverse(counts.iter().sum::<usize>()));
    let head: Vec<&str> = columns.iter().map(|(level, _)| level.name()).collect();
    println!("| good scans refused for | {} |\n|---|{}", head.join(" | "), "---|".repeat(head.len()));
    for (reason, counts) in sorted {
        let counts: Vec<String> = counts.iter().map(usize::to_string).collect();
        println!("| {reason} | {} |", counts.join(" | "));
    }
}

fn row(name: &str, columns: &Columns, of: impl Fn(&[Judged]) -> String) {
    let values: Vec<String> = columns.iter().map(|(_, cells)| of(cells)).collect();
    println!("| {name} | {} |", values.join(" | "));
}

/// An error of the accepted cells, and its stated ±, mm.
fn accepted(cells: &[Judged], error: fn(&Judged) -> Option<f64>) -> Vec<(f64, f64)> {
    cells.iter().filter(|cell| cell.accepted).filter_map(|cell| Some((error(cell)?, cell.said_mm?))).collect()
}

/// The same of those with a statement.
fn clear(cells: &[Judged], error: fn(&Judged) -> Option<f64>) -> Vec<(f64, f64)> {
    accepted(cells, error).into_iter().filter(|(_, said)| *said < SAYS_LITTLE_MM).collect()
}

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|value| value * value).sum::<f64>() / values.len() as f64).sqrt()
}

fn quantiles(values: &[f64]) -> String {
    let of = |part: f64| {
        quantile(values.iter().copied(), part).map_or_else(|| "-".to_owned(), |mm| format!("{mm:.2}"))
    };
    [0.1, 0.5, 0.9].map(of).join(", ")
}
