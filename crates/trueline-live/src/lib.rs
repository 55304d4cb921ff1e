//! The robot live: robots' streams, a gate before every command, and simulated controllers.
//!
//! By default the PC only listens. For every robot, poses come from a [`RobotSource`]: ABB's EGM ([`Endpoint`]), Universal
//! Robots' RTDE ([`ur`]), FANUC's HSPO and Stream Motion ([`fanuc`]), KUKA's RSI ([`kuka`]). Messages are checked
//! ([`frame_filter`]), stamped by the kernel ([`stamped_socket`]) and handed to a recorder. Motion is EGM's alone, and
//! passes [`motion::Gate`]. [`controller`] is the other side of EGM: a robot controller that runs in virtual time for tests
//! and in real time for other people's programs.
//!
//! ```
//! use trueline_live::controller::{Controller, ControllerSettings, Task};
//! use trueline_live::{FrameFilter, SequenceStatus};
//! use trueline_geometry::Pose;
//!
//! // A simulated controller tells where it is; what it sends is judged as if it had come over the network.
//! let mut robot = Controller::new(ControllerSettings::new(Task::Guidance { start: Pose::identity() }));
//! let mut filter = FrameFilter::new(None);
//! let from = "192.168.125.1:6511".parse()?;
//! let datagram = robot.run_cycle().ok_or("a controller speaks first")?;
//! let (frame, status) = filter.judge(&datagram, from, 0)?;
//! assert_eq!(status, SequenceStatus::First);
//! assert!(frame.base_from_tool.translation.vector.norm() < 1e-3);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod controller;
pub mod egm;
pub mod endpoint;
pub mod fanuc;
pub mod frame_filter;
pub mod guide;
pub mod host_clock;
pub mod kuka;
mod link_report;
pub mod link_watch;
pub mod motion;
pub mod pose_feed;
pub mod priority;
pub mod protocol;
mod reply_times;
mod robot_answer;
pub mod robot_frame;
pub mod robot_link;
pub mod robot_source;
mod source_report;
pub mod source_watch;
pub mod stamped_socket;
pub mod stream_counts;
pub mod stream_sim;
pub mod udp_sim;
pub mod udp_source;
pub mod ur;
mod wait;
mod zyx_angles;

pub use endpoint::{Endpoint, Newest, Received};
pub use frame_filter::{FrameFilter, Rejection, SequenceStatus};
pub use guide::Guide;
pub use host_clock::HostClock;
pub use link_watch::LinkWatch;
pub use protocol::{LinkAddress, LinkError, LinkOptions, Protocol};
pub use reply_times::ReplyTimes;
pub use robot_answer::RobotAnswer;
pub use robot_frame::RobotFrame;
pub use robot_link::{RobotLink, StreamBrief, StreamReport, StreamWatch};
pub use robot_source::{RobotPacket, RobotPose, RobotSource};
pub use source_watch::SourceWatch;
