//! Points of a running sensor in base: frames wait for the poses of their exposure, and are placed then.

use std::collections::VecDeque;
use trueline_dataset::{Feature, Measured};
use trueline_geometry::Pose;
use trueline_mcap::ProfileEntry;
use trueline_rt::{BadSetting, PlaceError, Placer, PlacerCalibration, Points, PoseError, Readout, Settings};

/// Frames that wait for a pose at most; of more, the oldest are placed with what there is.
const MOST_WAITING: usize = 64;

/// The points of a frame.
#[derive(Clone, Debug, PartialEq)]
enum Readings {
    Profile(Vec<[f64; 2]>),
    Pixels([f64; 2]),
    Camera([f64; 3]),
}

impl Readings {
    /// When a point was exposed after the first one, s.
    fn after_s(&self, readout: Readout, index: usize) -> f64 {
        let pixel = if let Self::Pixels(pixel) = self { *pixel } else { [0.0; 2] };
        readout.after_s(index, pixel)
    }
}

/// Kind of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PlacedKind {
    /// A whole profile.
    Profile,
    /// A seam point.
    Seam,
}

/// Points of a frame in base; those that cannot be placed are left out.
#[derive(Clone, Copy, Debug)]
pub struct PlacedPoints<'a> {
    /// Kind of the points.
    pub kind: PlacedKind,
    /// When the first point of the frame was exposed, ns by the clock of the poses.
    pub exposed_ns: i64,
    /// When each point was exposed after that, s.
    pub after_s: &'a [f64],
    /// The points, m.
    pub in_base_m: &'a [[f64; 3]],
    /// Their ±, m.
    pub sigma_m: &'a [f64],
}

struct Frame {
    stamp_ns: i64,
    kind: PlacedKind,
    readings: Readings,
}

/// Places profiles and seam points of a running cell.
pub struct LivePlacer {
    placer: Placer,
    readout: Readout,
    time_offset_ns: i64,
    last_pose_ns: i64,
    waiting: VecDeque<Frame>,
    in_base_m: Vec<[f64; 3]>,
    sigma_m: Vec<f64>,
    after_s: Vec<f64>,
    /// Why the last frame was refused, if it was.
    refused: Option<String>,
    news: Option<String>,
}

impl LivePlacer {
    /// The message that a trouble is over.
    pub const AGAIN: &'static str = "frames are placed again";

    /// With a calibration.
    ///
    /// # Errors
    /// [`BadSetting`] names a number that is not finite or out of range.
    pub fn new(calibration: &PlacerCalibration, settings: &Settings) -> Result<Self, BadSetting> {
        Ok(Self {
            placer: Placer::new(calibration, settings)?,
            readout: settings.readout,
            time_offset_ns: (calibration.time_offset_s * 1e9) as i64,
            last_pose_ns: i64::MIN,
            waiting: VecDeque::new(),
            in_base_m: Vec::new(),
            sigma_m: Vec::new(),
            after_s: Vec::new(),
            refused: None,
            news: None,
        })
    }

    /// Takes a pose `base_from_tool`, and places what has waited for it.
    pub fn pose(&mut self, stamp_ns: i64, base_from_tool: &Pose, mut placed: impl FnMut(PlacedPoints<'_>)) {
        match self.placer.push_pose(stamp_ns, base_from_tool) {
            Ok(()) => self.last_pose_ns = stamp_ns,
            // Overtaken datagrams are an everyday matter.
            Err(PoseError::NotLater { .. }) => {}
            Err(error @ PoseError::NotFinite) => self.refuse(error.to_string()),
            Err(error @ PoseError::ClockWentBack { .. }) => {
                self.last_pose_ns = stamp_ns;
                self.refuse(error.to_string());
            }
        }
        while self.waiting.front().is_some_and(|frame| self.is_due(frame)) {
            self.place_one(&mut placed);
        }
    }

    /// Takes a profile.
    pub fn profile(&mut self, profile: &ProfileEntry, placed: impl FnMut(PlacedPoints<'_>)) {
        let readings = Readings::Profile(profile.columns.iter().flatten().copied().collect());
        self.take(Frame { stamp_ns: profile.stamp_ns, kind: PlacedKind::Profile, readings }, placed);
    }

    /// Takes a seam point.
    pub fn seam(&mut self, feature: &Feature, placed: impl FnMut(PlacedPoints<'_>)) {
        let readings = match feature.measured {
            Measured::Profile(reading) => Readings::Profile(vec![reading]),
            Measured::Pixel(pixel) => Readings::Pixels(pixel),
            Measured::Point(point) => Readings::Camera(point),
        };
        self.take(Frame { stamp_ns: feature.stamp_ns, kind: PlacedKind::Seam, readings }, placed);
    }

    /// Why frames are not placed, or that they are again, since this was asked before.
    pub fn news(&mut self) -> Option<String> {
        self.news.take()
    }

    /// When a frame with this stamp was exposed, ns by the clock of the poses.
    #[must_use]
    pub fn exposed_ns(&self, stamp_ns: i64) -> i64 {
        stamp_ns.saturating_sub(self.time_offset_ns)
    }

    fn is_due(&self, frame: &Frame) -> bool {
        self.exposed_ns(frame.stamp_ns) <= self.last_pose_ns
    }

    fn take(&mut self, frame: Frame, mut placed: impl FnMut(PlacedPoints<'_>)) {
        self.waiting.push_back(frame);
        while self.waiting.len() > MOST_WAITING
            || self.waiting.front().is_some_and(|frame| self.is_due(frame))
        {
            self.place_one(&mut placed);
        }
    }

    fn place_one(&mut self, placed: &mut impl FnMut(PlacedPoints<'_>)) {
        let Some(Frame { stamp_ns, kind, readings }) = self.waiting.pop_front() else { return };
        let points = match &readings {
            Readings::Profile(readings) => Points::Profile(readings),
            Readings::Pixels(pixel) => Points::Pixels(std::slice::from_ref(pixel)),
            Readings::Camera(point) => Points::Camera(std::slice::from_ref(point)),
        };
        self.in_base_m.resize(points.len(), [0.0; 3]);
        self.sigma_m.resize(points.len(), 0.0);
        match self.placer.place(stamp_ns, points, &mut self.in_base_m, &mut self.sigma_m) {
            Ok(frame) => {
                let after_s = (0..points.len()).map(|index| readings.after_s(self.readout, index));
                self.after_s.clear();
                self.after_s.extend(after_s);
                if frame.flagged > 0 {
                    let is_good = |index: usize| self.sigma_m[index].is_finite();
                    let mut index = 0..;
                    self.in_base_m.retain(|_| index.next().is_some_and(is_good));
                    let mut index = 0..;
                    self.after_s.retain(|_| index.next().is_some_and(is_good));
                    self.sigma_m.retain(|sigma_m| sigma_m.is_finite());
                }
                if self.refused.take().is_some() {
                    self.news = Some(Self::AGAIN.to_owned());
                }
                placed(PlacedPoints {
                    kind,
                    exposed_ns: frame.exposed_ns,
                    after_s: &self.after_s,
                    in_base_m: &self.in_base_m,
                    sigma_m: &self.sigma_m,
                });
            }
            // At the start, which needs no message.
            Err(PlaceError::Unsettled { .. } | PlaceError::FramesUnsettled) => {}
            Err(error) => self.refuse(format!("a frame is not placed: {error}")),
        }
    }

    /// One trouble is told once, whatever its numbers.
    fn refuse(&mut self, why: String) {
        if self.refused.is_none() {
            self.news = Some(why.clone());
        }
        self.refused = Some(why);
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;
    use trueline_rt::{Carrier, SensorModel};

    /// Poses at 250 Hz along x at 0.1 m/s, from zero.
    const PERIOD_NS: i64 = 4_000_000;

    fn calibration(time_offset_s: f64) -> PlacerCalibration {
        PlacerCalibration {
            sensor: SensorModel::Profiler,
            shape: None,
            tool_from_camera: Pose::identity(),
            time_offset_s,
            covariance: PlacerCalibration::covariance_of(1e-4, 1e-3, 1e-4),
            reading_sigma_m: 2e-5,
            carrier: Carrier::Tool,
            axes: Vec::new(),
        }
    }

    fn placer(time_offset_s: f64) -> LivePlacer {
        LivePlacer::new(&calibration(time_offset_s), &Settings::default()).unwrap()
    }

    fn pose(k: i64) -> Pose {
        Pose::translation(0.1 * (k * PERIOD_NS) as f64 * 1e-9, 0.0, 0.0)
    }

    fn profile(stamp_ns: i64) -> ProfileEntry {
        ProfileEntry { profile: 1, stamp_ns, columns: vec![None, Some([0.0, 0.3]), None] }
    }

    #[test]
    fn a_frame_waits_for_the_poses_of_its_exposure_and_is_then_where_the_robot_was() {
        // Stamped 60 ms before its exposure, further than a pose is predicted.
        let mut placer = placer(-0.060);
        let mut xs = Vec::new();
        for k in 0..500 {
            placer.pose(k * PERIOD_NS, &pose(k), |points| {
                assert_eq!((points.kind, points.in_base_m.len()), (PlacedKind::Profile, 1));
                xs.push((points.exposed_ns, points.in_base_m[0][0]));
            });
            if k % 10 == 0 {
                placer.profile(&profile(k * PERIOD_NS), |_| unreachable!("its pose has not come"));
            }
        }
        assert!(xs.len() > 30, "{}", xs.len());
        assert!(
            xs.iter().all(|(exposed_ns, x)| (x - 0.1 * *exposed_ns as f64 * 1e-9).abs() < 1e-9),
            "{xs:?}"
        );
        assert_eq!(placer.news(), None);
    }

    /// A profile with a NaN that is read out point by point: each remaining point keeps its own time.
    #[test]
    fn each_point_has_the_time_of_its_exposure() {
        let settings = Settings { readout: Readout::ByIndex(1e-5), ..Settings::default() };
        let mut placer = LivePlacer::new(&calibration(0.010), &settings).unwrap();
        (0..200).for_each(|k| placer.pose(k * PERIOD_NS, &pose(k), |_| {}));
        let columns = vec![Some([0.0, 0.3]), None, Some([f64::NAN, 0.3]), Some([0.002, 0.3])];
        let mut times_s = Vec::new();
        placer.profile(&ProfileEntry { profile: 1, stamp_ns: 150 * PERIOD_NS, columns }, |points| {
            assert_eq!((points.in_base_m.len(), points.sigma_m.len()), (2, 2));
            times_s.extend_from_slice(points.after_s);
        });
        assert_eq!(times_s, [0.0, 2e-5]);
    }

    #[test]
    fn poses_that_end_are_told_once_and_so_is_that_they_go_on() {
        let mut placer = placer(0.010);
        (0..200).for_each(|k| placer.pose(k * PERIOD_NS, &pose(k), |_| {}));
        let mut placed = 0;
        for k in 200..400 {
            placer.profile(&profile(k * PERIOD_NS), |_| placed += 1);
        }
        // Those that a prediction of 20 ms reaches.
        assert!(placed <= 9, "{placed}");
        assert!(placer.news().is_some_and(|news| news.contains("after the last pose")));
        assert_eq!(placer.news(), None);
        (400..800).for_each(|k| placer.pose(k * PERIOD_NS, &pose(k), |_| {}));
        placer.profile(&profile(799 * PERIOD_NS), |_| placed += 1);
        assert_eq!(placer.news().as_deref(), Some(LivePlacer::AGAIN));
    }
}
