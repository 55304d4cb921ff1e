//! Points in base, while it runs.

use crate::calibration::{Carrier, PlacerCalibration, SensorModel};
use crate::chain::Chain;
use crate::error::{AxisError, BadSetting, PlaceError, PoseError};
use crate::frame_clock::{FrameClock, FrameTime};
use crate::interpolation;
use crate::lift::Lift;
use crate::points::Points;
use crate::pose_stream::PoseStream;
use crate::settings::{Readout, Settings};
use crate::spread::Spread;
use crate::stamps::{self, is_stamp, seconds};
use crate::sweep::{Knot, Sweep};
use trueline_geometry::Pose;

/// Result of a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placed {
    /// Points that were placed.
    pub placed: usize,
    /// Points that were not: their coordinates are NaN and their ± is infinite.
    pub flagged: usize,
    /// When the first of its points was exposed, by the robot's clock, ns.
    pub exposed_ns: i64,
    /// Time from the exposure of the last of its points to the last pose, or to the last value of an external
    /// axis, s; negative if one of them is predicted.
    pub age_s: f64,
}

/// The state of the stream of an external axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisHealth {
    /// Whether its period is known.
    pub is_settled: bool,
    /// How long ago the last value was, s; `None` before the first.
    pub silent_s: Option<f64>,
    /// Whether that is longer than values are bridged.
    pub is_stalled: bool,
    /// Usual time between values, s.
    pub period_s: f64,
    /// Noise of a value, rad or m.
    pub noise: f64,
    /// Number of jumps of its clock.
    pub jumps: u32,
}

/// The state of both streams.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Health {
    /// Whether frames can be placed: poses, frames and all external axes are sufficiently known.
    pub is_settled: bool,
    /// How long ago the last pose was, s; `None` before the first.
    pub silent_s: Option<f64>,
    /// Whether that is longer than poses are bridged.
    pub is_stalled: bool,
    /// Usual time between poses, s.
    pub pose_period_s: f64,
    /// Noise of a pose along each axis, m.
    pub pose_noise_m: f64,
    /// Noise of an attitude about each axis, rad.
    pub pose_noise_rad: f64,
    /// Usual largest delay of poses and frames, s; zero if stamps are used unchanged.
    pub usual_late_s: [f64; 2],
    /// Numbers of jumps of the clocks of poses and of frames.
    pub jumps: [u32; 2],
}

/// Places the points of a running sensor by a calibration.
///
/// A frame is placed at its exposure, the stamp less the time offset, by the interpolation of the estimate. Beyond the last
/// pose one is predicted, with the robot's possible motion meanwhile in the ±; further on the frame is refused. All memory
/// is made by [`Placer::new`]; nothing waits for another thread.
///
/// ```
/// use trueline_geometry::Pose;
/// use trueline_rt::{Carrier, Placer, PlacerCalibration, Points, SensorModel, Settings};
///
/// let calibration = PlacerCalibration {
///     sensor: SensorModel::Profiler,
///     shape: None,
///     tool_from_camera: Pose::identity(),
///     time_offset_s: 0.010,
///     covariance: PlacerCalibration::covariance_of(1e-4, 1e-3, 1e-4),
///     reading_sigma_m: 2e-5,
///     carrier: Carrier::Tool,
///     axes: Vec::new(),
/// };
/// let mut placer = Placer::new(&calibration, &Settings::default())?;
/// for k in 0..100 {
///     placer.push_pose(k * 4_000_000, &Pose::translation(1e-3 * k as f64, 0.0, 0.0))?;
/// }
/// // Stamped at 210 ms, exposed at 200 ms, when the tool was at 50 mm.
/// let (mut points, mut sigma_m) = ([[0.0; 3]; 1], [0.0; 1]);
/// placer.place(210_000_000, Points::Profile(&[[0.0, 0.3]]), &mut points, &mut sigma_m)?;
/// assert!((points[0][0] - 0.05).abs() < 1e-9 && sigma_m[0] < 1e-3);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct Placer {
    settings: Settings,
    time_offset_s: f64,
    tool_from_camera: Pose,
    carrier: Carrier,
    lift: Lift,
    spread: Spread,
    stream: PoseStream,
    chain: Chain,
    frames: FrameClock,
    last_arrival_ns: Option<i64>,
}

impl Placer {
    /// A placer with a calibration. It makes all its memory here.
    ///
    /// # Errors
    /// [`BadSetting`] names a number that is not finite or out of range.
    pub fn new(calibration: &PlacerCalibration, settings: &Settings) -> Result<Self, BadSetting> {
        if let Some(name) = calibration.problem().or_else(|| settings.problem()) {
            return Err(BadSetting { name });
        }
        // Readings of a sheet err within it.
        let reading_axes = if matches!(calibration.sensor, SensorModel::Points { .. }) { 3.0 } else { 2.0 };
        Ok(Self {
            settings: *settings,
            time_offset_s: calibration.time_offset_s,
            tool_from_camera: calibration.tool_from_camera,
            carrier: calibration.carrier,
            lift: Lift::of(calibration),
            spread: Spread::of(calibration, reading_axes),
            stream: PoseStream::new(settings),
            chain: Chain::new(&calibration.axes, calibration.carrier, settings),
            frames: FrameClock::new(settings.frame_stamps),
            last_arrival_ns: None,
        })
    }

    /// Takes a pose `base_from_tool` that has arrived, stamped `stamp_ns`.
    ///
    /// # Errors
    /// [`PoseError`]: the pose is not finite, not later than the last one, or by a clock that went back. The stream
    /// continues.
    pub fn push_pose(&mut self, stamp_ns: i64, base_from_tool: &Pose) -> Result<(), PoseError> {
        let lines_from_carrier = match self.carrier {
            Carrier::Tool => *base_from_tool,
            Carrier::Fixed => base_from_tool.inverse(),
        };
        let taken = self.stream.push(stamp_ns, &lines_from_carrier);
        if taken != Err(PoseError::NotFinite) {
            self.last_arrival_ns = Some(stamp_ns);
        }
        taken
    }

    /// Takes a value of an external axis that has arrived, stamped `stamp_ns`: its angle (rad) or its way (m). `axis` is its number in
    /// [`PlacerCalibration::axes`].
    ///
    /// # Errors
    /// [`AxisError`]: an unknown axis, a value that is not finite or not later than the last one, or a clock that went
    /// back. The stream continues.
    pub fn push_axis(&mut self, axis: usize, stamp_ns: i64, value: f64) -> Result<(), AxisError> {
        let axes = self.chain.count();
        self.chain.stream_mut(axis).ok_or(AxisError::NoSuchAxis { axis, axes })?.push(stamp_ns, value)
    }

    /// Places the points of a frame stamped `stamp_ns` into `base_points` (m, in base). `sigma_m` receives
    /// the ± of each: the root mean square of the distance from the true point, m. A point that cannot be
    /// placed is NaN, and its ± infinite.
    ///
    /// # Errors
    /// [`PlaceError`] states why no point of the frame can be placed; the buffers are then NaN and infinite for all points.
    pub fn place(
        &mut self,
        stamp_ns: i64,
        points: Points<'_>,
        base_points: &mut [[f64; 3]],
        sigma_m: &mut [f64],
    ) -> Result<Placed, PlaceError> {
        let count = points.len();
        let buffer = base_points.len().min(sigma_m.len());
        if buffer < count {
            return Err(PlaceError::BufferTooShort { buffer, points: count });
        }
        let (base_points, sigma_m) = (&mut base_points[..count], &mut sigma_m[..count]);
        let placed = self.placed(stamp_ns, points, base_points, sigma_m);
        if placed.is_err() {
            base_points.fill([f64::NAN; 3]);
            sigma_m.fill(f64::INFINITY);
        }
        placed
    }

    fn placed(
        &mut self,
        stamp_ns: i64,
        points: Points<'_>,
        base_points: &mut [[f64; 3]],
        sigma_m: &mut [f64],
    ) -> Result<Placed, PlaceError> {
        if !self.lift.takes(&points) {
            return Err(PlaceError::OtherSensor);
        }
        let frame = self.frames.time(stamp_ns)?;
        let exposed_ns = stamps::stamp(-self.time_offset_s, frame.stamp_ns);
        if !is_stamp(exposed_ns) {
            return Err(PlaceError::StampOutOfRange);
        }
        // The stamp is a whole number of nanoseconds, the offset is not.
        let exposure_s = seconds(frame.stamp_ns, self.stream.origin_ns) - self.time_offset_s;
        let readout = self.settings.readout;
        let sweep = match readout {
            Readout::AtOnce => Sweep::Still(self.knot(exposure_s, frame)?),
            _ => Sweep::over(readout, &points, |after_s| self.knot(exposure_s + after_s, frame))?,
        };
        let placed = self.lift.place(points, &sweep, readout, base_points, sigma_m);
        Ok(Placed { placed, flagged: base_points.len() - placed, exposed_ns, age_s: sweep.age_s() })
    }

    /// Pose of the camera at an exposure, s from the origin of the stream.
    fn knot(&self, exposure_s: f64, frame: FrameTime) -> Result<Knot, PlaceError> {
        let located = interpolation::at(&self.stream, &self.settings, exposure_s)?;
        let stamp_sigma_s = frame.sigma_s.hypot(self.settings.stamp_sigma_s);
        let (located, form) = if self.chain.is_empty() {
            (located, self.spread.at(&located, stamp_sigma_s))
        } else {
            let carried = self.chain.carried(&located, self.stream.origin_ns, exposure_s)?;
            (carried.located, self.spread.among_axes(&located, &carried, stamp_sigma_s))
        };
        Ok(Knot::new(&(located.base_from_tool * self.tool_from_camera), &form, located.age_s))
    }

    /// The state of the stream of an external axis at a time of its clock, ns; `None` if there is no such axis.
    #[must_use]
    pub fn axis_health(&self, axis: usize, now_ns: i64) -> Option<AxisHealth> {
        let stream = self.chain.stream(axis)?;
        let last_ns = stream.last_arrival_ns().filter(|_| is_stamp(now_ns));
        let silent_s = last_ns.map(|last_ns| seconds(now_ns, last_ns));
        let gap_s = stream.gap_limit_s();
        Some(AxisHealth {
            is_settled: stream.is_settled(),
            silent_s,
            is_stalled: gap_s > 0.0 && silent_s.is_some_and(|silent_s| silent_s > gap_s),
            period_s: stream.period_s(),
            noise: stream.noise(),
            jumps: stream.clock().map_or(0, |clock| clock.jumps()),
        })
    }

    /// The state of both streams at a time of their clock, ns.
    #[must_use]
    pub fn health(&self, now_ns: i64) -> Health {
        let [pose_noise_m, pose_noise_rad] = self.stream.noise();
        let last_ns = self.last_arrival_ns.filter(|_| is_stamp(now_ns));
        let silent_s = last_ns.map(|last_ns| seconds(now_ns, last_ns));
        let gap_s = self.stream.gap_limit_s();
        let clocks = [self.stream.clock(), self.frames.clock()];
        Health {
            is_settled: self.stream.is_settled()
                && self.chain.is_settled()
                && clocks.iter().flatten().all(|clock| clock.is_settled()),
            silent_s,
            is_stalled: gap_s > 0.0 && silent_s.is_some_and(|silent_s| silent_s > gap_s),
            pose_period_s: self.stream.period_s(),
            pose_noise_m,
            pose_noise_rad,
            usual_late_s: clocks.map(|clock| clock.map_or(0.0, |clock| clock.usual_late_s())),
            jumps: clocks.map(|clock| clock.map_or(0, |clock| clock.jumps())),
        }
    }
}
