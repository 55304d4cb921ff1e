//! The program as another program starts it.
#![allow(dead_code, clippy::unwrap_used, reason = "every test uses some of it; a test fails by panicking")]

use std::net::UdpSocket;
use std::path::Path;
use std::process::{Command, Output, Stdio};

/// The program in a folder, not yet started; nobody types anything.
pub(crate) fn command(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_trueline"));
    command.current_dir(folder).args(arguments).stdin(Stdio::null());
    command
}

/// Runs it to its end.
pub(crate) fn trueline(folder: &Path, arguments: &[&str]) -> Output {
    command(folder, arguments).output().unwrap()
}

/// Its exit code.
pub(crate) fn code(output: &Output) -> i32 {
    output.status.code().unwrap()
}

/// Its text on stderr.
pub(crate) fn words(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// All its text.
pub(crate) fn text(output: &Output) -> String {
    [&output.stdout, &output.stderr].map(|bytes| String::from_utf8_lossy(bytes).into_owned()).concat()
}

/// Fails with its text if it ended with another code.
pub(crate) fn ends_with(output: &Output, expected: i32) {
    assert_eq!(code(output), expected, "{}", text(output));
}

/// An address of this machine with a port that is free.
pub(crate) fn address() -> String {
    UdpSocket::bind("127.0.0.1:0").unwrap().local_addr().unwrap().to_string()
}
