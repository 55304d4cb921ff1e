//! `trueline scan`.

use crate::args::ScanArgs;
use crate::failure::Failure;
use crate::foxglove_view::FoxgloveView;
use crate::live_cell::{self, LiveCell};
use crate::live_page::CellPage;
use crate::live_screen::LiveScreen;
use crate::{interrupt, output, path_file, planned_scan};
use std::io::BufRead;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use trueline_cell::{ARRIVAL, CellRecording, EndedScan, RECORDING, guide_scan};
use trueline_dataset::{Error, Problem, outputs, source_file};
use trueline_live::guide::Patience;
use trueline_live::motion::{
    CheckedPath, Gate, MotionLimits, OperatorCommand, PathError, PathSummary, derive_limits, limits_file,
};
use trueline_live::{Endpoint, Guide, HostClock, LinkAddress, Protocol, RobotLink};
use trueline_mcap::NoteLevel;

/// Runs the command.
pub(crate) fn run(args: &ScanArgs) -> Result<ExitCode, Failure> {
    let poses = path_file::read(&args.path)?;
    let limits = match &args.limits {
        Some(file) => limits_file::parse(file, &limits_text(file)?)?,
        None => {
            derive_limits::limits_for(&poses, args.pace, reach_m(args)?).map_err(|e| refused(args, &e))?
        }
    };
    if let Some(file) = &args.write_limits {
        return write_limits(file, &limits);
    }
    let path = CheckedPath::new(&poses, args.pace, &limits).map_err(|e| refused(args, &e))?;
    let plan = PathSummary { path: &path, poses: &poses, limits: &limits, pace: args.pace }.to_string();
    let (true, Some(bind), Some(out)) = (args.enable_motion, args.bind, &args.out) else {
        output::data(&format!("{plan}Nothing moves: this was the dry run.{}", next_step(args)))?;
        return Ok(ExitCode::SUCCESS);
    };
    let endpoint = endpoint(bind, args)?;
    if out.join(RECORDING).exists() {
        return Err(Error::in_file(&out.join(RECORDING), Problem::AlreadyExists).into());
    }
    confirm(&plan, args)?;
    interrupt::watch()?;
    guide(endpoint, Gate::new(limits, path, args.timeout_s), out, args)
}

fn refused(args: &ScanArgs, error: &PathError) -> Failure {
    let hint = match error {
        PathError::Attitude { .. } => {
            "a path with a pass that is spun by half a turn is for the robot's own program (`trueline plan --program`); others do not jump"
        }
        PathError::TooShort { .. } | PathError::TimeStands { .. } => {
            "a path is the output of `trueline plan`, or a robot.csv with poses at rising times"
        }
        _ => {
            "plan within the limits, travel more slowly (--pace), or widen them (--write-limits shows what it takes)"
        }
    };
    Failure::new(format!("{}: {error}", path_file::file(&args.path).display()), hint)
}

/// Receives the robot at one network card.
fn endpoint(bind: SocketAddr, args: &ScanArgs) -> Result<Endpoint, Failure> {
    if bind.ip().is_unspecified() {
        return Err(Failure::new(
            "--bind 0.0.0.0: a robot is only guided through the network card that it is connected to",
            "name the address of the network card that the robot is connected to",
        ));
    }
    let address =
        LinkAddress { protocol: Protocol::Egm, bind: Some(bind), robot: args.robot, robot_port: None };
    match address.open(HostClock::start())? {
        RobotLink::Egm(endpoint) => Ok(*endpoint),
        RobotLink::Other(_) => {
            Err(Failure::new("only robots that speak EGM are guided", "see the book's page Live"))
        }
    }
}

/// Reach of the tool's load: as stated by the user, or as in the plan.
fn reach_m(args: &ScanArgs) -> Result<f64, Failure> {
    if let Some(reach_mm) = args.reach_mm {
        return Ok(reach_mm * 1e-3);
    }
    let cell = args.path.join(planned_scan::CELL);
    if !cell.exists() {
        return Ok(derive_limits::REACH_M);
    }
    Ok(planned_scan::read_files(&cell)?.cell.limits.reach_m)
}

fn limits_text(file: &Path) -> Result<String, Failure> {
    source_file::text(file).map_err(|error| {
        let hint = "`trueline scan PATH --write-limits FILE` writes limits to begin with";
        Failure::new(error.to_string(), hint)
    })
}

fn write_limits(file: &Path, limits: &MotionLimits) -> Result<ExitCode, Failure> {
    outputs::must_be_new(file)?;
    output::file(file, &limits_file::format(limits))?;
    output::words(&format!(
        "{}: the tightest limits that contain the path. Read every line: you are responsible for these limits.",
        file.display()
    ));
    Ok(ExitCode::SUCCESS)
}

fn next_step(args: &ScanArgs) -> &'static str {
    if args.limits.is_none() {
        " No limits were given: --write-limits FILE writes some to begin with."
    } else {
        " To lead the robot: --enable-motion --bind IP:PORT --robot IP --out FOLDER; --pace 0.1 first."
    }
}

/// Asks again; the typed text must be the word.
fn confirm(plan: &str, args: &ScanArgs) -> Result<(), Failure> {
    let from = args.robot.map_or_else(|| "the first sender of a valid frame".to_owned(), |ip| ip.to_string());
    output::words(&format!(
        "{plan}\nThis program is about to lead the robot ({from}). Its limits are not safety-rated. Nobody within reach,\n\
         the enabling device or emergency stop in hand, the first time at --pace 0.1?\n\
         Ctrl-C stops smoothly along the path; a second Ctrl-C falls silent at once.\n\
         Type `move` to begin:"
    ));
    let mut typed = String::new();
    let read = std::io::stdin().lock().read_line(&mut typed);
    if read.is_ok() && typed.trim() == "move" {
        return Ok(());
    }
    Err(Failure::new("not confirmed: nothing was sent", "type the word `move` to begin"))
}

/// The plan's own sensor file is beside its path.
fn sensor(args: &ScanArgs) -> Option<PathBuf> {
    let beside = args.path.join("sensor.toml");
    args.sensor.clone().or_else(|| beside.exists().then_some(beside))
}

fn guide(mut endpoint: Endpoint, gate: Gate, out: &Path, args: &ScanArgs) -> Result<ExitCode, Failure> {
    let sensor = sensor(args);
    let mut cell = LiveCell::open(&args.camera, sensor.as_deref(), endpoint.clock(), false)?;
    let view = FoxgloveView::of(&args.foxglove, "trueline scan")?;
    view.hear(&mut cell, None)?;
    let recording = CellRecording::create(cell.recording(out, &args.tool, ARRIVAL), endpoint.clock())?;
    endpoint
        .discard_waiting()
        .map_err(|error| Failure::new(format!("--bind: {error}"), "did the network go away?"))?;
    if !args.quiet {
        let (bind, armed_s) = (endpoint.local_address().map(|a| a.to_string()), args.armed_s.as_secs_f64());
        let bind = bind.unwrap_or_default();
        output::words(&format!("listening at {bind}: start the RAPID program within {armed_s:.0} s"));
    }
    let guide = Guide::new(endpoint, gate, Patience { armed: args.armed_s, hold: args.hold_s });
    let page = CellPage::of(&args.serve, "trueline scan", &cell.cell)?;
    let screen = LiveScreen::new(args.quiet);
    let ended = guide_scan(&mut cell.cell, guide, recording, command, |scan, state| {
        let robot = scan.to_string();
        screen.show(&robot, state);
        page.show(&robot, scan.robot, state);
        view.show(&scan.robot, state);
    });
    drop(screen);
    let Some(ended) = ended else {
        return Err(Failure::new(
            "the guiding thread panicked; the controller stops by its timeout",
            "please report this; the recording is kept",
        ));
    };
    if !ended.had_priority && !args.quiet {
        output::words("warning: no real-time priority (needs CAP_SYS_NICE); a busy PC may pause the scan");
    }
    let is_seen = cell.tell(&ended.camera, ended.estimate_panicked, args.quiet);
    conclude(ended, is_seen, args.quiet)
}

/// Meaning of Ctrl-C.
fn command() -> OperatorCommand {
    match interrupt::times() {
        0 => OperatorCommand::Go,
        1 => OperatorCommand::Stop,
        _ => OperatorCommand::Silence,
    }
}

fn conclude(ended: EndedScan, is_seen: bool, quiet: bool) -> Result<ExitCode, Failure> {
    let (end, well) = (format!("the scan ended: {}", ended.end(is_seen)), ended.is_well(is_seen));
    let EndedScan { recording, replies, .. } = ended;
    recording.note(if well { NoteLevel::Info } else { NoteLevel::Error }, end.clone());
    let finished = recording.finish();
    output::words(&end.replacen("the", "The", 1));
    let [median, p99, p999, all] = [0.5, 0.99, 0.999, 1.0].map(|share| replies.within_ms(share));
    let report = format!(
        "{}  answers  {}, sent within {median:.2} ms (median), {p99:.2} ms (99 %), {p999:.2} ms (99.9 %), {all:.2} ms (all)",
        finished.watch.egm.report(),
        replies.count(),
    );
    live_cell::tell_recording(&finished, &report, quiet)?;
    Ok(if well && finished.is_complete() { ExitCode::SUCCESS } else { ExitCode::from(1) })
}
