//! The link of the cell that a change belongs to: clock, bracket, sensor, fixture, or the axis that carries the fixture.
//!
//! A fixture that moved on its table is at another place of the table, at every angle. A table that moved or leans is at another
//! place of base, so it displaces the part by an amount that turns with the table. With D the displacement in base and A(q) the
//! table at the angle q of a weld, the part is displaced by A(q)⁻¹ D A(q) on the table. Welds at one angle cannot separate the
//! two, so both are named.

use super::change::VISIBLE;
use super::piece::PieceInformation;
use crate::parameters::{ALL, CALIBRATION, Kind};
use crate::quadratic::Quadratic;
use nalgebra::{DMatrix, DVector};

/// A part of the cell that can move.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Link {
    /// The time offset.
    Clock,
    /// The bracket of the sensor.
    Bracket,
    /// The sensor itself.
    Sensor,
    /// The fixture of the part.
    Fixture,
    /// The axis that carries the fixture.
    Axis,
}

impl Link {
    /// The link of a kind of change.
    #[must_use]
    pub fn of(kind: Kind) -> Self {
        match kind {
            Kind::Timing => Self::Clock,
            Kind::Bracket => Self::Bracket,
            Kind::Sensor => Self::Sensor,
            Kind::Seam => Self::Fixture,
        }
    }

    /// Its name in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Clock => "clock",
            Self::Bracket => "bracket",
            Self::Sensor => "sensor",
            Self::Fixture => "fixture",
            Self::Axis => "axis",
        }
    }

    fn kind(self) -> Kind {
        match self {
            Self::Clock => Kind::Timing,
            Self::Bracket => Kind::Bracket,
            Self::Sensor => Kind::Sensor,
            Self::Fixture | Self::Axis => Kind::Seam,
        }
    }
}

/// Welds before and after a change.
pub(crate) struct BeforeAndAfter<'a> {
    /// Good welds before it.
    pub before: Vec<&'a PieceInformation>,
    /// All welds since then.
    pub after: &'a [PieceInformation],
    /// Uncertainty of the calibration itself.
    pub prior: &'a Quadratic,
    /// The part with a possibly moved fixture.
    pub part: usize,
}

/// The links that explain some welds about as well as the best, among those that the detector names and the axis. `variance` is
/// that of single pieces relative to their evidence, by kind.
#[must_use]
pub(crate) fn of(
    welds: &BeforeAndAfter<'_>,
    named: &[Kind],
    variance: impl Fn(Kind) -> f64,
    told_apart: f64,
) -> Vec<Link> {
    let mut candidates: Vec<Link> = named.iter().map(|kind| Link::of(*kind)).collect();
    if welds.after.iter().all(|piece| piece.part_from_axis.is_none()) {
        return sorted(candidates);
    }
    let changes = welds.changes();
    if changes.is_empty() {
        // The earlier place of the part is unknown.
        candidates.extend(candidates.contains(&Link::Fixture).then_some(Link::Axis));
        return sorted(candidates);
    }
    let worth = |link: Link| worth(&changes, link, welds.part) / variance(link.kind());
    let all: Vec<(Link, f64)> =
        candidates.into_iter().chain([Link::Axis]).map(|link| (link, worth(link))).collect();
    let best = all.iter().map(|(_, worth)| *worth).fold(f64::NEG_INFINITY, f64::max);
    sorted(all.into_iter().filter(|(_, worth)| *worth > best - told_apart).map(|(link, _)| link).collect())
}

fn sorted(mut links: Vec<Link>) -> Vec<Link> {
    links.sort_unstable();
    links.dedup();
    links
}

impl<'a> BeforeAndAfter<'a> {
    /// The welds after the change, with evidence relative to the usual state of their part; parts without a good weld are left
    /// out.
    fn changes(&self) -> Vec<(&'a PieceInformation, Quadratic)> {
        let changed = |piece: &'a PieceInformation| {
            let usual = self.usual(piece.part)?;
            let Quadratic { matrix, vector } = &piece.evidence;
            Some((piece, Quadratic { matrix: matrix.clone(), vector: vector - matrix * usual }))
        };
        self.after.iter().filter_map(changed).collect()
    }

    /// Error of the calibration and mean place of a part before the change, in [`UNITS`].
    fn usual(&self, part: usize) -> Option<DVector<f64>> {
        let mut own = self.before.iter().filter(|piece| piece.part == part).peekable();
        own.peek()?;
        let mut sum = Quadratic::nothing(ALL);
        own.for_each(|piece| sum.add(&piece.evidence));
        let mut calibration = sum.matrix.view_mut((0, 0), (CALIBRATION, CALIBRATION));
        calibration += &self.prior.matrix;
        let mut calibration = sum.vector.rows_mut(0, CALIBRATION);
        calibration += &self.prior.vector;
        let directions = shown(&sum, 1.0);
        Some(directions.iter().fold(DVector::zeros(ALL), |at, (direction, information)| {
            at + direction * (direction.dot(&sum.vector) / information)
        }))
    }
}

/// Directions that some pieces determine, with their information.
fn shown(sum: &Quadratic, pieces: f64) -> Vec<(DVector<f64>, f64)> {
    let eigen = sum.matrix.clone().symmetric_eigen();
    let pairs = eigen.eigenvalues.iter().enumerate().filter(|(_, value)| **value > VISIBLE * pieces);
    pairs.map(|(k, value)| (eigen.eigenvectors.column(k).into_owned(), *value)).collect()
}

/// The sum of squares explained by a change of a link, minus its dimensions.
fn worth(changes: &[(&PieceInformation, Quadratic)], link: Link, part: usize) -> f64 {
    let columns = link.kind().columns();
    let mut sum = Quadratic::nothing(columns.len());
    for (piece, evidence) in changes {
        let mut map = DMatrix::zeros(ALL, columns.len());
        match (link, &piece.part_from_axis) {
            (Link::Axis, Some(by_axis)) => map.view_mut((CALIBRATION, 0), (6, 6)).copy_from(by_axis),
            (Link::Axis, None) => continue,
            // Another part's fixture may stay.
            (Link::Fixture, _) if piece.part != part => continue,
            _ => map.view_mut((columns.start, 0), (columns.len(), columns.len())).fill_with_identity(),
        }
        sum.add(&evidence.of_unknowns(&map));
    }
    let directions = shown(&sum, changes.len() as f64);
    directions
        .iter()
        .map(|(direction, information)| direction.dot(&sum.vector).powi(2) / information - 1.0)
        .sum()
}
