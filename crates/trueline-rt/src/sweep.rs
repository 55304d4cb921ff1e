//! The motion of the camera while one frame is read out: all at once, or over a time.

use crate::error::PlaceError;
use crate::points::Points;
use crate::settings::Readout;
use nalgebra::{Matrix3x4, Matrix4};
use trueline_geometry::Pose;

/// Time from one knot to the next, s: a tool that turns at 2 rad/s moves a point 0.3 m away by (2 · 0.5 ms)²/8 · 0.3 m = 40 nm off the
/// straight line between them.
const STEP_S: f64 = 0.000_5;
/// Most knots; longer readouts have longer steps.
const MOST: usize = 64;
/// Steps by which rounding may put an exposure outside the knots.
const ROUNDING: f64 = 1e-6;
/// A step over lost or missing poses flags the points in it.
const NO_KNOT: Knot = Knot {
    base_by_point: Matrix3x4::new(
        f64::NAN,
        f64::NAN,
        f64::NAN,
        f64::NAN,
        f64::NAN,
        f64::NAN,
        f64::NAN,
        f64::NAN,
        f64::NAN,
        f64::NAN,
        f64::NAN,
        f64::NAN,
    ),
    form: Matrix4::new(
        0.0,
        0.0,
        0.0,
        0.0,
        0.0,
        0.0,
        0.0,
        0.0,
        0.0,
        0.0,
        0.0,
        0.0,
        0.0,
        0.0,
        0.0,
        f64::INFINITY,
    ),
    age_s: f64::INFINITY,
};

/// Pose of the camera at one time.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Knot {
    /// A point in base, by the point in the camera and 1.
    pub base_by_point: Matrix3x4<f64>,
    /// The variance of it, m².
    pub form: Matrix4<f64>,
    pub age_s: f64,
}

impl Knot {
    pub(crate) fn new(base_from_camera: &Pose, form: &Matrix4<f64>, age_s: f64) -> Self {
        let base_by_point = base_from_camera.to_homogeneous().fixed_view::<3, 4>(0, 0).into_owned();
        Self { base_by_point, form: *form, age_s }
    }

    fn toward(&self, other: &Self, share: f64) -> Self {
        Self {
            base_by_point: self.base_by_point + (other.base_by_point - self.base_by_point) * share,
            form: self.form + (other.form - self.form) * share,
            age_s: self.age_s,
        }
    }

    fn is_there(&self) -> bool {
        self.age_s.is_finite()
    }
}

/// The camera over the exposure of a frame.
#[expect(clippy::large_enum_variant, reason = "one a frame, on the stack")]
#[derive(Debug)]
pub(crate) enum Sweep {
    /// All points are exposed at once.
    Still(Knot),
    /// One after the other.
    Moving(Knots),
}

/// Knots at even steps from the first exposure to the last.
#[derive(Debug)]
pub(crate) struct Knots {
    knots: [Knot; MOST],
    count: usize,
    from_s: f64,
    step_s: f64,
}

impl Sweep {
    /// Over the readout of some points; `at` places the camera at a time after the first exposure, s.
    pub(crate) fn over(
        readout: Readout,
        points: &Points<'_>,
        at: impl Fn(f64) -> Result<Knot, PlaceError>,
    ) -> Result<Self, PlaceError> {
        let [from_s, to_s] = span_s(readout, points);
        if from_s >= to_s {
            return Ok(Self::Still(at(if from_s.is_finite() { from_s } else { 0.0 })?));
        }
        let steps = (((to_s - from_s) / STEP_S).ceil() as usize).clamp(1, MOST - 1);
        let step_s = (to_s - from_s) / steps as f64;
        let mut sweep = Knots { knots: [NO_KNOT; MOST], count: steps + 1, from_s, step_s };
        let mut refused = None;
        for (k, knot) in sweep.knots.iter_mut().take(steps + 1).enumerate() {
            match at(from_s + step_s * k as f64) {
                Ok(there) => *knot = there,
                Err(error) => refused = Some(error),
            }
        }
        match refused {
            Some(error) if !sweep.knots.iter().any(Knot::is_there) => Err(error),
            _ => Ok(Self::Moving(sweep)),
        }
    }

    /// The least age of all knots, s.
    pub(crate) fn age_s(&self) -> f64 {
        match self {
            Self::Still(knot) => knot.age_s,
            Self::Moving(sweep) => {
                sweep.knots[..sweep.count].iter().map(|knot| knot.age_s).fold(f64::INFINITY, f64::min)
            }
        }
    }
}

impl Knots {
    /// Pose of the camera at a time after the first exposure, s; `None` if no pose is known.
    pub(crate) fn at(&self, after_s: f64) -> Option<Knot> {
        let place = (after_s - self.from_s) / self.step_s;
        // The last exposure may come out a little beyond the last knot.
        if !(place >= -ROUNDING && place <= (self.count - 1) as f64 + ROUNDING) {
            return None;
        }
        let index = (place as usize).min(self.count.saturating_sub(2));
        let (from, to) = (&self.knots[index], self.knots.get(index + 1)?);
        (from.is_there() && to.is_there()).then(|| from.toward(to, place - index as f64))
    }
}

/// First and last exposure of some points, s; infinite of none.
fn span_s(readout: Readout, points: &Points<'_>) -> [f64; 2] {
    let count = points.len();
    let ends = |mut times_s: &mut dyn Iterator<Item = f64>| {
        let times_s = (&mut times_s).filter(|time_s| time_s.is_finite());
        times_s
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[from, to], time_s| [from.min(time_s), to.max(time_s)])
    };
    match (readout, points) {
        (Readout::ByRow(_) | Readout::ByColumn(_), Points::Pixels(pixels)) => {
            ends(&mut pixels.iter().map(|pixel| readout.after_s(0, *pixel)))
        }
        (Readout::ByIndex(_), _) if count > 0 => {
            ends(&mut [0, count - 1].into_iter().map(|k| readout.after_s(k, [0.0; 2])))
        }
        _ => [0.0, 0.0],
    }
}
