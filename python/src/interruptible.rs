//! Long work without the interpreter's lock, which Ctrl-C ends.

use crate::failure::Failure;
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread;
use std::time::Duration;

/// How often Python is asked whether somebody pressed Ctrl-C.
const ASK_EVERY: Duration = Duration::from_millis(50);

/// Does the work on a thread of its own while other Python threads run. After Ctrl-C the caller gets its `KeyboardInterrupt`
/// at once; the work holds nothing of Python's, and what it still finds is dropped.
///
/// # Errors
/// That of the work, `KeyboardInterrupt`, or `RuntimeError` if the work panicked.
pub fn run<T, F>(py: Python<'_>, work: F) -> PyResult<T>
where
    T: Send + 'static,
    F: FnOnce() -> Result<T, Failure> + Send + 'static,
{
    let (send, receive) = channel();
    // Nobody listens any more after Ctrl-C.
    let spawned = thread::Builder::new().name("trueline".into()).spawn(move || drop(send.send(work())));
    spawned.map_err(|error| PyRuntimeError::new_err(format!("no thread can be started: {error}")))?;
    py.detach(move || {
        loop {
            match receive.recv_timeout(ASK_EVERY) {
                Ok(answer) => return answer.map_err(PyErr::from),
                Err(RecvTimeoutError::Timeout) => Python::attach(|py| py.check_signals())?,
                Err(RecvTimeoutError::Disconnected) => {
                    return Err(PyRuntimeError::new_err(
                        "a bug of trueline ended the calculation; please report it",
                    ));
                }
            }
        }
    })
}
