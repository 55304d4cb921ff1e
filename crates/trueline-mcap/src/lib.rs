//! Recordings in MCAP: written so that nothing is lost, read from any program.
//!
//! | folder | type in → out | names |
//! |---|---|---|
//! | `write` | [`Entry`] → file, while it happens; a [`Listener`] hears of it | [`Recorder`], [`log_writer`] |
//! | `live` | the same messages → viewers, by the Foxglove WebSocket (feature `live-view`) | `live::LiveView` |
//! | `wire` | [`Entry`] ↔ the messages of trueline's own topics | [`About`] |
//! | `read` | .mcap, rosbag2 folder, .db3, .db3.zstd, cut off or damaged → messages and [`Damage`] | [`Bag`], [`LogReader`], [`survey()`] |
//! | [`message`] | schema and bytes → [`Content`] | [`message::decode`] |
//! | `import` | recording and [`Choice`] → [`Imported`]: a `Recording` and its pictures | [`import()`], [`DatasetFolder`] |
//!
//! A recording that was cut off is normal: a program can be killed and a disk can be full. Data written before an error
//! stay readable, and missing data are reported ([`Damage`]). Data without a valid checksum are never trusted.
//!
//! ```
//! use trueline_mcap::{About, Entry, Recorder, survey};
//! # use trueline_mcap::{NoteEntry, NoteLevel};
//!
//! let folder = tempfile::tempdir()?;
//! let file = folder.path().join("recording.mcap");
//! let recorder = Recorder::create(&file, &About { tool: "weld_tcp".to_owned(), ..About::default() })?;
//! let note = NoteEntry { steady_ns: 1, level: NoteLevel::Info, text: "begins".to_owned() };
//! assert!(recorder.handle().offer(Entry::Note(note)), "never waits for the disk");
//! recorder.finish()?;
//! let found = survey(&file)?;
//! assert!(found.is_own && found.damages.is_empty());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod import;
mod import_error;
#[cfg(feature = "live-view")]
pub mod live;
pub mod message;
mod read;
mod wire;
mod write;

pub use import::choice::{Choice, StampClock};
pub use import::dataset_folder::DatasetFolder;
pub use import::recorded_pictures::RecordedPictures;
pub use import::recorded_profiles::RecordedProfiles;
pub use import::to_recording::{Imported, import, import_without_profiles};
pub use import_error::ImportError;
pub use message::content_error::ContentError;
pub use message::{Content, Kind};
pub use read::bag::Bag;
pub use read::bag_item::{BagItem, BagMessage};
pub use read::chunk;
pub use read::damage::{Damage, DamagedFile};
pub use read::log_reader::{Item, LogReader};
pub use read::place::{Place, RecordPlace};
pub use read::survey::{LinkSurvey, Survey, TopicSurvey, survey};
pub use wire::about::About;
pub use write::cloud::{CLOUD_TOPIC, CloudFile};
pub use write::entry::{
    AnswerEntry, COMPLETE, ClockEntry, Entry, FeaturesEntry, FrameEntry, InputsEntry, NoteEntry, NoteLevel,
    ProfileEntry, RejectedEntry, RobotEntry,
};
pub use write::listener::Listener;
pub use write::log_writer;
pub use write::record_error::RecordError;
pub use write::recorder::{Recorded, Recorder, RecorderHandle, RecorderState};
pub use write::seam_points::{ImagePoints, SEAM_TOPIC, seam_points};
pub use write::sink::Sink;
