//! The one curve of a drawing in DXF: lines, arcs, polylines and splines that meet end to end.
//!
//! DXF in text is lines in pairs, a code and its value; the tables of a drawing are skipped. A library for the whole format
//! needs thirty others, two of them abandoned, and forgets the line of a mistake. So the format is read here.

mod entity;
mod joined;
mod pairs;
mod spline;

use crate::error::Error;
use entity::Entity;
use nalgebra::Vector3;
use pairs::Pairs;
use std::path::Path;

/// Units of a drawing by the number of `$INSUNITS`, in m; a drawing that states none is in millimetres.
const UNITS: [(i64, f64); 8] =
    [(0, 1e-3), (1, 0.0254), (2, 0.3048), (4, 1e-3), (5, 1e-2), (6, 1.0), (13, 1e-6), (14, 0.1)];

/// The points of the curve of a drawing, m: two ends, or the first again at the end of a closed one.
pub(crate) fn points(file: &Path, bytes: &[u8]) -> Result<Vec<Vector3<f64>>, Error> {
    let mut pairs = Pairs::new(file, bytes)?;
    let (mut unit_m, mut pieces) = (1e-3, Vec::new());
    while let Some(pair) = pairs.next_pair()? {
        if !(pair.code == 0 && pair.value == "SECTION") {
            continue;
        }
        match pairs.next_pair()? {
            Some(name) if name.value == "HEADER" => unit_m = unit(&mut pairs)?.unwrap_or(unit_m),
            Some(name) if name.value == "ENTITIES" => pieces = entities(&mut pairs)?,
            _ => {}
        }
    }
    let curve = joined::one_curve(&pairs, pieces)?;
    Ok(curve.into_iter().map(|point| point * unit_m).collect())
}

/// The unit of a drawing, m; `None` where its header states none.
fn unit(pairs: &mut Pairs<'_>) -> Result<Option<f64>, Error> {
    while let Some(pair) = pairs.next_pair()? {
        match (pair.code, pair.value) {
            (0, "ENDSEC") => return Ok(None),
            (9, "$INSUNITS") => {}
            _ => continue,
        }
        let Some(value) = pairs.next_pair()? else { return Ok(None) };
        let number = pairs.whole(&value)?;
        let known = UNITS.iter().find(|(unit, _)| *unit == number);
        return known.map(|(_, unit_m)| Some(*unit_m)).ok_or_else(|| {
            let what = format!("a drawing in the unknown unit {number} of $INSUNITS");
            pairs.error(
                value.line,
                what,
                "export it in millimetres (4), centimetres (5), metres (6) or inches (1)",
            )
        });
    }
    Ok(None)
}

/// The curves of the section of entities, in the unit of the drawing.
fn entities(pairs: &mut Pairs<'_>) -> Result<Vec<joined::Piece>, Error> {
    let mut pieces = Vec::new();
    let mut entity: Option<Entity<'_>> = None;
    while let Some(pair) = pairs.next_pair()? {
        if pair.code != 0 {
            if let Some(entity) = &mut entity {
                entity.pairs.push(pair);
            }
            continue;
        }
        // The corners of an old polyline are entities of their own, up to its SEQEND.
        if let Some(open) = entity.as_mut().filter(|open| open.name == "POLYLINE") {
            if pair.value == "VERTEX" {
                open.pairs.push(pair);
                continue;
            }
            if pair.value == "SEQEND" {
                continue;
            }
        }
        if let Some(done) = entity.take() {
            pieces.push(done.piece(pairs)?);
        }
        if pair.value == "ENDSEC" || pair.value == "EOF" {
            break;
        }
        entity = Some(Entity { name: pair.value, line: pair.line, pairs: Vec::new() });
    }
    if let Some(unfinished) = entity {
        pieces.push(unfinished.piece(pairs)?);
    }
    Ok(pieces)
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;

    fn drawing(entities: &str) -> String {
        let head = "0 SECTION 2 HEADER 9 $INSUNITS 70 4 0 ENDSEC 0 SECTION 2 ENTITIES";
        let words = format!("{head} {entities} 0 ENDSEC 0 EOF");
        words.split_whitespace().collect::<Vec<_>>().join("\n")
    }

    fn read(text: &str) -> Result<Vec<Vector3<f64>>, Error> {
        points(Path::new("part.dxf"), text.as_bytes())
    }

    fn near(points: &[Vector3<f64>], expected: &[[f64; 3]]) {
        assert_eq!(points.len(), expected.len(), "{points:?}");
        for (point, expected) in points.iter().zip(expected) {
            assert!((point * 1e3 - Vector3::from(*expected)).norm() < 1e-6, "{point} {expected:?}");
        }
    }

    #[test]
    fn pieces_in_any_order_and_direction_are_one_curve() {
        let lines = "0 LINE 10 0 20 0 30 1 11 10 21 0 31 1  0 LINE 10 20 20 5 30 1 11 10 21 0 31 1";
        near(&read(&drawing(lines)).unwrap(), &[[0.0, 0.0, 1.0], [10.0, 0.0, 1.0], [20.0, 5.0, 1.0]]);
        let apart = "0 LINE 10 0 20 0 11 10 21 0  0 LINE 10 20 20 5 11 11 21 0";
        let error = read(&drawing(apart)).unwrap_err();
        assert!(error.to_string().contains("line 26") && error.to_string().contains("1.000"), "{error}");
    }

    #[test]
    fn polylines_old_and_new_and_their_bows() {
        let new = "0 LWPOLYLINE 90 3 70 1 38 2 10 0 20 0 10 4 20 0 10 4 20 3";
        near(
            &read(&drawing(new)).unwrap(),
            &[[0.0, 0.0, 2.0], [4.0, 0.0, 2.0], [4.0, 3.0, 2.0], [0.0, 0.0, 2.0]],
        );
        let old = "0 POLYLINE 66 1 70 8 0 VERTEX 10 0 20 0 30 0 70 32 0 VERTEX 10 1 20 2 30 3 70 32 0 SEQEND";
        near(&read(&drawing(old)).unwrap(), &[[0.0; 3], [1.0, 2.0, 3.0]]);
        // A bulge of 1 is half a circle, to the right of the way for a positive one as seen from its middle.
        let bow = "0 LWPOLYLINE 90 2 70 0 10 -1 20 0 42 1 10 1 20 0";
        let points = read(&drawing(bow)).unwrap();
        assert!(points.iter().all(|point| (point.norm() - 1e-3).abs() < 1e-9));
        assert!(points[points.len() / 2].y < -0.9e-3, "{points:?}");
    }

    #[test]
    fn arcs_circles_and_ellipses_in_planes_of_their_own() {
        let arc = "0 ARC 10 0 20 0 30 0 40 2 50 350 51 10";
        let points = read(&drawing(arc)).unwrap();
        assert!(points.iter().all(|point| (point.norm() - 2e-3).abs() < 1e-12 && point.x > 1.9e-3));
        let turned = "0 CIRCLE 10 0 20 0 30 5 40 2 210 1 220 0 230 0";
        let points = read(&drawing(turned)).unwrap();
        assert!(points.iter().all(|point| (point.x - 5e-3).abs() < 1e-12));
        assert!((points[0] - points[points.len() - 1]).norm() < 1e-12);
        let ellipse = "0 ELLIPSE 10 0 20 0 30 0 11 0 21 4 31 0 40 0.5 41 0 42 6.283185307179586";
        let points = read(&drawing(ellipse)).unwrap();
        let on = |point: &Vector3<f64>| (point.y / 4e-3).powi(2) + (point.x / 2e-3).powi(2);
        assert!(points.iter().all(|point| (on(point) - 1.0).abs() < 1e-9));
    }

    /// A rational quadratic spline with the weight cos 45° is a quarter of a circle.
    #[test]
    fn splines_with_weights() {
        let quarter = "0 SPLINE 70 4 71 2 72 6 73 3 40 0 40 0 40 0 40 1 40 1 40 1 41 1 41 0.7071067811865476 41 1 10 1 20 0 30 0 10 1 20 1 30 0 10 0 20 1 30 0";
        let points = read(&drawing(quarter)).unwrap();
        assert!(points.iter().all(|point| (point.norm() - 1e-3).abs() < 1e-12), "{points:?}");
        assert!((points[points.len() - 1] * 1e3 - Vector3::y()).norm() < 1e-12);
    }

    #[test]
    fn what_is_no_curve_is_refused_where_it_stands() {
        for (entities, words) in [
            ("0 TEXT 1 hello", "TEXT"),
            ("0 LINE 10 0 20 zero 11 1 21 0", "line 20"),
            ("0 LINE 10 0 20 0 11 nan 21 0", "a number"),
            ("0 SPLINE 70 0 71 3 40 0 40 1 10 0 20 0", "knots"),
            ("0 POLYLINE 70 64 0 SEQEND", "mesh"),
            ("", "no curve"),
        ] {
            let error = read(&drawing(entities)).unwrap_err();
            assert!(error.to_string().contains(words), "{entities}: {error}");
            assert!(!error.hint().is_empty());
        }
        let inches = drawing("0 LINE 10 0 20 0 11 1 21 0").replace("\n70\n4\n", "\n70\n1\n");
        near(&read(&inches).unwrap(), &[[0.0; 3], [25.4, 0.0, 0.0]]);
        assert!(read(&inches.replace("\n70\n1\n", "\n70\n3\n")).unwrap_err().to_string().contains("unit 3"));
        assert!(read("AutoCAD Binary DXF\r\n\u{1a}\0").unwrap_err().to_string().contains("binary"));
        assert!(read("0\nSECTION\n2").unwrap_err().to_string().contains("line 3"));
    }
}
