//! Straight segments among the edgels: the line with the most brightness along it, then the next.
//!
//! Lines through two edgels with the same direction are tried in a fixed, spread order and refitted. This is RANSAC
//! \[Fischler1981\] without chance, so the same picture gives the same answer.

use crate::fastest::fastest;
use crate::lens::Lens;
use crate::line::Line2;
use crate::locate::edgel::Edgel;
use crate::locate::tiles::{MOST_CANDIDATES, TILE};
use nalgebra::Vector2;

/// Distance within which an edgel lies on a line, px.
const NEAR_PX: f32 = 2.5;
/// Sine of the angle within which an edgel points along a line.
const PARALLEL: f32 = 0.35;
/// Lines that are tried for one segment.
const TRIALS: usize = 160;
/// Edgels a segment has at least.
pub(crate) const FEWEST: usize = 3;
/// Part of a stretch that edgels cover where the stripe is continuous; scattered glints cover less.
const CONTINUOUS: f64 = 0.7;
/// Largest number of segments.
pub(crate) const MOST_SEGMENTS: usize = 8;
/// An edgel in the ideal picture.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Mark {
    at: [f32; 2],
    along: [f32; 2],
    weight: f32,
    sigma_px: f32,
    brightness: f32,
}

/// An edgel on a segment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SegmentMark {
    /// Distance along the segment's line from its point, px.
    pub s: f64,
    /// Distance from the line, px; positive on the side of its normal.
    pub beside_px: f64,
    /// Its weight.
    pub weight: f64,
}

/// A straight segment of the stripe.
#[derive(Clone, Debug, PartialEq)]
pub struct LineSegment {
    /// Its line in the ideal picture.
    pub line: Line2,
    /// Edgels along it, by rising distance.
    pub marks: Vec<SegmentMark>,
    /// Typical standard deviation of the brightness across it, px.
    pub sigma_px: f64,
    /// Typical brightness above the surroundings, in levels.
    pub brightness: f64,
}

impl LineSegment {
    /// Weight of all its edgels.
    #[must_use]
    pub fn weight(&self) -> f64 {
        self.marks.iter().map(|mark| mark.weight).sum()
    }

    /// First and last edgel along the line, px.
    #[must_use]
    pub fn span(&self) -> [f64; 2] {
        let ends = self.marks.first().zip(self.marks.last());
        ends.map_or([0.0; 2], |(first, last)| [first.s, last.s])
    }

    /// Turns a segment of a picture made smaller by a factor into one of the picture itself.
    pub(crate) fn unbin(&mut self, factor: usize) {
        let k = factor as f64;
        self.line.point = (self.line.point * k).add_scalar(0.5 * (k - 1.0));
        for mark in &mut self.marks {
            mark.s *= k;
            mark.beside_px *= k;
        }
        self.sigma_px *= k;
    }

    /// Length from its first edgel to its last, px.
    #[must_use]
    pub fn length_px(&self) -> f64 {
        let [first, last] = self.span();
        last - first
    }

    /// How far it is continuous from one of its ends on, px.
    #[must_use]
    pub(crate) fn continuous_from_end_px(&self, from_last: bool) -> f64 {
        let [first, last] = self.span();
        if from_last {
            continuous_px(self.marks.iter().rev().map(|mark| last - mark.s))
        } else {
            continuous_px(self.marks.iter().map(|mark| mark.s - first))
        }
    }

    /// Weight of the edgels in a stretch along the line.
    #[must_use]
    pub(crate) fn weight_between(&self, from: f64, to: f64) -> f64 {
        self.marks.iter().filter(|mark| (from..to).contains(&mark.s)).map(|mark| mark.weight).sum()
    }

    /// Length of a stretch along the line that edgels cover, px: a tile for each tile's length with one.
    #[must_use]
    pub(crate) fn covered_px(&self, from: f64, to: f64) -> f64 {
        let tile = TILE as f64;
        let mut last = f64::NEG_INFINITY;
        let mut covered = 0.0;
        for SegmentMark { s, .. } in self.marks.iter().filter(|mark| (from..=to).contains(&mark.s)) {
            covered += (s - last).min(tile);
            last = *s;
        }
        covered
    }
}

/// Properties of the marks that every trial line uses, field by field: many are processed at once.
#[derive(Clone, Debug, Default)]
struct MarkColumns {
    u: Vec<f32>,
    v: Vec<f32>,
    along_u: Vec<f32>,
    along_v: Vec<f32>,
    weight: Vec<f32>,
    /// Weights of those on the last line that was tried, zero for others.
    on_line: Vec<f32>,
}

impl MarkColumns {
    fn fill(&mut self, marks: &[Mark]) {
        let fill = |column: &mut Vec<f32>, value: fn(&Mark) -> f32| {
            column.clear();
            column.extend(marks.iter().map(value));
            // Whole lanes: entries without weight add nothing.
            column.resize(marks.len().next_multiple_of(LANES), 0.0);
        };
        fill(&mut self.u, |mark| mark.at[0]);
        fill(&mut self.v, |mark| mark.at[1]);
        fill(&mut self.along_u, |mark| mark.along[0]);
        fill(&mut self.along_v, |mark| mark.along[1]);
        fill(&mut self.weight, |mark| mark.weight);
        fill(&mut self.on_line, |_| 0.0);
    }
}

/// Marks that are added up at once.
const LANES: usize = 8;

/// Weight of the marks along a line through a point.
#[inline(always)]
fn support(marks: &mut MarkColumns, through: [f32; 2], along: [f32; 2]) -> f32 {
    let MarkColumns { u, v, along_u, along_v, weight, on_line } = marks;
    let at = u.iter().zip(&*v).zip(along_u.iter().zip(&*along_v));
    for ((on_line, ((u, v), (along_u, along_v))), weight) in on_line.iter_mut().zip(at).zip(&*weight) {
        let beside = along[0] * (v - through[1]) - along[1] * (u - through[0]);
        let turned = along[0] * along_v - along[1] * along_u;
        let is_on = (beside.abs() < NEAR_PX) & (turned.abs() < PARALLEL);
        *on_line = if is_on { *weight } else { 0.0 };
    }
    let mut sums = [0.0_f32; LANES];
    for weights in on_line.as_chunks::<LANES>().0 {
        for k in 0..LANES {
            sums[k] += weights[k];
        }
    }
    sums.iter().sum()
}

/// Finds segments; keeps its memory from one picture to the next.
#[derive(Clone, Debug)]
pub(crate) struct SegmentFinder {
    trials: usize,
    marks: Vec<Mark>,
    columns: MarkColumns,
    members: Vec<Mark>,
    /// Memory of segments that are gone.
    spare: Vec<Vec<SegmentMark>>,
}

impl Default for SegmentFinder {
    fn default() -> Self {
        Self::with_trials(TRIALS)
    }
}

impl SegmentFinder {
    /// One that tries another number of lines for a segment.
    pub(crate) fn with_trials(trials: usize) -> Self {
        Self {
            trials,
            marks: Vec::new(),
            columns: MarkColumns::default(),
            members: Vec::new(),
            spare: Vec::new(),
        }
    }

    /// The straight segments among the edgels, the strongest first.
    pub(crate) fn find(&mut self, edgels: &[Edgel], lens: &Lens, segments: &mut Vec<LineSegment>) {
        self.spare.extend(segments.drain(..).map(|segment| segment.marks));
        self.marks.clear();
        let brightest = edgels.iter().fold(0.0_f32, |top, e| top.max(e.brightness));
        self.marks.extend(edgels.iter().filter_map(|edgel| mark(edgel, lens, brightest)));
        while segments.len() < MOST_SEGMENTS && self.marks.len() >= FEWEST {
            let Some(line) = self.best_line().and_then(|line| self.refitted(line)) else { break };
            self.take(&line);
            if self.members.len() < FEWEST {
                break;
            }
            let memory = self.spare.pop().unwrap_or_else(|| Vec::with_capacity(MOST_CANDIDATES));
            segments.push(segment(&line, &mut self.members, memory));
        }
    }

    /// The line through two edgels that has the most others along it.
    fn best_line(&mut self) -> Option<Line2> {
        self.columns.fill(&self.marks);
        let count = self.marks.len();
        let mut best: Option<(f32, Mark, [f32; 2])> = None;
        for trial in 0..self.trials {
            // Multiples of irrational numbers spread evenly over all pairs.
            let first = self.marks[spread(trial, 0.618_034, count)];
            let second = self.marks[spread(trial, 0.414_214_f32 + trial as f32 * 1e-4, count)];
            let chord = [second.at[0] - first.at[0], second.at[1] - first.at[1]];
            let length = chord[0].hypot(chord[1]);
            if length < 1.5 * TILE as f32 {
                continue;
            }
            let along = chord.map(|c| c / length);
            if !(parallel(along, first.along) && parallel(along, second.along)) {
                continue;
            }
            let score = fastest!(support(&mut self.columns, first.at, along));
            if best.as_ref().is_none_or(|(most, _, _)| score > *most) {
                best = Some((score, first, along));
            }
        }
        best.map(|(_, mark, along)| Line2 {
            point: Vector2::from(mark.at.map(f64::from)),
            along: Vector2::from(along.map(f64::from)),
        })
    }

    /// Weighted orthogonal regression over the edgels near a line, twice.
    fn refitted(&self, line: Line2) -> Option<Line2> {
        let mut line = line;
        for _ in 0..2 {
            let (mut sum, mut mean) = (0.0, Vector2::zeros());
            let mut second = nalgebra::Matrix2::zeros();
            for mark in self.marks.iter().filter(|mark| lies_on(mark, &line)) {
                let (at, weight) = (Vector2::from(mark.at.map(f64::from)), f64::from(mark.weight));
                // About the line's point: sums of squares of large coordinates would lose digits.
                let from = at - line.point;
                sum += weight;
                mean += from * weight;
                second += from * from.transpose() * weight;
            }
            if sum <= 0.0 {
                return None;
            }
            mean /= sum;
            let spread = second / sum - mean * mean.transpose();
            let angle = 0.5 * (2.0 * spread.m12).atan2(spread.m11 - spread.m22);
            line = Line2 { point: line.point + mean, along: Vector2::new(angle.cos(), angle.sin()) };
        }
        Some(line)
    }

    /// Moves the edgels along a line to the members.
    fn take(&mut self, line: &Line2) {
        self.members.clear();
        let members = &mut self.members;
        self.marks.retain(|mark| {
            let on = lies_on(mark, line);
            if on {
                members.push(*mark);
            }
            !on
        });
    }
}

fn mark(edgel: &Edgel, lens: &Lens, brightest: f32) -> Option<Mark> {
    let at = lens.ideal(edgel.u, edgel.v);
    let ahead = lens.ideal(edgel.u + 4.0 * edgel.along[0], edgel.v + 4.0 * edgel.along[1]);
    let along = [ahead[0] - at[0], ahead[1] - at[1]];
    let length = along[0].hypot(along[1]);
    // Dim ghosts count less than the stripe, but a dim arm still counts.
    let weight = (edgel.brightness / brightest).sqrt();
    let mark = Mark {
        at,
        along: along.map(|c| c / length),
        weight,
        sigma_px: edgel.sigma_px,
        brightness: edgel.brightness,
    };
    (length.is_finite() && length > 0.0 && weight.is_finite()).then_some(mark)
}

/// The segment along a line; `marks` is memory that may be used.
fn segment(line: &Line2, members: &mut [Mark], mut marks: Vec<SegmentMark>) -> LineSegment {
    marks.clear();
    marks.extend(members.iter().map(|mark| {
        let at = Vector2::from(mark.at.map(f64::from));
        let [s, beside_px] = [line.station(&at), line.distance(&at)];
        SegmentMark { s, beside_px, weight: f64::from(mark.weight) }
    }));
    marks.sort_unstable_by(|a, b| a.s.total_cmp(&b.s));
    let mut middle = |value: fn(&Mark) -> f32| {
        let half = members.len() / 2;
        f64::from(value(members.select_nth_unstable_by(half, |a, b| value(a).total_cmp(&value(b))).1))
    };
    LineSegment { line: *line, marks, sigma_px: middle(|m| m.sigma_px), brightness: middle(|m| m.brightness) }
}

fn spread(trial: usize, ratio: f32, count: usize) -> usize {
    let part = ((trial + 1) as f32 * ratio).fract();
    ((part * count as f32) as usize).min(count - 1)
}

fn parallel(a: [f32; 2], b: [f32; 2]) -> bool {
    (a[0] * b[1] - a[1] * b[0]).abs() < PARALLEL
}

fn lies_on(mark: &Mark, line: &Line2) -> bool {
    let at = Vector2::from(mark.at.map(f64::from));
    line.distance(&at).abs() < f64::from(NEAR_PX)
        && parallel(mark.along, [line.along.x as f32, line.along.y as f32])
}

/// The longest stretch from the first edgel on that edgels cover continuously, px; `stations` rise.
#[must_use]
pub(crate) fn continuous_px(stations: impl Iterator<Item = f64>) -> f64 {
    let tile = TILE as f64;
    let (mut begin, mut last) = (f64::NAN, f64::NAN);
    let (mut covered, mut longest) = (0.0, 0.0);
    for s in stations.filter(|s| *s >= 0.0) {
        if begin.is_nan() {
            (begin, last) = (s, s - tile);
        }
        covered += (s - last).min(tile);
        last = s;
        let length = s - begin + tile;
        if covered >= CONTINUOUS * length {
            longest = length;
        }
    }
    longest
}
