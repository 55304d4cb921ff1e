//! `trueline record`.

use super::listen;
use crate::args::RecordArgs;
use crate::failure::Failure;
use crate::live_recording::{Finished, LiveRecording};
use crate::{interrupt, link_text, output};
use std::io::IsTerminal;
use std::process::ExitCode;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};
use trueline_live::Endpoint;
use trueline_live::link_watch::Brief;

/// A robot that says nothing for so long has ended its program.
const SILENCE: Duration = Duration::from_secs(5);

/// Runs the command.
pub fn run(args: &RecordArgs) -> Result<ExitCode, Failure> {
    let longest = match args.for_s.map(Duration::try_from_secs_f64).transpose() {
        Ok(longest) => longest.unwrap_or(Duration::MAX),
        Err(_) => {
            return Err(Failure::new(
                "--for-s: expected a number of seconds above 0",
                "for example --for-s 60",
            ));
        }
    };
    interrupt::watch()?;
    let mut endpoint = listen::bind(args.link.bind, args.link.robot)?;
    let mut recording =
        LiveRecording::create(&args.out, args.sensor.as_deref(), &args.tool, endpoint.clock())?;
    let shared = Shared::default();
    let heard = thread::scope(|scope| {
        let hearing = scope.spawn(|| {
            let heard = hear(&mut endpoint, &mut recording, longest, &shared);
            shared.over.store(true, Ordering::SeqCst);
            heard
        });
        show(&shared, args.quiet);
        hearing.join().unwrap_or_else(|_| Err(std::io::Error::other("the recording thread panicked")))
    });
    let finished = recording.finish();
    if let Err(error) = &heard {
        output::words(&format!("warning: {}: {error}; the recording is kept", args.link.bind));
    }
    conclude(&finished, heard.is_ok(), args.quiet)
}

/// What the thread that hears shows to the one that displays.
#[derive(Default)]
struct Shared {
    brief: Mutex<Brief>,
    over: AtomicBool,
}

/// Hears until told to stop, until time is up, or until the robot has ended.
fn hear(
    endpoint: &mut Endpoint,
    recording: &mut LiveRecording,
    longest: Duration,
    shared: &Shared,
) -> std::io::Result<()> {
    let start = Instant::now();
    let (mut frames, mut changed) = (0, Instant::now());
    while start.elapsed() < longest && interrupt::times() == 0 && recording.failure().is_none() {
        endpoint.hear(Duration::from_millis(20), |heard| recording.heard(heard))?;
        recording.tick();
        let brief = recording.watch().brief();
        if brief.frames != frames {
            (frames, changed) = (brief.frames, Instant::now());
        }
        if frames > 0 && longest == Duration::MAX && changed.elapsed() > SILENCE {
            break;
        }
        // Whoever displays may hold it; then the next look will do.
        if let Ok(mut shown) = shared.brief.try_lock() {
            *shown = brief;
        }
    }
    Ok(())
}

fn show(shared: &Shared, quiet: bool) {
    let shows = !quiet && std::io::stderr().is_terminal();
    while !shared.over.load(Ordering::SeqCst) {
        thread::sleep(Duration::from_millis(100));
        if shows {
            let brief = shared.brief.lock().map(|brief| *brief).unwrap_or_default();
            output::status(&format!("recording: {}. Ctrl-C ends it", link_text::brief(&brief)));
        }
    }
    if shows {
        output::status("");
    }
}

/// Says what became of a recording; 0 if all is well.
fn conclude(finished: &Finished, heard: bool, quiet: bool) -> Result<ExitCode, Failure> {
    let report = finished.watch.report();
    finished.tell(quiet);
    if !quiet {
        output::data(&link_text::text(&report))?;
        output::words(&format!("written to {}", finished.file.display()));
    }
    if report.robot.is_none() {
        output::words("no robot was heard: `trueline listen` says why");
    }
    let well = heard && report.robot.is_some() && finished.losses.is_empty();
    Ok(if well { ExitCode::SUCCESS } else { ExitCode::from(1) })
}
