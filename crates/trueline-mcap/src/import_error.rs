//! Why a recording cannot be made into a dataset.

use crate::message::content_error::ContentError;
use std::path::{Path, PathBuf};
use trueline_geometry::arm::urdf::UrdfError;

/// Obstacles: a file, a message, or a choice that is the user's.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ImportError {
    /// The operating system refused.
    #[error("{}: cannot be read or written: {why}", file.display())]
    Io {
        /// The file.
        file: PathBuf,
        /// Its statement.
        why: String,
    },
    /// Neither MCAP nor SQLite nor a folder with such files.
    #[error("{}: is not a readable recording", file.display())]
    NotARecording {
        /// The file or folder.
        file: PathBuf,
    },
    /// A bag of ROS 1.
    #[error("{}: is a bag of ROS 1", file.display())]
    RosBag1 {
        /// The file.
        file: PathBuf,
    },
    /// A file that this build cannot read.
    #[error("{}: is a rosbag2 data base, and this program was built without them", file.display())]
    WithoutRosbag2 {
        /// The file.
        file: PathBuf,
    },
    /// A compressed recording that this build cannot read.
    #[error("{}: is compressed by {by}, and this program was built without that", file.display())]
    WithoutCompression {
        /// The file.
        file: PathBuf,
        /// Kind of the compression.
        by: String,
    },
    /// A data base that is not of rosbag2.
    #[error("{}: is not a database of rosbag2: {why}", file.display())]
    Database {
        /// The file.
        file: PathBuf,
        /// Error of SQLite.
        why: String,
    },
    /// A message that is needed and cannot be used.
    #[error("{topic}, message {number} at {}: {problem}", seconds(*log_time))]
    Message {
        /// Its topic.
        topic: String,
        /// Which of the topic it is, from 1.
        number: u64,
        /// When it was recorded, ns.
        log_time: u64,
        /// The fault.
        problem: ContentError,
    },
    /// A topic that is not there, or is of another kind.
    #[error("no topic `{topic}` with {wanted}; there are: {}", list(candidates))]
    NoTopic {
        /// The requested topic.
        topic: String,
        /// The content it should have.
        wanted: &'static str,
        /// Topics that would do.
        candidates: Vec<String>,
    },
    /// No source of the robot's poses.
    #[error("the recording has no robot poses; its topics are: {}", list(topics))]
    NoRobot {
        /// All topics with their types.
        topics: Vec<String>,
    },
    /// The robot is there in angles of its joints only.
    #[error("the robot is recorded in joint angles only (`{topic}`), and those need the robot's kinematics")]
    OnlyJointAngles {
        /// The topic.
        topic: String,
    },
    /// A URDF is given without anything to explain.
    #[error("the URDF cannot be used: the recording has no joint angles")]
    NoJointAngles,
    /// A URDF that cannot be used.
    #[error("the URDF cannot be used: {why}")]
    Urdf {
        /// The fault.
        why: String,
    },
    /// A URDF with more than one tool.
    #[error("the URDF has several frames that nothing is mounted on: {}", list(ends))]
    ToolNeeded {
        /// Those frames.
        ends: Vec<String>,
    },
    /// Joint angles of a part of an arm.
    #[error("`{topic}`: a message has some joints of the arm, but not `{joint}`")]
    JointMissing {
        /// The topic.
        topic: String,
        /// The joint.
        joint: String,
    },
    /// A joint of an axis that is nowhere.
    #[error("no message has the joint `{joint}` of an axis; there are: {}", list(seen))]
    NoAxis {
        /// The joint.
        joint: String,
        /// All joints that are there.
        seen: Vec<String>,
    },
    /// An axis with its joint in another unit.
    #[error("axis `{name}`: joint `{joint}` is in {} or {}", units[0].trim_start_matches('_'), units[1].trim_start_matches('_'))]
    AxisUnit {
        /// Its name.
        name: String,
        /// Its joint.
        joint: String,
        /// Units that joints of this recording have.
        units: [&'static str; 2],
    },
    /// An axis that contradicts itself.
    #[error("{0}")]
    Axis(String),
    /// More than one topic could be meant.
    #[error("several topics have {wanted}: {}", list(candidates))]
    SeveralTopics {
        /// Their content.
        wanted: &'static str,
        /// The topics.
        candidates: Vec<String>,
    },
    /// Transforms with several possible poses of the robot.
    #[error("which transform is the robot's pose? the recording has: {}", list(links))]
    FramesNeeded {
        /// The transforms, as parent → child.
        links: Vec<String>,
        /// The one frame without a parent, and the one at the end of the one chain that moves, if there is but one of each.
        proposal: Option<[String; 2]>,
    },
    /// A frame that is not there.
    #[error("no frame `{frame}`; there are: {}", list(known))]
    UnknownFrame {
        /// The requested frame.
        frame: String,
        /// All frames.
        known: Vec<String>,
    },
    /// Poses in another frame than requested.
    #[error("the poses of `{topic}` are in frame `{found}`, not in `{wanted}`")]
    OtherBase {
        /// The topic.
        topic: String,
        /// The frame of the poses.
        found: String,
        /// The requested frame.
        wanted: String,
    },
    /// Frames without a connection.
    #[error("no transforms lead from `{base}` to `{tool}`")]
    NoChain {
        /// The outer frame.
        base: String,
        /// The inner frame.
        tool: String,
    },
    /// A frame that hangs on two others.
    #[error("frame `{child}` has more than one parent: {}", list(parents))]
    SeveralParents {
        /// The frame.
        child: String,
        /// Its parents.
        parents: Vec<String>,
    },
    /// A static transform that changes.
    #[error("the static transform {link} was published with different values")]
    StaticChanged {
        /// The transform, as parent → child.
        link: String,
    },
    /// Transforms that are not published repeatedly.
    #[error("nothing moves between `{base}` and `{tool}`: the transforms are static")]
    NothingMoves {
        /// The outer frame.
        base: String,
        /// The inner frame.
        tool: String,
    },
    /// Transforms without a common time.
    #[error("the transforms from `{base}` to `{tool}` are never known at the same time")]
    NeverTogether {
        /// The outer frame.
        base: String,
        /// The inner frame.
        tool: String,
    },
    /// Messages without stamps.
    #[error("the messages of `{topic}` all have the stamp 0: their sender did not stamp them")]
    NotStamped {
        /// The topic.
        topic: String,
    },
    /// Something has no IEEE 1588 time.
    #[error("{count} {what} have no IEEE 1588 time")]
    NoPtp {
        /// How many.
        count: usize,
        /// The kind of data.
        what: &'static str,
    },
    /// Two clocks that follow different masters.
    #[error(
        "the camera's clock and the controller's are {apart_s:.1} s apart: they do not follow the same master"
    )]
    ClocksApart {
        /// How far, s.
        apart_s: f64,
    },
    /// No description of the sensor.
    #[error("the recording does not describe the sensor")]
    NoSensor,
    /// Seam points of another sensor.
    #[error("the recorded seam points do not fit a sensor of kind `{sensor}`")]
    OtherSensor {
        /// The kind of the sensor.
        sensor: &'static str,
    },
    /// Profiles with codes among their numbers.
    #[error("{topic}: {problem}")]
    Profiles {
        /// Their topic.
        topic: String,
        /// The fault.
        problem: trueline_dataset::Problem,
    },
    /// The dataset cannot be written, or the sensor cannot be read.
    #[error(transparent)]
    Dataset(#[from] trueline_dataset::Error),
}

impl ImportError {
    pub(crate) fn io(file: &Path, error: &std::io::Error) -> Self {
        Self::Io { file: file.to_owned(), why: error.to_string() }
    }

    /// Remedy for the user.
    #[must_use]
    pub fn hint(&self) -> String {
        let text = match self {
            Self::Io { .. } => "check the path and its permissions",
            Self::NotARecording { .. } => {
                "readable: an .mcap file, a folder of rosbag2, a .db3 or .db3.zstd file"
            }
            Self::RosBag1 { .. } => "`mcap convert in.bag out.mcap` makes it an MCAP file",
            Self::WithoutRosbag2 { .. } | Self::WithoutCompression { .. } => self.hint_of_builds(),
            Self::Database { .. } => "a .db3 file of rosbag2 has the tables `topics` and `messages`",
            Self::Message { problem, .. } => return problem.hint(),
            Self::NoTopic { .. } | Self::SeveralTopics { .. } => {
                "name one of them with --pose-topic or --image-topic"
            }
            Self::NoRobot { .. } => "record the pose of the tool as well: tf, or a PoseStamped",
            Self::OnlyJointAngles { .. } => {
                "give the robot's URDF: --urdf robot.urdf --tool FRAME; or record the pose of the tool as well"
            }
            Self::NoJointAngles => "leave --urdf out: poses and transforms need none",
            Self::Urdf { .. } => "xacro is expanded first: xacro robot.xacro > robot.urdf",
            Self::ToolNeeded { .. } => "name the right one with --tool",
            Self::JointMissing { .. } => "all joints between --base and --tool must come in one message",
            Self::NoAxis { .. } | Self::AxisUnit { .. } | Self::Axis(_) => return self.hint_of_axes(),
            Self::FramesNeeded { proposal: Some([base, tool]), .. } => {
                return format!(
                    "perhaps --base {base} --tool {tool}? the tool is the frame of the robot's reported \
                    poses"
                );
            }
            Self::FramesNeeded { .. }
            | Self::UnknownFrame { .. }
            | Self::NoChain { .. }
            | Self::NothingMoves { .. } => {
                "name the frames with --base and --tool; the tool is the frame of the robot's reported \
                poses"
            }
            Self::OtherBase { .. } => "leave --base out, or choose another topic",
            Self::SeveralParents { .. } => "were two recordings joined? split the recording",
            Self::StaticChanged { .. } => "split the recording where it changes",
            Self::NeverTogether { .. } => "do their stamps come from different clocks?",
            Self::NotStamped { .. } => {
                "the recording times vary too much to replace them: let the driver stamp its messages"
            }
            Self::NoPtp { .. } => {
                "controllers send it from RobotWare 7.16 on, if synchronised; cameras have to follow PTP: leave --stamps ptp out"
            }
            Self::ClocksApart { .. } => {
                "37 s is the difference of TAI and UTC: one of the two is not synchronised, or counts otherwise"
            }
            Self::NoSensor => {
                "`trueline import mcap|rosbag2 SRC --sensor sensor.toml --out DIR`; or lay sensor.toml into the bag's folder"
            }
            Self::OtherSensor { .. } => "give the sensor that was recorded with --sensor sensor.toml",
            Self::Profiles { .. } => {
                "let the driver write NaN for no return, as in PointCloud2; or state the code for no \
                return: `trueline import mcap|rosbag2 SRC --no-return-mm 0 --out DIR`"
            }
            Self::Dataset(error) => return error.hint(),
        };
        text.to_owned()
    }

    fn hint_of_builds(&self) -> &'static str {
        match self {
            Self::WithoutCompression { .. } => {
                "build with the feature `compression` (`full` has it), or `mcap decompress` it"
            }
            _ => "build with the feature `rosbag2` (`full` has it), or `ros2 bag convert` it to MCAP",
        }
    }

    fn hint_of_axes(&self) -> String {
        match self {
            Self::AxisUnit { name, joint, units: [turn, shift] } => {
                format!("does it turn or shift? --axis {name}{turn}={joint}, or --axis {name}{shift}={joint}")
            }
            Self::NoAxis { .. } => {
                "name one of them: --axis NAME_deg=JOINT. KUKA's RSI sends E1 to E6 with DEF_EIPos in its SEND section; ABB's EGM calls \
                 them eax_a to eax_f"
                    .to_owned()
            }
            _ => "correct --axis".to_owned(),
        }
    }
}

fn seconds(log_time: u64) -> String {
    format!("{}.{:09} s", log_time / 1_000_000_000, log_time % 1_000_000_000)
}

impl From<UrdfError> for ImportError {
    fn from(error: UrdfError) -> Self {
        match error {
            UrdfError::SeveralEnds { ends } => Self::ToolNeeded { ends },
            UrdfError::UnknownFrame { frame, known } => Self::UnknownFrame { frame, known },
            UrdfError::Unusable { why } => Self::Urdf { why },
        }
    }
}

fn list(names: &[String]) -> String {
    if names.is_empty() { "none".to_owned() } else { names.join(", ") }
}
