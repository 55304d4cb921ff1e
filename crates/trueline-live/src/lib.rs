//! The robot live: ABB EGM on the wire, a gate before every command, and a simulated controller.
//!
//! By default the PC only listens ([`endpoint`]). What it receives is checked ([`frame_filter`]), stamped by the kernel
//! ([`stamped_socket`]) and handed to a recorder. Motion passes [`motion::Gate`]. [`controller`] is the other side: a
//! robot controller that runs in virtual time for tests and in real time for other people's programs.

pub mod controller;
pub mod egm;
pub mod endpoint;
pub mod fanuc;
pub mod frame_filter;
pub mod guide;
pub mod host_clock;
pub mod kuka;
pub mod link_watch;
pub mod motion;
pub mod pose_feed;
pub mod rapid;
pub mod reply_times;
pub mod robot_frame;
pub mod robot_source;
pub mod stamped_socket;
pub mod udp_source;
pub mod ur;
mod wait;
pub mod zyx_angles;

pub use endpoint::{Endpoint, Newest, Received};
pub use frame_filter::{FrameFilter, Rejection, SequenceStatus};
pub use guide::Guide;
pub use host_clock::HostClock;
pub use link_watch::LinkWatch;
pub use reply_times::ReplyTimes;
pub use robot_frame::RobotFrame;
