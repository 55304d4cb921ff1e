//! Seam points in base as an MCAP file that viewers show: a cloud of points for each image.

use crate::wire::encode::timestamp;
use crate::wire::frame_names::BASE;
use crate::wire::topics::ENCODING;
use foxglove::Encode;
use foxglove::messages::packed_element_field::NumericType;
use foxglove::messages::{PackedElementField, PointCloud, Pose, Quaternion, Vector3};
use mcap::records::MessageHeader;
use mcap::{McapError, WriteOptions};
use prost::Message;
use std::collections::BTreeMap;
use std::io::Cursor;

/// The topic that they are written to.
pub const SEAM_TOPIC: &str = "/seam_points";

/// The seam points of an image.
#[derive(Clone, Debug, PartialEq)]
pub struct ImagePoints {
    /// When it was exposed, ns.
    pub exposed_ns: i64,
    /// Its points in base, m.
    pub in_base_m: Vec<[f64; 3]>,
}

/// The bytes of the file; messages of `foxglove.PointCloud` in frame `base`, logged at the exposure.
///
/// # Errors
/// A message without a schema, which none of these is.
pub fn seam_points(images: &[ImagePoints]) -> Result<Vec<u8>, McapError> {
    let library = concat!("trueline ", env!("CARGO_PKG_VERSION"));
    let options = WriteOptions::new().library(library).compression(None);
    let mut writer = options.create(Cursor::new(Vec::new()))?;
    let schema = PointCloud::get_schema();
    let (name, data) = schema.map_or_else(Default::default, |schema| (schema.name, schema.data.into_owned()));
    let schema_id = writer.add_schema(&name, ENCODING, &data)?;
    let channel_id = writer.add_channel(schema_id, SEAM_TOPIC, ENCODING, &BTreeMap::new())?;
    for (image, sequence) in images.iter().zip(0..) {
        let stamp = image.exposed_ns as u64;
        let header = MessageHeader { channel_id, sequence, log_time: stamp, publish_time: stamp };
        writer.write_to_known_channel(&header, &cloud(image).encode_to_vec())?;
    }
    writer.finish()?;
    Ok(writer.into_inner().into_inner())
}

fn cloud(image: &ImagePoints) -> PointCloud {
    let field = |name: &str, offset: u32| PackedElementField {
        name: name.to_owned(),
        offset,
        r#type: NumericType::Float64.into(),
    };
    PointCloud {
        timestamp: Some(timestamp(image.exposed_ns)),
        frame_id: BASE.to_owned(),
        pose: Some(Pose {
            position: Some(Vector3 { x: 0.0, y: 0.0, z: 0.0 }),
            orientation: Some(Quaternion { x: 0.0, y: 0.0, z: 0.0, w: 1.0 }),
        }),
        point_stride: 24,
        fields: vec![field("x", 0), field("y", 8), field("z", 16)],
        data: image
            .in_base_m
            .iter()
            .flatten()
            .flat_map(|value| value.to_le_bytes())
            .collect::<Vec<u8>>()
            .into(),
    }
}
