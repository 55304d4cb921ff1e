//! Rows of heights as Keyence's programs export them: columns before the heights, and commas behind them.

use std::path::Path;
use trueline_dataset::Error;
use trueline_dataset::import::profiles::{EvenColumns, ProfileFormat, Raw, read};

/// 20 profiles of 8 heights from -4 mm on, each behind what `first` makes of its number; the heights at both ends see nothing.
fn text(first: impl Fn(usize) -> String, end: &str) -> String {
    let row = |k: usize| {
        let heights = (0..8).map(|c| match c {
            0 | 7 => "-99.9999".to_owned(),
            _ => format!("{:.4}", 5.0 + 0.01 * ((c * 7 + k * 3) % 5) as f64),
        });
        heights.collect::<Vec<_>>().join(",")
    };
    (0..20).map(|k| format!("{}{}{end}\n", first(k), row(k))).collect()
}

fn read_rows(text: &str) -> Result<Raw, Error> {
    let even = Some(EvenColumns { first_mm: -4.0, step_mm: 1.0 });
    read(Path::new("export.csv"), text.as_bytes().to_vec(), ProfileFormat::KeyenceLjX, even)
}

#[test]
fn one_value_too_many_is_refused_whatever_the_first_column_is() {
    for first in [
        |k: usize| format!("{},", (65_530 + k) % 65_536),
        |k: usize| format!("{:.6},", k as f64 / 33.0),
        |k: usize| format!("{},", k * 3 % 7),
        |_: usize| "5.0,".to_owned(),
    ] {
        let error = read_rows(&text(first, "")).unwrap_err().to_string();
        let said = "export.csv, line 1: 9 values, but a start of -4 mm and a pitch of 1 mm require 8";
        assert_eq!(error, said);
    }
    assert_eq!(read_rows(&text(|_| String::new(), "")).unwrap().profiles.len(), 20);
    // A height at the mirrored place of the first one.
    let last = read_rows(&text(|_| String::new(), ",-99.9999")).unwrap();
    assert_eq!((last.profiles[0].points.len(), last.profiles[0].left_out), (6, 3));
}

/// A file that was cut off, and counters that wrap or are too large for one.
#[test]
fn rows_of_another_width_and_counters_that_wrap_end_nothing() {
    let cut = "No.,time_ms,-1,0,1\n1,10,5,5,5\n2,20,5,5,5\n3\n";
    let format = ProfileFormat::KeyenceLjX;
    let error = read(Path::new("cut.csv"), cut.as_bytes().to_vec(), format, None).unwrap_err().to_string();
    assert!(error.starts_with("cut.csv, line 4: "), "{error}");
    let wraps = |k: usize| format!("{},", (65_530 + k) % 65_536);
    let header = "No.,0,1,2,3,4,5,6,7\n".to_owned();
    assert_eq!(read_rows(&(header + &text(wraps, ""))).unwrap().profiles.len(), 20);
    let leaps = |k: usize| if k < 19 { format!("{k},") } else { "1e30,".to_owned() };
    assert_eq!(read_rows(&text(leaps, "")).unwrap().profiles.len(), 20);
}

#[test]
fn a_comma_at_the_end_of_a_row_makes_no_value() {
    let names = "0,1,2,3,4,5,6,7";
    for (header, counter) in [
        (format!("No.,{names}\n"), true),
        (format!("No.,{names},\n"), true),
        (String::new(), true),
        (String::new(), false),
    ] {
        let rows = text(|k| if counter { format!("{k},") } else { String::new() }, ",");
        let raw = read_rows(&(header + &rows)).unwrap();
        let first = &raw.profiles[0];
        assert_eq!((first.points.len(), first.left_out, raw.notes.len()), (6, 2, usize::from(counter)));
        assert!((first.points[0].x_m + 3e-3).abs() < 1e-12, "{}", first.points[0].x_m);
        assert_eq!(raw.profiles[7].frame, counter.then_some(7));
    }
    // A column that the header names, and in which nothing was seen.
    let named = format!("No.,{names}\n") + &text(|k| format!("{k},"), "").replace(",-99.9999\n", ",\n");
    assert_eq!(read_rows(&named).unwrap().profiles[0].left_out, 2);
}

#[test]
fn a_date_beside_a_time_of_day_is_no_height() {
    let rows = text(|k| format!("2026/11/28,14:03:12.{k:03},"), "");
    let raw = read_rows(&format!("Date,Time,0,1,2,3,4,5,6,7\n{rows}")).unwrap();
    assert_eq!((raw.profiles[3].stamp_ns, raw.profiles[3].points.len()), (Some(50_592_003_000_000), 6));
    assert_eq!(raw.notes[0], "the first column `Date` is not used");
}
