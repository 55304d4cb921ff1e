//! Why something is refused.

/// A calibration or settings that no placer can work with.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{name}` is not finite or out of range")]
pub struct BadSetting {
    /// The name of the field.
    pub name: &'static str,
}

/// Why a pose is not taken. The stream continues.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PoseError {
    /// The pose is not finite, further than 100 km or no rotation; or the stamp is further from zero than 95 years.
    #[error("the pose or its stamp is not finite and in range")]
    NotFinite,
    /// The stamp is not later than the last one.
    #[error("the stamp is {behind_ns} ns behind the last pose")]
    NotLater {
        /// By how much, ns.
        behind_ns: i64,
    },
    /// The clock went back: the stream begins anew with this pose.
    #[error("the clock of the poses went back by {behind_ns} ns; the poses before are forgotten")]
    ClockWentBack {
        /// By how much, ns.
        behind_ns: i64,
    },
}

/// Why a value of an external axis is not taken. The stream continues.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum AxisError {
    /// The value is not finite and in range, or the stamp is further from zero than 95 years.
    #[error("the value or its stamp is not finite and in range")]
    NotFinite,
    /// The calibration has no such axis.
    #[error("the calibration has {axes} axes, and none of number {axis}")]
    NoSuchAxis {
        /// The requested number, from 0.
        axis: usize,
        /// Their number.
        axes: usize,
    },
    /// The stamp is not later than the last one.
    #[error("the stamp is {behind_ns} ns behind the last value")]
    NotLater {
        /// By how much, ns.
        behind_ns: i64,
    },
    /// The clock went back: the stream begins anew with this value.
    #[error("the clock of the axis went back by {behind_ns} ns; the values before are forgotten")]
    ClockWentBack {
        /// By how much, ns.
        behind_ns: i64,
    },
}

/// Why an external axis has no value at an exposure.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum AxisProblem {
    /// Too few values to know the stream.
    #[error("{values} of {needed} values so far")]
    Unsettled {
        /// Values so far.
        values: usize,
        /// Values that are needed.
        needed: usize,
    },
    /// The exposure is before the first value that is remembered.
    #[error("the exposure is {by_s:.4} s before the first value")]
    BeforeValues {
        /// By how much, s.
        by_s: f64,
    },
    /// Values around the exposure were lost.
    #[error("the exposure is in a gap of {gap_s:.4} s between values")]
    InGap {
        /// Length of the gap, s.
        gap_s: f64,
    },
    /// The values around the exposure are not the motion of an axis, or their times are not certain.
    #[error("the values around the exposure are doubtful")]
    Doubtful,
    /// The values end before the exposure, by more than is predicted.
    #[error("the exposure is {by_s:.4} s after the last value; at most {limit_s:.4} s are predicted")]
    ValuesEnded {
        /// By how much, s.
        by_s: f64,
        /// The limit, s.
        limit_s: f64,
    },
}

/// Why a frame is not placed.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum PlaceError {
    /// Too few poses to know the stream: its period and its noise.
    #[error("the stream of poses is not settled: {poses} of {needed} poses")]
    Unsettled {
        /// Poses so far.
        poses: usize,
        /// Poses that are needed.
        needed: usize,
    },
    /// The clock of the frames is not known yet.
    #[error("the clock of the frames is not settled")]
    FramesUnsettled,
    /// The stamp of the frame is out of range.
    #[error("the stamp is out of range")]
    StampOutOfRange,
    /// The stamp of the frame is late or early against its own clock by more than delays explain.
    #[error("the stamp is {late_s:.4} s late against the clock of the frames")]
    StampJumped {
        /// How late, s; negative if early.
        late_s: f64,
    },
    /// The exposure is before the first pose that is remembered.
    #[error("the exposure is {by_s:.4} s before the first pose")]
    BeforePoses {
        /// By how much, s.
        by_s: f64,
    },
    /// Poses around the exposure were lost.
    #[error("the exposure is in a gap of {gap_s:.4} s between poses")]
    InGap {
        /// Length of the gap, s.
        gap_s: f64,
    },
    /// The poses around the exposure are not the motion of a robot, or their times are not certain.
    #[error("the poses around the exposure are doubtful")]
    DoubtfulPoses,
    /// The poses end before the exposure, by more than is predicted.
    #[error("the exposure is {by_s:.4} s after the last pose; at most {limit_s:.4} s are predicted")]
    PosesEnded {
        /// By how much, s.
        by_s: f64,
        /// The limit, s.
        limit_s: f64,
    },
    /// An external axis has no value at the exposure.
    #[error("external axis {axis}: {problem}")]
    Axis {
        /// Its number, from 0.
        axis: usize,
        /// Why.
        problem: AxisProblem,
    },
    /// A buffer is shorter than the points.
    #[error("a buffer of {buffer} is too short for {points} points")]
    BufferTooShort {
        /// Length of the buffer.
        buffer: usize,
        /// Number of points.
        points: usize,
    },
    /// These points are not of the calibrated sensor.
    #[error("the sensor does not report such points")]
    OtherSensor,
}
