//! Content of messages: one vocabulary ([`Content`]) for the schemas of trueline, ROS and Foxglove.

pub(crate) mod content;
pub(crate) mod content_error;
pub(crate) mod decode;
pub(crate) mod external;
mod foxglove;
mod gray_picture;
mod ros;
pub mod ros_cursor;
mod ros_profile;
pub(crate) mod spatial;
pub(crate) mod stamp;

pub use content::{
    Content, FrameStamps, JointStates, Kind, Picture, PictureOrigin, StampedPicture, StampedPose,
    StampedProfile, StampedTransform,
};
pub use decode::{decode, kind};
