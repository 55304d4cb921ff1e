//! The messages of Foxglove that matter here.

use crate::message::content::{Content, Kind, StampedPicture, StampedPose, StampedProfile, StampedTransform};
use crate::message::content_error::ContentError;
use crate::message::gray_picture::{RawPicture, compressed};
use crate::message::ros_profile::{PointField, Points};
use crate::message::spatial::{frame_name, pose_of};
use crate::message::stamp;
use foxglove::messages::{
    CompressedImage, FrameTransform, FrameTransforms, PointCloud, PoseInFrame, Quaternion, RawImage, Vector3,
    packed_element_field::NumericType,
};
use prost::Message;

/// Kind of the messages of a schema.
#[must_use]
pub(super) fn kind(schema: &str) -> Kind {
    match schema {
        "foxglove.PoseInFrame" => Kind::Pose,
        "foxglove.FrameTransform" | "foxglove.FrameTransforms" => Kind::Transforms,
        "foxglove.CompressedImage" | "foxglove.RawImage" => Kind::Picture,
        "foxglove.PointCloud" => Kind::Profile,
        _ => Kind::Other,
    }
}

/// Understands a message.
///
/// # Errors
/// [`ContentError`] names the faulty field.
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
        "foxglove.PointCloud" => profile(bytes).map(Content::Profile),
        "foxglove.RawImage" => raw_image(bytes).map(Content::Picture),
        _ => Ok(Content::Other),
    }
}

/// The stamp of any of these messages, in its first field. The type of the foxglove crate reads seconds that it cannot hold as
/// zero, and has no information.
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
        ns.ok_or(ContentError::Stamp).and_then(stamp::in_range)
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

/// An empty message is valid too, and reads as zeros: a missing value must be recognisable.
fn position(wire: Option<Vector3>) -> Result<[f64; 3], ContentError> {
    let p = wire.ok_or(ContentError::Missing { field: "the position" })?;
    Ok([p.x, p.y, p.z])
}

fn rotation(wire: Option<Quaternion>) -> Result<[f64; 4], ContentError> {
    let q = wire.ok_or(ContentError::Missing { field: "the rotation" })?;
    Ok([q.x, q.y, q.z, q.w])
}

/// A cloud in the plane y = 0; without a field for it y is 0.
fn profile(bytes: &[u8]) -> Result<StampedProfile, ContentError> {
    let wire = message::<PointCloud>(bytes)?;
    let field = |name: &str| {
        let field = wire.fields.iter().find(|field| field.name == name)?;
        let double = match NumericType::try_from(field.r#type) {
            Ok(NumericType::Float32) => false,
            Ok(NumericType::Float64) => true,
            _ => return None,
        };
        Some(PointField { name: name.to_owned(), offset: field.offset as usize, double })
    };
    let missing = || ContentError::Missing { field: "x or z in single or double precision" };
    let (x, z) = (field("x").ok_or_else(missing)?, field("z").ok_or_else(missing)?);
    let y = field("y");
    let step = wire.point_stride as usize;
    if !x.fits(step) || !z.fits(step) || y.as_ref().is_some_and(|y| !y.fits(step)) {
        return Err(ContentError::CutOff { field: "the points" });
    }
    let mut profile = Points::default();
    for point in wire.data.chunks_exact(step) {
        let y_m = y.as_ref().map_or(0.0, |y| y.read(point, false));
        profile.add([x.read(point, false), y_m, z.read(point, false)])?;
    }
    let Points { points, no_return } = profile;
    Ok(StampedProfile { stamp_ns: message::<Stamp>(bytes)?.ns()?, frame: None, points, no_return })
}

fn raw_image(bytes: &[u8]) -> Result<StampedPicture, ContentError> {
    let wire = message::<RawImage>(bytes)?;
    let picture = RawPicture {
        width: wire.width,
        height: wire.height,
        step: wire.step,
        encoding: &wire.encoding,
        // As in the schema.
        big_endian: false,
        bytes: &wire.data,
    };
    let (picture, origin) = picture.gray()?;
    Ok(StampedPicture { stamp_ns: message::<Stamp>(bytes)?.ns()?, picture, origin })
}
