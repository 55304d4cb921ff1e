//! Separators of the columns of a line, and of the fields between.

/// Separator of two columns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Separator {
    /// One character.
    Character(char),
    /// One or more blanks or tabs.
    Blanks,
}

/// Brackets of a group of numbers: a pose of UR, KUKA or ABB.
pub(crate) const GROUPS: [char; 2] = ['[', '{'];

/// The fields of a line; quotes around a field are taken off.
pub(crate) fn fields(line: &str, separator: Separator) -> Vec<String> {
    let line = line.trim_start_matches('\u{feff}').trim_end_matches('\r');
    let Separator::Character(character) = separator else {
        return line.split_whitespace().map(str::to_owned).collect();
    };
    let groups = line.contains(GROUPS) && balanced(line);
    let mut fields = vec![String::new()];
    let (mut quoted, mut depth) = (false, 0_i32);
    for letter in line.chars() {
        if groups && !quoted {
            depth += i32::from(matches!(letter, '[' | '{')) - i32::from(matches!(letter, ']' | '}'));
        }
        if letter == '"' {
            quoted = !quoted;
        } else if letter == character && !quoted && depth <= 0 {
            fields.push(String::new());
        } else if let Some(field) = fields.last_mut() {
            field.push(letter);
        }
    }
    fields.iter().map(|field| field.trim().to_owned()).collect()
}

/// Whether every bracket of a line is closed.
fn balanced(line: &str) -> bool {
    let count = |letter: char| line.matches(letter).count();
    count('[') == count(']') && count('{') == count('}')
}
