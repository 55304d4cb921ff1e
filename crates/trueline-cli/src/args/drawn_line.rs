//! `--drawn-line`: X,Y,Z:X,Y,Z in mm.

use nalgebra::Vector3;
use trueline_method::DrawnLine;

/// Two points of a line, m.
pub(crate) fn points_m(text: &str) -> Result<[Vector3<f64>; 2], String> {
    let wrong =
        |why: &str| format!("`{text}`: {why}; for example 1150,80,120:1450,80,120 (mm, robot's base)");
    let (from, to) = text.split_once(':').ok_or_else(|| wrong("expected two points with a colon between"))?;
    let point =
        |text: &str| point_m(text).ok_or_else(|| wrong("a point is three numbers with commas between"));
    let points = [point(from)?, point(to)?];
    let differ = DrawnLine::through(0, points, 0.0).is_some();
    differ.then_some(points).ok_or_else(|| wrong("the points are less than a millimetre apart"))
}

fn point_m(text: &str) -> Option<Vector3<f64>> {
    let numbers: Vec<f64> = text
        .split(',')
        .map(|number| number.trim().parse().ok().filter(|x: &f64| x.is_finite()))
        .collect::<Option<_>>()?;
    let [x, y, z] = numbers.as_slice() else { return None };
    Some(Vector3::new(*x, *y, *z) * 1e-3)
}

#[cfg(test)]
mod tests {
    use super::points_m;
    use nalgebra::Vector3;

    #[test]
    fn two_points_are_read_in_millimetres() {
        let found = points_m("1150,-80,120: 1450.5,80,1.2e2").unwrap_or_default();
        let wanted = [Vector3::new(1.150, -0.080, 0.120), Vector3::new(1.4505, 0.080, 0.120)];
        // But for rounding.
        assert!(found.iter().zip(wanted).all(|(found, wanted)| (found - wanted).amax() < 1e-12), "{found:?}");
    }

    #[test]
    fn what_is_no_line_is_refused_with_an_example() {
        for (text, why) in [
            ("1,2,3", "two points"),
            ("1,2:3,4,5", "three numbers"),
            ("1,2,3:4,5,x", "three numbers"),
            ("1,2,3:4,5,nan", "three numbers"),
            ("1,2,3:1,2,3.5", "less than a millimetre"),
        ] {
            let Err(message) = points_m(text) else { unreachable!("{text} was read") };
            assert!(message.contains(why) && message.contains("1450"), "{message}");
        }
    }
}
