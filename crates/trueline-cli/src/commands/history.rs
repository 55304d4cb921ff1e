//! `trueline history`.

use crate::args::HistoryArgs;
use crate::failure::Failure;
use crate::output;
use std::process::ExitCode;
use trueline_watch::store::{CalibrationRow, HistoryRow};
use trueline_watch::words::{hidden, numbered};
use trueline_watch::{State, Store, history_csv, history_page};

/// Runs the command.
pub(crate) fn run(args: &HistoryArgs) -> Result<ExitCode, Failure> {
    let files = [&args.csv, &args.parquet, &args.report].map(|file| file.as_deref());
    output::expect_files(&[&args.state], &files)?;
    let store = Store::open_to_read(&args.state)?;
    let calibrations = store.calibrations()?;
    let wanted = args.calibration.map_or_else(|| store.in_use(), |id| Ok(Some(id)))?;
    let chosen = calibrations.iter().find(|row| Some(row.id) == wanted);
    let Some(chosen) = chosen else {
        return Err(Failure::new(
            format!("{}: does not contain this calibration", args.state.display()),
            format!("there are {}; `trueline watch` adds them", calibrations.len()),
        ));
    };
    let history = store.history(chosen.id, args.last)?;
    let repaired = store.reported_repair(chosen.id)?;
    if let Some(file) = &args.csv {
        output::json(file, &history_csv::csv(&history))?;
    }
    if let Some(file) = &args.parquet {
        output::file(file, &parquet(&history)?)?;
    }
    if let Some(file) = &args.report {
        let title = format!("{} by {}", args.state.display(), chosen.name);
        output::file(file, &history_page::html(&history, repaired, &title, &output::command_line()))?;
    }
    if !args.quiet {
        calibrations.iter().for_each(|row| output::words(&text(row, row.id == chosen.id)));
        output::words(&state(&store, &history, repaired)?);
        if let Some(last) = history.last() {
            output::words(&format!("blind to: {}", hidden(&last.blind_to)));
        }
    }
    Ok(ExitCode::SUCCESS)
}

/// The state of the calibration in use, and its words.
#[cfg(feature = "ros2")]
pub(crate) fn verdict(file: &std::path::Path) -> Result<(State, String), Failure> {
    let store = Store::open_to_read(file)?;
    let Some(id) = store.in_use()? else { return Ok((State::Good, "no weld was watched".to_owned())) };
    let history = store.history(id, 1)?;
    let repaired = store.reported_repair(id)?;
    let last = history.last().filter(|_| repaired.is_none());
    Ok((last.map_or(State::Good, HistoryRow::state), state(&store, &history, repaired)?))
}

/// The state after the last weld, with its size and the remedy.
fn state(store: &Store, history: &[HistoryRow], repaired: Option<i64>) -> Result<String, Failure> {
    if let Some(before) = repaired {
        return Ok(format!("A repair before weld {before} is reported. The next welds will show it."));
    }
    let Some((last, alarm)) = history.last().and_then(|row| Some((row, row.alarm.as_ref()?))) else {
        return Ok("no change seen".to_owned());
    };
    let word = if last.state() == State::Alarm { "alarm" } else { "changed within the tolerance" };
    let text = match &alarm.text {
        Some(text) => text.clone(),
        None => format!("since {}", since(store, alarm.since)?),
    };
    Ok(format!("{word}: {}: {text}", alarm.kind))
}

/// A weld by its number and its name, if that is still kept.
fn since(store: &Store, number: i64) -> Result<String, Failure> {
    Ok(match store.name(number)? {
        Some(name) => numbered(number, &name),
        None => format!("weld {number}"),
    })
}

#[cfg(feature = "parquet")]
fn parquet(history: &[HistoryRow]) -> Result<Vec<u8>, Failure> {
    let bytes = trueline_watch::history_parquet::bytes(history);
    bytes.map_err(|error| {
        Failure::new(
            format!("the table cannot be written: {error}"),
            "please report this; --csv has the same",
        )
    })
}

#[cfg(not(feature = "parquet"))]
fn parquet(_: &[HistoryRow]) -> Result<Vec<u8>, Failure> {
    Err(Failure::new(
        "--parquet: this program was built without it",
        format!("--csv has the same; {}", crate::args::left_out::how_to_build()),
    ))
}

fn text(row: &CalibrationRow, chosen: bool) -> String {
    let mark = if chosen { "*" } else { " " };
    format!(
        "{mark} calibration {}: {}, time offset {:.3} ms, {} welds",
        row.id,
        row.name,
        row.time_offset_s * 1e3,
        row.welds
    )
}
