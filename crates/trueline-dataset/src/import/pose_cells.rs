//! Poses in one cell: `p[x, y, z, rx, ry, rz]` of UR, `{E6POS: X 1, Y 2, …}` of KUKA, `[[x, y, z], [q1, q2, q3, q4], …]` of
//! ABB, or any numbers in brackets. Each becomes as many columns.

use crate::dialect::quoted;
use std::borrow::Cow;

/// The names of the numbers of an ABB robtarget, for the part that is a pose.
const ABB: [&str; 7] = ["x", "y", "z", "q1", "q2", "q3", "q4"];
/// Names of the numbers behind its configuration: external axes; 9E9 marks a missing one.
const ABB_EXTERNAL: [&str; 6] = ["eax_a", "eax_b", "eax_c", "eax_d", "eax_e", "eax_f"];
/// Their start.
const ABB_EXTERNAL_AT: usize = 11;

/// A table with each cell in brackets split into as many cells; unchanged if there are none, or if rows differ.
pub(super) fn expanded(csv: Vec<u8>, lines_before: usize, has_names: bool) -> Vec<u8> {
    let Ok(text) = std::str::from_utf8(&csv) else { return csv };
    if !text.contains(['[', '{']) {
        return csv;
    }
    let read = || {
        let mut reader = csv::ReaderBuilder::new()
            .has_headers(false)
            .flexible(true)
            .trim(csv::Trim::All)
            .from_reader(&*csv);
        reader.records().collect::<Result<Vec<_>, _>>().ok()
    };
    let Some(records) = read() else { return csv };
    let (head, rows) = records.split_at(usize::from(has_names).min(records.len()));
    let Some(first) = rows.first() else { return csv };
    let groups: Vec<Option<Vec<(String, String)>>> = first.iter().map(group).collect();
    if groups.iter().all(Option::is_none) {
        return csv;
    }
    let mut out = "\n".repeat(lines_before);
    let mut line = lines_before as u64 + 1;
    if let Some(names) = head.first() {
        out.push_str(&line_of(names.iter().zip(&groups).flat_map(|(name, group)| match group {
            Some(group) => group.iter().map(|(own, _)| name_of(name, own).into()).collect(),
            None => vec![Cow::Borrowed(name)],
        })));
        line += 1;
    }
    for row in rows {
        let at = row.position().map_or(line, |position| line_of_row(&csv, position));
        while line < at {
            out.push('\n');
            line += 1;
        }
        out.push_str(&line_of(row.iter().enumerate().flat_map(|(k, cell)| {
            match groups.get(k).and_then(Option::as_ref).and(group(cell)) {
                Some(group) => group.into_iter().map(|(_, number)| number.into()).collect(),
                None => vec![Cow::Borrowed(cell)],
            }
        })));
        line += 1;
    }
    out.into_bytes()
}

/// The line of a row, from 1: its position is that where the row before it ends, and empty lines may follow there.
pub(super) fn line_of_row(csv: &[u8], position: &csv::Position) -> u64 {
    let at = usize::try_from(position.byte()).unwrap_or(usize::MAX).min(csv.len());
    let empty = csv[at..].iter().take_while(|byte| matches!(byte, b'\n' | b'\r'));
    position.line() + empty.filter(|&&byte| byte == b'\n').count() as u64
}

fn line_of<'a>(cells: impl Iterator<Item = Cow<'a, str>>) -> String {
    cells.map(|cell| quoted(&cell).into_owned()).collect::<Vec<_>>().join(",") + "\n"
}

/// A name of its own counts; numbers without names get the column's.
fn name_of(column: &str, own: &str) -> String {
    if own.bytes().all(|byte| byte.is_ascii_digit()) { format!("{column}_{own}") } else { own.to_owned() }
}

/// The numbers of a cell with their names or places; `None` if it is not a pose.
fn group(cell: &str) -> Option<Vec<(String, String)>> {
    let cell = cell.trim();
    if let Some(inner) = cell.strip_prefix('{').and_then(|rest| rest.strip_suffix('}')) {
        // KUKA: the type before a colon, then name and number by a blank.
        let inner = inner.split_once(':').map_or(inner, |(_, rest)| rest);
        let pair = |item: &str| {
            let (name, number) = item.trim().split_once([' ', '='])?;
            number.trim().parse::<f64>().ok()?;
            Some((name.to_owned(), number.trim().to_owned()))
        };
        return inner.split(',').map(pair).collect();
    }
    let inner = cell.trim_start_matches('p').strip_prefix('[')?.strip_suffix(']')?;
    let numbers: Vec<String> = inner
        .split([',', ';', ' '])
        .map(|item| item.trim_matches(['[', ']', ' ']).to_owned())
        .filter(|item| !item.is_empty())
        .collect();
    numbers.iter().all(|item| item.parse::<f64>().is_ok()).then_some(())?;
    if inner.starts_with('[') && numbers.len() >= ABB.len() {
        let external = numbers.get(ABB_EXTERNAL_AT..).unwrap_or_default().to_vec();
        let external = ABB_EXTERNAL.into_iter().zip(external).filter(|(_, number)| !is_absent(number));
        let pose = ABB.into_iter().zip(numbers);
        return Some(pose.chain(external).map(|(name, number)| (name.to_owned(), number)).collect());
    }
    (numbers.len() > 1).then(|| numbers.into_iter().enumerate().map(|(k, n)| (k.to_string(), n)).collect())
}

/// Whether the number of an external axis marks a missing one.
fn is_absent(number: &str) -> bool {
    number.parse::<f64>().is_ok_and(|number| number >= 9e9)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;

    fn text(csv: &str) -> String {
        String::from_utf8(expanded(csv.as_bytes().to_vec(), 0, true)).unwrap()
    }

    #[test]
    fn a_pose_in_one_cell_becomes_columns() {
        assert_eq!(text("t,pose\n1,\"p[1, -2.5, 3e-3]\"\n"), "t,pose_0,pose_1,pose_2\n1,1,-2.5,3e-3\n");
        assert_eq!(text("t,$POS_ACT\n1,\"{E6POS: X 1.5, Y -2, A 10, S 2}\"\n"), "t,X,Y,A,S\n1,1.5,-2,10,2\n");
        let abb = "t,target\n1,\"[[1,2,3],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]\"\n";
        assert_eq!(text(abb), "t,x,y,z,q1,q2,q3,q4\n1,1,2,3,1,0,0,0\n");
        let with_axis = abb.replacen("9E9", "30.5", 1);
        assert_eq!(text(&with_axis), "t,x,y,z,q1,q2,q3,q4,eax_a\n1,1,2,3,1,0,0,0,30.5\n");
        // Empty lines keep the count.
        assert_eq!(text("t,p\n\n1,[1 2]\n"), "t,p_0,p_1\n\n1,1,2\n");
    }

    #[test]
    fn what_is_no_pose_is_left_as_it_is() {
        for csv in ["t,x [mm]\n1,2\n", "t,note\n1,[open]\n", "t,p\n", ""] {
            assert_eq!(text(csv), csv);
        }
        // A row without one is met where the table is read.
        assert_eq!(text("t,p\n1,[1 2]\n2,none\n"), "t,p_0,p_1\n1,1,2\n2,none\n");
    }
}
