//! The words below the options of every command.

/// Every command, however deep, with its whole name.
fn commands(of: &clap::Command, name: &str) -> Vec<(String, clap::Command)> {
    let own = format!("{name} {}", of.get_name());
    let below = of.get_subcommands().flat_map(|sub| commands(sub, &own)).collect::<Vec<_>>();
    std::iter::once((own, of.clone())).chain(below).collect()
}

/// Whether a line is part of a paragraph, and not an example or an option.
fn is_prose(line: &str) -> bool {
    line.starts_with(|c: char| c.is_alphabetic())
}

/// A paragraph that is broken in the source is broken once more by a narrower terminal, after its first words.
#[test]
fn paragraphs_are_left_to_the_terminal_to_break() {
    let mut broken = Vec::new();
    for (name, command) in commands(&trueline_args::command(), "") {
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
