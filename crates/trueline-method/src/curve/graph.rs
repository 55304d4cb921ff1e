//! Points near each other as a graph: connected parts, and distances along it.

use crate::order_statistics::median;
use nalgebra::Vector3;

/// The radius is this many times the distance of the neighbour of this rank, in the median …
const RADIUS: (f64, usize) = (3.0, 6);
/// … and at least this, m.
const LEAST_RADIUS_M: f64 = 3e-3;
/// A point with fewer neighbours than this part of the median is an outlier: the farthest point of a graph would be one, and be
/// mistaken for the end of the curve.
const LEAST_DEGREE: f64 = 0.35;
/// A part with fewer of the points is a heap of outliers.
const LEAST_PART: f64 = 0.08;
/// Parts are one curve if the gap between their ends is less than this part of the shorter of them …
const SHORT_GAP: f64 = 0.3;
/// … and both ends lead into it (cosine): the ends of two seams side by side do not.
const FACING: f64 = 0.5;

/// A connected part.
struct Part {
    /// Its ends, each with the direction in which it leads.
    ends: [(usize, Vector3<f64>); 2],
    /// Distance of its ends along the graph, m.
    length_m: f64,
}

/// The neighbour graph of some points.
#[derive(Clone, Debug)]
pub(crate) struct Graph {
    /// Neighbours of each point with their distance, m.
    edges: Vec<Vec<(usize, f64)>>,
    /// Within this points are neighbours, m.
    pub radius_m: f64,
    /// Which points are left.
    pub kept: Vec<bool>,
}

impl Graph {
    /// Of points, m, without outliers; `None` of too few.
    #[must_use]
    pub(crate) fn of(points: &[Vector3<f64>]) -> Option<Self> {
        let count = points.len();
        if count <= RADIUS.1 + 1 {
            return None;
        }
        let mut near = Vec::with_capacity(count);
        for one in points {
            let mut squares: Vec<f64> = points.iter().map(|other| (other - one).norm_squared()).collect();
            near.push(squares.select_nth_unstable_by(RADIUS.1, f64::total_cmp).1.sqrt());
        }
        let radius_m = (RADIUS.0 * median(near.into_iter())?).max(LEAST_RADIUS_M);
        let neighbours = |i: usize| {
            let of = points.iter().enumerate().filter(move |(j, _)| *j != i);
            of.map(move |(j, other)| (j, (other - points[i]).norm())).filter(move |(_, d)| *d < radius_m)
        };
        let edges: Vec<Vec<(usize, f64)>> = (0..count).map(|i| neighbours(i).collect()).collect();
        let least = LEAST_DEGREE * median(edges.iter().map(|e| e.len() as f64))?;
        let kept = edges.iter().map(|e| e.len() as f64 >= least).collect();
        Some(Self { edges, radius_m, kept })
    }

    /// The same with every point, for tests of what leaving some out is good for.
    #[cfg(test)]
    pub(crate) fn with_all(mut self) -> Self {
        self.kept.fill(true);
        self
    }

    /// The same with parts joined whose ends face each other across a short gap: there the seam was not seen.
    #[must_use]
    pub(crate) fn bridged(mut self, points: &[Vector3<f64>]) -> Self {
        while let Some((from, to, length_m)) = self.bridge(points) {
            self.edges[from].push((to, length_m));
            self.edges[to].push((from, length_m));
        }
        self
    }

    /// The shortest gap that may be bridged.
    fn bridge(&self, points: &[Vector3<f64>]) -> Option<(usize, usize, f64)> {
        let parts = self.parts(points);
        let mut best: Option<(usize, usize, f64)> = None;
        for (k, one) in parts.iter().enumerate() {
            for other in &parts[k + 1..] {
                for (from, leads_from) in &one.ends {
                    for (to, leads_to) in &other.ends {
                        let gap = points[*to] - points[*from];
                        let length_m = gap.norm();
                        let is_short = length_m < SHORT_GAP * one.length_m.min(other.length_m);
                        let faces = leads_from.dot(&gap) > FACING * length_m
                            && -leads_to.dot(&gap) > FACING * length_m;
                        if is_short && faces && best.is_none_or(|(_, _, best_m)| length_m < best_m) {
                            best = Some((*from, *to, length_m));
                        }
                    }
                }
            }
        }
        best
    }

    /// The connected parts that are no heaps of outliers.
    fn parts(&self, points: &[Vector3<f64>]) -> Vec<Part> {
        let mut seen = vec![false; self.kept.len()];
        let mut parts = Vec::new();
        for start in 0..self.kept.len() {
            if !self.kept[start] || seen[start] {
                continue;
            }
            let Some((first, distances_m)) = self.farthest(start) else { continue };
            let reached = distances_m.iter().map(|d| d.is_finite());
            let size = reached.clone().filter(|reached| *reached).count();
            reached.zip(&mut seen).for_each(|(own, seen)| *seen |= own);
            if size as f64 >= LEAST_PART * points.len() as f64
                && let Some((last, distances_m)) = self.farthest(first)
            {
                let ends = [first, last].map(|end| (end, self.leads(points, end)));
                parts.push(Part { ends, length_m: distances_m[last] });
            }
        }
        parts
    }

    /// Where the curve leads at an end: away from the neighbours.
    fn leads(&self, points: &[Vector3<f64>], end: usize) -> Vector3<f64> {
        let away: Vector3<f64> = self.neighbours(end).map(|k| points[end] - points[k]).sum();
        away.try_normalize(0.0).unwrap_or_default()
    }

    /// The same with the largest connected part alone.
    #[must_use]
    pub(crate) fn largest_part(mut self) -> Self {
        let mut best: Vec<bool> = vec![false; self.kept.len()];
        let mut seen = vec![false; self.kept.len()];
        for start in 0..self.kept.len() {
            if !self.kept[start] || seen[start] {
                continue;
            }
            let part: Vec<bool> = self.distances_m(start).iter().map(|d| d.is_finite()).collect();
            part.iter().zip(&mut seen).for_each(|(own, seen)| *seen |= own);
            let size = |part: &[bool]| part.iter().filter(|own| **own).count();
            if size(&part) > size(&best) {
                best = part;
            }
        }
        self.kept = best;
        self
    }

    /// The same without some points.
    #[must_use]
    pub(crate) fn without(&self, left_out: impl Fn(usize) -> bool) -> Self {
        let kept = self.kept.iter().enumerate().map(|(k, kept)| *kept && !left_out(k)).collect();
        Self { kept, ..self.clone() }
    }

    /// Number of points that are left.
    #[must_use]
    pub(crate) fn size(&self) -> usize {
        self.kept.iter().filter(|kept| **kept).count()
    }

    /// Neighbours of a point that are left.
    pub(crate) fn neighbours(&self, of: usize) -> impl Iterator<Item = usize> {
        self.edges[of].iter().map(|(k, _)| *k).filter(|k| self.kept[*k])
    }

    /// Distance of each point along the graph, m; infinite of those that are not connected.
    #[must_use]
    pub(crate) fn distances_m(&self, from: usize) -> Vec<f64> {
        let count = self.kept.len();
        let (mut distances_m, mut done) = (vec![f64::INFINITY; count], vec![false; count]);
        distances_m[from] = 0.0;
        loop {
            let open = (0..count).filter(|k| !done[*k] && distances_m[*k].is_finite());
            let Some(next) = open.min_by(|a, b| distances_m[*a].total_cmp(&distances_m[*b])) else {
                return distances_m;
            };
            done[next] = true;
            for (k, length_m) in &self.edges[next] {
                let by_way_m = distances_m[next] + length_m;
                if self.kept[*k] && by_way_m < distances_m[*k] {
                    distances_m[*k] = by_way_m;
                }
            }
        }
    }

    /// The point that is farthest from another along the graph.
    #[must_use]
    pub(crate) fn farthest(&self, from: usize) -> Option<(usize, Vec<f64>)> {
        let distances_m = self.distances_m(from);
        let reached = (0..distances_m.len()).filter(|k| distances_m[*k].is_finite());
        let farthest = reached.max_by(|a, b| distances_m[*a].total_cmp(&distances_m[*b]))?;
        Some((farthest, distances_m))
    }
}
