//! Commands that this build leaves out: they are known by name, and say how to get them.

use clap::{Arg, Command};
use std::ffi::OsString;

/// Builds the program with everything that a release has.
pub(crate) const FULL_BUILD: &str = "cargo build --release --bin trueline --features full";

/// Builds it with ROS 2, which no release has: it takes minutes more.
const ROS2_BUILD: &str = "cargo build --release --bin trueline --features full,ros2";

/// A command, the feature that it needs, and whether this build has that.
type Needs = (&'static str, &'static str, bool);

const NEEDS: [Needs; 10] = [
    ("watch", "live", cfg!(feature = "live")),
    ("history", "live", cfg!(feature = "live")),
    ("listen", "live", cfg!(feature = "live")),
    ("record", "live", cfg!(feature = "live")),
    ("scan", "live", cfg!(feature = "live")),
    ("robot-sim", "live", cfg!(feature = "live")),
    ("stream-sim", "live", cfg!(feature = "live")),
    ("camera-sim", "gige", cfg!(feature = "gige")),
    ("serve", "serve", cfg!(feature = "serve")),
    ("ros2-node", "ros2", cfg!(feature = "ros2")),
];

/// The command line with the names of the parts left out: with any arguments they are understood, and then refused.
pub(crate) fn named(command: Command) -> Command {
    with_names(command, &left_out(&NEEDS))
}

/// The feature that a command needs, where this build has it not.
pub(crate) fn feature_of(command: &str) -> Option<&'static str> {
    left_out(&NEEDS).into_iter().find(|(name, _)| *name == command).map(|(_, feature)| feature)
}

/// The command line that builds the program with a feature.
fn build_with(feature: &str) -> &'static str {
    if feature == "ros2" { ROS2_BUILD } else { FULL_BUILD }
}

/// The remedy for a command that needs a feature.
pub(crate) fn how_to_have(feature: &str) -> String {
    if feature == "ros2" { format!("from the source: `{ROS2_BUILD}`") } else { how_to_build() }
}

/// The remedy.
pub(crate) fn how_to_build() -> String {
    format!("released programs have everything; from the source: `{FULL_BUILD}`")
}

fn left_out(needs: &[Needs]) -> Vec<(&'static str, &'static str)> {
    needs.iter().filter(|(.., is_there)| !is_there).map(|(name, feature, _)| (*name, *feature)).collect()
}

fn with_names(mut command: Command, names: &[(&'static str, &'static str)]) -> Command {
    if names.is_empty() {
        return command;
    }
    // The list names commands of releases only.
    let of_releases = names.iter().filter(|(_, feature)| build_with(feature) == FULL_BUILD);
    let list = of_releases.map(|(name, _)| *name).collect::<Vec<_>>().join(", ");
    if !list.is_empty() {
        let note = format!("Not in this build: {list}; for them: {FULL_BUILD}");
        let end = command.get_after_help().map(|text| format!("{text}\n\n{note}")).unwrap_or(note);
        command = command.after_help(end);
    }
    for (name, feature) in names {
        let words = Arg::new("words")
            .num_args(0..)
            .trailing_var_arg(true)
            .allow_hyphen_values(true)
            .value_parser(clap::value_parser!(OsString));
        let build = build_with(feature);
        let about = format!("Not in this build, which has not the feature `{feature}`: {build}");
        command = command
            .subcommand(Command::new(*name).about(about).hide(true).disable_help_flag(true).arg(words));
    }
    command
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_command_that_is_left_out_is_understood_with_any_words() {
        let program = with_names(Command::new("trueline"), &[("record", "live")]);
        assert!(
            program
                .clone()
                .render_help()
                .to_string()
                .contains("Not in this build: record; for them: cargo build")
        );
        for words in [&["--out", "cell", "-v"][..], &["--help"], &["a", "b"], &[]] {
            let called = program.clone().try_get_matches_from(["trueline", "record"].iter().chain(words));
            assert!(called.is_ok_and(|matches| matches.subcommand_name() == Some("record")), "{words:?}");
        }
    }

    #[test]
    fn only_what_needs_a_feature_that_is_not_there_is_left_out() {
        assert_eq!(left_out(&[("a", "live", true), ("b", "gige", false)]), [("b", "gige")]);
        assert!(
            Command::new("trueline").get_after_help().is_none()
                && with_names(Command::new("t"), &[]).get_after_help().is_none()
        );
    }
}
