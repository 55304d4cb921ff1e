//! Long work without the interpreter's lock, which Ctrl-C ends.

use crate::failure::Failure;
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread;
use std::time::Duration;

/// How often Python is asked whether somebody pressed Ctrl-C.
const ASK_EVERY: Duration = Duration::from_millis(50);
/// Interval of the checks of borrowing work.
const LOOK_EVERY: Duration = Duration::from_millis(5);

/// Does the work on a thread of its own while other Python threads run. After Ctrl-C the caller gets its `KeyboardInterrupt`
/// at once. The work holds nothing of Python's, and its later findings are dropped.
///
/// # Errors
/// The error of the work, `KeyboardInterrupt`, or `RuntimeError` if the work panicked.
pub(crate) fn run<T, F>(py: Python<'_>, work: F) -> PyResult<T>
where
    T: Send + 'static,
    F: FnOnce() -> Result<T, Failure> + Send + 'static,
{
    let (send, receive) = channel();
    // There is no listener any more after Ctrl-C.
    let spawned = thread::Builder::new().name("trueline".into()).spawn(move || drop(send.send(work())));
    spawned.map_err(|error| PyRuntimeError::new_err(format!("no thread can be started: {error}")))?;
    py.detach(move || {
        loop {
            match receive.recv_timeout(ASK_EVERY) {
                Ok(answer) => return answer.map_err(PyErr::from),
                Err(RecvTimeoutError::Timeout) => Python::attach(|py| py.check_signals())?,
                Err(RecvTimeoutError::Disconnected) => {
                    return Err(panicked());
                }
            }
        }
    })
}

/// The same for work that borrows arrays: after Ctrl-C `stop` is set, and the caller waits until the work has seen it.
///
/// # Errors
/// As [`run`].
pub(crate) fn borrowing<T, F>(py: Python<'_>, stop: &AtomicBool, work: F) -> PyResult<T>
where
    T: Send,
    F: FnOnce() -> Result<T, Failure> + Send,
{
    py.detach(|| {
        thread::scope(|scope| {
            let worker = scope.spawn(work);
            while !worker.is_finished() {
                thread::park_timeout(LOOK_EVERY);
                if let Err(interrupted) = Python::attach(|py| py.check_signals()) {
                    stop.store(true, Ordering::Relaxed);
                    // Its result is dropped.
                    drop(worker.join());
                    return Err(interrupted);
                }
            }
            worker.join().map_err(|_| panicked())?.map_err(PyErr::from)
        })
    })
}

fn panicked() -> PyErr {
    PyRuntimeError::new_err("a bug of trueline ended the calculation; please report it")
}
