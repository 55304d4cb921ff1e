//! Records events while they happen: a source never waits, and a killed program loses a moment.

use crate::wire::about::About;
use crate::write::entry::Entry;
use crate::write::entry_queue::{EntryQueue, Next};
use crate::write::listener::{Heard, Listener};
use crate::write::log_writer::{LogWriter, words};
use crate::write::record_error::RecordError;
use crate::write::sink::Sink;
use mcap::McapError;
use std::fs::{self, File, OpenOptions};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::thread::{Builder, JoinHandle};
use std::time::{Duration, Instant};

pub use crate::write::entry_queue::RecorderState;

/// Largest loss by a kill: entries are handed to the operating system this often.
const FLUSH_EVERY: Duration = Duration::from_millis(250);
/// Largest loss by a power failure.
const SYNC_EVERY: Duration = Duration::from_secs(1);

/// A recording in progress. Without [`Recorder::finish`] it is ended as well, but without a result.
pub struct Recorder {
    file: PathBuf,
    queue: Arc<EntryQueue>,
    thread: Option<JoinHandle<()>>,
}

/// Input of entries; there may be many.
#[derive(Clone)]
pub struct RecorderHandle {
    queue: Arc<EntryQueue>,
}

/// A recording that was ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Recorded {
    /// The file.
    pub file: PathBuf,
    /// Entries in it.
    pub written: u64,
    /// The number of these, or of unwritable ones, with data of the cell: all except clocks and notes.
    pub of_cell: u64,
    /// Its bytes.
    pub bytes: u64,
    /// Entries for which there was no room.
    pub refused: u64,
}

impl RecorderHandle {
    /// Gives in an entry. Never waits for the disk: `false`, and counted, if there is no room or writing has failed.
    #[must_use]
    pub fn offer(&self, entry: Entry) -> bool {
        self.queue.offer(entry)
    }

    /// How the recording is doing.
    #[must_use]
    pub fn state(&self) -> RecorderState {
        self.queue.state()
    }
}

impl Recorder {
    /// Begins a recording in a new file.
    ///
    /// # Errors
    /// A file that is there already, or that cannot be written.
    pub fn create(path: &Path, about: &About) -> Result<Self, RecordError> {
        Self::create_heard(path, about, None)
    }

    /// Begins a recording in a new file; a listener hears of every entry in the thread that writes.
    ///
    /// # Errors
    /// A file that is there already, or that cannot be written.
    pub fn create_heard(
        path: &Path,
        about: &About,
        listener: Option<Arc<dyn Listener>>,
    ) -> Result<Self, RecordError> {
        let file = OpenOptions::new().write(true).create_new(true).open(path).map_err(|error| {
            let file = path.to_owned();
            match error.kind() {
                io::ErrorKind::AlreadyExists => RecordError::AlreadyExists { file },
                _ => RecordError::Create { file, why: error.to_string() },
            }
        })?;
        let recorder = Self::begin(file, path, about, Heard::by(listener));
        match &recorder {
            Ok(_) => keep_name(path),
            // It holds nothing. If it cannot be removed, the first error is still the reported one.
            Err(_) => drop(fs::remove_file(path)),
        }
        recorder
    }

    /// Begins a recording onto another sink; errors name it `name`.
    ///
    /// # Errors
    /// A sink that cannot be written, or no thread to be had.
    pub fn onto<S: Sink + 'static>(sink: S, name: &Path, about: &About) -> Result<Self, RecordError> {
        Self::begin(sink, name, about, Heard::default())
    }

    fn begin<S: Sink + 'static>(
        sink: S,
        name: &Path,
        about: &About,
        heard: Heard,
    ) -> Result<Self, RecordError> {
        let refused = |why: String| RecordError::Create { file: name.to_owned(), why };
        let log = LogWriter::new(sink, about).map_err(|error| refused(words(&error)))?.heard(heard);
        let queue = Arc::new(EntryQueue::new());
        queue.flushed(log.bytes());
        let of_thread = Arc::clone(&queue);
        let thread = Builder::new()
            .name("recorder".to_owned())
            .spawn(move || write(log, &of_thread))
            .map_err(|error| refused(error.to_string()))?;
        Ok(Self { file: name.to_owned(), queue, thread: Some(thread) })
    }

    /// Input of entries.
    #[must_use]
    pub fn handle(&self) -> RecorderHandle {
        RecorderHandle { queue: Arc::clone(&self.queue) }
    }

    /// Ends the recording: writes the waiting entries, then the index. Entries offered from now on are refused.
    ///
    /// # Errors
    /// Writing that failed, now or before.
    pub fn finish(mut self) -> Result<Recorded, RecordError> {
        self.close();
        let RecorderState { written, of_cell, bytes, refused, failure, .. } = self.queue.state();
        let file = std::mem::take(&mut self.file);
        match failure {
            Some(why) => Err(RecordError::Stopped { file, written, refused, why }),
            None => Ok(Recorded { file, written, of_cell, bytes, refused }),
        }
    }

    fn close(&mut self) {
        self.queue.close();
        if let Some(thread) = self.thread.take()
            && thread.join().is_err()
        {
            self.queue.fail("the writing thread broke down".to_owned());
        }
    }
}

impl Drop for Recorder {
    fn drop(&mut self) {
        self.close();
    }
}

/// A file that is synced can still lose its name with the power. If folders cannot be synced there is nothing to do.
fn keep_name(path: &Path) {
    let parent = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    if let Ok(folder) = File::open(parent) {
        drop(folder.sync_all());
    }
}

fn write<S: Sink>(mut log: LogWriter<S>, queue: &EntryQueue) {
    let ended = match write_until_closed(&mut log, queue) {
        Ok(()) => log.finish(),
        Err(error) => {
            log.abandon();
            Err(error)
        }
    };
    match ended {
        Ok(bytes) => queue.flushed(bytes),
        Err(error) => queue.fail(words(&error)),
    }
}

fn write_until_closed<S: Sink>(log: &mut LogWriter<S>, queue: &EntryQueue) -> Result<(), McapError> {
    let start = Instant::now();
    let (mut flushed, mut synced) = (start, start);
    let (mut is_new, mut is_unsynced) = (false, false);
    loop {
        let deadline = match (is_new, is_unsynced) {
            (true, _) => flushed + FLUSH_EVERY,
            (false, true) => synced + SYNC_EVERY,
            (false, false) => Instant::now() + SYNC_EVERY,
        };
        match queue.next(deadline) {
            Next::Entry(entry) => {
                log.write(*entry)?;
                is_new = true;
            }
            Next::Idle => {}
            Next::Closed => return Ok(()),
        }
        let now = Instant::now();
        if is_new && now >= flushed + FLUSH_EVERY {
            log.flush()?;
            queue.flushed(log.bytes());
            (is_new, is_unsynced, flushed) = (false, true, now);
        }
        if is_unsynced && now >= synced + SYNC_EVERY {
            log.sync()?;
            (is_unsynced, synced) = (false, now);
        }
    }
}
