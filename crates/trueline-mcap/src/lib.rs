//! Recordings in MCAP: written so that nothing is lost, read whoever wrote them.
//!
//! | arrow | type in → out | where |
//! |---|---|---|
//! | record | [`Entry`] → file, while it happens | [`Recorder`], [`log_writer`] |
//! | read | file, cut off or damaged → items and [`Damage`] | [`LogReader`] |
//! | open | .mcap, rosbag2 folder, .db3, .db3.zstd → messages | [`Bag`] |
//! | understand | schema and bytes → [`Content`] | [`message`] |
//! | unpack | recording and [`Choice`] → dataset folder | [`unpack()`] |
//!
//! A recording that was cut off is normal: a program can be killed and a disk can be full. What was written before stays
//! readable, and what is missing is told ([`Damage`]). Nothing that a checksum does not vouch for is taken as read.

pub mod about;
pub mod bag;
mod bag_files;
pub mod choice;
mod chosen;
pub mod chunk;
mod collect;
mod common_clock;
pub mod content_error;
pub mod damage;
mod dataset_folder;
pub mod entry;
mod entry_messages;
pub mod error;
pub mod foxglove_messages;
mod frame_files;
pub mod import_error;
mod in_order;
pub mod log_reader;
pub mod log_writer;
pub mod message;
mod own_messages;
mod pictures;
pub mod recorder;
pub mod ros_cursor;
pub mod ros_messages;
mod schemas;
mod sink;
mod spatial;
#[cfg(feature = "rosbag2")]
mod sqlite_bag;
mod summary;
pub mod survey;
mod topics;
mod transform_chain;
pub mod trueline_messages;
pub mod unpack;
mod waiting;

pub use about::About;
pub use bag::{Bag, BagItem, BagMessage, DamagedFile};
pub use choice::{Choice, StampClock};
pub use content_error::ContentError;
pub use damage::Damage;
pub use entry::{
    AnswerEntry, ClockEntry, Entry, FeaturesEntry, FrameEntry, NoteEntry, NoteLevel, PacketEntry,
    RejectedEntry, RobotEntry,
};
pub use error::RecordError;
pub use import_error::ImportError;
pub use log_reader::{Item, LogReader};
pub use message::{Content, Kind};
pub use recorder::{Recorded, Recorder, RecorderHandle, RecorderState};
pub use sink::Sink;
pub use survey::{LinkSurvey, Survey, TopicSurvey, survey};
pub use unpack::{Unpacked, unpack};
