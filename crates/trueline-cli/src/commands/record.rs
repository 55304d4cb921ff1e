//! `trueline record`.

use crate::args::RecordArgs;
use crate::failure::Failure;
use crate::foxglove_view::FoxgloveView;
use crate::live_cell::{self, LiveCell};
use crate::live_page::CellPage;
use crate::live_screen::LiveScreen;
use crate::live_watch::LiveWatch;
use crate::service::{Rounds, Service};
use crate::{interrupt, output};
use std::process::ExitCode;
use std::sync::Mutex;
use trueline_cell::{CellRecording, RobotBrief, Until, record_robot};
use trueline_live::HostClock;

/// Runs the command.
pub(crate) fn run(args: &RecordArgs) -> Result<ExitCode, Failure> {
    args.link.check()?;
    interrupt::watch()?;
    let clock = HostClock::start();
    let mut cell = LiveCell::open(&args.camera, args.sensor.as_deref(), clock, true)?;
    let view = FoxgloveView::of(&args.foxglove, "trueline record")?;
    view.hear(&mut cell, args.calibration.as_deref())?;
    let mut watched = LiveWatch::of(args, &mut cell, &view)?;
    let page = CellPage::of(&args.serve, "trueline record", &cell.cell)?;
    let mut link = args.link.open(clock)?;
    let mut recording =
        CellRecording::create(cell.recording(&args.out, &args.tool, args.link.stamps()), clock)?;
    let (handle, shown) = (recording.handle(), Mutex::new(RobotBrief::default()));
    // The thread that records asks each time round.
    let rounds = Rounds::default();
    let stop = || rounds.one() && interrupt::times() > 0;
    let until = Until { longest: args.for_s, stop: &stop };
    let mut service = Service::ready("records a robot");
    let screen = LiveScreen::new(args.quiet);
    let outcome = cell.cell.run(
        &handle,
        |_| record_robot(&mut link, &mut recording, &until, &shown),
        |state| {
            let brief = shown.lock().map(|brief| *brief).unwrap_or_default();
            let robot = brief.to_string();
            screen.show(&robot, state);
            page.show(&robot, brief, state);
            view.show(&brief, state);
            if rounds.have_grown() {
                service.alive();
            }
            if let Some(watched) = &mut watched {
                watched.look(false);
            }
        },
    );
    drop(screen);
    let wrong = match outcome.robot {
        Some(wrong) => wrong.map(|error| error.to_string()),
        None => Some("the recording thread panicked".to_owned()),
    };
    if let Some(why) = &wrong {
        output::words(&format!("warning: {why}; the recording is kept"));
    }
    let finished = recording.finish();
    let seen = cell.tell(&outcome.camera, outcome.estimate_panicked, args.quiet);
    let report = finished.watch.report(&link);
    live_cell::tell_recording(&finished, &report.to_string(), args.quiet)?;
    if !report.has_robot() {
        output::words("no robot was heard: `trueline listen` shows why");
    }
    let heavy_loss = report.heavy_loss();
    if let Some(part) = heavy_loss {
        output::words(&format!(
            "warning: {:.0} % packet loss from the robot; check the load of this PC and of the network",
            100.0 * part
        ));
    }
    let is_good = watched.map_or(Ok(true), LiveWatch::finish)?;
    let is_heard = report.has_robot() && heavy_loss.is_none();
    let well = is_good && wrong.is_none() && seen && is_heard && finished.is_complete();
    Ok(if well { ExitCode::SUCCESS } else { ExitCode::from(1) })
}
