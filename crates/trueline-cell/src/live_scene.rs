//! A cell as viewers see it: its recording's own messages, and points in base where a calibration is known.

use crate::cell_listener::CellListener;
use crate::live_placer::{LivePlacer, PlacedKind, PlacedPoints};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};
use trueline_dataset::Feature;
use trueline_geometry::Pose;
use trueline_mcap::live::{LiveChannels, LogLevel};
use trueline_mcap::{CLOUD_TOPIC, Entry, Listener, SEAM_TOPIC};

/// Between pictures: they are large, and an eye needs no more.
const PICTURE_EVERY: Duration = Duration::from_millis(200);
/// The topic of pictures.
const PICTURE_TOPIC: &str = "/camera/image";
/// Between transforms that do not change, for viewers that have come meanwhile.
const STATIC_EVERY_NS: i64 = 1_000_000_000;

/// Publishes what a cell records.
pub struct LiveScene {
    channels: LiveChannels,
    placing: Option<Mutex<Placing>>,
    pictured: Mutex<Option<Instant>>,
}

struct Placing {
    placer: LivePlacer,
    tool_from_sensor: Option<Pose>,
    told_ns: i64,
}

impl LiveScene {
    /// Of a cell whose sensor is not calibrated yet.
    #[must_use]
    pub fn new(channels: LiveChannels) -> Self {
        Self { channels, placing: None, pictured: Mutex::default() }
    }

    /// With points in base; `tool_from_sensor` of a sensor that the robot carries.
    #[must_use]
    pub fn with_placer(self, placer: LivePlacer, tool_from_sensor: Option<Pose>) -> Self {
        let placing = Placing { placer, tool_from_sensor, told_ns: i64::MIN };
        Self { placing: Some(Mutex::new(placing)), ..self }
    }

    /// Where it publishes.
    #[must_use]
    pub fn channels(&self) -> &LiveChannels {
        &self.channels
    }

    fn publish(&self, points: PlacedPoints<'_>) {
        let topic = match points.kind {
            PlacedKind::Profile => CLOUD_TOPIC,
            PlacedKind::Seam => SEAM_TOPIC,
        };
        self.channels.points(topic, points.exposed_ns, points.in_base_m, points.sigma_m);
    }

    fn place(&self, now_ns: i64, take: impl FnOnce(&mut LivePlacer, &dyn Fn(PlacedPoints<'_>))) {
        let Some(placing) = &self.placing else { return };
        let mut placing = placing.lock().unwrap_or_else(PoisonError::into_inner);
        take(&mut placing.placer, &|points| self.publish(points));
        if let Some(news) = placing.placer.news() {
            self.channels.log(now_ns, LogLevel::Warning, &news);
        }
    }

    fn pose(&self, stamp_ns: i64, base_from_tool: &Pose) {
        self.place(stamp_ns, |placer, publish| placer.pose(stamp_ns, base_from_tool, publish));
        let Some(placing) = &self.placing else { return };
        let mut placing = placing.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(tool_from_sensor) = placing.tool_from_sensor
            && stamp_ns >= placing.told_ns.saturating_add(STATIC_EVERY_NS)
        {
            placing.told_ns = stamp_ns;
            self.channels.sensor(stamp_ns, &tool_from_sensor);
        }
    }

    /// Whether a picture is due.
    fn is_picture_due(&self) -> bool {
        let mut pictured = self.pictured.lock().unwrap_or_else(PoisonError::into_inner);
        let is_due = pictured.is_none_or(|at| at.elapsed() >= PICTURE_EVERY);
        if is_due {
            *pictured = Some(Instant::now());
        }
        is_due
    }
}

impl Listener for LiveScene {
    fn entry(&self, entry: &Entry) {
        match entry {
            Entry::Robot(robot) => self.pose(robot.steady_ns, &robot.base_from_tool),
            Entry::Profile(profile) => {
                self.place(profile.stamp_ns, |placer, publish| placer.profile(profile, publish));
            }
            Entry::Features(features) => features.features.iter().for_each(|feature| self.seam(feature)),
            _ => {}
        }
    }

    fn message(&self, topic: &str, log_ns: i64, bytes: &[u8]) {
        if topic != PICTURE_TOPIC || (self.channels.is_wanted(topic) && self.is_picture_due()) {
            self.channels.message(topic, log_ns, bytes);
        }
    }
}

impl CellListener for LiveScene {
    fn seam(&self, feature: &Feature) {
        self.place(feature.stamp_ns, |placer, publish| placer.seam(feature, publish));
    }
}
