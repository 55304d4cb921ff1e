//! Lines that fit a terminal.

/// Columns of a line, at most; a word that is longer stays whole.
const WIDTH: usize = 100;

/// The same text with long lines broken between words; what goes on stands below where the line's value begins.
#[must_use]
pub fn wrapped(text: &str) -> String {
    text.lines().map(|line| broken(line) + "\n").collect()
}

fn broken(line: &str) -> String {
    if line.chars().count() <= WIDTH {
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
        } else if column + 1 + length > WIDTH {
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

/// Where the value of a row begins: after its name and two blanks or more; else after the mark of an item.
fn value_column(line: &str) -> usize {
    let start = line.chars().take_while(|c| *c == ' ').count();
    let text: Vec<char> = line.chars().collect();
    let gap = (start..text.len().min(40)).find(|k| text[*k] == ' ' && text.get(k + 1) == Some(&' '));
    match gap {
        Some(gap) => gap + text[gap..].iter().take_while(|c| **c == ' ').count(),
        None if line[start..].starts_with("- ") => start + 2,
        None => start,
    }
}

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
}
