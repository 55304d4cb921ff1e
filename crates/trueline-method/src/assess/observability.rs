//! Observability of the unknowns, with advice for the user.

use crate::problem::parameters::{LINES, Parameters, ROTATION, TIME_OFFSET, TRANSLATION, line_index};
use nalgebra::{DMatrix, Vector3};
use std::fmt;
use trueline_lsq::Information;

/// A direction is observable if its singular value (whitened Jacobian, columns scaled to length one) exceeds this fraction of the largest.
///
/// Tilting by α moves a singular value of about α/√2: 10⁻⁴ is a tilt of 0.01°. Robots repeat their attitude to about 2·10⁻⁵ rad. This noise alone
/// gives values of that size without any tilt.
pub const RANK_THRESHOLD: f64 = 1e-4;

/// A component belongs to the null space if more than this fraction of its square lies there.
const SHARE: f64 = 1e-2;

/// Variances within this factor belong to the same directions.
const WHOLE: f64 = 1.2;

/// Upper bound of the prior standard deviation of any clock, sensor or mounting, s, rad and m.
const MOST_SIGMA_SI: f64 = 1.0;

/// A group of unknowns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Group {
    /// The time offset.
    TimeOffset,
    /// Hand-eye rotation.
    Rotation,
    /// Hand-eye translation.
    Translation,
    /// A line, by its number.
    Line(usize),
}

impl Group {
    /// The name in the result.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::TimeOffset => "time_offset",
            Self::Rotation => "hand_eye_rotation",
            Self::Translation => "hand_eye_translation",
            Self::Line(_) => "line",
        }
    }
}

/// An undetermined unknown of a scan.
#[derive(Clone, Debug, PartialEq)]
pub struct Unobservable {
    /// A group of unknowns.
    pub group: Group,
    /// Unit directions: tool axes for the hand-eye, base axes for a line. Empty for the time offset, and for a component that is known only together
    /// with others.
    pub directions: Vec<[f64; 3]>,
}

impl Unobservable {
    /// The same, direction by direction.
    #[must_use]
    pub fn one_by_one(&self) -> Vec<Self> {
        if self.directions.is_empty() {
            return vec![self.clone()];
        }
        let one = |direction: &[f64; 3]| Self { group: self.group, directions: vec![*direction] };
        self.directions.iter().map(one).collect()
    }
}

/// The undetermined unknown and the motion that determines it.
impl fmt::Display for Unobservable {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let axes = axis_names(&self.directions);
        match self.group {
            Group::TimeOffset => f.write_str(
                "the time offset cannot be determined from this scan. Sweep the sensor across the line, for \
                 example along an S-path of ±10 mm at 0.5 Hz or faster; the stand-off must be constant or \
                 swing at another frequency",
            ),
            Group::Rotation if axes.is_empty() => together(f, "the hand-eye rotation"),
            Group::Rotation => write!(
                f,
                "rotation about the tool's {axes} cannot be determined from this scan. Sweep the seam \
                 through the field of view, along the stripe and in range"
            ),
            Group::Translation if axes.is_empty() => together(f, "the hand-eye translation"),
            Group::Translation => write!(
                f,
                "translation along the tool's {axes} cannot be determined from this scan. Tilt the torch by \
                at least ±10° about {}",
                match self.directions.len() {
                    1 => "an axis perpendicular to it",
                    2 => "the axis perpendicular to both",
                    _ => "two different axes",
                }
            ),
            Group::Line(number) => together(f, &format!("line {number}")),
        }
    }
}

impl std::error::Error for Unobservable {}

fn together(f: &mut fmt::Formatter<'_>, what: &str) -> fmt::Result {
    write!(f, "{what} cannot be determined independently; the motion above also fixes this")
}

/// Directions in words: "x axis", "x, y and z axes", "direction (0.71, 0.71, 0.00)".
fn axis_names(directions: &[[f64; 3]]) -> String {
    let main = |v: &[f64; 3]| Some(["x", "y", "z"][v.iter().position(|part| part.abs() > 0.9)?]);
    let axes: Option<Vec<&str>> = directions.iter().map(main).collect();
    match axes.as_deref() {
        Some([]) => String::new(),
        Some([axis]) => format!("{axis} axis"),
        Some([first @ .., last]) => format!("{} and {last} axes", first.join(", ")),
        None => {
            let name = |v: &[f64; 3]| match main(v) {
                Some(axis) => format!("{axis} axis"),
                None => format!("direction ({:.2}, {:.2}, {:.2})", v[0], v[1], v[2]),
            };
            directions.iter().map(name).collect::<Vec<_>>().join(" and ")
        }
    }
}

/// Observability of the unknowns.
#[derive(Clone, Debug, PartialEq)]
pub struct Observability {
    /// Number of observable directions.
    pub rank: usize,
    /// Number of unknowns estimated.
    pub size: usize,
    /// Largest over smallest singular value.
    pub condition: f64,
    /// All singular values as parts of the largest, falling.
    pub singular_values: Vec<f64>,
    /// The unknowns that make up the direction of each, the strongest first; numbers of the tangent's components.
    pub composition: Vec<Vec<usize>>,
    /// Unobservable unknowns, in the order of the groups.
    pub unobservable: Vec<Unobservable>,
    /// For each component of the tangent, whether it is observable.
    pub observable_components: Vec<bool>,
}

impl Observability {
    /// Whether the whole hand-eye transform is observable.
    #[must_use]
    pub fn shows_hand_eye(&self) -> bool {
        self.observable_components[ROTATION..LINES].iter().all(|seen| *seen)
    }

    /// Whether time offset and hand-eye are both fully observable.
    #[must_use]
    pub(crate) fn shows_all(&self) -> bool {
        self.observable_components[..LINES].iter().all(|seen| *seen)
    }

    /// Whether a group is fully observable.
    #[must_use]
    pub fn shows(&self, group: Group) -> bool {
        self.unobservable.iter().all(|unseen| unseen.group != group)
    }

    /// The same without unbounded unknowns: a standard deviation of metres, radians or seconds means an undetermined number.
    #[must_use]
    pub(crate) fn bounded(mut self, covariance: &DMatrix<f64>) -> Self {
        let has_none = |k: usize| covariance[(k, k)].is_nan() || covariance[(k, k)] > MOST_SIGMA_SI.powi(2);
        let groups = [
            (Group::TimeOffset, TIME_OFFSET..ROTATION),
            (Group::Rotation, ROTATION..TRANSLATION),
            (Group::Translation, TRANSLATION..LINES),
        ];
        for (place, (group, components)) in groups.into_iter().enumerate() {
            let first = components.start;
            let unseen: Vec<usize> = components.filter(|k| has_none(*k)).collect();
            unseen.iter().for_each(|k| self.observable_components[*k] = false);
            if !unseen.is_empty() && self.shows(group) {
                let axis = |k: &usize| std::array::from_fn(|axis| if axis + first == *k { 1.0 } else { 0.0 });
                let directions =
                    if group == Group::TimeOffset { Vec::new() } else { unseen.iter().map(axis).collect() };
                self.unobservable
                    .insert(place.min(self.unobservable.len()), Unobservable { group, directions });
            }
        }
        self
    }

    /// For a scan without usable features.
    pub(crate) fn of_nothing(at: &Parameters) -> Self {
        let size = at.dimension();
        let null = DMatrix::identity(size, size);
        Self {
            rank: 0,
            size: size.saturating_sub(at.unknowns().known_before().len()),
            condition: f64::INFINITY,
            singular_values: vec![0.0; size],
            composition: vec![Vec::new(); size],
            unobservable: named(&null, at, false),
            observable_components: vec![false; size],
        }
    }
}

/// Finds the unobservable unknowns. `information` is `all` without the directions that are noise. `shows_time_offset` states whether the time offset
/// is observable.
#[must_use]
pub fn assess(
    information: &Information,
    all: &Information,
    at: &Parameters,
    shows_time_offset: bool,
) -> Observability {
    let null = information.null_space();
    let share = |k: usize| null.row(k).norm_squared();
    let (known, claimed) = (information.covariance(), all.covariance());
    // A component whose variance depends on a removed direction is not known without it.
    let is_whole = |k: usize| claimed[(k, k)] <= WHOLE * known[(k, k)];
    let mut observable_components: Vec<bool> =
        (0..null.nrows()).map(|k| share(k) <= SHARE && is_whole(k)).collect();
    let only_noise = observable_components[TIME_OFFSET] && !shows_time_offset;
    observable_components[TIME_OFFSET] &= shows_time_offset;
    let shows_time_offset = observable_components[TIME_OFFSET];
    // Bows and shape have a prior. They are always observable and not part of the result.
    let known_before = at.unknowns().known_before().len();
    Observability {
        // A scan without information does not determine even these.
        rank: information.rank().saturating_sub(usize::from(only_noise) + known_before),
        size: information.size().saturating_sub(known_before),
        condition: information.condition(),
        singular_values: information
            .singular_values()
            .iter()
            .map(|value| value / information.singular_values().max().max(f64::MIN_POSITIVE))
            .collect(),
        composition: information.composition().to_vec(),
        unobservable: named(null, at, shows_time_offset),
        observable_components,
    }
}

/// Whether a component belongs to the null space.
pub(crate) fn is_null(null: &DMatrix<f64>, component: usize) -> bool {
    null.row(component).norm_squared() > SHARE
}

/// The null space by groups of unknowns, and the time offset.
pub(crate) fn named(null: &DMatrix<f64>, at: &Parameters, shows_time_offset: bool) -> Vec<Unobservable> {
    let mut unobservable = Vec::new();
    if !shows_time_offset {
        unobservable.push(Unobservable { group: Group::TimeOffset, directions: Vec::new() });
    }
    for (group, first) in [(Group::Rotation, ROTATION), (Group::Translation, TRANSLATION)] {
        let directions: Vec<[f64; 3]> =
            principal_directions(null, first).into_iter().map(Into::into).collect();
        if !directions.is_empty() {
            unobservable.push(Unobservable { group, directions });
        }
    }
    for (k, line) in at.lines.iter().enumerate() {
        if (line_index(k)..line_index(k + 1)).any(|row| null.row(row).norm_squared() > SHARE) {
            let direction = line_direction(null, k, &line.axes());
            unobservable.push(Unobservable { group: Group::Line(k), directions: vec![direction.into()] });
        }
    }
    unobservable
}

/// Directions of a group of three with a large part in the null space, strongest first.
fn principal_directions(null: &DMatrix<f64>, first: usize) -> Vec<Vector3<f64>> {
    let rows = null.rows(first, 3);
    let projector: nalgebra::Matrix3<f64> = (rows * rows.transpose()).fixed_view::<3, 3>(0, 0).into();
    let eigen = projector.symmetric_eigen();
    let mut order = [0, 1, 2];
    order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
    if eigen.eigenvalues.min() > SHARE {
        // None of the three is observable. The tool's axes are then as good as any and easier to read.
        return vec![Vector3::x(), Vector3::y(), Vector3::z()];
    }
    let strong = order.into_iter().filter(|&k| eigen.eigenvalues[k] > SHARE);
    strong.map(|k| with_positive_main(eigen.eigenvectors.column(k).into())).collect()
}

/// Direction in which the line could move: its strongest null offset, or turn, in base.
fn line_direction(null: &DMatrix<f64>, line: usize, axes: &nalgebra::Matrix3<f64>) -> Vector3<f64> {
    let strongest = |first: usize| {
        let rows = null.rows(first, 2);
        let projector: nalgebra::Matrix2<f64> = (rows * rows.transpose()).fixed_view::<2, 2>(0, 0).into();
        let eigen = projector.symmetric_eigen();
        let k = eigen.eigenvalues.imax();
        (eigen.eigenvalues[k], eigen.eigenvectors.column(k).into_owned())
    };
    let (turn, offset) = (strongest(line_index(line)), strongest(line_index(line) + 2));
    let v = if offset.0 >= turn.0 { offset.1 } else { turn.1 };
    with_positive_main(axes.column(1) * v[0] + axes.column(2) * v[1])
}

fn with_positive_main(v: Vector3<f64>) -> Vector3<f64> {
    if v[v.iamax()] < 0.0 { -v } else { v }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;
    use trueline_dataset::Guess;
    use trueline_geometry::{Line, Pose};
    use trueline_model::Curvature;

    #[test]
    fn a_scan_that_shows_nothing_has_no_rank_even_where_bows_are_known_beforehand() {
        let guess = Guess { time_offset_s: 0.0, tool_from_camera: Pose::identity() };
        let line = Line::new(Vector3::zeros(), &Vector3::x_axis());
        let bow = Curvature { bow_m: [0.0; 2], half_length_m: 0.1, middle_m: 0.0 };
        let at = Parameters { curvatures: vec![bow], ..Parameters::straight(&guess, vec![line]) };
        let nothing = Information::new(&DMatrix::zeros(at.dimension(), at.dimension()), &[], 1e-6).unwrap();
        let found = assess(&nothing, &nothing, &at, true);
        assert_eq!((found.rank, found.size), (0, at.dimension() - at.unknowns().known_before().len()));
        assert!(found.observable_components.iter().all(|seen| !seen), "{found:?}");
    }
}
