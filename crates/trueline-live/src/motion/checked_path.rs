//! A path that keeps the limits everywhere, at its own pace and while it starts and stops: proved once, before anything moves.

use super::limits::{FASTEST_M_S, MotionLimits};
use super::path_timing::{PathState, Ramp};
use super::spline::Spline;
use nalgebra::{UnitQuaternion, Vector3};
use trueline_dataset::RobotSample;
use trueline_geometry::{Pose, se3, so3};

/// Commanded pose of the robot, and its motion there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reference {
    /// `base_from_tool`.
    pub base_from_tool: Pose,
    /// Velocity of the tool's origin in base, m/s.
    pub velocity_m_s: Vector3<f64>,
    /// Angular velocity in base, rad/s.
    pub angular_velocity_rad_s: Vector3<f64>,
}

impl Reference {
    /// Rest at a pose.
    #[must_use]
    pub fn rest(base_from_tool: Pose) -> Self {
        Self { base_from_tool, velocity_m_s: Vector3::zeros(), angular_velocity_rad_s: Vector3::zeros() }
    }

    /// Whether nothing is to move.
    #[must_use]
    pub fn is_rest(&self) -> bool {
        self.velocity_m_s == Vector3::zeros() && self.angular_velocity_rad_s == Vector3::zeros()
    }
}

/// Why a path is not travelled.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum PathError {
    /// Too little to travel.
    #[error("the path has {poses} poses; two at least are needed, with rising times")]
    TooShort {
        /// Number of poses.
        poses: usize,
    },
    /// Stamps that do not rise.
    #[error("the path's time does not rise at {at_s:.3} s")]
    TimeStands {
        /// Time of the violation.
        at_s: f64,
    },
    /// An attitude too far from the first, or a jump.
    #[error("at {at_s:.3} s the attitude jumps, or is more than {:.0}° from the first", FARTHEST_RAD.to_degrees())]
    Attitude {
        /// Time of the violation.
        at_s: f64,
    },
    /// Outside the box.
    #[error("at {at_s:.3} s the tool is at [{:.1}, {:.1}, {:.1}] mm: outside the box, or nearer to its side than the scan may begin off the path ({:.1} mm)", at_m[0] * 1e3, at_m[1] * 1e3, at_m[2] * 1e3, margin_m * 1e3)]
    OutsideBox {
        /// When.
        at_s: f64,
        /// Place of the violation.
        at_m: [f64; 3],
        /// Distance that must stay to the sides.
        margin_m: f64,
    },
    /// The tool leans too far.
    #[error("at {at_s:.3} s the tool leans {:.1}°, with the allowed start {:.1}°; the cone has {:.1}°", lean_rad.to_degrees(), (lean_rad + margin_rad).to_degrees(), cone_rad.to_degrees())]
    OutsideCone {
        /// When.
        at_s: f64,
        /// Angle from the cone's axis.
        lean_rad: f64,
        /// Angle that must stay to the cone.
        margin_rad: f64,
        /// The cone.
        cone_rad: f64,
    },
    /// Too fast in some way.
    #[error("at {at_s:.3} s {what} reaches {found:.1} {unit}; the limit is {limit:.1} {unit}")]
    TooMuch {
        /// When.
        at_s: f64,
        /// The quantity.
        what: &'static str,
        /// Its value.
        found: f64,
        /// Its limit.
        limit: f64,
        /// Unit of both.
        unit: &'static str,
    },
    /// No room to brake.
    #[error("the path is so near to its limits that stopping along it would take {stop_s:.1} s; {} s at most are allowed", 1.0 / GENTLEST_PER_S)]
    NoRoomToStop {
        /// Time from full pace to rest, without the lag.
        stop_s: f64,
    },
}

/// The fastest start and stop: half a second from rest to the path's pace.
pub(super) const BRISKEST_PER_S: f64 = 2.0;
/// The slowest that is accepted.
const GENTLEST_PER_S: f64 = 0.5;
/// Lag of the rate, s: with the briskest ramp its second derivative is 40 /s².
pub(super) const LAG_S: f64 = 0.1;
/// Farthest attitude from the first: a rotation vector has no trouble up to there, rad.
const FARTHEST_RAD: f64 = 2.0;
/// Greatest turn between poses of the path, rad.
const TURN_RAD: f64 = 0.5;

/// Greatest derivatives of the path over its own time.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Extremes {
    /// m/s.
    pub speed_m_s: f64,
    /// m/s².
    pub acceleration_m_s2: f64,
    /// m/s³.
    pub jerk_m_s3: f64,
    /// rad/s.
    pub turn_rad_s: f64,
    /// rad/s².
    pub turn_acceleration_rad_s2: f64,
    /// Speed of the fastest point that the tool carries, m/s.
    pub tip_m_s: f64,
}

/// A path within limits.
#[derive(Clone, Debug)]
pub struct CheckedPath {
    position: Spline<3>,
    /// Rotation vector from the first attitude.
    turn: Spline<3>,
    first_rotation: UnitQuaternion<f64>,
    extremes: Extremes,
    ramp: Ramp,
}

impl CheckedPath {
    /// Checks poses, at their own pace or a share of it, against limits. The cubic splines through them must stay in
    /// box and cone, with room for the start of the scan. They must stay below every limit of speed, acceleration and
    /// jerk, also while the motion starts and stops.
    ///
    /// # Errors
    /// The first place where box or cone is left; of speeds, accelerations and jerk the place where a limit is passed by most.
    pub fn new(poses: &[RobotSample], pace: f64, limits: &MotionLimits) -> Result<Self, PathError> {
        let times_s = times_s(poses, pace)?;
        let first_rotation = poses[0].base_from_tool.rotation;
        let turns = turns(poses, &times_s, &first_rotation)?;
        let positions = poses.iter().map(|p| p.base_from_tool.translation.vector).collect();
        let mut path = Self {
            position: Spline::through(times_s.clone(), positions),
            turn: Spline::through(times_s, turns),
            first_rotation,
            extremes: Extremes::default(),
            ramp: Ramp { slope_per_s: BRISKEST_PER_S, lag_s: LAG_S },
        };
        path.check_room(limits)?;
        path.extremes = path.check_pace(limits)?;
        path.ramp = ramp(&path.extremes, limits)?;
        Ok(path)
    }

    /// Its duration, s, at its own pace.
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        self.position.end_s()
    }

    /// Its greatest derivatives.
    #[must_use]
    pub fn extremes(&self) -> Extremes {
        self.extremes
    }

    /// How quickly it may be begun and left.
    #[must_use]
    pub fn ramp(&self) -> Ramp {
        self.ramp
    }

    /// Longest time with hardly any motion, s: less than 1 mm/s and 0.1°/s.
    #[must_use]
    pub(crate) fn longest_rest_s(&self) -> f64 {
        let (mut longest_s, mut since_s) = (0.0_f64, 0.0);
        for piece in 0..self.position.pieces() {
            let (start_s, length_s) = self.position.piece_s(piece);
            let ([speed_m_s, ..], [turn_rad_s, ..]) = (self.position.bounds(piece), self.turn.bounds(piece));
            if speed_m_s > 1e-3 || turn_rad_s > 0.1_f64.to_radians() {
                since_s = start_s + length_s;
            }
            longest_s = longest_s.max(start_s + length_s - since_s);
        }
        longest_s
    }

    /// Corners of the box about the tool's way, m.
    #[must_use]
    pub(crate) fn extent_m(&self) -> [Vector3<f64>; 2] {
        let first = self.at(0.0).base_from_tool.translation.vector;
        (0..self.position.pieces()).fold([first; 2], |[low, high], piece| {
            let (start_s, length_s) = self.position.piece_s(piece);
            let point = self.at(start_s + length_s).base_from_tool.translation.vector;
            [low.inf(&point), high.sup(&point)]
        })
    }

    /// The path at its own pace.
    #[must_use]
    pub fn at(&self, path_s: f64) -> Reference {
        let (position, turn) = (self.position.at(path_s), self.turn.at(path_s));
        Reference {
            base_from_tool: se3::from_parts(self.first_rotation * so3::exp(&turn.value), position.value),
            velocity_m_s: position.first,
            angular_velocity_rad_s: self.first_rotation * (so3::left_jacobian(&turn.value) * turn.first),
        }
    }

    /// The reference of the motion.
    #[must_use]
    pub fn along(&self, on_path: &PathState) -> Reference {
        let at = self.at(on_path.path_s);
        Reference {
            velocity_m_s: at.velocity_m_s * on_path.rate,
            angular_velocity_rad_s: at.angular_velocity_rad_s * on_path.rate,
            ..at
        }
    }

    fn check_room(&self, limits: &MotionLimits) -> Result<(), PathError> {
        for piece in 0..self.position.pieces() {
            let (start_s, length_s) = self.position.piece_s(piece);
            // A box is convex, and between its ends a piece leaves their chord by at most h²/8 of its second derivative. A
            // direction that rotates is on no chord: it is no further from the nearer end than the motion of half the
            // piece.
            let [_, bend_m_s2, _] = self.position.bounds(piece);
            let [turn_rad_s, ..] = self.turn.bounds(piece);
            let margin_m = limits.start_m + length_s * length_s / 8.0 * bend_m_s2;
            let margin_rad = limits.start_rad + 0.5 * length_s * turn_rad_s;
            for at_s in [start_s, start_s + length_s] {
                let pose = self.at(at_s).base_from_tool;
                let at_m = pose.translation.vector;
                if !limits.in_box(&at_m, margin_m) {
                    return Err(PathError::OutsideBox { at_s, at_m: at_m.into(), margin_m });
                }
                let lean_rad = limits.cone_angle_rad(&pose);
                if lean_rad + margin_rad > limits.cone_rad {
                    let cone_rad = limits.cone_rad;
                    return Err(PathError::OutsideCone { at_s, lean_rad, margin_rad, cone_rad });
                }
            }
        }
        Ok(())
    }

    /// The greatest derivatives, or where a limit is passed by most.
    fn check_pace(&self, limits: &MotionLimits) -> Result<Extremes, PathError> {
        let mut most = Extremes::default();
        let mut worst = Worst::default();
        for piece in 0..self.position.pieces() {
            let here = self.extremes_of(piece, limits);
            worst.see(self.position.piece_s(piece).0, &here, limits);
            most = most.max(&here);
        }
        worst.passed.map_or(Ok(most), |(_, error)| Err(error))
    }

    fn extremes_of(&self, piece: usize, limits: &MotionLimits) -> Extremes {
        let [speed_m_s, acceleration_m_s2, jerk_m_s3] = self.position.bounds(piece);
        let [turn_rad_s, bend, bend_more] = self.turn.bounds(piece);
        // α = J w'' + J' w', and neither J's norm nor that of its derivative by w is above 1.
        let turn_acceleration_rad_s2 = bend + turn_rad_s * turn_rad_s;
        // ω'' = J w''' + 2 J' w'' + J'' w', with J = ∫ exp(s w) ds over 0 to 1: |J'| ≤ |w'|/2, |J''| ≤ (|w''| + |w'|²)/2.
        let turn_jerk_rad_s3 = bend_more + 1.5 * turn_rad_s * bend + 0.5 * turn_rad_s.powi(3);
        let tip_m_s = self.tip_m_s(piece, jerk_m_s3 + turn_jerk_rad_s3 * limits.reach_m, limits);
        Extremes { speed_m_s, acceleration_m_s2, jerk_m_s3, turn_rad_s, turn_acceleration_rad_s2, tip_m_s }
    }
}

impl CheckedPath {
    /// The speed of the fastest point that the tool carries: a convex function of (v, ω). Within a piece it exceeds the
    /// larger of its ends by at most the distance of v and ω from their chords, h²/8 of their second derivatives.
    fn tip_m_s(&self, piece: usize, most_second_m_s3: f64, limits: &MotionLimits) -> f64 {
        let (start_s, length_s) = self.position.piece_s(piece);
        let [from, to] = [start_s, start_s + length_s].map(|at_s| {
            let at = self.at(at_s);
            limits.tip_speed_m_s(&at.velocity_m_s, &at.angular_velocity_rad_s)
        });
        from.max(to) + length_s * length_s / 8.0 * most_second_m_s3
    }
}

impl Extremes {
    fn max(&self, other: &Self) -> Self {
        Self {
            speed_m_s: self.speed_m_s.max(other.speed_m_s),
            acceleration_m_s2: self.acceleration_m_s2.max(other.acceleration_m_s2),
            jerk_m_s3: self.jerk_m_s3.max(other.jerk_m_s3),
            turn_rad_s: self.turn_rad_s.max(other.turn_rad_s),
            turn_acceleration_rad_s2: self.turn_acceleration_rad_s2.max(other.turn_acceleration_rad_s2),
            tip_m_s: self.tip_m_s.max(other.tip_m_s),
        }
    }
}

/// The largest violation of a limit, as a multiple of it.
#[derive(Default)]
struct Worst {
    passed: Option<(f64, PathError)>,
}

impl Worst {
    fn see(&mut self, at_s: f64, here: &Extremes, limits: &MotionLimits) {
        let degrees = 1.0_f64.to_degrees();
        let rows = [
            ("the speed", here.speed_m_s, limits.speed_m_s, 1e3, "mm/s"),
            ("the speed of the tool's load", here.tip_m_s, FASTEST_M_S, 1e3, "mm/s"),
            ("the acceleration", here.acceleration_m_s2, limits.acceleration_m_s2, 1e3, "mm/s²"),
            ("the jerk", here.jerk_m_s3, limits.jerk_m_s3, 1e3, "mm/s³"),
            ("the angular speed", here.turn_rad_s, limits.turn_rad_s, degrees, "°/s"),
            (
                "the angular acceleration",
                here.turn_acceleration_rad_s2,
                limits.turn_acceleration_rad_s2,
                degrees,
                "°/s²",
            ),
        ];
        for (what, found, limit, per_unit, unit) in rows {
            // NaN meets no limit, and counts as the worst.
            let is_kept = found <= limit;
            let times = if found.is_nan() { f64::INFINITY } else { found / limit };
            if !is_kept && self.passed.is_none_or(|(worst, _)| times > worst) {
                let (found, limit) = (found * per_unit, limit * per_unit);
                self.passed = Some((times, PathError::TooMuch { at_s, what, found, limit, unit }));
            }
        }
    }
}

/// The fastest ramp within the path's free margin. With path p and rate r, the reference is p(s), s' = r: its
/// acceleration is p''r² + p'r', its jerk p'''r³ + 3p''rr' + p'r'', and `|r'| ≤ ρ`, `|r''| ≤ 2ρ/W`.
fn ramp(most: &Extremes, limits: &MotionLimits) -> Result<Ramp, PathError> {
    let free = [
        (limits.acceleration_m_s2 - most.acceleration_m_s2, most.speed_m_s),
        (limits.turn_acceleration_rad_s2 - most.turn_acceleration_rad_s2, most.turn_rad_s),
        (limits.jerk_m_s3 - most.jerk_m_s3, 3.0 * most.acceleration_m_s2 + 2.0 * most.speed_m_s / LAG_S),
    ];
    let slopes = free.map(|(free, per_slope)| if per_slope > 0.0 { free / per_slope } else { f64::INFINITY });
    let slope_per_s = slopes.into_iter().fold(BRISKEST_PER_S, f64::min);
    if slope_per_s < GENTLEST_PER_S {
        return Err(PathError::NoRoomToStop { stop_s: 1.0 / slope_per_s });
    }
    Ok(Ramp { slope_per_s, lag_s: LAG_S })
}

fn times_s(poses: &[RobotSample], pace: f64) -> Result<Vec<f64>, PathError> {
    let [first, _, ..] = poses else { return Err(PathError::TooShort { poses: poses.len() }) };
    let times: Vec<f64> = poses.iter().map(|p| (p.stamp_ns - first.stamp_ns) as f64 * 1e-9 / pace).collect();
    match times.windows(2).find(|pair| pair[1] <= pair[0]) {
        Some(pair) => Err(PathError::TimeStands { at_s: pair[1] }),
        None => Ok(times),
    }
}

fn turns(
    poses: &[RobotSample],
    times_s: &[f64],
    first: &UnitQuaternion<f64>,
) -> Result<Vec<Vector3<f64>>, PathError> {
    let turns: Vec<Vector3<f64>> =
        poses.iter().map(|p| so3::log(&(first.inverse() * p.base_from_tool.rotation))).collect();
    let bad = |k: &usize| {
        turns[*k].norm() > FARTHEST_RAD || (*k > 0 && (turns[*k] - turns[*k - 1]).norm() > TURN_RAD)
    };
    match (0..turns.len()).find(bad) {
        Some(k) => Err(PathError::Attitude { at_s: times_s[k] }),
        None => Ok(turns),
    }
}
