//! A log of KUKA's RSI: one `<Rob>` a cycle, as the controller sends it, as CSV.
//!
//! `RIst` is the actual pose of the active tool in the active base (mm, degrees), `IPOC` the controller's clock in ms, `EIPos` the actual
//! positions of the external axes (degrees or mm).

use super::table_text::TableText;
use crate::error::Error;
use crate::source_file;
use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};
use std::path::Path;

/// The columns of the table, beside the time.
const POSE: [&str; 6] = ["X", "Y", "Z", "A", "B", "C"];
/// The columns of external axes, where the log has them.
const EXTERNAL: [&str; 6] = ["E1", "E2", "E3", "E4", "E5", "E6"];

/// One cycle, as far as it was read.
#[derive(Default)]
struct Cycle {
    pose: [Option<String>; 6],
    external: [Option<String>; 6],
    ipoc: Option<String>,
    /// Line of its pose, or of its start.
    line: u64,
}

/// Content of a log.
struct Log {
    cycles: Vec<Cycle>,
    /// Whether there is text between the elements.
    has_other_text: bool,
}

/// Whether a file has elements `Rob` of RSI.
pub(super) fn is_rsi(bytes: &[u8]) -> bool {
    let start = String::from_utf8_lossy(&bytes[..bytes.len().min(4000)]).into_owned();
    start.contains("<Rob") && (start.contains("<RIst") || start.contains("<IPOC"))
}

/// The table: a row for each cycle.
///
/// # Errors
/// Broken XML, and a cycle without an actual pose or a clock.
pub(super) fn as_csv(file: &Path, bytes: &[u8], notes: &mut Vec<String>) -> Result<TableText, Error> {
    let Log { cycles, has_other_text } = read(file, &source_text(file, bytes)?)?;
    let clock: Vec<u64> =
        cycles.iter().filter_map(|cycle| cycle.ipoc.as_deref()?.trim().parse().ok()).collect();
    let mut steps: Vec<u64> = clock.windows(2).map(|two| two[1].saturating_sub(two[0])).collect();
    steps.sort_unstable();
    let step = steps.get(steps.len() / 2).copied().unwrap_or(0);
    notes.push(match step {
        // Simulators count cycles there.
        0 | 1 => format!("{}: RSI whose IPOC steps by {step}: it is not a clock in ms", file.display()),
        _ => format!("{}: RSI: RIst is the pose, IPOC the time in ms, in steps of {step}", file.display()),
    });
    if has_other_text {
        notes.push(format!("{}: text between the elements of RSI is ignored", file.display()));
    }
    let time = if step > 1 { "time_ms" } else { "IPOC" };
    // By the names of the controller's own variables it is a log of KUKA, whether its maker is named or not.
    let names = POSE.map(|name| format!("POS_ACT_MES.{name}"));
    // Axes that the robot does not have are in no cycle.
    let is_there = |k: &usize| cycles.iter().any(|cycle| cycle.external[*k].is_some());
    let external: Vec<usize> = (0..EXTERNAL.len()).filter(is_there).collect();
    let beside = external.iter().map(|k| EXTERNAL[*k].to_owned());
    let names: Vec<String> = names.into_iter().chain(beside).collect();
    let mut csv = format!("{time},{}\n", names.join(","));
    let mut row_lines = Vec::with_capacity(cycles.len());
    for cycle in cycles {
        let missing = |what: &str| {
            let hint =
                "RIst and IPOC must be in the SEND list of the RSI configuration; or leave this cycle out";
            let mut error = Error::unreadable(file, format!("a cycle of RSI without {what}"), hint);
            error.line = Some(cycle.line);
            error
        };
        row_lines.push(cycle.line);
        csv.push_str(cycle.ipoc.as_deref().ok_or_else(|| missing("IPOC"))?);
        for value in &cycle.pose {
            csv.push(',');
            csv.push_str(&value.as_deref().ok_or_else(|| missing("X … C of RIst"))?.replace(',', "."));
        }
        for k in &external {
            csv.push(',');
            csv.push_str(&cycle.external[*k].as_deref().unwrap_or_default().replace(',', "."));
        }
        csv.push('\n');
    }
    Ok(TableText { bytes: csv.into_bytes(), row_lines })
}

fn source_text(file: &Path, bytes: &[u8]) -> Result<String, Error> {
    source_file::expect_lines(file, bytes)?;
    Ok(crate::dialect::decode(file, bytes.to_vec())?.0)
}

fn read(file: &Path, text: &str) -> Result<Log, Error> {
    let mut reader = Reader::from_str(text);
    let (mut cycles, mut current, mut in_ipoc) = (Vec::new(), None::<Cycle>, false);
    let mut has_other_text = false;
    let (mut line, mut counted) = (1_u64, 0_usize);
    loop {
        // Of an element its beginning counts, and of broken ones that of the broken element.
        let begins = reader.buffer_position();
        let event = reader.read_event();
        let begins = if event.is_err() { reader.error_position() } else { begins };
        let at = usize::try_from(begins).unwrap_or(usize::MAX).min(text.len());
        line += text.as_bytes()[counted.min(at)..at].iter().filter(|&&byte| byte == b'\n').count() as u64;
        counted = counted.max(at);
        let broken = |why: String| {
            let mut error = Error::unreadable(
                file,
                format!("broken XML ({why})"),
                "the log is probably cut off: leave the line out",
            );
            error.line = Some(line);
            error
        };
        match event.map_err(|error| broken(error.to_string()))? {
            Event::Start(tag) | Event::Empty(tag) if tag.local_name().as_ref() == "RIst" => {
                if let Some(cycle) = &mut current {
                    (cycle.pose, cycle.line) = (attributes(&tag, POSE), line);
                }
            }
            Event::Start(tag) | Event::Empty(tag) if tag.local_name().as_ref() == "EIPos" => {
                if let Some(cycle) = &mut current {
                    cycle.external = attributes(&tag, EXTERNAL);
                }
            }
            Event::Start(tag) if tag.local_name().as_ref() == "Rob" => {
                current = Some(Cycle { line, ..Cycle::default() });
            }
            Event::Start(tag) if tag.local_name().as_ref() == "IPOC" => in_ipoc = true,
            Event::Text(words) if in_ipoc => {
                if let Some(cycle) = &mut current {
                    cycle.ipoc = Some(words.trim().to_owned());
                }
            }
            Event::Text(words) if current.is_none() => has_other_text |= !words.trim().is_empty(),
            Event::End(tag) if tag.local_name().as_ref() == "IPOC" => in_ipoc = false,
            Event::End(tag) if tag.local_name().as_ref() == "Rob" => cycles.extend(current.take()),
            Event::Eof => return Ok(Log { cycles, has_other_text }),
            _ => {}
        }
    }
}

/// The attributes of these names.
fn attributes(tag: &BytesStart<'_>, names: [&str; 6]) -> [Option<String>; 6] {
    names.map(|name| {
        let attribute = tag.attributes().flatten().find(|a| a.key.as_ref() == name)?;
        Some(attribute.value.trim().to_owned())
    })
}
