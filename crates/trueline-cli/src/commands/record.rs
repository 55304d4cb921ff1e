//! `trueline record`.

use super::{listen, record_source};
use crate::args::{ProtocolName, RecordArgs};
use crate::failure::Failure;
use crate::live_cell::{self, LiveCell};
use crate::live_screen::LiveScreen;
use crate::{interrupt, link_text, output};
use std::process::ExitCode;
use std::sync::Mutex;
use std::time::{Duration, Instant};
use trueline_cell::{ARRIVAL, CellRecording, FinishedRecording};
use trueline_live::link_watch::Brief;
use trueline_live::{Endpoint, HostClock};

/// A robot that says nothing for so long has ended its program.
pub const SILENCE: Duration = Duration::from_secs(5);

/// Runs the command.
pub fn run(args: &RecordArgs) -> Result<ExitCode, Failure> {
    let longest = match args.for_s.map(Duration::try_from_secs_f64).transpose() {
        Ok(longest) if longest != Some(Duration::ZERO) => longest.unwrap_or(Duration::MAX),
        _ => {
            return Err(Failure::new(
                "--for-s: expected a number of seconds above 0",
                "for example --for-s 60",
            ));
        }
    };
    let link = args.link.link();
    if link.protocol != ProtocolName::Egm {
        return record_source::run(&link, args, longest);
    }
    let bind = link.bind()?;
    interrupt::watch()?;
    let clock = HostClock::start();
    let sensor = args.sensor.as_deref();
    let mut cell = LiveCell::open(&args.camera, sensor, clock, true)?;
    let mut endpoint = listen::bind(bind, link.robot, clock)?;
    let mut recording = CellRecording::create(cell.recording(&args.out, &args.tool, ARRIVAL), clock)?;
    let handle = recording.handle();
    let shown = Mutex::new(Brief::default());
    let screen = LiveScreen::new(args.quiet);
    let outcome = cell.cell.run(
        &handle,
        |_| hear(&mut endpoint, &mut recording, longest, &shown),
        |state| {
            let line = shown.lock().map(|brief| link_text::brief(&brief)).unwrap_or_default();
            screen.show(&line, state);
        },
    );
    drop(screen);
    let heard = outcome.robot.unwrap_or_else(|| Err(std::io::Error::other("the recording thread panicked")));
    let finished = recording.finish();
    if let Err(error) = &heard {
        output::words(&format!("warning: {}: {error}; the recording is kept", bind));
    }
    let seen = cell.tell(&outcome.camera, outcome.estimate_panicked, args.quiet);
    conclude(&finished, heard.is_ok() && seen, args.quiet)
}

/// Hears until told to stop, until time is up, or until the robot has ended; the camera may be gone meanwhile.
fn hear(
    endpoint: &mut Endpoint,
    recording: &mut CellRecording,
    longest: Duration,
    shown: &Mutex<Brief>,
) -> std::io::Result<()> {
    let start = Instant::now();
    let (mut frames, mut changed) = (0, Instant::now());
    while start.elapsed() < longest && interrupt::times() == 0 && !recording.has_failed() {
        endpoint.receive(Duration::from_millis(20), |heard| recording.datagram(heard))?;
        recording.tick();
        let brief = recording.watch().brief();
        if brief.frames != frames {
            (frames, changed) = (brief.frames, Instant::now());
        }
        if frames > 0 && longest == Duration::MAX && changed.elapsed() > SILENCE {
            break;
        }
        // Whoever displays may hold it; then the next look will do.
        if let Ok(mut shown) = shown.try_lock() {
            *shown = brief;
        }
    }
    Ok(())
}

/// Says what became of a recording; 0 if all is well.
fn conclude(finished: &FinishedRecording, well: bool, quiet: bool) -> Result<ExitCode, Failure> {
    let report = finished.watch.report();
    live_cell::tell_recording(finished, quiet);
    if !quiet {
        match output::data(&link_text::text(&report)) {
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
