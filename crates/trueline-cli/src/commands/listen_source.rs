//! `trueline listen --protocol …`: robots other than ABB's.

use super::listen;
use crate::args::ListenArgs;
use crate::failure::Failure;
use crate::robot_link::Link;
use crate::{interrupt, output, source_text};
use std::io::IsTerminal;
use std::process::ExitCode;
use std::thread;
use std::time::{Duration, Instant};
use trueline_live::robot_source::{RobotSource, SourceError};
use trueline_live::{HostClock, SourceWatch};

/// Runs the command.
pub fn run(link: &Link, args: &ListenArgs) -> Result<ExitCode, Failure> {
    let duration = listen::duration(args)?;
    interrupt::watch()?;
    let mut source = link.open(HostClock::start())?;
    let (watch, refused) = hear(source.as_mut(), duration, args.quiet);
    let (report, about) = (watch.report(), source.about());
    let heard = report.robot.is_some();
    if let Some(file) = &args.json {
        output::json(file, &format!("{:#}", source_text::json(&report, &about)))?;
    }
    if !args.quiet {
        let mut text = source_text::text(&report, &about);
        if !heard {
            text.push_str(source_text::nothing(link.protocol));
        }
        output::summary(args.json.as_deref(), &text)?;
    }
    if let Some(error) = &refused {
        output::words(&format!("warning: {error}"));
    }
    Ok(if heard && refused.is_none() { ExitCode::SUCCESS } else { ExitCode::from(1) })
}

/// Listens; a robot that is not there yet, or went away, is called again. Returns what went wrong last, unless poses came after.
fn hear(source: &mut dyn RobotSource, duration: Duration, quiet: bool) -> (SourceWatch, Option<SourceError>) {
    let shows = !quiet && std::io::stderr().is_terminal();
    let (start, mut shown) = (Instant::now(), Instant::now());
    let (mut watch, mut wrong) = (SourceWatch::default(), None);
    while start.elapsed() < duration && interrupt::times() == 0 {
        let before = watch.frames();
        match source.receive(Duration::from_millis(50), &mut |packet| watch.note(packet)) {
            Ok(()) if watch.frames() > before => wrong = None,
            Ok(()) => {}
            Err(error @ SourceError::Refused { .. }) => {
                wrong = Some(error);
                break;
            }
            Err(error) => {
                wrong = Some(error);
                thread::sleep(Duration::from_millis(50));
            }
        }
        if shows && shown.elapsed() > Duration::from_millis(250) {
            shown = Instant::now();
            let left = duration.saturating_sub(start.elapsed()).as_secs_f64();
            output::status(&format!("listening, {left:.0} s left. {} poses", watch.frames()));
        }
    }
    if shows {
        output::status("");
    }
    (watch, wrong)
}
