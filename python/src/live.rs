//! A recording that is under way.

use crate::columns;
use crate::failure::Failure;
use crate::live_settings::LiveSettings;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::Duration;
use trueline::live::{CellRecording, CellState, Progress, RobotBrief, Until, record_robot};
use trueline_live::HostClock;

/// How often Python is asked whether somebody pressed Ctrl-C.
const ASK_EVERY: Duration = Duration::from_millis(50);

/// How a recording is doing, five times a second.
struct Doing {
    robot: RobotBrief,
    cell: CellState,
}

/// Its result.
struct Ended {
    file: String,
    poses: u64,
    complete: bool,
    words: Vec<String>,
}

/// A recording on threads of its own.
#[pyclass(frozen, module = "trueline._trueline")]
pub struct LiveRecording {
    stop: Arc<AtomicBool>,
    states: Mutex<Receiver<Doing>>,
    thread: Mutex<Option<JoinHandle<Result<Ended, Failure>>>>,
}

#[pymethods]
impl LiveRecording {
    /// Begins to record.
    #[new]
    fn new(settings: LiveSettings) -> PyResult<Self> {
        let stop = Arc::new(AtomicBool::new(false));
        let (send, receive) = channel();
        let stopped = Arc::clone(&stop);
        let thread = thread::Builder::new()
            .name("trueline-live".into())
            .spawn(move || record(&settings, &stopped, &send))
            .map_err(|error| Failure::new(format!("no thread can be started: {error}"), ""))?;
        Ok(Self { stop, states: Mutex::new(receive), thread: Mutex::new(Some(thread)) })
    }

    /// The next state; `None` when the recording has ended.
    fn next<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        let doing = py.detach(|| {
            let states = self.states.lock().unwrap_or_else(PoisonError::into_inner);
            loop {
                match states.recv_timeout(ASK_EVERY) {
                    // A slow reader gets the newest.
                    Ok(doing) => return Ok(Some(states.try_iter().last().unwrap_or(doing))),
                    Err(RecvTimeoutError::Timeout) => Python::attach(|py| py.check_signals())?,
                    Err(RecvTimeoutError::Disconnected) => return PyResult::Ok(None),
                }
            }
        })?;
        doing.map(|doing| state(py, &doing)).transpose()
    }

    /// Ends the recording and waits until all of it is in the file; returns its result, once.
    fn finish<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        self.stop.store(true, Ordering::SeqCst);
        let thread = self.thread.lock().unwrap_or_else(PoisonError::into_inner).take();
        let Some(thread) = thread else { return Ok(None) };
        let ended = py.detach(|| thread.join());
        let panicked = || Failure::new("a bug of trueline ended the recording; please report it", "");
        let ended = ended.map_err(|_| panicked())??;
        let out = PyDict::new(py);
        out.set_item("file", ended.file)?;
        out.set_item("robot_poses", ended.poses)?;
        out.set_item("complete", ended.complete)?;
        out.set_item("words", ended.words)?;
        Ok(Some(out))
    }
}

fn record(settings: &LiveSettings, stop: &AtomicBool, states: &Sender<Doing>) -> Result<Ended, Failure> {
    let clock = HostClock::start();
    let stopped = || stop.load(Ordering::SeqCst);
    let mut cell = settings.cell(clock, &stopped)?;
    let mut link = settings.address()?.open(clock).map_err(Failure::from)?;
    let mut recording = CellRecording::create(settings.recording(&cell), clock).map_err(Failure::from)?;
    let (handle, shown) = (recording.handle(), Mutex::new(RobotBrief::default()));
    let until = Until { longest: settings.longest()?, stop: &stopped };
    let outcome = cell.run(
        &handle,
        |_| record_robot(&mut link, &mut recording, &until, &shown),
        |cell| {
            let robot = *shown.lock().unwrap_or_else(PoisonError::into_inner);
            // There may be no listener any more.
            drop(states.send(Doing { robot, cell: cell.clone() }));
        },
    );
    let finished = recording.finish();
    let report = finished.watch.report(&link);
    let mut words = finished.losses();
    words.extend(match outcome.robot {
        Some(wrong) => wrong.map(|error| error.to_string()),
        None => Some("the recording thread panicked".to_owned()),
    });
    words.extend(outcome.camera.err().map(|error| error.to_string()));
    words.extend(outcome.estimate_panicked.then(|| "the estimate failed".to_owned()));
    words.extend((!report.has_robot()).then(|| "no robot was heard".to_owned()));
    let complete = words.is_empty() && finished.is_complete();
    words.extend(finished.notes());
    Ok(Ended { file: finished.file.display().to_string(), poses: finished.watch.frames(), complete, words })
}

fn state<'py>(py: Python<'py>, doing: &Doing) -> PyResult<Bound<'py, PyDict>> {
    let out = PyDict::new(py);
    out.set_item("robot_poses", doing.robot.poses)?;
    out.set_item("base_from_tool", doing.robot.base_from_tool.map(|pose| columns::pose(py, &pose)))?;
    out.set_item("robot", doing.robot.to_string())?;
    let camera = doing.cell.camera.unwrap_or_default();
    out.set_item("pictures", camera.frames)?;
    out.set_item("pictures_lost", camera.lost())?;
    out.set_item("seam_points", camera.seams)?;
    out.set_item("estimate", doing.cell.estimate.as_ref().map(ToString::to_string))?;
    let estimated = match &doing.cell.estimate {
        Some(Progress::Estimated(estimated)) => Some(estimated),
        _ => None,
    };
    let offset = estimated.and_then(|estimated| estimated.time_offset_s);
    out.set_item("time_offset_s", offset.map(|[value, _]| value))?;
    out.set_item("time_offset_sigma_s", offset.map(|[_, sigma]| sigma))?;
    out.set_item("translation_sigma_m", estimated.and_then(|estimated| estimated.translation_sigma_m))?;
    out.set_item("rotation_sigma_rad", estimated.and_then(|estimated| estimated.rotation_sigma_rad))?;
    out.set_item("is_enough", estimated.and_then(|estimated| estimated.is_enough))?;
    out.set_item("advice", estimated.map_or_else(Vec::new, |estimated| estimated.advice.clone()))?;
    Ok(out)
}
