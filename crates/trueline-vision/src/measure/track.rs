//! Path of a straight segment through the picture: one station for each column, or row, that it crosses.

use crate::frame::Frame;
use crate::lens::Lens;
use crate::line::Line2;
use crate::picture::Level;

/// Distance along the line of the points that are computed; between them is interpolated. Distortion bends a
/// line by some 1e-4 px per px²: 1e-4 · 16² / 8 = 0.003 px at most, half of it on average, and alternating.
const NODE_PX: f64 = 16.0;

/// One section through the stripe.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Station {
    /// Distance along the line in the ideal picture, px.
    pub s: f64,
    /// Column (or row) of the section.
    pub at: usize,
    /// Place of the line in it: row (or column), px.
    pub centre: f64,
    /// Pixels along the section for a pixel square to the line in the ideal picture.
    pub stretch: f64,
}

/// The sections along a stretch of a line.
#[derive(Clone, Debug, Default)]
pub struct Track {
    /// The sections, by rising distance along the line or by falling.
    pub stations: Vec<Station>,
    /// Whether sections are columns; else rows.
    pub by_columns: bool,
}

struct Node {
    s: f64,
    /// Coordinate that counts the sections, and the one along them.
    along: f64,
    across: f64,
    stretch: f64,
}

impl Track {
    /// Lays sections along a line between two distances, as far as the picture reaches.
    pub fn lay<L: Level>(&mut self, line: &Line2, span: [f64; 2], frame: Frame<'_, L>) {
        let middle = frame.lens.distorted(&line.at(0.5 * (span[0] + span[1]))).1 * line.along;
        self.by_columns = middle.x.abs() >= middle.y.abs();
        self.lay_again(line, span, frame);
    }

    /// Lays sections along a line that has hardly moved: by columns, or rows, as before.
    pub(crate) fn lay_again<L: Level>(&mut self, line: &Line2, span: [f64; 2], frame: Frame<'_, L>) {
        self.stations.clear();
        let limit = if self.by_columns { frame.picture.width() } else { frame.picture.height() };
        let steps = ((span[1] - span[0]) / NODE_PX).ceil().max(1.0);
        let mut before = self.node(line, span[0], frame.lens);
        for k in 1..=steps as usize {
            let after = self.node(line, span[0] + (span[1] - span[0]) * k as f64 / steps, frame.lens);
            self.between(&before, &after, limit);
            before = after;
        }
    }

    /// Keeps every second section: enough for a first look.
    pub fn thin(&mut self) {
        let kept = self.stations.len().div_ceil(2);
        for k in 0..kept {
            self.stations[k] = self.stations[2 * k];
        }
        self.stations.truncate(kept);
    }

    fn node(&self, line: &Line2, s: f64, lens: &Lens) -> Node {
        let (pixel, d_distorted) = lens.distorted(&line.at(s));
        let (along, across) = if self.by_columns { (0, 1) } else { (1, 0) };
        let (tangent, normal) = (d_distorted * line.along, d_distorted * line.normal());
        // Moving the line by its normal moves its crossing with a fixed section.
        let stretch = normal[across] - normal[along] * tangent[across] / tangent[along];
        Node { s, along: pixel[along], across: pixel[across], stretch }
    }

    /// The sections from one node to the next, the first included and the last not.
    fn between(&mut self, from: &Node, to: &Node, limit: usize) {
        let rising = to.along > from.along;
        let (low, high) = if rising { (from.along, to.along) } else { (to.along, from.along) };
        let first = low.ceil().max(0.0) as usize;
        let end = (high.ceil().max(0.0) as usize).min(limit);
        let sections = first..end.max(first);
        let length = to.along - from.along;
        let station = |at: usize| {
            let part = (at as f64 - from.along) / length;
            let mix = |a: f64, b: f64| a + (b - a) * part;
            Station {
                s: mix(from.s, to.s),
                at,
                centre: mix(from.across, to.across),
                stretch: mix(from.stretch, to.stretch),
            }
        };
        if rising {
            self.stations.extend(sections.map(station));
        } else {
            self.stations.extend(sections.rev().map(station));
        }
    }
}
