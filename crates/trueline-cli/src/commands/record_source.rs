//! `trueline record --protocol …`: robots other than ABB's.

use super::record::SILENCE;
use crate::args::{ProtocolName, RecordArgs};
use crate::failure::Failure;
use crate::live_cell::{self, LiveCell};
use crate::live_screen::LiveScreen;
use crate::robot_link::Link;
use crate::{interrupt, output, source_text};
use std::process::ExitCode;
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread;
use std::time::{Duration, Instant};
use trueline_cell::{ARRIVAL, CellRecording, FinishedRecording, READING};
use trueline_live::robot_source::{RobotSource, SourceAbout, SourceError};
use trueline_live::{HostClock, SequenceStatus};
use trueline_mcap::NoteLevel;

/// Runs the command.
pub fn run(link: &Link, args: &RecordArgs, longest: Duration) -> Result<ExitCode, Failure> {
    interrupt::watch()?;
    let clock = HostClock::start();
    let mut source = link.open(clock)?;
    let mut cell = LiveCell::open(&args.camera, args.sensor.as_deref(), clock, true)?;
    let stamps = if link.protocol == ProtocolName::UrRtde { READING } else { ARRIVAL };
    let mut recording = CellRecording::create(cell.recording(&args.out, &args.tool, stamps), clock)?;
    let (handle, poses) = (recording.handle(), AtomicU64::new(0));
    let screen = LiveScreen::new(args.quiet);
    let outcome = cell.cell.run(
        &handle,
        |_| hear(source.as_mut(), &mut recording, longest, &poses),
        |state| screen.show(&format!("robot: {} poses", poses.load(Ordering::Relaxed)), state),
    );
    drop(screen);
    let about = source.about();
    recording.note(NoteLevel::Info, spoken(&about));
    let finished = recording.finish();
    let refused = outcome.robot.unwrap_or_else(|| Some("the recording thread panicked".to_owned()));
    if let Some(why) = &refused {
        output::words(&format!("warning: {why}; the recording is kept"));
    }
    let seen = cell.tell(&outcome.camera, outcome.estimate_panicked, args.quiet);
    conclude(&finished, &about, refused.is_none() && seen, args.quiet)
}

fn spoken(about: &SourceAbout) -> String {
    let controller = about.controller.as_deref().unwrap_or("controller unknown");
    let mut text =
        format!("robot: {}, {controller}; poses: {}; clock: {}", about.protocol, about.pose, about.clock);
    for note in &about.notes {
        text.push_str("; ");
        text.push_str(note);
    }
    text
}

/// Hears until told to stop, until time is up, or until the robot has ended. A lost connection is made anew, and is a note in
/// the recording. Returns why the robot cannot be listened to, if it cannot.
fn hear(
    source: &mut dyn RobotSource,
    recording: &mut CellRecording,
    longest: Duration,
    poses: &AtomicU64,
) -> Option<String> {
    let (start, mut changed, mut lost) = (Instant::now(), Instant::now(), false);
    while start.elapsed() < longest && interrupt::times() == 0 && !recording.has_failed() {
        let before = recording.source().frames();
        let received = source.receive(Duration::from_millis(20), &mut |packet| {
            if let Ok((_, SequenceStatus::First)) = packet.judged {
                recording.note(NoteLevel::Info, format!("the stream of {} begins", packet.from));
            }
            recording.packet(packet);
        });
        recording.tick();
        let frames = recording.source().frames();
        poses.store(frames, Ordering::Relaxed);
        if frames > before {
            (changed, lost) = (Instant::now(), false);
        }
        match received {
            Ok(()) => {}
            Err(error @ SourceError::Refused { .. }) => return Some(error.to_string()),
            Err(error) => {
                if !std::mem::replace(&mut lost, true) {
                    recording.note(NoteLevel::Warning, error.to_string());
                }
                thread::sleep(Duration::from_millis(20));
            }
        }
        if frames > 0 && longest == Duration::MAX && changed.elapsed() > SILENCE {
            break;
        }
    }
    None
}

fn conclude(
    finished: &FinishedRecording,
    about: &SourceAbout,
    well: bool,
    quiet: bool,
) -> Result<ExitCode, Failure> {
    let report = finished.source.report();
    live_cell::tell_recording(finished, quiet);
    if !quiet {
        match output::data(&source_text::text(&report, about)) {
            // Whoever reads our output may be gone: what became of the recording is told by the exit code all the same.
            Ok(()) | Err(Failure::BrokenPipe) => {}
            Err(other) => return Err(other),
        }
        output::words(&format!("written to {}", finished.file.display()));
    }
    if report.robot.is_none() {
        output::words("no robot was heard: `trueline listen` says why");
    }
    let well = well && report.robot.is_some() && finished.is_complete();
    Ok(if well { ExitCode::SUCCESS } else { ExitCode::from(1) })
}
