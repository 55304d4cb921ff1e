//! The topics of a live view, and what is published on them.

use super::live_view_error::LiveViewError;
use super::own_schemas;
use crate::wire::encode::timestamp;
use crate::wire::frame_names::{BASE, TOOL};
use crate::wire::topics::{ENCODING, TOPICS, standard};
use crate::write::cloud::CLOUD_TOPIC;
use crate::write::seam_points::SEAM_TOPIC;
use foxglove::messages::packed_element_field::NumericType;
use foxglove::messages::{
    FrameTransform, Log, PackedElementField, PointCloud, Pose as FoxglovePose, Quaternion, Vector3,
    log::Level,
};
use foxglove::{Context, PartialMetadata, RawChannel, Schema};
use prost::Message;
use serde_json::Value;
use std::collections::BTreeMap;
use std::sync::Arc;
use trueline_geometry::Pose;

/// How a calibration grows, as JSON.
pub const ESTIMATE_TOPIC: &str = "/estimate";
/// Result of a weld, as JSON.
pub const WELD_TOPIC: &str = "/weld";

/// The frames of what the sensor sees: pictures, and profiles.
const SENSOR_FRAMES: [&str; 2] = ["camera", "profiler"];

/// How much a line of the log matters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LogLevel {
    /// Good to know.
    Info,
    /// Something is not as it should be.
    Warning,
    /// An alarm, or something that failed.
    Error,
}

/// Where live messages are published; there may be many owners. A stamp is in ns since 1970.
#[derive(Clone)]
pub struct LiveChannels {
    // Channels know their context weakly.
    _context: Arc<Context>,
    by_topic: Arc<BTreeMap<String, Arc<RawChannel>>>,
}

impl LiveChannels {
    pub(super) fn of(context: Arc<Context>) -> Result<Self, LiveViewError> {
        let json = |topic: &str, name: &str, schema: &Value| {
            let schema = Schema::new(name, "jsonschema", schema.to_string().into_bytes());
            (topic.to_owned(), "json", schema)
        };
        let mut all: Vec<(String, &str, Schema)> = TOPICS
            .iter()
            .map(|topic| {
                let schema = Schema::new(topic.schema.clone(), ENCODING, topic.descriptors.to_vec());
                (topic.name.to_owned(), ENCODING, schema)
            })
            .collect();
        for topic in [CLOUD_TOPIC, SEAM_TOPIC] {
            let cloud = standard::<PointCloud>(0, topic);
            let schema = Schema::new(cloud.schema, ENCODING, cloud.descriptors.to_vec());
            all.push((topic.to_owned(), ENCODING, schema));
        }
        all.push(json(ESTIMATE_TOPIC, "trueline.Estimate", &own_schemas::estimate()));
        all.push(json(WELD_TOPIC, "trueline.Weld", &own_schemas::weld()));
        let mut by_topic = BTreeMap::new();
        for (topic, encoding, schema) in all {
            let channel = context
                .channel_builder(topic.clone())
                .message_encoding(encoding)
                .schema(schema)
                .build_raw()
                .map_err(|error| LiveViewError::Channel { topic: topic.clone(), why: error.to_string() })?;
            by_topic.insert(topic, channel);
        }
        Ok(Self { _context: context, by_topic: Arc::new(by_topic) })
    }

    /// All topics.
    pub fn topics(&self) -> impl Iterator<Item = &str> {
        self.by_topic.keys().map(String::as_str)
    }

    /// Whether a viewer has requested a topic.
    #[must_use]
    pub fn is_wanted(&self, topic: &str) -> bool {
        self.by_topic.get(topic).is_some_and(|channel| channel.has_sinks())
    }

    /// Publishes a message that is encoded already, as it is in a recording.
    pub fn message(&self, topic: &str, stamp_ns: i64, bytes: &[u8]) {
        if let Some(channel) = self.by_topic.get(topic) {
            // Viewers know no time before 1970.
            channel.log_with_meta(bytes, PartialMetadata::with_log_time(stamp_ns.max(0) as u64));
        }
    }

    /// Publishes JSON on [`ESTIMATE_TOPIC`] or [`WELD_TOPIC`].
    pub fn json(&self, topic: &str, stamp_ns: i64, json: &Value) {
        if self.is_wanted(topic) {
            self.message(topic, stamp_ns, json.to_string().as_bytes());
        }
    }

    /// Publishes words.
    pub fn log(&self, stamp_ns: i64, level: LogLevel, text: &str) {
        let level = match level {
            LogLevel::Info => Level::Info,
            LogLevel::Warning => Level::Warning,
            LogLevel::Error => Level::Error,
        };
        let message = Log {
            timestamp: Some(timestamp(stamp_ns)),
            level: level as i32,
            message: text.to_owned(),
            name: "trueline".to_owned(),
            ..Log::default()
        };
        self.message("/log", stamp_ns, &message.encode_to_vec());
    }

    /// Publishes where the sensor is on the tool, for profiles and pictures in their own frames. A viewer that connects later has to be
    /// told again.
    pub fn sensor(&self, stamp_ns: i64, tool_from_sensor: &Pose) {
        let (p, q) = (tool_from_sensor.translation.vector, tool_from_sensor.rotation.quaternion());
        for frame in SENSOR_FRAMES {
            let transform = FrameTransform {
                timestamp: Some(timestamp(stamp_ns)),
                parent_frame_id: TOOL.to_owned(),
                child_frame_id: frame.to_owned(),
                translation: Some(Vector3 { x: p.x, y: p.y, z: p.z }),
                rotation: Some(Quaternion { x: q.i, y: q.j, z: q.k, w: q.w }),
            };
            self.message("/tf", stamp_ns, &transform.encode_to_vec());
        }
    }

    /// Publishes points in base (m), each with its ± (m), on [`CLOUD_TOPIC`] or [`SEAM_TOPIC`].
    pub fn points(&self, topic: &str, exposed_ns: i64, in_base_m: &[[f64; 3]], sigma_m: &[f64]) {
        if !self.is_wanted(topic) {
            return;
        }
        let fields = ["x", "y", "z", "sigma"].into_iter().zip(0_u32..).map(|(name, place)| {
            let offset = place * size_of::<f32>() as u32;
            PackedElementField { name: name.to_owned(), offset, r#type: NumericType::Float32.into() }
        });
        let numbers = in_base_m.iter().zip(sigma_m).flat_map(|(point, sigma_m)| {
            let [x, y, z] = *point;
            // Single precision: 60 nm at a metre, for the eye alone.
            [x, y, z, *sigma_m].map(|number| (number as f32).to_le_bytes())
        });
        let cloud = PointCloud {
            timestamp: Some(timestamp(exposed_ns)),
            frame_id: BASE.to_owned(),
            pose: Some(FoxglovePose {
                position: Some(Vector3 { x: 0.0, y: 0.0, z: 0.0 }),
                orientation: Some(Quaternion { x: 0.0, y: 0.0, z: 0.0, w: 1.0 }),
            }),
            point_stride: 4 * size_of::<f32>() as u32,
            fields: fields.collect(),
            data: numbers.flatten().collect::<Vec<u8>>().into(),
        };
        self.message(topic, exposed_ns, &cloud.encode_to_vec());
    }
}
