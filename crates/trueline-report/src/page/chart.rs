//! Charts: their content, not their drawing.

use super::columns::{Column, Columns};
use serde_json::{Value, json};

/// A chart with its words.
#[derive(Debug)]
pub struct Chart {
    /// Name in its address.
    pub id: &'static str,
    /// Heading.
    pub title: &'static str,
    /// Advice for the reader.
    pub explanation: String,
    /// Its content in words, for readers who cannot see it.
    pub alternative: String,
    /// Whether it takes the whole width.
    pub wide: bool,
    /// Its content.
    pub drawn: Drawn,
}

/// Content of a chart.
#[derive(Debug)]
pub enum Drawn {
    /// Points and lines over two axes.
    Plot {
        /// Horizontal axis.
        x: Axis,
        /// Vertical axis.
        y: Axis,
        /// Points and lines.
        series: Vec<Series>,
        /// Lines across.
        marks: Vec<Mark>,
    },
    /// Counts in bins, and their expectation.
    Histogram(Histogram),
    /// A colour for each pair of names.
    Matrix(Matrix),
    /// A colour for each place.
    Heat(Box<Heat>),
    /// Bars beside names.
    Bars {
        /// Names.
        names: Vec<String>,
        /// Values, one a name.
        values: Vec<f64>,
        /// Axis of the values.
        axis: Axis,
        /// A line across.
        mark: Option<Mark>,
    },
    /// Points and lines in space, equal scales, to be turned around.
    Scene(Vec<Part>),
    /// The same with parts that move, and a slider of time.
    Film {
        /// The fixed parts.
        parts: Vec<Part>,
        /// The moving parts: for each picture equally many points, one picture after the other.
        moving: Vec<Part>,
        /// Their motion, likewise; it may reach beyond the shown part.
        arm: Option<Part>,
        /// When each picture is, s.
        times: Column,
    },
}

/// An axis.
#[derive(Debug, Default)]
pub struct Axis {
    /// Quantity and unit.
    pub name: String,
    /// Logarithmic.
    pub log: bool,
    /// The values are decimal exponents of how rare something is: 3 is written 1 in 10³.
    pub rarity: bool,
    /// Runs downwards.
    pub inverse: bool,
    /// Its ends; else those of the values.
    pub limits: Option<[f64; 2]>,
}

impl Axis {
    /// A linear axis.
    #[must_use]
    pub fn of(name: &str) -> Self {
        Self { name: name.to_owned(), ..Self::default() }
    }

    /// A logarithmic one.
    #[must_use]
    pub fn log(name: &str) -> Self {
        Self { name: name.to_owned(), log: true, ..Self::default() }
    }

    /// One of how rare something is, by the decimal exponent, itself on a logarithmic scale.
    #[must_use]
    pub fn rarity(name: &str) -> Self {
        Self { rarity: true, ..Self::log(name) }
    }

    /// The same from one value to another.
    #[must_use]
    pub fn between(self, low: f64, high: f64) -> Self {
        Self { limits: Some([low, high]), ..self }
    }

    fn json(&self) -> Value {
        json!({ "name": self.name, "log": self.log, "rarity": self.rarity, "inverse": self.inverse, "limits": self.limits })
    }
}

/// Colours of the page, which differ between light and dark.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Colour {
    /// First.
    A,
    /// Second.
    B,
    /// Third.
    C,
    /// Fourth.
    D,
    /// Fifth.
    E,
    /// Sixth.
    F,
    /// Something is wrong.
    Bad,
    /// In the background.
    Soft,
}

impl Colour {
    /// The first six, again and again.
    #[must_use]
    pub fn of(k: usize) -> Self {
        [Self::A, Self::B, Self::C, Self::D, Self::E, Self::F][k % 6]
    }

    fn name(self) -> &'static str {
        match self {
            Self::A => "--a",
            Self::B => "--b",
            Self::C => "--c",
            Self::D => "--d",
            Self::E => "--e",
            Self::F => "--f",
            Self::Bad => "--bad",
            Self::Soft => "--soft",
        }
    }
}

/// Points, or a line through them.
#[derive(Debug)]
pub struct Series {
    /// Name in the legend.
    pub name: String,
    /// Values on the horizontal axis.
    pub x: Column,
    /// Values on the vertical axis.
    pub y: Column,
    /// Colour.
    pub colour: Colour,
    /// A line; else points.
    pub line: bool,
    /// A line that is dashed.
    pub dashed: bool,
    /// A line with its points.
    pub dotted: bool,
    /// For each point the number of a place on the page, `#frame-NUMBER`, that a click leads to.
    pub leads_to: Option<Column>,
}

impl Series {
    /// Points.
    #[must_use]
    pub fn points(name: &str, x: Column, y: Column, colour: Colour) -> Self {
        Self {
            name: name.to_owned(),
            x,
            y,
            colour,
            line: false,
            dashed: false,
            dotted: false,
            leads_to: None,
        }
    }

    /// A line.
    #[must_use]
    pub fn line(name: &str, x: Column, y: Column, colour: Colour) -> Self {
        Self { line: true, ..Self::points(name, x, y, colour) }
    }

    /// A line through points, drawn as steps.
    #[must_use]
    pub fn steps(name: &str, x: Column, y: Column, colour: Colour) -> Self {
        Self { dotted: true, ..Self::line(name, x, y, colour) }
    }

    /// Gaps are part of a line, but no points.
    fn points_drawn(&self, columns: &Columns) -> usize {
        if self.line { columns.len(self.y) } else { columns.finite(self.y) }
    }

    fn json(&self) -> Value {
        json!({
            "name": self.name, "x": self.x.0, "y": self.y.0, "colour": self.colour.name(), "line": self.line,
            "dashed": self.dashed, "dotted": self.dotted, "leads_to": self.leads_to.map(|c| c.0),
        })
    }
}

/// A line across a plot.
#[derive(Debug)]
pub struct Mark {
    /// Name.
    pub name: String,
    /// The place.
    pub at: f64,
    /// Upright, at a value of the horizontal axis.
    pub upright: bool,
}

impl Mark {
    fn json(&self) -> Value {
        json!({ "name": self.name, "at": self.at, "upright": self.upright })
    }
}

/// Counts in equal bins.
#[derive(Debug)]
pub struct Histogram {
    /// Axis of the counted quantity.
    pub axis: Axis,
    /// Start of the first bin.
    pub low: f64,
    /// Width of a bin.
    pub width: f64,
    /// Counts.
    pub counts: Vec<usize>,
    /// Counts that were expected.
    pub expected: Vec<f64>,
    /// Values beyond both ends.
    pub beyond: usize,
}

/// Values for pairs of names.
#[derive(Debug)]
pub struct Matrix {
    /// Names of the columns.
    pub columns: Vec<String>,
    /// Names of the rows.
    pub rows: Vec<String>,
    /// Row by row; values that are not finite are left out.
    pub values: Vec<f64>,
    /// Value of the strongest colour on both sides of zero.
    pub strongest: f64,
}

/// Values for cells of a rectangle.
#[derive(Debug)]
pub struct Heat {
    /// Horizontal axis, with its limits.
    pub x: Axis,
    /// Vertical axis, with its limits.
    pub y: Axis,
    /// Width and height of a cell.
    pub cell: [f64; 2],
    /// Middle of each cell, its value, and how many numbers are behind it.
    pub cells: Vec<[f64; 4]>,
    /// Value of the strongest colour.
    pub strongest: f64,
    /// Whether values lie on both sides of zero.
    pub signed: bool,
    /// Name and unit of the value.
    pub unit: String,
    /// The unit alone.
    pub short: String,
    /// Keep the scales of both axes alike.
    pub equal: bool,
}

/// A part of a scene.
#[derive(Debug)]
pub struct Part {
    /// Name in the legend.
    pub name: String,
    /// x, y, z, x, y, z, …; a gap ends a line.
    pub xyz: Column,
    /// Colour.
    pub colour: Colour,
    /// Lines; else points.
    pub line: bool,
}

impl Part {
    fn json(&self) -> Value {
        json!({ "name": self.name, "xyz": self.xyz.0, "colour": self.colour.name(), "line": self.line })
    }
}

impl Chart {
    pub(super) fn json(&self, columns: &Columns) -> Value {
        let mut value = match &self.drawn {
            Drawn::Plot { x, y, series, marks } => json!({
                "kind": "plot",
                "x": x.json(),
                "y": y.json(),
                "series": series.iter().map(Series::json).collect::<Vec<_>>(),
                "marks": marks.iter().map(Mark::json).collect::<Vec<_>>(),
                "points": series.iter().map(|s| s.points_drawn(columns)).sum::<usize>(),
            }),
            Drawn::Histogram(h) => json!({
                "kind": "histogram", "axis": h.axis.json(), "low": h.low, "width": h.width, "counts": h.counts,
                "expected": h.expected, "beyond": h.beyond, "points": h.counts.len() + h.expected.len(),
            }),
            Drawn::Matrix(m) => {
                let cells: Vec<[f64; 3]> = (m.values.iter().enumerate())
                    .filter(|(_, value)| value.is_finite())
                    .map(|(k, value)| [(k % m.columns.len()) as f64, (k / m.columns.len()) as f64, *value])
                    .collect();
                json!({
                    "kind": "matrix", "columns": m.columns, "rows": m.rows, "points": cells.len(), "cells": cells,
                    "strongest": m.strongest,
                })
            }
            Drawn::Heat(h) => json!({
                "kind": "heat", "x": h.x.json(), "y": h.y.json(), "cell": h.cell, "cells": h.cells, "unit": h.unit, "short": h.short, "strongest": h.strongest, "signed": h.signed, "equal": h.equal, "points": h.cells.len(),
            }),
            Drawn::Bars { names, values, axis, mark } => json!({
                "kind": "bars", "names": names, "values": values, "axis": axis.json(),
                "mark": mark.as_ref().map(Mark::json), "points": values.len(),
            }),
            Drawn::Scene(parts) => {
                json!({
                    "kind": "scene",
                    "parts": parts.iter().map(Part::json).collect::<Vec<_>>(),
                    "points": parts.iter().map(|p| columns.len(p.xyz) / 3).sum::<usize>(),
                })
            }
            Drawn::Film { parts, moving, arm, times } => {
                let still = parts.iter().map(|p| columns.len(p.xyz) / 3).sum::<usize>();
                let filmed =
                    moving.iter().map(|p| columns.len(p.xyz) / 3 / columns.len(*times)).sum::<usize>();
                json!({
                    "kind": "film",
                    "parts": parts.iter().map(Part::json).collect::<Vec<_>>(),
                    "moving": moving.iter().map(Part::json).collect::<Vec<_>>(),
                    "arm": arm.as_ref().map(Part::json),
                    "times": times.0,
                    "points": still + filmed,
                })
            }
        };
        value["id"] = json!(self.id);
        value["alternative"] = json!(self.alternative);
        value
    }
}
