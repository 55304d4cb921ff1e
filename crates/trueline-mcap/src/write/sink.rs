//! Destination of a recording.

use std::fs::File;
use std::io::{self, BufWriter, Seek, SeekFrom, Write};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// A sink for appended bytes, with a command to keep them through a power failure.
pub trait Sink: Write + Send {
    /// Returns when everything written is safe.
    ///
    /// # Errors
    /// Error of the operating system.
    fn sync(&mut self) -> io::Result<()>;
}

impl Sink for File {
    fn sync(&mut self) -> io::Result<()> {
        self.sync_data()
    }
}

/// A sink with two owners: the MCAP writer takes one and hides it, but it must be synced.
pub(crate) struct SharedSink<S: Sink> {
    inner: Arc<Mutex<Counted<S>>>,
}

struct Counted<S: Sink> {
    out: BufWriter<S>,
    bytes: u64,
}

impl<S: Sink> SharedSink<S> {
    pub(crate) fn new(sink: S) -> Self {
        Self { inner: Arc::new(Mutex::new(Counted { out: BufWriter::new(sink), bytes: 0 })) }
    }

    pub(crate) fn other_owner(&self) -> Self {
        Self { inner: Arc::clone(&self.inner) }
    }

    /// Bytes written so far.
    pub(crate) fn bytes(&self) -> u64 {
        self.lock().bytes
    }

    pub(crate) fn sync(&self) -> io::Result<()> {
        let mut inner = self.lock();
        inner.out.flush()?;
        inner.out.get_mut().sync()
    }

    fn lock(&self) -> MutexGuard<'_, Counted<S>> {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl<S: Sink> Write for SharedSink<S> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let mut inner = self.lock();
        let written = inner.out.write(bytes)?;
        inner.bytes += written as u64;
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.lock().out.flush()
    }
}

/// Reports its position only: written data are never changed.
impl<S: Sink> Seek for SharedSink<S> {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        match to {
            SeekFrom::Current(0) => Ok(self.bytes()),
            _ => Err(io::Error::from(io::ErrorKind::Unsupported)),
        }
    }
}
