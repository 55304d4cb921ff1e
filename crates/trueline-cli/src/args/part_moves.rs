//! `--part-moves` and `--seam-part-moves`: MM[,DEG].

use trueline_method::PartMoves;

/// Scatter of the turn about each axis, degrees, if none is stated.
const TURN_DEG: f64 = 0.1;
/// Largest shift, mm: the start of a curve takes the part as fixed within this.
const MOST_MM: f64 = 3.0;
/// Largest turn, degrees.
const MOST_DEG: f64 = 2.0;

/// Scatter of a part's place.
pub(crate) fn part_moves(text: &str) -> Result<PartMoves, String> {
    let wrong = |expected: &str| {
        format!("expected {expected}, found {text}; for example 0.3 (mm) or 0.3,0.1 (mm, degrees)")
    };
    let (shift, turn) = text.split_once(',').map_or((text, None), |(shift, turn)| (shift, Some(turn)));
    let within = |text: &str, most: f64| text.trim().parse().ok().filter(|x: &f64| *x > 0.0 && *x <= most);
    let shift_mm = within(shift, MOST_MM).ok_or_else(|| wrong("a shift above 0, up to 3 mm"))?;
    let turn_deg = turn.map_or(Some(TURN_DEG), |turn| within(turn, MOST_DEG));
    let turn_deg = turn_deg.ok_or_else(|| wrong("a turn above 0, up to 2 degrees"))?;
    Ok(PartMoves { shift_m: shift_mm * 1e-3, turn_rad: turn_deg.to_radians() })
}

#[cfg(test)]
mod tests {
    use super::{TURN_DEG, part_moves};

    #[test]
    fn a_shift_and_a_turn_are_read() {
        let both = part_moves("0.3, 0.2").unwrap_or_else(|message| unreachable!("{message}"));
        // But for rounding.
        assert!((both.shift_m - 0.3e-3).abs() < 1e-12 && (both.turn_rad.to_degrees() - 0.2).abs() < 1e-12);
        let shift = part_moves("0.3").unwrap_or_else(|message| unreachable!("{message}"));
        assert!((shift.turn_rad.to_degrees() - TURN_DEG).abs() < 1e-12);
    }

    #[test]
    fn other_text_is_refused_with_an_example() {
        for text in ["", "0", "-1", "4", "nan", "0.3,", "0.3,0", "0.3,3", "0.3,0.1,2", "inf"] {
            let Err(message) = part_moves(text) else { unreachable!("{text} was read") };
            assert!(message.contains("0.3,0.1"), "{message}");
        }
    }
}
