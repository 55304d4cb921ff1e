//! A cloud of points in base as an MCAP file that viewers show: a message for each frame, written as it comes.

use crate::wire::encode::timestamp;
use crate::wire::frame_names::BASE;
use crate::wire::topics::ENCODING;
use foxglove::Encode;
use foxglove::messages::packed_element_field::NumericType;
use foxglove::messages::{PackedElementField, PointCloud, Pose, Quaternion, Vector3};
use mcap::records::MessageHeader;
use mcap::{McapError, WriteOptions, Writer};
use prost::Message;
use std::collections::BTreeMap;
use std::io::{Seek, Write};

/// The topic that it is written to.
pub const CLOUD_TOPIC: &str = "/cloud";

/// Bytes of a number.
const DOUBLE: usize = size_of::<f64>();

/// A file of `foxglove.PointCloud` in frame `base`, logged at the exposure; numbers are in double precision.
pub struct CloudFile<W: Write + Seek> {
    writer: Writer<W>,
    channel_id: u16,
    sequence: u32,
    fields: Vec<PackedElementField>,
}

impl<W: Write + Seek> CloudFile<W> {
    /// A file with points of x, y, z, and then these columns.
    ///
    /// # Errors
    /// Error of the operating system.
    pub fn create(out: W, columns: &[&str]) -> Result<Self, McapError> {
        let library = concat!("trueline ", env!("CARGO_PKG_VERSION"));
        // Random digits do not compress, and delay their reader.
        let mut writer = WriteOptions::new().library(library).compression(None).create(out)?;
        let schema = PointCloud::get_schema();
        let (name, data) =
            schema.map_or_else(Default::default, |schema| (schema.name, schema.data.into_owned()));
        let schema_id = writer.add_schema(&name, ENCODING, &data)?;
        let channel_id = writer.add_channel(schema_id, CLOUD_TOPIC, ENCODING, &BTreeMap::new())?;
        let names = ["x", "y", "z"].iter().chain(columns);
        let fields = names.zip(0_u32..).map(|(name, place)| PackedElementField {
            name: (*name).to_owned(),
            offset: place * DOUBLE as u32,
            r#type: NumericType::Float64.into(),
        });
        Ok(Self { writer, channel_id, sequence: 0, fields: fields.collect() })
    }

    /// Writes a frame: its points one after the other, each x, y, z (m) and the other columns.
    ///
    /// # Errors
    /// Error of the operating system.
    pub fn frame(&mut self, exposed_ns: i64, numbers: &[f64]) -> Result<(), McapError> {
        let cloud = PointCloud {
            timestamp: Some(timestamp(exposed_ns)),
            frame_id: BASE.to_owned(),
            pose: Some(Pose {
                position: Some(Vector3 { x: 0.0, y: 0.0, z: 0.0 }),
                orientation: Some(Quaternion { x: 0.0, y: 0.0, z: 0.0, w: 1.0 }),
            }),
            point_stride: (self.fields.len() * DOUBLE) as u32,
            fields: self.fields.clone(),
            data: numbers.iter().flat_map(|number| number.to_le_bytes()).collect::<Vec<u8>>().into(),
        };
        let (sequence, channel_id) = (self.sequence, self.channel_id);
        // Times of a viewer begin at zero.
        let stamp = exposed_ns.max(0) as u64;
        let header = MessageHeader { channel_id, sequence, log_time: stamp, publish_time: stamp };
        self.sequence = self.sequence.wrapping_add(1);
        self.writer.write_to_known_channel(&header, &cloud.encode_to_vec())
    }

    /// Ends the file.
    ///
    /// # Errors
    /// Error of the operating system.
    pub fn finish(mut self) -> Result<(), McapError> {
        self.writer.finish().map(drop)
    }
}
