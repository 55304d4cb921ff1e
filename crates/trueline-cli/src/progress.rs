//! Progress bars for work of more than a second.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::thread;
use std::time::Duration;
use trueline_method::diagnose::steps::Step;

/// A bar on stderr; drawn only on a terminal, and not if all is to be quiet.
pub(crate) fn bar(total: u64, what: &'static str, quiet: bool) -> ProgressBar {
    let target = if quiet { ProgressDrawTarget::hidden() } else { ProgressDrawTarget::stderr_with_hz(5) };
    let bar = ProgressBar::with_draw_target(Some(total), target);
    let template = "{bar:30} {pos}/{len} {prefix}  {per_sec}  {eta} left";
    let style = ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar());
    bar.enable_steady_tick(Duration::from_millis(500));
    bar.with_style(style).with_prefix(what)
}

/// Does work that reports its present step, and shows it with the remaining time if known.
pub(crate) fn steps<T>(quiet: bool, work: impl FnOnce(&mut dyn FnMut(Step<'_>)) -> T) -> T {
    let bar = bar(1, "", quiet);
    let style = ProgressStyle::with_template("{bar:30} {eta} left, trying: {wide_msg}");
    bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
    let result = work(&mut |step| {
        bar.set_length(step.of as u64);
        bar.set_position(step.done as u64);
        bar.set_message(step.name.to_owned());
    });
    bar.finish_and_clear();
    result
}

/// Does work of unknown length. After a second a terminal shows for how long it has been going on.
pub(crate) fn during<T>(what: &'static str, quiet: bool, work: impl FnOnce() -> T) -> T {
    if quiet {
        return work();
    }
    let (done, waiting) = mpsc::channel::<()>();
    thread::scope(|scope| {
        scope.spawn(move || {
            if waiting.recv_timeout(Duration::from_secs(1)) != Err(RecvTimeoutError::Timeout) {
                return;
            }
            let spinner = ProgressBar::with_draw_target(None, ProgressDrawTarget::stderr_with_hz(5));
            let style = ProgressStyle::with_template("{spinner} {prefix}  {elapsed}");
            let spinner = spinner.with_style(style.unwrap_or_else(|_| ProgressStyle::default_spinner()));
            spinner.set_prefix(what);
            spinner.enable_steady_tick(Duration::from_millis(200));
            // It ends when the work has ended.
            let _ = waiting.recv();
            spinner.finish_and_clear();
        });
        let result = work();
        drop(done);
        result
    })
}
