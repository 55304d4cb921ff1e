//! The words below the options of every command.

/// Every command, however deep, with its whole name.
fn commands(of: &clap::Command, name: &str) -> Vec<(String, clap::Command)> {
    let own = format!("{name} {}", of.get_name());
    let below = of.get_subcommands().flat_map(|sub| commands(sub, &own)).collect::<Vec<_>>();
    std::iter::once((own, of.clone())).chain(below).collect()
}

/// The options of both programs.
fn all_commands() -> Vec<(String, clap::Command)> {
    let of_devices = commands(&trueline_cli::testbench(), "");
    commands(&trueline_cli::command(), "").into_iter().chain(of_devices).collect()
}

/// Whether a line is part of a paragraph, and not an example or an option.
fn is_prose(line: &str) -> bool {
    line.starts_with(|c: char| c.is_alphabetic())
}

/// A paragraph that is broken in the source is broken once more by a narrower terminal, after its first words.
#[test]
fn paragraphs_are_left_to_the_terminal_to_break() {
    let mut broken = Vec::new();
    for (name, command) in all_commands() {
        let texts = [command.get_after_help(), command.get_after_long_help()];
        for text in texts.into_iter().flatten().map(ToString::to_string) {
            let lines: Vec<&str> = text.lines().collect();
            let goes_on = |pair: &&[&str]| {
                is_prose(pair[0]) && pair[1].starts_with(|c: char| c.is_lowercase() || c == '`')
            };
            broken.extend(lines.windows(2).filter(goes_on).map(|pair| format!("{name}: {}", pair[1])));
        }
    }
    assert!(broken.is_empty(), "{broken:#?}");
}

/// A user's input for an option of a command itself, not for one of every command.
fn own_options(command: &clap::Command) -> Vec<&clap::Arg> {
    let is_own = |arg: &&clap::Arg| arg.get_long().is_some() && !arg.is_hide_set();
    command.get_arguments().filter(is_own).collect()
}

/// A list of 36 options in a row is read by nobody.
#[test]
fn a_command_with_many_options_has_what_everybody_needs_first_and_the_rest_under_headings() {
    let mut many = 0;
    for (name, command) in all_commands() {
        let options = own_options(&command);
        if options.len() <= 10 {
            continue;
        }
        many += 1;
        let first: Vec<_> = options.iter().filter(|arg| arg.get_help_heading().is_none()).collect();
        assert!(first.len() <= 5, "{name}: {} options have no heading", first.len());
        assert!(first.iter().all(|arg| !arg.is_hide_short_help_set()), "{name}");
        let [short, long] = [command.clone().render_help(), command.clone().render_long_help()]
            .map(|text| text.to_string().lines().count());
        assert!(short < long, "{name}: -h has {short} lines, --help {long}");
        for wanted in ["json", "report"] {
            let has = options.iter().any(|arg| arg.get_long() == Some(wanted));
            let is_first = first.iter().any(|arg| arg.get_long() == Some(wanted));
            assert!(!has || is_first, "{name}: --{wanted} is not among the first");
        }
    }
    assert!(many >= 10, "{many} commands have many options");
}

/// Lines of `--help` that begin with an option, over all commands of `trueline`: as many as a reader can take.
const MOST_OPTIONS: usize = 342;

#[test]
fn there_are_no_more_options_than_a_reader_can_take() {
    let begins = |line: &&str| line.starts_with("  -") || line.starts_with("      --");
    let of_command = |(_, mut command): (String, clap::Command)| {
        let text = command.render_long_help().to_string();
        // Examples have options too.
        text.split("\nExample").next().unwrap_or_default().lines().filter(begins).count()
    };
    let commands = commands(&trueline_cli::command(), "").into_iter();
    // `trueline help` has the same commands once more.
    let options: usize = commands.filter(|(name, _)| !name.contains(" help")).map(of_command).sum();
    assert!(options <= MOST_OPTIONS, "{options} options");
}
