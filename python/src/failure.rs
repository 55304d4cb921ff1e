//! Errors as Python sees them: one exception with a hint.

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

pyo3::create_exception!(trueline, TruelineError, PyValueError, "Unusable input; `hint` names the remedy.");

/// The fault and its remedy, before it is raised.
#[derive(Debug)]
pub struct Failure {
    message: String,
    hint: String,
}

impl Failure {
    /// A failure with a hint.
    pub fn new(message: impl Into<String>, hint: impl Into<String>) -> Self {
        Self { message: message.into(), hint: hint.into() }
    }
}

impl From<trueline::Error> for Failure {
    fn from(error: trueline::Error) -> Self {
        let hint = error.hint();
        Self::new(error.to_string(), hint)
    }
}

impl From<trueline_dataset::Error> for Failure {
    fn from(error: trueline_dataset::Error) -> Self {
        trueline::Error::from(error).into()
    }
}

impl From<Failure> for PyErr {
    fn from(failure: Failure) -> Self {
        Python::attach(|py| {
            let error = TruelineError::new_err(failure.message);
            let raised = error.value(py);
            // Tracebacks print the notes of an exception, and only these.
            let noted = raised.call_method1("add_note", (format!("hint: {}", failure.hint),));
            match noted.and_then(|_| raised.setattr("hint", failure.hint)) {
                Ok(()) => error,
                Err(other) => other,
            }
        })
    }
}
