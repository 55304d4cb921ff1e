//! The messages of Foxglove that matter here.

use crate::message::content::{Content, Kind, StampedPicture, StampedPose, StampedTransform};
use crate::message::content_error::ContentError;
use crate::message::gray_picture::{RawPicture, compressed};
use crate::message::spatial::{frame_name, pose_of};
use foxglove::messages::{
    CompressedImage, FrameTransform, FrameTransforms, PoseInFrame, Quaternion, RawImage, Vector3,
};
use prost::Message;

/// What messages of a schema are.
#[must_use]
pub(super) fn kind(schema: &str) -> Kind {
    match schema {
        "foxglove.PoseInFrame" => Kind::Pose,
        "foxglove.FrameTransform" | "foxglove.FrameTransforms" => Kind::Transforms,
        "foxglove.CompressedImage" | "foxglove.RawImage" => Kind::Picture,
        _ => Kind::Other,
    }
}

/// Understands a message.
///
/// # Errors
/// [`ContentError`] says which field is at fault.
pub(super) fn decode(schema: &str, bytes: &[u8]) -> Result<Content, ContentError> {
    match schema {
        "foxglove.PoseInFrame" => pose(bytes).map(Content::Pose),
        "foxglove.FrameTransform" => {
            let stamp = message::<Stamp>(bytes)?;
            Ok(Content::Transforms(vec![transform(&message(bytes)?, &stamp)?]))
        }
        "foxglove.FrameTransforms" => transforms(bytes).map(Content::Transforms),
        "foxglove.CompressedImage" => {
            let image = message::<CompressedImage>(bytes)?;
            let (picture, origin) = compressed(&image.data, &image.format)?;
            let stamp_ns = message::<Stamp>(bytes)?.ns()?;
            Ok(Content::Picture(StampedPicture { stamp_ns, picture, origin }))
        }
        "foxglove.RawImage" => raw_image(bytes).map(Content::Picture),
        _ => Ok(Content::Other),
    }
}

/// The stamp of any of these messages, in its first field. The type of the foxglove crate reads seconds that it cannot hold as
/// zero, and says nothing.
#[derive(Clone, PartialEq, Message)]
struct Stamp {
    #[prost(message, optional, tag = "1")]
    timestamp: Option<prost_types::Timestamp>,
}

/// The stamps of [`FrameTransforms`].
#[derive(Clone, PartialEq, Message)]
struct Stamps {
    #[prost(message, repeated, tag = "1")]
    transforms: Vec<Stamp>,
}

impl Stamp {
    fn ns(&self) -> Result<i64, ContentError> {
        let time = self.timestamp.ok_or(ContentError::Missing { field: "the timestamp" })?;
        let whole_ns = time.seconds.checked_mul(1_000_000_000);
        let nanos = (0..1_000_000_000).contains(&time.nanos).then_some(i64::from(time.nanos));
        let ns = whole_ns.zip(nanos).and_then(|(whole, nanos)| whole.checked_add(nanos));
        ns.ok_or(ContentError::Stamp)
    }
}

fn message<M: Message + Default>(bytes: &[u8]) -> Result<M, ContentError> {
    M::decode(bytes).map_err(|error| ContentError::Protobuf { why: error.to_string() })
}

fn pose(bytes: &[u8]) -> Result<StampedPose, ContentError> {
    let wire = message::<PoseInFrame>(bytes)?;
    let pose = wire.pose.ok_or(ContentError::Missing { field: "the pose" })?;
    Ok(StampedPose {
        stamp_ns: message::<Stamp>(bytes)?.ns()?,
        frame: frame_name(&wire.frame_id),
        pose: pose_of(position(pose.position)?, rotation(pose.orientation)?)?,
    })
}

fn transforms(bytes: &[u8]) -> Result<Vec<StampedTransform>, ContentError> {
    let (wire, stamps) = (message::<FrameTransforms>(bytes)?, message::<Stamps>(bytes)?);
    wire.transforms.iter().zip(&stamps.transforms).map(|(wire, stamp)| transform(wire, stamp)).collect()
}

fn transform(wire: &FrameTransform, stamp: &Stamp) -> Result<StampedTransform, ContentError> {
    Ok(StampedTransform {
        stamp_ns: stamp.ns()?,
        parent: frame_name(&wire.parent_frame_id),
        child: frame_name(&wire.child_frame_id),
        parent_from_child: pose_of(position(wire.translation)?, rotation(wire.rotation)?)?,
    })
}

/// Nothing is a message too, and reads as zeros: what is missing must be seen to be missing.
fn position(wire: Option<Vector3>) -> Result<[f64; 3], ContentError> {
    let p = wire.ok_or(ContentError::Missing { field: "the position" })?;
    Ok([p.x, p.y, p.z])
}

fn rotation(wire: Option<Quaternion>) -> Result<[f64; 4], ContentError> {
    let q = wire.ok_or(ContentError::Missing { field: "the rotation" })?;
    Ok([q.x, q.y, q.z, q.w])
}

fn raw_image(bytes: &[u8]) -> Result<StampedPicture, ContentError> {
    let wire = message::<RawImage>(bytes)?;
    let picture = RawPicture {
        width: wire.width,
        height: wire.height,
        step: wire.step,
        encoding: &wire.encoding,
        // The schema says so.
        big_endian: false,
        bytes: &wire.data,
    };
    let (picture, origin) = picture.gray()?;
    Ok(StampedPicture { stamp_ns: message::<Stamp>(bytes)?.ns()?, picture, origin })
}
