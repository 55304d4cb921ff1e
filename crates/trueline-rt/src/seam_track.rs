//! A seam that is followed: points that a sensor measured ahead, and where a torch is to be when its command acts.

use crate::calibration::is_pose;
use crate::error::BadSetting;
use crate::seam_fit::{self, SeamFit};
use crate::track_settings::{AheadError, SeamPointError, TrackSettings};
use nalgebra::{Point3, Vector3};
use trueline_geometry::{Pose, se3, so3};

/// This many points in a row off the seam begin another one.
const RESTART_AFTER: usize = 8;
/// Nothing is expected of a seam of fewer points.
const EXPECTED_FROM: usize = 8;

/// Target of a torch. It is advice: the robot's program checks it against the limits of the motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Target {
    /// The torch in base, at its present attitude to the seam.
    pub base_from_torch: Pose,
    /// Way along the seam from its first point, m.
    pub along_m: f64,
    /// Direction of the seam in base.
    pub tangent: Vector3<f64>,
    /// Direction across the seam in base, square to the tangent and to the torch's own axis.
    pub across: Vector3<f64>,
    /// The third direction, nearest to the torch's own axis (z).
    pub upward: Vector3<f64>,
    /// Standard deviation across the seam, along each of the two directions, m.
    pub sigma_m: f64,
    /// How far off the seam the torch is now, along `across` and `upward`, m.
    pub off_m: [f64; 2],
}

/// The points of a seam along its way. All memory is made by [`SeamTrack::new`].
///
/// ```
/// use nalgebra::Vector3;
/// use trueline_geometry::Pose;
/// use trueline_rt::{SeamTrack, TrackSettings};
///
/// let mut track = SeamTrack::new(&TrackSettings::default())?;
/// for k in 0..100 {
///     track.push(&Vector3::new(0.001 * f64::from(k), 0.0, 0.0), 5e-5)?;
/// }
/// // At 20 mm/s the torch goes 2 mm before a command acts that takes 100 ms.
/// let target = track.ahead(&Pose::translation(0.010, 0.001, 0.0), 0.020, 0.100)?;
/// assert!((target.base_from_torch.translation.vector - Vector3::new(0.012, 0.0, 0.0)).norm() < 1e-9);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct SeamTrack {
    settings: TrackSettings,
    points: Vec<Vector3<f64>>,
    along_m: Vec<f64>,
    sigmas_m: Vec<f64>,
    off_in_a_row: usize,
}

impl SeamTrack {
    /// A track without points.
    ///
    /// # Errors
    /// [`BadSetting`] names a number that is not finite or out of range.
    pub fn new(settings: &TrackSettings) -> Result<Self, BadSetting> {
        if let Some(name) = settings.problem() {
            return Err(BadSetting { name });
        }
        let room = 2 * settings.points_kept;
        let (points, along_m, sigmas_m) =
            (Vec::with_capacity(room), Vec::with_capacity(room), Vec::with_capacity(room));
        Ok(Self { settings: *settings, points, along_m, sigmas_m, off_in_a_row: 0 })
    }

    /// Forgets all points: another seam begins.
    pub fn clear(&mut self) {
        self.points.clear();
        self.along_m.clear();
        self.sigmas_m.clear();
        self.off_in_a_row = 0;
    }

    /// Way from the first to the last point, m; zero of none.
    #[must_use]
    pub fn length_m(&self) -> f64 {
        self.along_m.last().copied().unwrap_or(0.0)
    }

    /// Takes a seam point in base (m) with its ± (m), further along the seam than the one before.
    ///
    /// # Errors
    /// [`SeamPointError`]: the point is not taken, unless another seam begins with it.
    pub fn push(&mut self, point: &Vector3<f64>, sigma_m: f64) -> Result<(), SeamPointError> {
        if !(point.iter().all(|number| number.is_finite()) && sigma_m.is_finite() && sigma_m > 0.0) {
            return Err(SeamPointError::NotFinite);
        }
        let Some((last, last_m)) = self.points.last().copied().zip(self.along_m.last().copied()) else {
            self.append(point, 0.0, sigma_m);
            return Ok(());
        };
        let step = point - last;
        let expected = (self.points.len() >= EXPECTED_FROM).then(|| self.fit_at(last_m)).and_then(Result::ok);
        let (ahead_m, off_m) = match expected {
            None => (step.norm(), 0.0),
            Some(fit) => {
                let from_fit = point - fit.point;
                let beyond_m = from_fit.dot(&fit.tangent);
                let off = from_fit - fit.tangent * beyond_m;
                let bent_m = 0.5 * self.settings.curvature_per_m * beyond_m * beyond_m;
                // Steps from point to point do not add up the fits' errors at their ends. Along the direction in
                // its middle a chord is as long as the arc.
                let middle = self.fit_at(last_m + 0.5 * step.dot(&fit.tangent).max(0.0));
                let tangent = middle.map_or(fit.tangent, |middle| middle.tangent);
                (step.dot(&tangent), (off.norm() - bent_m).max(0.0))
            }
        };
        if off_m > self.settings.jump_m {
            self.off_in_a_row += 1;
            if self.off_in_a_row < RESTART_AFTER {
                return Err(SeamPointError::OffSeam { off_m, in_a_row: self.off_in_a_row });
            }
            self.clear();
            self.append(point, 0.0, sigma_m);
            return Err(SeamPointError::AnotherSeam);
        }
        if ahead_m <= 0.0 {
            return Err(SeamPointError::NotAhead { behind_m: -ahead_m });
        }
        self.off_in_a_row = 0;
        self.append(point, last_m + ahead_m, sigma_m);
        Ok(())
    }

    fn append(&mut self, point: &Vector3<f64>, along_m: f64, sigma_m: f64) {
        let kept = self.settings.points_kept;
        if self.points.len() == 2 * kept {
            self.points.copy_within(kept.., 0);
            self.along_m.copy_within(kept.., 0);
            self.sigmas_m.copy_within(kept.., 0);
            self.points.truncate(kept);
            self.along_m.truncate(kept);
            self.sigmas_m.truncate(kept);
        }
        self.points.push(*point);
        self.along_m.push(along_m);
        self.sigmas_m.push(sigma_m);
    }

    /// The seam at a way along it.
    fn fit_at(&self, along_m: f64) -> Result<SeamFit, AheadError> {
        seam_fit::at(&self.settings, &self.points, &self.along_m, &self.sigmas_m, along_m)
    }

    /// Target of the torch after `delay_s` at `speed_m_s` along the seam. `delay_s` is the loop's whole
    /// delay, from the given pose to the motion of a command.
    ///
    /// # Errors
    /// [`AheadError`] states why there is no target.
    pub fn ahead(&self, base_from_torch: &Pose, speed_m_s: f64, delay_s: f64) -> Result<Target, AheadError> {
        let lead_m = speed_m_s * delay_s;
        if !(is_pose(base_from_torch) && lead_m.is_finite() && speed_m_s >= 0.0 && delay_s >= 0.0) {
            return Err(AheadError::NotFinite);
        }
        let torch = base_from_torch.translation.vector;
        let here = self.nearest(&torch)?;
        let there = self.fit_at(here.along_m + lead_m)?;
        let turn = between(&here.tangent, &there.tangent);
        let rotation = turn * base_from_torch.rotation;
        let frame = |tangent: &Vector3<f64>, rotation: &nalgebra::UnitQuaternion<f64>| {
            let axis = rotation * Vector3::z();
            let upward = (axis - tangent * tangent.dot(&axis))
                .try_normalize(PARALLEL)
                .unwrap_or_else(|| across_any(tangent));
            (upward.cross(tangent), upward)
        };
        let (across_here, upward_here) = frame(&here.tangent, &base_from_torch.rotation);
        let (across, upward) = frame(&there.tangent, &rotation);
        let off = torch - here.point;
        Ok(Target {
            base_from_torch: se3::from_parts(rotation, Point3::from(there.point).coords),
            along_m: there.along_m,
            tangent: there.tangent,
            across,
            upward,
            sigma_m: there.sigma_m,
            off_m: [off.dot(&across_here), off.dot(&upward_here)],
        })
    }

    /// The seam at its nearest place to a point.
    fn nearest(&self, to: &Vector3<f64>) -> Result<SeamFit, AheadError> {
        let distances = self.points.iter().map(|point| (point - to).norm_squared());
        let nearest = distances.enumerate().min_by(|a, b| a.1.total_cmp(&b.1));
        let Some((index, _)) = nearest else {
            return Err(AheadError::TooFewPoints { points: 0, needed: seam_fit::FEWEST });
        };
        let mut fit = self.fit_at(self.along_m[index])?;
        // The foot of the perpendicular: Newton's method on a seam that hardly bends within the window.
        for _ in 0..STEPS {
            let by_m = (to - fit.point).dot(&fit.tangent);
            fit = self.fit_at(fit.along_m + by_m)?;
        }
        Ok(fit)
    }
}

/// Steps toward the foot of the perpendicular; each leaves the product of offset and curvature, a few percent.
const STEPS: usize = 3;
/// An axis this near to the tangent has no part square to it.
const PARALLEL: f64 = 1e-6;

/// Any direction square to another.
fn across_any(direction: &Vector3<f64>) -> Vector3<f64> {
    let other = if direction.x.abs() < 0.9 { Vector3::x() } else { Vector3::y() };
    direction.cross(&other).normalize()
}

/// The least turn that takes one unit vector to another.
fn between(from: &Vector3<f64>, to: &Vector3<f64>) -> nalgebra::UnitQuaternion<f64> {
    let axis = from.cross(to);
    let (sine, cosine) = (axis.norm(), from.dot(to));
    if sine < f64::MIN_POSITIVE {
        return nalgebra::UnitQuaternion::identity();
    }
    so3::exp(&(axis * (sine.atan2(cosine) / sine)))
}
