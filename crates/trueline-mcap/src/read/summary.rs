//! The summary at the end of a finished file: the topics again, should their first mention be damaged.

use crate::read::chunk::RECORD_LIMIT;
use mcap::Summary;
use mcap::sans_io::{SummaryReadEvent, SummaryReader, SummaryReaderOptions};
use std::io::{Read, Seek};

/// The summary, if there is one that can be read.
pub fn read_summary<R: Read + Seek>(source: &mut R, length: u64) -> Option<Summary> {
    let options =
        SummaryReaderOptions::default().with_file_size(length).with_record_length_limit(RECORD_LIMIT);
    let mut reader = SummaryReader::new_with_options(options);
    while let Some(event) = reader.next_event() {
        match event.ok()? {
            SummaryReadEvent::SeekRequest(to) => {
                let at = source.seek(to).ok()?;
                reader.notify_seeked(at);
            }
            SummaryReadEvent::ReadRequest(wanted) if wanted > RECORD_LIMIT => return None,
            SummaryReadEvent::ReadRequest(wanted) => {
                let got = source.read(reader.insert(wanted)).ok()?;
                reader.notify_read(got);
            }
        }
    }
    reader.finish()
}
