//! The compiled half of the Python module `trueline`: arrays in, arrays and JSON out. Names, types and words are in Python.

mod calibration;
mod columns;
mod failure;
mod interruptible;
mod live;
mod live_settings;
mod named;
mod options;
mod pictures;
mod placer;
mod profiles;
mod recording;
mod rows;
mod seam_track;

use pyo3::prelude::*;
use std::ffi::OsString;
use std::process::ExitCode;

/// Runs the program with a command line; the first word is the program's name. Returns its exit code.
#[pyfunction]
fn main(py: Python<'_>, words: Vec<OsString>) -> u8 {
    let code = py.detach(|| trueline_cli::run(words));
    match code {
        code if code == ExitCode::SUCCESS => 0,
        code if code == ExitCode::from(1) => 1,
        _ => 2,
    }
}

#[pymodule]
fn _trueline(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add("TruelineError", module.py().get_type::<failure::TruelineError>())?;
    module.add_class::<recording::Recording>()?;
    module.add_class::<calibration::Calibration>()?;
    module.add_class::<live::LiveRecording>()?;
    module.add_class::<placer::Placer>()?;
    module.add_class::<seam_track::SeamTrack>()?;
    module.add_function(wrap_pyfunction!(main, module)?)?;
    module.add_function(wrap_pyfunction!(pictures::picture_seams, module)?)?;
    module.add_function(wrap_pyfunction!(profiles::profile_seams, module)?)?;
    Ok(())
}
