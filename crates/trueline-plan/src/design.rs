//! The numbers that a path is made of, and the box that they are searched in.

use crate::axis_course::AxisCourse;
use crate::cell::Cell;
use crate::cell_axis::CellAxis;
use crate::seam::Seam;
use crate::shape::Shape;
use crate::sweep::{Sweep, Swing};
use trueline_dataset::AxisMotion;

/// A path in numbers.
#[derive(Clone, Debug, PartialEq)]
pub struct Design {
    /// How it progresses along the seam.
    pub shape: Shape,
    /// Duration, s.
    pub duration_s: f64,
    /// Time to get up to speed, and to come to rest, s.
    pub ramp_s: f64,
    /// Part of the seam that is scanned.
    pub length_share: f64,
    /// Its middle, as a part of the seam's length from the seam's middle: −½ to ½.
    pub centre: f64,
    /// Place of the seam along the stripe, as a part of the stand-off: the view is wider further away.
    pub stripe: Sweep,
    /// Stand-off, m.
    pub stand_off: Sweep,
    /// Work angle, travel angle, spin, rad.
    pub tilts: [Sweep; 3],
    /// The external axes, in the order of the cell's.
    pub axes: Vec<AxisCourse>,
}

impl Design {
    /// All sweeps: along the stripe, stand-off, work angle, travel angle, spin.
    #[must_use]
    pub fn sweeps(&self) -> [&Sweep; 5] {
        let [work, travel, spin] = &self.tilts;
        [&self.stripe, &self.stand_off, work, travel, spin]
    }

    /// The same with all swings slower by this factor; the one bow of a C stays one.
    #[must_use]
    pub(crate) fn slowed(mut self, times: f64) -> Self {
        let bow_hz = self.stripe.swings[0].frequency_hz;
        for sweep in [&mut self.stripe, &mut self.stand_off].into_iter().chain(&mut self.tilts) {
            *sweep = sweep.slowed(times);
        }
        self.axes = self.axes.into_iter().map(|course| course.slowed(times)).collect();
        if self.shape == Shape::C {
            self.stripe.swings[0].frequency_hz = bow_hz;
        }
        self
    }
}

/// Slowest and fastest swing, Hz.
const FREQUENCY_HZ: [f64; 2] = [0.04, 1.2];
/// Shortest and longest ramp, s; never more than a quarter of the scan.
const RAMP_S: [f64; 2] = [0.4, 2.0];
/// Widest sweep along the stripe to either side: 30°.
const STRIPE: f64 = 0.577;

/// Least scanned length of a seam, m. With less, the answer would depend on one bead, tack or dent, and the seam's direction
/// on almost nothing.
const LEAST_LENGTH_M: f64 = 0.05;
/// Of a short seam this part will do, for its ends may be elsewhere.
const PART_OF_SHORT_SEAM: f64 = 1.0 / 3.0;

/// The least part of a seam that is scanned.
#[must_use]
pub(crate) fn least_share(seam: &Seam) -> f64 {
    (LEAST_LENGTH_M / seam.length_m()).min(PART_OF_SHORT_SEAM)
}

/// Numbers of a design without external axes: ramp, share and centre of the seam. Each sweep has its reach, the shares of its two harmonics,
/// and two frequencies and phases; all but the one along the stripe have a mean.
pub const DIMENSION: usize = 3 + 6 + 4 * 7;
/// Further numbers for an external axis that swings.
const OF_AXIS: usize = 7;

/// Numbers of a design in a cell.
#[must_use]
pub(crate) fn dimension(cell: &Cell) -> usize {
    let swing = cell.axes.iter().filter(|axis| axis.limits.motion == AxisMotion::Swings);
    DIMENSION + OF_AXIS * swing.count()
}

/// Makes the design of a point of the unit box. For any point, means and swings stay within the limits of stand-off
/// and tilt, and the axes within their ranges. Numbers that are missing are in the middle.
#[must_use]
pub(crate) fn from_unit_box(cell: &Cell, shape: Shape, duration_s: f64, unit: &[f64]) -> Design {
    let (limits, seam) = (&cell.limits, &cell.seam);
    let mut rest = unit.iter().map(|x| mirrored(*x));
    let mut next = |low: f64, high: f64| low + (high - low) * rest.next().unwrap_or(0.5);
    let longest_ramp_s = RAMP_S[1].min(0.25 * duration_s);
    let ramp_s = next(RAMP_S[0].min(longest_ramp_s), longest_ramp_s);
    let length_share = next(least_share(seam), 1.0);
    let centre = 0.5 * (1.0 - length_share) * next(-1.0, 1.0);
    let reach = next(0.0, STRIPE);
    let mut stripe = Sweep { mean: 0.0, swings: swings(reach, &mut next) };
    if shape == Shape::C {
        // Half a swing over the whole scan: one bow.
        stripe.swings[0].frequency_hz = 0.5 / (duration_s - ramp_s);
    }
    let mut within = |range: [f64; 2]| {
        let middle = 0.5 * (range[0] + range[1]);
        let half = 0.5 * (range[1] - range[0]);
        let reach = half * next(0.0, 1.0);
        // The mean has the part of the range that the swings leave.
        let mean = middle + (half - reach) * next(-1.0, 1.0);
        Sweep { mean, swings: swings(reach, &mut next) }
    };
    let stand_off = within(limits.stand_off_m);
    let tilts = limits.tilt_rad.map(|limit| within([-limit, limit]));
    let mut course = |axis: &CellAxis| AxisCourse::within(&axis.limits, duration_s - ramp_s, &mut within);
    let axes = cell.axes.iter().map(&mut course).collect();
    Design { shape, duration_s, ramp_s, length_share, centre, stripe, stand_off, tilts, axes }
}

/// Two harmonics with a sum of amplitudes of `reach`.
fn swings(reach: f64, next: &mut impl FnMut(f64, f64) -> f64) -> [Swing; 2] {
    let first = reach * next(0.0, 1.0);
    let [low, high] = FREQUENCY_HZ.map(f64::ln);
    [first, reach - first].map(|amplitude| Swing {
        amplitude,
        frequency_hz: next(low, high).exp(),
        phase_rad: next(-std::f64::consts::PI, std::f64::consts::PI),
    })
}

/// Folds any number into 0 to 1, as between two mirrors, so that a search has no walls.
fn mirrored(x: f64) -> f64 {
    let folded = x.rem_euclid(2.0);
    if folded > 1.0 { 2.0 - folded } else { folded }
}
