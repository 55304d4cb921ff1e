//! Records a robot cell and estimates while it records.
//!
//! ```text
//! robot ──▶ RobotLink ─▶ CellRecording ─┬─▶ entries ─▶ Recorder ─▶ recording.mcap
//!                                       └─▶ LiveEstimate ◀─┐
//! camera ─▶ FrameSource ─▶ FrameStamper ─▶ CameraRecorder ─┴─▶ entries ─▶ Recorder
//! ```
//!
//! | step | type in → out | where |
//! |---|---|---|
//! | map | datagram, answer, frame, clock reading → [`Entry`](trueline_mcap::Entry) | [`entries`] |
//! | stamp | a picture's stamps → the one that calibration uses | [`FrameStamper`] |
//! | record the robot | datagrams and answers → recording | [`CellRecording`] |
//! | record the camera | pictures → recording, seam points → estimate | [`CameraRecorder`] |
//! | estimate | all so far → [`Progress`] | [`LiveEstimate`] |
//! | place | profiles, seam points and poses → points in base | [`LivePlacer`] |
//! | run | camera, estimate and robot, a thread each | [`Cell`] |
//! | record | a robot that its own program drives → recording | [`record_robot`] |
//! | guide | a robot that follows a path → recording | [`guide_scan`] |
//!
//! ```
//! use std::sync::atomic::AtomicBool;
//! use trueline_cell::{LiveEstimate, Progress};
//! use trueline_sim::{Preset, simulate};
//!
//! let scan = simulate(&Preset::Quick.scenario(), 1).ok_or("no seam in view")?;
//! let estimate = LiveEstimate::new(scan.sensor, None);
//! estimate.offer_poses(&mut scan.robot.clone()); // from the thread that receives them
//! scan.features.into_iter().for_each(|feature| estimate.add_feature(feature)); // from the camera's
//! let over = AtomicBool::new(true); // runs in a thread of its own until this is set, and once more then
//! estimate.run(&over);
//! let Progress::Estimated(estimated) = estimate.progress() else { return Err("no estimate".into()) };
//! let [offset_s, sigma_s] = estimated.time_offset_s.ok_or("not observable")?;
//! let truth_s = scan.truth.ok_or("not simulated")?.parameters.time_offset_s;
//! assert!((offset_s - truth_s).abs() < 5.0 * sigma_s);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Nothing here prints or depends on a terminal: [`Cell::run`] calls back with [`CellState`], plain values.

mod camera_clock;
mod camera_counts;
mod camera_recorder;
mod camera_source;
mod cell;
mod cell_listener;
mod cell_recording;
#[cfg(feature = "gige")]
mod drawing_time;
pub mod entries;
mod error;
mod frame_stamper;
pub mod frame_tree;
mod guided_scan;
mod input_watch;
mod live_estimate;
mod live_picture;
mod live_placer;
#[cfg(feature = "live-view")]
mod live_scene;
mod live_welds;
mod progress_text;
mod robot_brief;
mod robot_recorder;
#[cfg(feature = "ros2")]
mod ros2_dds;
#[cfg(feature = "ros2")]
mod ros2_marker;
#[cfg(feature = "ros2")]
mod ros2_messages;
#[cfg(feature = "ros2")]
mod ros2_node;
#[cfg(feature = "ros2")]
mod ros2_publishers;
#[cfg(feature = "ros2")]
mod ros2_source;
mod seam_finder;
#[cfg(feature = "gige")]
mod simulated_camera;
#[cfg(feature = "gige")]
mod simulated_encoder;
#[cfg(feature = "ros2")]
mod stream_lag;

pub use camera_clock::{CameraClock, Exchange};
pub use camera_counts::CameraCounts;
pub use camera_recorder::CameraRecorder;
pub use camera_source::{CameraChoice, CameraSettings};
pub use cell::{Cell, CellOutcome, CellState};
pub use cell_listener::CellListener;
pub use cell_recording::{ARRIVAL, CellRecording, FinishedRecording, READING, RECORDING, RecordingSettings};
pub use error::CellError;
pub use frame_stamper::{FrameStamper, StampChoice};
pub use guided_scan::{EndedScan, ScanState, guide_scan};
pub use live_estimate::{Estimated, LiveEstimate, Progress};
pub use live_picture::{LivePicture, SmallPicture};
pub use live_placer::{LivePlacer, PlacedKind, PlacedPoints};
#[cfg(feature = "live-view")]
pub use live_scene::LiveScene;
pub use live_welds::LiveWelds;
pub use robot_brief::RobotBrief;
pub use robot_recorder::{Until, record_robot};
#[cfg(feature = "ros2")]
pub use ros2_node::{Placing, Ros2Node, Ros2NodeCounts, Ros2NodeSettings, WatchVerdict};
#[cfg(feature = "ros2")]
pub use ros2_source::{Ros2Source, Ros2Topic, TRANSFORMS};
pub use seam_finder::SeamFinder;
#[cfg(feature = "gige")]
pub use simulated_camera::{CameraLook, CameraWiring, SceneError, SimulatedScene, WiredInput};
#[cfg(all(feature = "v4l2", target_os = "linux"))]
pub use trueline_camera::v4l2::V4l2Settings;
pub use trueline_camera::{CameraSetup, PixelFormat, Trigger};
