//! Points near each other as a graph: connected parts, and distances along it.

use crate::order_statistics::median;
use nalgebra::{Matrix3, Vector3};

/// The radius is this multiple of the median distance to the neighbour of this rank …
const RADIUS: (f64, usize) = (3.0, 6);
/// … and at least this, m.
const LEAST_RADIUS_M: f64 = 3e-3;
/// A point with fewer neighbours than this fraction of the median is an outlier. The farthest point of a graph would be one, and
/// would look like the end of the curve.
const LEAST_DEGREE: f64 = 0.35;
/// A part with less than this fraction of the points is a cluster of outliers.
const LEAST_PART: f64 = 0.08;
/// Parts are one curve if the gap between their ends is less than this fraction of the shorter part, or if the sensor crossed
/// the gap from one reading to the next: then the order of time is the order along the curve …
const SHORT_GAP: f64 = 0.3;
/// … and if both ends point into the gap (cosine): the ends of two seams side by side do not.
const FACING: f64 = 0.5;
/// A neighbour lies to one side if it is this far along, in radii.
pub(crate) const ASIDE: f64 = 0.3;
/// A reading belongs to an end within this many radii.
const AT_END: f64 = 2.0;

/// A connected part.
struct Part {
    /// Its ends, each with its outward direction.
    ends: [(usize, Vector3<f64>); 2],
    /// Distance between its ends along the graph, m.
    length_m: f64,
}

/// The neighbour graph of some points.
#[derive(Clone, Debug)]
pub(crate) struct Graph {
    /// Neighbours of each point with their distances, m.
    edges: Vec<Vec<(usize, f64)>>,
    /// Radius of a neighbourhood, m.
    pub radius_m: f64,
    /// Points that are left.
    pub kept: Vec<bool>,
    /// Direction of the sensor's travel at each point if the curve crosses itself; else empty.
    along: Vec<Vector3<f64>>,
}

impl Graph {
    /// From points in the order of time, m, without outliers; `None` if there are too few.
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
        Some(Self { edges, radius_m, kept, along: Vec::new() })
    }

    /// The same; points of two crossing branches are no neighbours.
    #[must_use]
    pub(crate) fn parted(mut self, points: &[Vector3<f64>]) -> Self {
        let along = directions(points);
        if !self.crosses(points, &along) {
            return self;
        }
        for (k, edges) in self.edges.iter_mut().enumerate() {
            edges.retain(|(other, _)| are_alike(&along[k], &along[*other]));
        }
        self.along = along;
        self
    }

    /// Whether crossing branches were separated.
    #[must_use]
    pub(crate) fn is_parted(&self) -> bool {
        !self.along.is_empty()
    }

    /// Whether two points may lie on one branch.
    #[must_use]
    pub(crate) fn are_on_one_branch(&self, one: usize, other: usize) -> bool {
        self.along.is_empty() || are_alike(&self.along[one], &self.along[other])
    }

    /// Whether the points continue in two directions somewhere, to both sides in each.
    #[must_use]
    fn crosses(&self, points: &[Vector3<f64>], along: &[Vector3<f64>]) -> bool {
        /// At a crossing each branch has this fraction of the neighbours, and each side this fraction of the branch.
        const LEAST: (f64, f64) = (0.25, 0.2);
        let goes_on = |at: usize, branch: &[usize]| {
            let Some(first) = branch.first().map(|k| along[*k]) else { return false };
            let aside = |sign: f64| {
                let side = |k: &&usize| sign * first.dot(&(points[**k] - points[at])) > ASIDE * self.radius_m;
                branch.iter().filter(side).count() as f64
            };
            aside(1.0).min(aside(-1.0)) > LEAST.1 * branch.len() as f64
        };
        let is_crossing = |at: &usize| {
            let (own, other): (Vec<usize>, Vec<usize>) =
                self.neighbours(*at).partition(|k| are_alike(&along[*at], &along[*k]));
            let least = LEAST.0 * (own.len() + other.len()) as f64;
            own.len().min(other.len()) as f64 > least && goes_on(*at, &own) && goes_on(*at, &other)
        };
        (0..points.len()).filter(|k| self.kept[*k]).any(|at| is_crossing(&at))
    }

    /// The same with every point: for tests of the removal of outliers.
    #[cfg(test)]
    pub(crate) fn with_all(mut self) -> Self {
        self.kept.fill(true);
        self
    }

    /// The same with parts joined whose ends face each other across a short gap without seam points.
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
        let crossed = self.crossings(points);
        let mut best: Option<(usize, usize, f64)> = None;
        for (k, one) in parts.iter().enumerate() {
            for other in &parts[k + 1..] {
                for (from, leads_from) in &one.ends {
                    for (to, leads_to) in &other.ends {
                        let gap = points[*to] - points[*from];
                        let length_m = gap.norm();
                        let at =
                            |k: usize, end: usize| (points[k] - points[end]).norm() < AT_END * self.radius_m;
                        let goes = |(a, b): &(usize, usize)| {
                            (at(*a, *from) && at(*b, *to)) || (at(*a, *to) && at(*b, *from))
                        };
                        let shorter_m = one.length_m.min(other.length_m);
                        let is_short = length_m < SHORT_GAP * shorter_m || crossed.iter().any(goes);
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

    /// Consecutive readings that are no neighbours.
    fn crossings(&self, points: &[Vector3<f64>]) -> Vec<(usize, usize)> {
        let kept: Vec<usize> = (0..points.len()).filter(|k| self.kept[*k]).collect();
        let steps = kept.windows(2).map(|pair| (pair[0], pair[1]));
        steps.filter(|(a, b)| (points[*a] - points[*b]).norm() > self.radius_m).collect()
    }

    /// The connected parts without clusters of outliers.
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

    /// Outward direction at an end: away from the neighbours.
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

    /// Number of remaining points.
    #[must_use]
    pub(crate) fn size(&self) -> usize {
        self.kept.iter().filter(|kept| **kept).count()
    }

    /// Remaining neighbours of a point.
    pub(crate) fn neighbours(&self, of: usize) -> impl Iterator<Item = usize> {
        self.edges[of].iter().map(|(k, _)| *k).filter(|k| self.kept[*k])
    }

    /// Distance of each point along the graph, m; infinite if it is not connected.
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

    /// The farthest point from another along the graph.
    #[must_use]
    pub(crate) fn farthest(&self, from: usize) -> Option<(usize, Vec<f64>)> {
        let distances_m = self.distances_m(from);
        let reached = (0..distances_m.len()).filter(|k| distances_m[*k].is_finite());
        let farthest = reached.max_by(|a, b| distances_m[*a].total_cmp(&distances_m[*b]))?;
        Some((farthest, distances_m))
    }
}

/// Direction of the sensor's travel at each point in the order of time: the principal direction of the unit vectors between
/// nearby points. Outliers hardly turn it.
#[must_use]
pub(crate) fn directions(points: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
    /// Number of points before and after.
    const ABOUT: usize = 4;
    let about = |k: usize| &points[k.saturating_sub(ABOUT)..(k + ABOUT + 1).min(points.len())];
    let direction = |k: usize| {
        let mut spread = Matrix3::zeros();
        let near = about(k);
        for (i, one) in near.iter().enumerate() {
            for other in &near[i + 1..] {
                let along = (other - one).try_normalize(0.0).unwrap_or_default();
                spread += along * along.transpose();
            }
        }
        let eigen = spread.symmetric_eigen();
        eigen.eigenvectors.column(eigen.eigenvalues.imax()).into_owned()
    };
    (0..points.len()).map(direction).collect()
}

/// Whether two directions may belong to one branch: up to 37° apart.
fn are_alike(one: &Vector3<f64>, other: &Vector3<f64>) -> bool {
    const COSINE: f64 = 0.8;
    one.dot(other).abs() > COSINE
}
