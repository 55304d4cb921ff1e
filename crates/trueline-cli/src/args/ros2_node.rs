//! `trueline ros2-node`.

use crate::args::choice::one_of;
use crate::args::features::{JOINTS, JointChoice};
use crate::args::number;
use crate::args::protocol::frames;
use clap::Args;
use std::net::IpAddr;
use std::path::PathBuf;
use std::time::Duration;

#[derive(Args)]
#[command(after_help = "Examples:
  trueline ros2-node --calibration result.json --sensor sensor.toml --poses /tf --profiles /profiler/points --frames base_link:tool0
  trueline ros2-node --calibration result.json --sensor sensor.toml --poses /joint_states --urdf robot.urdf \\
      --profiles /profiler/points --frames base_link:tool0
  trueline ros2-node --calibration result.json --sensor sensor.toml --poses /tcp_pose --profiles /profiler/scan \\
      --profiles-type sensor_msgs/msg/LaserScan

Published: NAME/points (sensor_msgs/PointCloud2 in base with x, y, z, t and sigma, stamped with the true exposure), \
NAME/profile (the same profiles in the sensor's frame, stamped with the true exposure), NAME/seam (visualization_msgs/Marker: seam points with their ±, by the second), /tf_static (tool to sensor), /diagnostics (delays of both streams, and the verdict of `trueline watch` with --state). A profile waits for the pose of its exposure. One that cannot be placed is left out, and /diagnostics says why.

All stamps are those in the headers: the calibration must be of a bag of the same topics. A calibration file that changes is read again.

Needs no ROS on this PC. `ros2/` in the source has the ament package with a launch file.

Exit code: 0 ended by Ctrl-C or --for-s, 2 could not run.")]
pub(crate) struct Ros2NodeArgs {
    /// The calibration in use: the JSON of `trueline calibrate --json`
    #[arg(long)]
    pub(crate) calibration: PathBuf,
    /// The sensor.toml that it belongs to
    #[arg(long)]
    pub(crate) sensor: PathBuf,
    /// Topic of the robot: /tf, poses, or joint states with --urdf
    #[arg(long, value_name = "TOPIC")]
    pub(crate) poses: String,
    /// Type of its messages [default: tf2_msgs/msg/TFMessage of /tf, sensor_msgs/msg/JointState with --urdf, else
    /// geometry_msgs/msg/PoseStamped]
    #[arg(long, value_name = "TYPE")]
    pub(crate) poses_type: Option<String>,
    /// The robot's URDF, for joint states
    #[arg(long, value_name = "FILE")]
    pub(crate) urdf: Option<PathBuf>,
    /// Topic of the profiles
    #[arg(long, value_name = "TOPIC")]
    pub(crate) profiles: String,
    /// Type of its messages: sensor_msgs/msg/PointCloud2 or sensor_msgs/msg/LaserScan
    #[arg(long, value_name = "TYPE", default_value = "sensor_msgs/msg/PointCloud2")]
    pub(crate) profiles_type: String,
    /// Names of the frames of the robot's base and of the tool
    #[arg(long, value_name = "BASE:TOOL", value_parser = frames, default_value = "base_link:tool0")]
    pub(crate) frames: [String; 2],
    /// Name of the frame of the sensor
    #[arg(long, value_name = "NAME", default_value = "laser")]
    pub(crate) sensor_frame: String,
    /// Joint type of the seam in the profiles
    #[arg(long, value_parser = one_of(&JOINTS), default_value = "auto")]
    pub(crate) joint: JointChoice,
    /// State of `trueline watch`: its verdict goes to /diagnostics
    #[arg(long, value_name = "FILE")]
    pub(crate) state: Option<PathBuf>,
    /// Name of the node
    #[arg(long, value_name = "NAME", default_value = "trueline")]
    pub(crate) name: String,
    /// ROS_DOMAIN_ID
    #[arg(long, value_name = "ID", default_value_t = 0)]
    pub(crate) domain: u16,
    /// Address of this PC on the network of the other nodes
    #[arg(long, value_name = "IP", default_value = "127.0.0.1")]
    pub(crate) network: IpAddr,
    /// How long, s [default: until Ctrl-C]
    #[arg(long, value_parser = number::duration)]
    pub(crate) for_s: Option<Duration>,
    /// Print nothing but errors
    #[arg(long)]
    pub(crate) quiet: bool,
}
