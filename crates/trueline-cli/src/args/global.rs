//! Options of every command. Help shows them once, in that of the program itself.

use clap::Args;
use std::path::PathBuf;

/// The heading that they stand under.
pub(crate) const HEADING: &str = "Global options";

/// The words below the help of every command about these options.
pub(super) fn where_explained(program: &str) -> String {
    format!("Global options, such as --quiet, --verbose and --log-file: `{program} --help`")
}

#[derive(Args)]
pub(crate) struct GlobalArgs {
    /// When to use colours
    #[arg(long, global = true, value_enum, value_name = "WHEN", default_value_t = clap::ColorChoice::Auto, help_heading = HEADING)]
    pub(crate) color: clap::ColorChoice,
    /// Print nothing but errors, and data that were asked for
    #[arg(long, short, global = true, help_heading = HEADING)]
    pub(crate) quiet: bool,
    /// Verbose: list files read and written, with timings; with doctor, everything tried
    #[arg(long, short, global = true, help_heading = HEADING)]
    pub(crate) verbose: bool,
    /// Append a log to a file, a JSON object a line: the messages, and every stage with its duration. RUST_LOG sets the
    /// level: debug, or trueline_watch=debug,warn [default: trueline=debug,info]; without --log-file the log goes to
    /// stderr
    #[arg(long, global = true, value_name = "FILE", help_heading = HEADING)]
    pub(crate) log_file: Option<PathBuf>,
}

/// Their ids, and that of `--help`.
pub(super) const IDS: [&str; 5] = ["color", "quiet", "verbose", "log_file", "help"];

/// Names of global options that take a value.
#[cfg(feature = "live")]
const WITH_VALUE: [&str; 2] = ["--color", "--log-file"];

/// The first word of a command line, behind the program's name, that is neither a global option nor its value.
#[cfg(feature = "live")]
pub(super) fn first_word(words: &[std::ffi::OsString]) -> Option<String> {
    let mut words = words.iter().skip(1).map(|word| word.to_string_lossy());
    while let Some(word) = words.next() {
        if !word.starts_with('-') {
            return Some(word.into_owned());
        }
        if WITH_VALUE.contains(&&*word) {
            words.next();
        }
    }
    None
}
