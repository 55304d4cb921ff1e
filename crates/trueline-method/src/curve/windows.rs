//! Clock and hand-eye transform without a curve: in each short window the seam is a parabola of its own.
//!
//! In a window the readings in base are split along y, a first estimate of the seam's direction: the mean normal of the laser
//! sheet, which needs no lever, or the principal direction of the points. Across y they are a quadratic of s = y·p with six
//! coefficients. Variable projection eliminates these, so seven unknowns remain. It needs no curve, no order, no passes and no
//! start for t.

use crate::curve::arrow::SHARED;
use crate::curve::readings::Readings;
use crate::curve::sight::{HandEye, moved};
use nalgebra::{Matrix2x3, Matrix3, SMatrix, SVector, Vector2, Vector3};
use trueline_dataset::Guess;
use trueline_geometry::so3;
use trueline_lsq::Loss;

type Shared = SMatrix<f64, SHARED, SHARED>;

/// A window with fewer readings has no information.
const LEAST_READINGS: usize = 8;
/// The principal direction of the points is the seam's if it is within 53° of the sheet's normal.
const NEAR_COSINE: f64 = 0.6;
/// Longest step in t_d (s), φ (rad) and t (m).
const MOST_STEP: [f64; 3] = [0.08, 0.5, 0.2];
/// Prior standard deviations of t_d (s), φ (rad) and t (m), in units of the scale's residual.
const KNOWN: [f64; 3] = [2.0, 5.0, 0.3];
/// The parabola of a window is first fitted with a scale this many times larger.
const PARABOLA: [f64; 3] = [4.0, 2.0, 1.0];

/// Readings by windows.
#[derive(Clone, Debug)]
pub(crate) struct Windows {
    spans: Vec<Vec<usize>>,
    count: usize,
}

impl Windows {
    /// Windows of a duration, s, of readings thinned to a rate, 1/s.
    #[must_use]
    pub(crate) fn of(readings: &Readings, lasts_s: f64, rate_hz: f64) -> Self {
        let mut spans: Vec<Vec<usize>> = Vec::new();
        for label in readings.labels() {
            let (mut begun, mut taken) = (f64::NEG_INFINITY, f64::NEG_INFINITY);
            for k in readings.of_line(label) {
                let stamp_s = readings.list[k].stamp_s;
                if stamp_s - begun >= lasts_s {
                    begun = stamp_s;
                    spans.push(Vec::new());
                }
                if stamp_s - taken >= 1.0 / rate_hz - 1e-9 {
                    taken = stamp_s;
                    if let Some(span) = spans.last_mut() {
                        span.push(k);
                    }
                }
            }
        }
        spans.retain(|span| span.len() >= LEAST_READINGS);
        let count = spans.iter().map(Vec::len).sum();
        Self { spans, count }
    }

    /// Whether there are no windows.
    #[must_use]
    pub(crate) fn is_empty(&self) -> bool {
        self.spans.is_empty()
    }

    /// The result of steps with these scales of the loss, m; from the third on the points give the direction. With the mean loss
    /// at the last scale, 0 to 1; `None` if no window can be placed. `first` is the number of earlier steps; the hand-eye
    /// transform may be held.
    #[must_use]
    pub(crate) fn followed(
        &self,
        readings: &Readings,
        from: &Guess,
        scales_m: &[f64],
        (first, only_time): (usize, bool),
    ) -> Option<(Guess, f64)> {
        let mut at = *from;
        for (k, scale_m) in scales_m.iter().enumerate() {
            let sums = self.sums(readings, &at, *scale_m, first + k >= 2);
            let sums = if only_time { sums.of_time() } else { sums };
            at = moved(&at, &sums.step(&at)?);
        }
        Some((at, self.cost(readings, &at, *scales_m.last()?)))
    }

    /// Mean loss with a scale, m, with the points giving the directions: 0 to 1.
    fn cost(&self, readings: &Readings, at: &Guess, scale_m: f64) -> f64 {
        let (mut placed, mut explained) = (Vec::new(), 0.0);
        for span in &self.spans {
            place(readings, at, span, &mut placed);
            let frame = Frame::of(&placed, true).filter(|_| placed.len() >= LEAST_READINGS);
            let parabola = frame.and_then(|frame| Parabola::of(&frame, scale_m));
            explained += parabola.map_or(0.0, |parabola| parabola.explained);
        }
        1.0 - explained / self.count.max(1) as f64
    }

    fn sums(&self, readings: &Readings, at: &Guess, scale_m: f64, by_points: bool) -> Sums {
        let mut sums = Sums::default();
        let mut placed = Vec::new();
        for span in &self.spans {
            place(readings, at, span, &mut placed);
            if placed.len() >= LEAST_READINGS {
                sums.add(&placed, scale_m, by_points);
            }
        }
        sums
    }
}

/// A reading in base with its derivatives.
struct Placed {
    point: Vector3<f64>,
    /// The sheet's normal in base.
    normal: Vector3<f64>,
    by_shared: SMatrix<f64, 3, SHARED>,
}

fn place(readings: &Readings, at: &Guess, span: &[usize], placed: &mut Vec<Placed>) {
    placed.clear();
    let hand_eye = HandEye::of(at);
    let normal_in_tool = hand_eye.rotation * readings.sheet.plane().normal().into_inner();
    for k in span {
        let reading = &readings.list[*k];
        let Some(moving) = readings.motion.nearly_at(reading.stamp_s - at.time_offset_s) else { continue };
        let turned = hand_eye.rotation * reading.point;
        let lever = turned + hand_eye.translation;
        let mut by_shared = SMatrix::<f64, 3, SHARED>::zeros();
        let flight = moving.velocity + moving.attitude * moving.body_rate.cross(&lever);
        by_shared.set_column(0, &-flight);
        by_shared.fixed_columns_mut::<3>(1).copy_from(&(moving.attitude * -so3::hat(&turned)));
        by_shared.fixed_columns_mut::<3>(4).copy_from(&moving.attitude);
        placed.push(Placed {
            point: moving.position + moving.attitude * lever,
            normal: moving.attitude * normal_in_tool,
            by_shared,
        });
    }
}

/// The equations of all windows.
#[derive(Default)]
struct Sums {
    hessian: Shared,
    gradient: SVector<f64, SHARED>,
}

impl Sums {
    /// Adds a window.
    fn add(&mut self, placed: &[Placed], scale_m: f64, by_points: bool) {
        let Some(frame) = Frame::of(placed, by_points) else { return };
        let Some(parabola) = Parabola::of(&frame, scale_m) else { return };
        let Some(inverse) = parabola.moments.try_inverse() else { return };
        let mut cross = [SMatrix::<f64, 3, SHARED>::zeros(); 2];
        for (k, placed) in placed.iter().enumerate() {
            let (powers, weight) = (frame.powers(k), parabola.weights[k] / scale_m.powi(2));
            let slope = parabola.slope(&frame, k);
            let across = frame.across - slope * frame.along.transpose();
            let by_shared = across * placed.by_shared;
            let residual = parabola.residual(&frame, k);
            self.hessian += by_shared.tr_mul(&by_shared) * weight;
            // Towards zero: p moves by J x and the residual with it.
            self.gradient -= by_shared.tr_mul(&residual) * weight;
            for (side, cross) in cross.iter_mut().enumerate() {
                *cross += powers * by_shared.row(side) * weight;
            }
        }
        for cross in &cross {
            self.hessian -= cross.tr_mul(&(inverse * cross)) * scale_m.powi(2);
        }
    }

    /// The same with the hand-eye transform held.
    fn of_time(mut self) -> Self {
        for k in 1..SHARED {
            (self.gradient[k], self.hessian[(k, k)]) = (0.0, f64::MAX.sqrt());
        }
        self
    }

    /// The step to the solution of the equations, shortened to the limits.
    fn step(&self, at: &Guess) -> Option<SVector<f64, SHARED>> {
        let (mut hessian, mut gradient) = (self.hessian, self.gradient);
        let group = |k: usize| usize::from(k > 0) + usize::from(k > 3);
        for k in 0..SHARED {
            hessian[(k, k)] += KNOWN[group(k)].powi(-2);
        }
        let translation = at.tool_from_camera.translation.vector;
        for axis in 0..3 {
            gradient[4 + axis] -= translation[axis] * KNOWN[2].powi(-2);
        }
        let step = hessian.cholesky()?.solve(&gradient);
        let lengths = [step[0].abs(), step.fixed_rows::<3>(1).norm(), step.fixed_rows::<3>(4).norm()];
        let over = lengths.iter().zip(MOST_STEP).map(|(length, most)| length / most).fold(1.0, f64::max);
        let limited = step / over;
        limited.iter().all(|x| x.is_finite()).then_some(limited)
    }
}

/// The readings of a window along its direction and across it.
struct Frame {
    along: Vector3<f64>,
    across: Matrix2x3<f64>,
    /// s from the middle of the window, in units of `half_m`.
    s: Vec<f64>,
    half_m: f64,
    beside: Vec<Vector2<f64>>,
}

impl Frame {
    /// `None` without a direction or an extent.
    fn of(placed: &[Placed], by_points: bool) -> Option<Self> {
        /// A shorter window has no information on its parabola, m.
        const LEAST_HALF_M: f64 = 1e-6;
        let count = placed.len() as f64;
        let normal = placed.iter().map(|p| p.normal).sum::<Vector3<f64>>().try_normalize(1e-9)?;
        let middle = placed.iter().map(|p| p.point).sum::<Vector3<f64>>() / count;
        let along = if by_points { principal(placed, &middle, &normal) } else { normal };
        let least = along.iamin();
        let axis = Vector3::from_fn(|k, _| if k == least { 1.0 } else { 0.0 });
        let first = (axis - along * along.dot(&axis)).try_normalize(1e-9)?;
        let across = Matrix2x3::from_rows(&[first.transpose(), along.cross(&first).transpose()]);
        let mut s: Vec<f64> = placed.iter().map(|p| along.dot(&(p.point - middle))).collect();
        let half_m = s.iter().fold(0.0_f64, |most, s| most.max(s.abs()));
        if half_m < LEAST_HALF_M {
            return None;
        }
        s.iter_mut().for_each(|s| *s /= half_m);
        let beside = placed.iter().map(|p| across * (p.point - middle)).collect();
        Some(Self { along, across, s, half_m, beside })
    }

    fn powers(&self, k: usize) -> Vector3<f64> {
        Vector3::new(1.0, self.s[k], self.s[k] * self.s[k])
    }
}

/// The principal direction of the points if it is near the normal of the sheet; else that normal.
fn principal(placed: &[Placed], middle: &Vector3<f64>, normal: &Vector3<f64>) -> Vector3<f64> {
    /// Steps of the power method: directions of a tenth of the spread fall to 1e-6.
    const STEPS: usize = 6;
    let mut spread = Matrix3::zeros();
    for p in placed {
        let off = p.point - middle;
        spread += off * off.transpose();
    }
    let mut direction = *normal;
    for _ in 0..STEPS {
        match (spread * direction).try_normalize(1e-15) {
            Some(next) => direction = next,
            None => return *normal,
        }
    }
    if direction.dot(normal) > NEAR_COSINE { direction } else { *normal }
}

/// A robust fit of the parabola of a window.
struct Parabola {
    coefficients: SMatrix<f64, 3, 2>,
    moments: Matrix3<f64>,
    weights: Vec<f64>,
    /// Amount of the readings that it explains, as a sum of 1 − loss.
    explained: f64,
}

impl Parabola {
    fn of(frame: &Frame, scale_m: f64) -> Option<Self> {
        /// Prior that keeps the parabola's coefficients finite, as a fraction of a reading.
        const LEAST_MOMENT: f64 = 1e-6;
        let mut own = Self {
            coefficients: SMatrix::zeros(),
            moments: Matrix3::zeros(),
            weights: vec![1.0; frame.s.len()],
            explained: 0.0,
        };
        for times in PARABOLA {
            own.fit(frame, LEAST_MOMENT)?;
            let loss = Loss::GemanMcClure { scale: times * scale_m };
            own.explained = 0.0;
            for k in 0..frame.s.len() {
                let squared = own.residual(frame, k).norm_squared();
                own.weights[k] = loss.weight(squared);
                own.explained += 1.0 - loss.value(squared) / (times * scale_m).powi(2);
            }
        }
        own.fit(frame, LEAST_MOMENT)?;
        Some(own)
    }

    fn fit(&mut self, frame: &Frame, least: f64) -> Option<()> {
        let (mut moments, mut right) = (Matrix3::identity() * least, SMatrix::<f64, 3, 2>::zeros());
        for (k, weight) in self.weights.iter().enumerate() {
            let powers = frame.powers(k);
            moments += powers * powers.transpose() * *weight;
            right += powers * frame.beside[k].transpose() * *weight;
        }
        self.coefficients = moments.cholesky()?.solve(&right);
        self.moments = moments;
        Some(())
    }

    fn residual(&self, frame: &Frame, k: usize) -> Vector2<f64> {
        frame.beside[k] - self.coefficients.tr_mul(&frame.powers(k))
    }

    /// Change of the parabola per metre of s.
    fn slope(&self, frame: &Frame, k: usize) -> Vector2<f64> {
        let by_s = Vector3::new(0.0, 1.0, 2.0 * frame.s[k]);
        self.coefficients.tr_mul(&by_s) / frame.half_m
    }
}
