//! Entities of a drawing as points along them, in the unit of the drawing.

use super::joined::Piece;
use super::pairs::{Pair, Pairs};
use super::spline::Nurbs;
use crate::error::Error;
use nalgebra::{Matrix3, Vector3};
use std::f64::consts::{PI, TAU};

/// Points of a whole turn: a radius of 50 mm is cut by half a micrometre.
const PER_TURN: f64 = 720.0;
/// A plane with a normal this near to z has its axes from y [the format's own number].
const NEAR_Z: f64 = 1.0 / 64.0;

/// An entity with its pairs.
pub(super) struct Entity<'a> {
    pub(super) name: &'a str,
    pub(super) line: u64,
    pub(super) pairs: Vec<Pair<'a>>,
}

impl Entity<'_> {
    /// The points along it.
    pub(super) fn piece(&self, pairs: &Pairs<'_>) -> Result<Piece, Error> {
        let points = match self.name {
            "LINE" => vec![self.point(pairs, 10)?, self.point(pairs, 11)?],
            "LWPOLYLINE" | "POLYLINE" => self.polyline(pairs)?,
            "ARC" | "CIRCLE" => self.arc(pairs)?,
            "ELLIPSE" => self.ellipse(pairs)?,
            "SPLINE" => self.spline(pairs)?,
            other => {
                let what = format!("a drawing with {other}, which is not part of a curve");
                let hint =
                    "export the seam alone: lines, arcs, circles, ellipses, polylines and splines are read";
                return Err(pairs.error(self.line, what, hint));
            }
        };
        Ok(Piece { line: self.line, points })
    }

    fn wrong(&self, pairs: &Pairs<'_>, what: &str) -> Error {
        pairs.error(self.line, format!("a {} {what}", self.name), "export it as a polyline of points")
    }

    fn number(&self, pairs: &Pairs<'_>, code: i64) -> Result<Option<f64>, Error> {
        self.pairs.iter().find(|pair| pair.code == code).map(|pair| pairs.number(pair)).transpose()
    }

    fn needed(&self, pairs: &Pairs<'_>, code: i64) -> Result<f64, Error> {
        self.number(pairs, code)?.ok_or_else(|| self.wrong(pairs, &format!("without its value {code}")))
    }

    fn numbers(&self, pairs: &Pairs<'_>, code: i64) -> Result<Vec<f64>, Error> {
        self.pairs.iter().filter(|pair| pair.code == code).map(|pair| pairs.number(pair)).collect()
    }

    fn flags(&self, pairs: &Pairs<'_>) -> Result<i64, Error> {
        let own = self.pairs.iter().take_while(|pair| pair.code != 0).find(|pair| pair.code == 70);
        own.map_or(Ok(0), |pair| pairs.whole(pair))
    }

    /// x and y at `code` and the next ten, z if present.
    fn point(&self, pairs: &Pairs<'_>, code: i64) -> Result<Vector3<f64>, Error> {
        let [x, y] = [self.needed(pairs, code)?, self.needed(pairs, code + 10)?];
        Ok(Vector3::new(x, y, self.number(pairs, code + 20)?.unwrap_or(0.0)))
    }

    /// From the plane that an entity was drawn in to the drawing.
    fn plane(&self, pairs: &Pairs<'_>) -> Result<Matrix3<f64>, Error> {
        if self.number(pairs, 210)?.is_none() {
            return Ok(Matrix3::identity());
        }
        let normal = self.point(pairs, 210)?.try_normalize(1e-12);
        let normal = normal.ok_or_else(|| self.wrong(pairs, "in a plane without a normal"))?;
        let is_near = normal.x.abs() < NEAR_Z && normal.y.abs() < NEAR_Z;
        let x = if is_near { Vector3::y() } else { Vector3::z() }.cross(&normal).normalize();
        Ok(Matrix3::from_columns(&[x, normal.cross(&x), normal]))
    }

    fn polyline(&self, pairs: &Pairs<'_>) -> Result<Vec<Vector3<f64>>, Error> {
        let is_old = self.name == "POLYLINE";
        let flags = self.flags(pairs)?;
        if is_old && flags & (16 | 64) != 0 {
            return Err(self.wrong(pairs, "that is a mesh, and no curve"));
        }
        let is_flat = !is_old || flags & 8 == 0;
        let height = if is_old { 30 } else { 38 };
        let before = || self.pairs.iter().take_while(|pair| !is_old || pair.code != 0);
        let elevation =
            before().find(|pair| pair.code == height).map(|pair| pairs.number(pair)).transpose()?;
        let mut corners: Vec<Corner> = Vec::new();
        let of_corners = self.pairs.iter().skip(if is_old { before().count() } else { 0 });
        for pair in of_corners {
            match (pair.code, corners.last_mut()) {
                (0, _) if is_old => corners.push(Corner::default()),
                (10, _) if !is_old => {
                    corners.push(Corner {
                        place: Vector3::new(pairs.number(pair)?, 0.0, 0.0),
                        ..Corner::default()
                    });
                }
                (10, Some(corner)) => corner.place.x = pairs.number(pair)?,
                (20, Some(corner)) => corner.place.y = pairs.number(pair)?,
                (30, Some(corner)) if is_old => corner.place.z = pairs.number(pair)?,
                (42, Some(corner)) => corner.bulge = pairs.number(pair)?,
                (70, Some(corner)) if is_old => corner.is_frame = pairs.whole(pair)? & 16 != 0,
                _ => {}
            }
        }
        corners.retain(|corner| !corner.is_frame);
        if is_flat {
            corners.iter_mut().for_each(|corner| corner.place.z = elevation.unwrap_or(corner.place.z));
        }
        if flags & 1 != 0 {
            corners.extend(corners.first().copied());
        }
        let plane = if is_flat { self.plane(pairs)? } else { Matrix3::identity() };
        let mut points: Vec<Vector3<f64>> = Vec::new();
        for pair in corners.windows(2) {
            points.push(pair[0].place);
            points.extend(pair[0].bow(&pair[1]));
        }
        points.extend(corners.last().map(|corner| corner.place));
        Ok(points.iter().map(|point| plane * point).collect())
    }

    fn arc(&self, pairs: &Pairs<'_>) -> Result<Vec<Vector3<f64>>, Error> {
        let (centre, radius, plane) = (self.point(pairs, 10)?, self.needed(pairs, 40)?, self.plane(pairs)?);
        let (from, to) = if self.name == "CIRCLE" {
            (0.0, TAU)
        } else {
            (self.needed(pairs, 50)? * PI / 180.0, self.needed(pairs, 51)? * PI / 180.0)
        };
        let at = |angle: f64| centre + Vector3::new(angle.cos(), angle.sin(), 0.0) * radius;
        Ok(turn(from, to).map(|angle| plane * at(angle)).collect())
    }

    fn ellipse(&self, pairs: &Pairs<'_>) -> Result<Vec<Vector3<f64>>, Error> {
        let (centre, major) = (self.point(pairs, 10)?, self.point(pairs, 11)?);
        let normal = if self.number(pairs, 210)?.is_some() { self.point(pairs, 210)? } else { Vector3::z() };
        let normal = normal.try_normalize(1e-12).ok_or_else(|| self.wrong(pairs, "without a normal"))?;
        let minor = normal.cross(&major) * self.needed(pairs, 40)?;
        let from = self.number(pairs, 41)?.unwrap_or(0.0);
        let to = self.number(pairs, 42)?.unwrap_or(TAU);
        Ok(turn(from, to).map(|angle| centre + major * angle.cos() + minor * angle.sin()).collect())
    }

    fn spline(&self, pairs: &Pairs<'_>) -> Result<Vec<Vector3<f64>>, Error> {
        let [x, y, z] = [10, 20, 30].map(|code| self.numbers(pairs, code));
        let (x, y, mut z) = (x?, y?, z?);
        z.resize(x.len(), 0.0);
        if x.is_empty() || x.len() != y.len() {
            return Err(self.wrong(pairs, "without control points"));
        }
        let control = (0..x.len()).map(|k| Vector3::new(x[k], y[k], z[k])).collect();
        let degree = self.needed(pairs, 71)?;
        let nurbs = Nurbs::new(degree, self.numbers(pairs, 40)?, control, self.numbers(pairs, 41)?);
        let nurbs = nurbs
            .ok_or_else(|| self.wrong(pairs, "with knots, weights and control points that do not fit"))?;
        Ok(nurbs.points())
    }
}

/// Angles from one to another against the clock, rad.
fn turn(from: f64, to: f64) -> impl Iterator<Item = f64> {
    let over = (to - from).rem_euclid(TAU);
    let over = if over < 1e-9 { TAU } else { over };
    let count = (over / TAU * PER_TURN).ceil().max(2.0);
    (0..=count as usize).map(move |k| from + over * k as f64 / count)
}

/// A corner of a polyline.
#[derive(Clone, Copy, Default)]
struct Corner {
    place: Vector3<f64>,
    /// Tangent of a quarter of the angle of the arc to the next corner; positive against the clock.
    bulge: f64,
    /// Whether it only frames a smoothed polyline.
    is_frame: bool,
}

impl Corner {
    /// Points between this corner and the next.
    fn bow(&self, next: &Self) -> Vec<Vector3<f64>> {
        let chord = next.place - self.place;
        if self.bulge == 0.0 || chord.norm() == 0.0 {
            return Vec::new();
        }
        let angle = 4.0 * self.bulge.atan();
        // From the middle of the chord to the centre.
        let aside = Vector3::new(-chord.y, chord.x, 0.0) * (0.5 / (0.5 * angle).tan());
        let centre = self.place + chord * 0.5 + aside;
        let arm = self.place - centre;
        let count = (angle.abs() / TAU * PER_TURN).ceil().max(2.0);
        let at = |k: usize| {
            let (sine, cosine) = (angle * k as f64 / count).sin_cos();
            centre + Vector3::new(cosine * arm.x - sine * arm.y, sine * arm.x + cosine * arm.y, arm.z)
        };
        (1..count as usize).map(at).collect()
    }
}
