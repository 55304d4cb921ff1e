//! Faults of a cell: one variant a fault, with its size.

/// One thing that is wrong. Sizes are in SI units and pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Fault {
    /// The sensor differs from the statement of `sensor.toml`.
    Sensor(SensorError),
    /// The seam is not straight.
    Seam(SeamForm),
    /// The robot is not at its reported pose.
    Robot(RobotError),
    /// The seam point is not where the detector reports it.
    Feature(FeatureError),
    /// Stamps and rows are wrong.
    Stream(StreamError),
    /// Something happened once during the recording.
    Event(Event),
}

/// Difference of the stated sensor from the one that measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SensorError {
    /// The stated laser plane is shifted along its normal.
    PlaneOffset {
        /// Stated minus true offset, m.
        offset_m: f64,
    },
    /// The stated laser plane is turned about the stripe through the middle of the field of view.
    PlaneTiltAboutStripe {
        /// Angle, rad.
        angle_rad: f64,
    },
    /// The stated laser plane is turned about the range direction through the middle of the field of view.
    PlaneTiltAboutRange {
        /// Angle, rad.
        angle_rad: f64,
    },
    /// Both stated focal lengths are too large.
    Focal {
        /// Part of the true ones.
        share: f64,
    },
    /// The stated principal point is too far right.
    PrincipalPointU {
        /// Stated minus true, px.
        shift_px: f64,
    },
    /// The stated principal point is too far down.
    PrincipalPointV {
        /// Stated minus true, px.
        shift_px: f64,
    },
    /// The stated camera has this k1 less than the true one.
    Distortion {
        /// True minus stated k1.
        k1: f64,
    },
    /// A profiler that reports widths too large.
    ProfileWidth {
        /// Part of the true ones.
        share: f64,
    },
    /// A profiler that reports distances from its mid-range too large.
    ProfileDepth {
        /// Part of the true ones.
        share: f64,
    },
    /// A profiler with a range axis that leans towards its width axis.
    ProfileShear {
        /// Angle, rad.
        angle_rad: f64,
    },
}

/// How the seam departs from the straight line that the scan follows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SeamForm {
    /// A circular arc, bent sideways.
    BowAcross {
        /// How far the middle of the scanned length is from the chord of its ends, m.
        sagitta_m: f64,
    },
    /// A circular arc, bent towards the sensor.
    BowHeight {
        /// How far the middle of the scanned length is from the chord of its ends, m.
        sagitta_m: f64,
    },
    /// An Ornstein–Uhlenbeck process of the place on the seam; half as large in height.
    Wobble {
        /// Standard deviation across the seam, m.
        sigma_m: f64,
        /// Distance over which the correlation falls to 1/e, m.
        correlation_length_m: f64,
    },
}

/// Difference of the robot's reports from its pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RobotError {
    /// A smooth error of the position that depends on the place.
    PositionField {
        /// Root mean square length, m.
        rms_m: f64,
        /// Wavelength, m.
        wavelength_m: f64,
    },
    /// A smooth error of the attitude that depends on the place.
    AttitudeField {
        /// Root mean square angle, rad.
        rms_rad: f64,
        /// Wavelength, m.
        wavelength_m: f64,
    },
    /// A six-axis arm with another geometry than the controller's model: see [`crate::arm`].
    Arm {
        /// Root mean square position error over the workspace, mean removed, m.
        rms_m: f64,
    },
    /// The tool lags under acceleration: structure and drives are flexible.
    Flex {
        /// Displacement for each m/s², m.
        m_per_m_s2: f64,
    },
    /// The tool moves only after each axis of the reported position has moved this far.
    Backlash {
        /// Width of the play, m.
        width_m: f64,
    },
    /// The stream reports the command, and the tool follows it as a first-order lag.
    CommandLag {
        /// Time constant, s.
        time_constant_s: f64,
    },
    /// The reported attitude is older than the reported position.
    AttitudeLag {
        /// How much, s.
        lag_s: f64,
    },
}

/// How the detector's seam point differs from the seam.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FeatureError {
    /// Along v, and half as much along u, with the work angle (about the seam).
    BiasByWorkAngle {
        /// Per rad, px; for lengths 1 px is 0.05 mm.
        px_per_rad: f64,
    },
    /// The same with the travel angle (about the stripe).
    BiasByTravelAngle {
        /// Per rad, px.
        px_per_rad: f64,
    },
    /// The same with the spin (about the range direction).
    BiasBySpin {
        /// Per rad, px.
        px_per_rad: f64,
    },
    /// Along v, with the sign of the side of the image that the seam is on.
    BiasBySide {
        /// Size, px.
        bias_px: f64,
    },
    /// Rows are exposed one after the other.
    RollingShutter {
        /// From the first to the last row, s.
        readout_s: f64,
    },
    /// Some features are of a parallel line.
    ParallelLine {
        /// Distance from the line, m.
        beside_m: f64,
        /// Part of all features, at random.
        share: f64,
    },
    /// All features of the last part are of a parallel line.
    ParallelLineAtEnd {
        /// Distance from the line, m.
        beside_m: f64,
        /// Part of the scan.
        share: f64,
    },
    /// Noise of the seam point that lasts from frame to frame, 0.63 across and 0.48 in height; half as large in
    /// height.
    CorrelatedNoise {
        /// Standard deviation across the seam, m.
        sigma_m: f64,
    },
}

/// Errors of stamps and rows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum StreamError {
    /// Image stamps are cut to whole multiples.
    ImageGrain {
        /// Of this, s.
        grain_s: f64,
    },
    /// Robot stamps are cut to whole multiples.
    RobotGrain {
        /// Of this, s.
        grain_s: f64,
    },
    /// The time offset grows evenly over the scan.
    OffsetDrift {
        /// In all, s.
        change_s: f64,
    },
    /// The time offset swings once over the scan.
    OffsetSwing {
        /// Amplitude, s.
        amplitude_s: f64,
    },
    /// The time offset steps half way through.
    OffsetStep {
        /// Size of the step, s.
        step_s: f64,
    },
    /// Some frames repeat the picture of the frame before.
    DoubledFrames {
        /// Part of all frames.
        share: f64,
    },
    /// Some frames are lost, and the frame counter does not tell.
    UncountedLosses {
        /// Part of all frames.
        share: f64,
    },
    /// From half way on each feature carries the stamp of a later frame.
    FrameSlip {
        /// How many frames later.
        frames: f64,
    },
    /// Frames arrive late by a random time, in order.
    LateArrival {
        /// Mean delay (exponential), s.
        mean_s: f64,
    },
}

/// Something that happened during the recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// Twenty bad frames in a row, three times: spatter, a hand, a glare.
    Bursts,
    /// For a quarter of the scan the detector follows a parallel edge 5 mm beside.
    SecondLine,
    /// The robot stream is silent for 0.4 s, twice.
    RobotGaps,
    /// Every 50th robot row is recorded twice.
    DuplicateRows,
    /// The robot's clock is set forward by 80 ms two thirds through.
    RobotClockStep,
    /// Images queue up: from two thirds on they arrive 45 ms later.
    LateImages,
}
