//! The messages of ROS that matter here.

use crate::message::content::{
    Content, JointStates, Kind, StampedPicture, StampedPose, StampedProfile, StampedTransform,
};
use crate::message::content_error::ContentError;
use crate::message::gray_picture::{RawPicture, compressed};
use crate::message::ros_cursor::RosCursor;
use crate::message::ros_profile::{Points, laser_scan, point_cloud};
use crate::message::spatial::{frame_name, pose_of};
use crate::message::stamp;

/// Kind of a ROS type's messages. The type is written `package/msg/Name` in ROS 2, `package/Name` in ROS 1.
#[must_use]
pub(super) fn kind(schema: &str) -> Kind {
    let short = schema.replace("/msg/", "/");
    match short.as_str() {
        "geometry_msgs/PoseStamped" | "geometry_msgs/PoseWithCovarianceStamped" | "nav_msgs/Odometry" => {
            Kind::Pose
        }
        "sensor_msgs/PointCloud2" | "sensor_msgs/LaserScan" => Kind::Profile,
        "geometry_msgs/TransformStamped" | "tf2_msgs/TFMessage" | "tf/tfMessage" => Kind::Transforms,
        "sensor_msgs/Image" | "sensor_msgs/CompressedImage" => Kind::Picture,
        "sensor_msgs/JointState" => Kind::JointStates,
        _ => Kind::Other,
    }
}

/// Understands a ROS 2 message.
///
/// # Errors
/// [`ContentError`] names the faulty field.
pub(crate) fn decode_ros2(schema: &str, bytes: &[u8]) -> Result<Content, ContentError> {
    if kind(schema) == Kind::Other {
        return Ok(Content::Other);
    }
    Fields { cursor: RosCursor::ros2(bytes)?, header: Fields::header_of_ros2 }.content(schema)
}

/// Understands a ROS 1 message.
///
/// # Errors
/// [`ContentError`] names the faulty field.
pub(crate) fn decode_ros1(schema: &str, bytes: &[u8]) -> Result<Content, ContentError> {
    Fields { cursor: RosCursor::ros1(bytes), header: Fields::header_of_ros1 }.content(schema)
}

fn profile(stamp_ns: i64, Points { points, no_return }: Points) -> StampedProfile {
    StampedProfile { stamp_ns, frame: None, points, no_return }
}

type Read<T> = Result<T, ContentError>;
type Header = (i64, String);

/// A message's fields, and how its header is written.
struct Fields<'a> {
    cursor: RosCursor<'a>,
    header: fn(&mut RosCursor<'a>) -> Read<Header>,
}

impl<'a> Fields<'a> {
    fn content(mut self, schema: &str) -> Read<Content> {
        let content = match schema.rsplit('/').next().unwrap_or_default() {
            "Odometry" if kind(schema) == Kind::Pose => Content::Pose(self.odometry()?),
            "PoseWithCovarianceStamped" if kind(schema) == Kind::Pose => {
                let pose = self.pose()?;
                self.covariance()?;
                Content::Pose(pose)
            }
            _ if kind(schema) == Kind::Pose => Content::Pose(self.pose()?),
            "PointCloud2" if kind(schema) == Kind::Profile => {
                let (stamp_ns, _) = self.header()?;
                Content::Profile(profile(stamp_ns, point_cloud(&mut self.cursor)?))
            }
            _ if kind(schema) == Kind::Profile => {
                let (stamp_ns, _) = self.header()?;
                Content::Profile(profile(stamp_ns, laser_scan(&mut self.cursor)?))
            }
            "TransformStamped" if kind(schema) == Kind::Transforms => {
                Content::Transforms(vec![self.transform()?])
            }
            _ if kind(schema) == Kind::Transforms => Content::Transforms(self.transforms()?),
            _ if kind(schema) == Kind::JointStates => Content::JointStates(self.joint_states()?),
            "CompressedImage" if kind(schema) == Kind::Picture => Content::Picture(self.compressed_image()?),
            "Image" if kind(schema) == Kind::Picture => Content::Picture(self.image()?),
            _ => return Ok(Content::Other),
        };
        self.cursor.end()?;
        Ok(content)
    }

    fn header_of_ros2(cursor: &mut RosCursor<'a>) -> Read<Header> {
        let (s, ns) = (cursor.i32("header.stamp")?, cursor.u32("header.stamp")?);
        Ok((stamp_ns(i64::from(s), ns)?, frame_name(cursor.text("header.frame_id")?)))
    }

    fn header_of_ros1(cursor: &mut RosCursor<'a>) -> Read<Header> {
        cursor.u32("header.seq")?;
        let (s, ns) = (cursor.u32("header.stamp")?, cursor.u32("header.stamp")?);
        Ok((stamp_ns(i64::from(s), ns)?, frame_name(cursor.text("header.frame_id")?)))
    }

    fn header(&mut self) -> Read<Header> {
        (self.header)(&mut self.cursor)
    }

    fn pose(&mut self) -> Read<StampedPose> {
        let (stamp_ns, frame) = self.header()?;
        let (position, xyzw) = (self.cursor.f64s("position")?, self.cursor.f64s("orientation")?);
        Ok(StampedPose { stamp_ns, frame, pose: pose_of(position, xyzw)? })
    }

    fn odometry(&mut self) -> Read<StampedPose> {
        let (stamp_ns, frame) = self.header()?;
        self.cursor.text("child_frame_id")?;
        let (position, xyzw) = (self.cursor.f64s("position")?, self.cursor.f64s("orientation")?);
        self.covariance()?;
        // Linear and angular velocity.
        for _ in 0..6 {
            self.cursor.any_f64("twist")?;
        }
        self.covariance()?;
        Ok(StampedPose { stamp_ns, frame, pose: pose_of(position, xyzw)? })
    }

    /// Not used; a sender that does not know it may send NaN.
    fn covariance(&mut self) -> Read<()> {
        for _ in 0..36 {
            self.cursor.any_f64("covariance")?;
        }
        Ok(())
    }

    fn transform(&mut self) -> Read<StampedTransform> {
        let (stamp_ns, parent) = self.header()?;
        let child = frame_name(self.cursor.text("child_frame_id")?);
        let (translation, xyzw) = (self.cursor.f64s("translation")?, self.cursor.f64s("rotation")?);
        Ok(StampedTransform { stamp_ns, parent, child, parent_from_child: pose_of(translation, xyzw)? })
    }

    fn transforms(&mut self) -> Read<Vec<StampedTransform>> {
        // Stamp, two texts, seven numbers.
        let count = self.cursor.count(8 + 8 + 56, "transforms")?;
        (0..count).map(|_| self.transform()).collect()
    }

    fn joint_states(&mut self) -> Read<JointStates> {
        let (stamp_ns, _) = self.header()?;
        let count = self.cursor.count(4, "name")?;
        let names: Vec<String> =
            (0..count).map(|_| self.cursor.text("name").map(str::to_owned)).collect::<Read<_>>()?;
        let positions = self.numbers("position")?;
        for field in ["velocity", "effort"] {
            self.numbers(field)?;
        }
        let (expected, found) = (names.len(), positions.len());
        if expected != found && found != 0 {
            return Err(ContentError::Count { field: "position", expected, found });
        }
        Ok(JointStates { stamp_ns, names, positions })
    }

    fn numbers(&mut self, field: &'static str) -> Read<Vec<f64>> {
        let count = self.cursor.count(8, field)?;
        (0..count).map(|_| self.cursor.f64(field)).collect()
    }

    fn image(&mut self) -> Read<StampedPicture> {
        let (stamp_ns, _) = self.header()?;
        let (height, width) = (self.cursor.u32("height")?, self.cursor.u32("width")?);
        let encoding = self.cursor.text("encoding")?;
        let big_endian = self.cursor.u8("is_bigendian")? != 0;
        let step = self.cursor.u32("step")?;
        let bytes = self.cursor.bytes("data")?;
        let (picture, origin) = RawPicture { width, height, step, encoding, big_endian, bytes }.gray()?;
        Ok(StampedPicture { stamp_ns, picture, origin })
    }

    fn compressed_image(&mut self) -> Read<StampedPicture> {
        let (stamp_ns, _) = self.header()?;
        let format = self.cursor.text("format")?;
        let (picture, origin) = compressed(self.cursor.bytes("data")?, format)?;
        Ok(StampedPicture { stamp_ns, picture, origin })
    }
}

/// Seconds and a fraction as nanoseconds.
fn stamp_ns(s: i64, ns: u32) -> Read<i64> {
    // Seconds have 32 bits, so the product has 62.
    let whole = (ns < 1_000_000_000).then(|| s * 1_000_000_000 + i64::from(ns));
    whole.ok_or(ContentError::Stamp).and_then(stamp::in_range)
}
