//! `trueline scan`.

use super::listen;
use crate::args::ScanArgs;
use crate::failure::Failure;
use crate::live_cell::{self, LiveCell};
use crate::live_screen::LiveScreen;
use crate::{interrupt, link_text, output, path_file, planned_scan, priority};
use std::fmt::Write as _;
use std::io::BufRead;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;
use trueline_cell::{ARRIVAL, CellOutcome, CellRecording, RECORDING};
use trueline_dataset::{Error, Problem, RobotSample};
use trueline_live::guide::{Answer, Observer, Outcome, Patience};
use trueline_live::link_watch::Brief;
use trueline_live::motion::{
    CheckedPath, EndReason, Gate, GateState, MotionLimits, OperatorCommand, PathError, Phase, derive_limits,
    limits::FASTEST_M_S, limits_file,
};
use trueline_live::{Guide, HostClock, Received, ReplyTimes};
use trueline_mcap::NoteLevel;

/// Runs the command.
pub fn run(args: &ScanArgs) -> Result<ExitCode, Failure> {
    check(args)?;
    let poses = path_file::read(&args.path)?;
    let refused = |error: PathError| {
        let hint = match error {
            PathError::TooShort { .. } | PathError::TimeStands { .. } | PathError::Attitude { .. } => {
                "a path is what `trueline plan` writes, or a robot.csv with poses at rising times"
            }
            _ => {
                "plan within the limits, travel more slowly (--pace), or widen them (--write-limits shows what it takes)"
            }
        };
        Failure::new(format!("{}: {error}", path_file::file(&args.path).display()), hint)
    };
    let limits = match &args.limits {
        Some(file) => limits_file::parse(file, &limits_text(file)?)?,
        None => derive_limits::limits_for(&poses, args.pace, reach_m(args)?).map_err(refused)?,
    };
    if let Some(file) = &args.write_limits {
        return write_limits(file, &limits);
    }
    let path = CheckedPath::new(&poses, args.pace, &limits).map_err(refused)?;
    let plan = plan(&path, &poses, &limits, args);
    let (true, Some(bind), Some(out)) = (args.enable_motion, args.bind, &args.out) else {
        output::data(&format!("{plan}Nothing moves: this was the dry run.{}", next_step(args)))?;
        return Ok(ExitCode::SUCCESS);
    };
    let mut endpoint = listen::bind(bind, args.robot, HostClock::start())?;
    if out.join(RECORDING).exists() {
        return Err(Error::in_file(&out.join(RECORDING), Problem::AlreadyExists).into());
    }
    confirm(&plan, args)?;
    interrupt::watch()?;
    let sensor = sensor(args);
    let mut cell = LiveCell::open(&args.camera, sensor.as_deref(), endpoint.clock(), false)?;
    let recording = CellRecording::create(cell.recording(out, &args.tool, ARRIVAL), endpoint.clock())?;
    endpoint
        .discard_waiting()
        .map_err(|error| Failure::new(format!("{bind}: {error}"), "did the network go away?"))?;
    let gate = Gate::new(limits, path, args.timeout_s);
    let patience =
        Patience { armed: Duration::from_secs_f64(args.armed_s), hold: Duration::from_secs_f64(args.hold_s) };
    let guide = Guide::new(endpoint, gate, patience);
    if !args.quiet {
        output::words(&format!("listening at {bind}: start the RAPID program within {:.0} s", args.armed_s));
    }
    lead(guide, recording, &mut cell, args)
}

fn check(args: &ScanArgs) -> Result<(), Failure> {
    let bad = |what: &str, found: f64| {
        Failure::new(format!("{what}, found {found}"), "`trueline scan --help` explains it")
    };
    if !(args.pace > 0.0 && args.pace <= 1.0) {
        return Err(bad("--pace: expected a share above 0 and up to 1", args.pace));
    }
    if args.reach_mm.is_some_and(|reach_mm| !(reach_mm > 0.0 && reach_mm <= 3000.0)) {
        return Err(bad("--reach-mm: expected 1 to 3000 mm", args.reach_mm.unwrap_or_default()));
    }
    if !(args.hold_s > 0.0 && args.hold_s < 600.0) {
        return Err(bad("--hold-s: expected seconds above 0", args.hold_s));
    }
    if !(0.02..=10.0).contains(&args.timeout_s) {
        return Err(bad("--timeout-s: expected 0.02 to 10 s", args.timeout_s));
    }
    if !(1.0..=3600.0).contains(&args.armed_s) {
        return Err(bad("--armed-s: expected 1 to 3600 s", args.armed_s));
    }
    if args.bind.is_some_and(|bind| bind.ip().is_unspecified()) {
        return Err(Failure::new(
            "--bind 0.0.0.0: a robot is only guided through the network card that it is connected to",
            "name the address of the network card that the robot is connected to",
        ));
    }
    Ok(())
}

/// How far the tool carries something: as the user says, or to the back of the sensor that was planned for.
fn reach_m(args: &ScanArgs) -> Result<f64, Failure> {
    if let Some(reach_mm) = args.reach_mm {
        return Ok(reach_mm * 1e-3);
    }
    let cell = args.path.join(planned_scan::CELL);
    if !cell.exists() {
        return Ok(derive_limits::REACH_M);
    }
    Ok(planned_scan::read_cell(&cell)?.tool_from_camera.translation.vector.norm() + SENSOR_BODY_M)
}

/// From a camera's centre to the farthest corner of its sensor, m.
const SENSOR_BODY_M: f64 = 0.1;

fn limits_text(file: &Path) -> Result<String, Failure> {
    std::fs::read_to_string(file).map_err(|error| {
        let hint = "`trueline scan PATH --write-limits FILE` writes limits to begin with";
        Failure::new(format!("{}: {error}", file.display()), hint)
    })
}

fn write_limits(file: &Path, limits: &MotionLimits) -> Result<ExitCode, Failure> {
    if file.exists() {
        let message = format!("{}: already exists", file.display());
        return Err(Failure::new(message, "existing limits are never overwritten: name another file"));
    }
    output::file(file, &limits_file::format(limits))?;
    output::words(&format!(
        "{}: the tightest limits that contain the path. Read every line: you are responsible for these limits.",
        file.display()
    ));
    Ok(ExitCode::SUCCESS)
}

/// What would be sent.
fn plan(path: &CheckedPath, poses: &[RobotSample], limits: &MotionLimits, args: &ScanArgs) -> String {
    let mut out = String::new();
    let most = path.extremes();
    let [low, high] = path.extent_m().map(|corner| corner * 1e3);
    let start = poses[0].base_from_tool.translation.vector * 1e3;
    let _ = writeln!(
        out,
        "Path of {} poses, {:.1} s{}; {:.1} s to start, as many to stop",
        poses.len(),
        path.duration_s(),
        if args.pace < 1.0 { format!(" at {:.0} % of its pace", 100.0 * args.pace) } else { String::new() },
        1.0 / path.ramp().slope_per_s + 3.0 * path.ramp().lag_s,
    );
    let _ = writeln!(out, "  begins at    x {:.1}  y {:.1}  z {:.1} mm", start.x, start.y, start.z);
    for (axis, k) in [("x", 0), ("y", 1), ("z", 2)] {
        let [from, to] = limits.box_m.map(|corner| corner[k] * 1e3);
        let _ = writeln!(
            out,
            "  {axis}            {:.1} to {:.1} mm, allowed {from:.1} to {to:.1}",
            low[k], high[k]
        );
    }
    let d = f64::to_degrees;
    let rows = [
        ("speed", most.speed_m_s * 1e3, limits.speed_m_s * 1e3, "mm/s"),
        ("acceleration", most.acceleration_m_s2 * 1e3, limits.acceleration_m_s2 * 1e3, "mm/s²"),
        ("jerk", most.jerk_m_s3 * 1e3, limits.jerk_m_s3 * 1e3, "mm/s³"),
        ("turning", d(most.turn_rad_s), d(limits.turn_rad_s), "°/s"),
        ("turn change", d(most.turn_acceleration_rad_s2), d(limits.turn_acceleration_rad_s2), "°/s²"),
    ];
    for (what, found, limit, unit) in rows {
        let _ = writeln!(out, "  {what:<12} up to {found:.1} {unit}, allowed {limit:.1}");
    }
    let _ = writeln!(
        out,
        "  at the tip   up to {:.1} mm/s, allowed {:.1}: {:.0} mm from the tool's origin",
        most.tip_m_s * 1e3,
        FASTEST_M_S * 1e3,
        limits.reach_m * 1e3
    );
    if path.longest_rest_s() > DWELL_S {
        let _ = writeln!(
            out,
            "  warning      it rests for {:.1} s on the way: EGMRunPose may take that for the end",
            path.longest_rest_s()
        );
    }
    out
}

/// A rest that is longer comes near to \\CondTime, after which a guidance ends.
const DWELL_S: f64 = 1.5;

fn next_step(args: &ScanArgs) -> &'static str {
    if args.limits.is_none() {
        " No limits were given: --write-limits FILE writes some to begin with."
    } else {
        " To lead the robot: --enable-motion --bind IP:PORT --robot IP --out FOLDER; --pace 0.1 first."
    }
}

/// Asks once more; what is typed must be the word.
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

/// The plan's own sensor stands beside its path.
fn sensor(args: &ScanArgs) -> Option<PathBuf> {
    let beside = args.path.join("sensor.toml");
    args.sensor.clone().or_else(|| beside.exists().then_some(beside))
}

struct Watching<'a> {
    recording: CellRecording,
    replies: ReplyTimes,
    shown: &'a Mutex<(Brief, Phase)>,
    unrecorded: &'a AtomicBool,
}

impl Observer for Watching<'_> {
    fn received(&mut self, received: &Received<'_>) {
        self.recording.datagram(received);
    }

    fn answered(&mut self, answer: &Answer) {
        self.recording.answer(answer);
        if let Some(took_ns) = answer.since_frame_ns {
            self.replies.add(took_ns);
        }
    }

    fn stepped(&mut self, state: &GateState) {
        self.recording.tick();
        if self.recording.has_failed() {
            self.unrecorded.store(true, Ordering::SeqCst);
        }
        // Never waits for the display.
        if let Ok(mut shown) = self.shown.try_lock() {
            *shown = (self.recording.watch().brief(), state.phase);
        }
    }
}

fn lead(
    mut guide: Guide,
    recording: CellRecording,
    cell: &mut LiveCell,
    args: &ScanArgs,
) -> Result<ExitCode, Failure> {
    let shown = Mutex::new((Brief::default(), Phase::Waiting));
    let handle = recording.handle();
    let unrecorded = AtomicBool::new(false);
    let replies = ReplyTimes::default();
    let mut watching = Watching { recording, replies, shown: &shown, unrecorded: &unrecorded };
    let screen = LiveScreen::new(args.quiet);
    let CellOutcome { robot, camera, estimate_panicked } = cell.cell.run(
        &handle,
        |blind| {
            let hurried = priority::hurry();
            (guide.run(|| command(&[blind, &unrecorded]), &mut watching), hurried)
        },
        |state| {
            let (brief, phase) = shown.lock().map(|shown| *shown).unwrap_or_default();
            screen.show(&format!("{}: {}", phase_text(&phase), link_text::brief(&brief)), state);
        },
    );
    drop(screen);
    let Some((outcome, hurried)) = robot else {
        return Err(Failure::new(
            "the leading thread panicked; the controller stops by its timeout",
            "please report this; the recording is kept",
        ));
    };
    if !hurried && !args.quiet {
        output::words("warning: no real-time priority (needs CAP_SYS_NICE); a busy PC may pause the scan");
    }
    let seen = cell.tell(&camera, estimate_panicked, args.quiet);
    conclude(outcome, watching, seen, args)
}

/// What Ctrl-C means; a scan that is not seen or not recorded any more is stopped as well.
fn command(failures: &[&AtomicBool]) -> OperatorCommand {
    match interrupt::times() {
        0 if failures.iter().any(|failed| failed.load(Ordering::SeqCst)) => OperatorCommand::Stop,
        0 => OperatorCommand::Go,
        1 => OperatorCommand::Stop,
        _ => OperatorCommand::Silence,
    }
}

fn phase_text(phase: &Phase) -> String {
    match phase {
        Phase::Waiting => "waiting for the controller to be guided".to_owned(),
        Phase::Travelling { on_path, paused_for: 0, .. } => format!("on the path at {:.1} s", on_path.path_s),
        Phase::Travelling { on_path, .. } => format!("paused at {:.1} s: frames came late", on_path.path_s),
        Phase::Interrupted { on_path } => format!("at rest at {:.1} s: the robot is silent", on_path.path_s),
        Phase::Stopping { why, .. } => format!("stopping: {why}"),
        Phase::Holding { why, .. } => format!("holding: {why}"),
        Phase::Silent { why } => format!("silent: {why}"),
    }
}

fn conclude(
    outcome: std::io::Result<Outcome>,
    watching: Watching<'_>,
    seen: bool,
    args: &ScanArgs,
) -> Result<ExitCode, Failure> {
    let Watching { recording, replies, .. } = watching;
    let (end_reason, well) = match &outcome {
        Ok(outcome) => (
            ending_text(outcome, seen),
            outcome.end_reason == EndReason::Travelled && !outcome.observer_panicked && seen,
        ),
        Err(error) => (format!("the socket failed: {error}"), false),
    };
    let level = if well { NoteLevel::Info } else { NoteLevel::Error };
    recording.note(level, format!("the scan ended: {end_reason}"));
    let finished = recording.finish();
    output::words(&format!("The scan ended: {end_reason}"));
    live_cell::tell_recording(&finished, args.quiet);
    if !args.quiet {
        let times = [0.5, 0.99, 0.999, 1.0].map(|share| replies.within_ms(share));
        let said = output::data(&format!(
            "{}  answers  {}, sent within {:.2} ms (median), {:.2} ms (99 %), {:.2} ms (99.9 %), {:.2} ms (all)",
            link_text::text(&finished.watch.report()),
            replies.count(),
            times[0],
            times[1],
            times[2],
            times[3],
        ));
        verdict_first(said)?;
        output::words(&format!("written to {}", finished.file.display()));
    }
    Ok(if well && finished.is_complete() { ExitCode::SUCCESS } else { ExitCode::from(1) })
}

/// Whoever reads our output may be gone: how a scan ended is told by the exit code all the same.
fn verdict_first(said: Result<(), Failure>) -> Result<(), Failure> {
    match said {
        Err(Failure::BrokenPipe) => Ok(()),
        other => other,
    }
}

fn ending_text(outcome: &Outcome, seen: bool) -> String {
    let mut text = match outcome.end_reason {
        EndReason::Stopped if interrupt::times() == 0 && !seen => "stopped because the camera failed".to_owned(),
        EndReason::Stopped if interrupt::times() == 0 => "stopped because it is not recorded any more".to_owned(),
        EndReason::RobotSilent { .. } if outcome.was_converged => {
            "the controller ended the guidance: the robot was at its reference for \\CondTime (a slow path, or a rest on it; \
             `trueline rapid` writes a window that suits the path and its pace)"
                .to_owned()
        }
        end_reason => end_reason.to_string(),
    };
    let mut add = |count: u64, what: &str| {
        if count > 0 {
            let _ = write!(text, "; {what}: {count}");
        }
    };
    add(outcome.pauses.into(), "pauses because frames came late or not at all");
    add(outcome.jumps.into(), "frames not believed, the robot cannot have moved so far");
    add(outcome.unsent, "answers that could not be sent");
    if outcome.observer_panicked {
        text.push_str("; a part of this program beside the leading loop failed");
    }
    text
}
