//! Lines that fit a terminal.

/// Columns of a line, at most; a word that is longer stays whole.
const WIDTH: usize = 100;

/// Narrower terminals get lines of this many columns: the room beside an indent must hold a word.
const NARROWEST: usize = 60;

/// The same text with lines of more than a hundred columns broken between words; a continuation is indented to the line's
/// value.
#[must_use]
pub fn wrapped(text: &str) -> String {
    wrapped_to(text, WIDTH)
}

/// The same for a terminal of `columns` columns; of a wider one no more than a hundred are used.
#[must_use]
pub fn wrapped_to(text: &str, columns: usize) -> String {
    let width = columns.clamp(NARROWEST, WIDTH);
    text.lines().map(|line| broken(line, width) + "\n").collect()
}

fn broken(line: &str, width: usize) -> String {
    if line.chars().count() <= width {
        return line.to_owned();
    }
    let indent = value_column(line);
    let mut out = String::new();
    let mut column = 0;
    // The head of the line keeps its blanks: they align the values.
    let head: String = line.chars().take(indent).collect();
    let rest: String = line.chars().skip(indent).collect();
    for word in rest.split(' ') {
        let length = word.chars().count();
        let begins = column == 0;
        if begins {
            out.push_str(&head);
            column = indent;
        } else if column + 1 + length > width {
            out.push('\n');
            out.push_str(&" ".repeat(indent));
            column = indent;
        } else {
            out.push(' ');
            column += 1;
        }
        out.push_str(word);
        column += length;
    }
    out
}

/// Start of a row's value: after its name and two blanks or more; else after the mark of an item.
fn value_column(line: &str) -> usize {
    let start = line.chars().take_while(|c| *c == ' ').count();
    let text: Vec<char> = line.chars().collect();
    let gap = (start..text.len().min(40)).find(|k| text[*k] == ' ' && text.get(k + 1) == Some(&' '));
    match gap {
        Some(gap) => gap + text[gap..].iter().take_while(|c| **c == ' ').count(),
        None if line[start..].starts_with("- ") => start + 2,
        None => start + LABELS.iter().find(|label| line.starts_with(*label)).map_or(0, |label| label.len()),
    }
}

/// Labels of lines on stderr.
const LABELS: [&str; 5] = ["error: ", "hint: ", "mind: ", "note: ", "warning: "];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_go_on_below_where_they_begin() {
        let row =
            format!("  seam error             {}", "± 0.01 mm by the scan alone; ".repeat(5).trim_end());
        let text = wrapped(&row);
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines.len(), 2, "{text}");
        assert!(lines.iter().all(|line| line.chars().count() <= WIDTH), "{text}");
        assert!(lines[1].starts_with(&" ".repeat(25)) && !lines[1].starts_with(&" ".repeat(26)), "{text}");
        let words = |text: &str| text.split_whitespace().map(str::to_owned).collect::<Vec<_>>();
        assert_eq!(words(&text), words(&row), "no word is lost");
        let item = format!("  - {}", "tilt the sensor by more ".repeat(8));
        assert!(wrapped(&item).lines().nth(1).is_some_and(|line| line.starts_with("    tilt")
            || line.starts_with("    the")
            || line.starts_with("    sensor")
            || line.starts_with("    by")
            || line.starts_with("    more")));
        assert_eq!(wrapped("short\n"), "short\n");
    }

    #[test]
    fn a_narrow_terminal_gets_shorter_lines_below_their_label() {
        let hint = format!("hint: {}", "name a new file ".repeat(8).trim_end());
        for (columns, widest) in [(80, 80), (250, WIDTH), (10, NARROWEST)] {
            let text = wrapped_to(&hint, columns);
            let longest = text.lines().map(|line| line.chars().count()).max();
            // No word of it is longer than four letters, so that no line ends more than four columns before the edge.
            assert!(longest.is_some_and(|longest| longest <= widest && longest + 5 > widest), "{text}");
            assert!(
                text.lines().skip(1).all(|line| line.starts_with("      ") && !line.starts_with("       "))
            );
        }
    }
}
