//! Small files that would fill the memory: it is bounded by the size of the file, and by that of one chunk.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

#[path = "it/common/mod.rs"]
mod common;

use common::{entries, recorded};
use mcap::records::MessageHeader;
use mcap::{Compression, WriteOptions};
use peak_alloc::PeakAlloc;
use std::collections::BTreeMap;
use std::io::Cursor;
use std::sync::{Mutex, PoisonError};
use trueline_mcap::{Damage, LogReader};

#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

/// The allocator counts for all threads: one test at a time.
static ALONE: Mutex<()> = Mutex::new(());

const MB: usize = 1 << 20;

/// Messages in a file, what is wrong with it, and the memory that reading it took at most, bytes.
fn read(bytes: &[u8]) -> (usize, Vec<Damage>, usize) {
    MEMORY.reset_peak_usage();
    let before = MEMORY.current_usage();
    let mut reader = LogReader::open(Cursor::new(bytes)).unwrap();
    let mut items = 0;
    while reader.next_item().unwrap().is_some() {
        items += 1;
    }
    let damages = reader.damages().to_vec();
    (items, damages, MEMORY.peak_usage() - before)
}

/// As many messages of so many bytes in one chunk.
fn one_chunk(messages: usize, bytes: usize, compression: Option<Compression>) -> Vec<u8> {
    let mut file = Cursor::new(Vec::new());
    let options = WriteOptions::new()
        .compression(compression)
        .chunk_size(None)
        .compression_threads(0)
        .emit_message_indexes(false);
    let mut writer = options.create(&mut file).unwrap();
    let channel = writer.add_channel(0, "/bomb", "", &BTreeMap::new()).unwrap();
    let data = vec![0; bytes];
    for k in 0..messages as u64 {
        let header = MessageHeader { channel_id: channel, sequence: 0, log_time: k / 4096, publish_time: 0 };
        writer.write_to_known_channel(&header, &data).unwrap();
    }
    writer.finish().unwrap();
    drop(writer);
    file.into_inner()
}

/// Every 32-bit length of the file is made 4 GB in turn, whatever it is: topics, schemas, words, index, footer.
#[test]
fn no_length_field_asks_for_more_memory_than_there_is_data() {
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    for file in [recorded(entries(4)), one_chunk(3, 40, None)] {
        let (_, damages, honest) = read(&file);
        assert!(damages.is_empty());
        for at in 0..file.len() - 4 {
            let mut altered = file.clone();
            altered[at..at + 4].copy_from_slice(&0xffff_fff0_u32.to_le_bytes());
            let (_, _, peak) = read(&altered);
            // A chunk may grow to 64 MB, and the reader takes blocks of a megabyte.
            assert!(peak < honest + 68 * MB, "byte {at}: {peak} bytes");
        }
    }
}

/// Two million messages of nothing in less than 100 kB: they are handed out one by one.
#[test]
fn messages_of_a_chunk_are_not_kept() {
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    const MESSAGES: usize = 2_000_000;
    let file = one_chunk(MESSAGES, 0, Some(Compression::Zstd));
    assert!(file.len() < MB, "{} bytes", file.len());
    let (messages, damages, peak) = read(&file);
    assert!(damages.is_empty(), "{damages:?}");
    // The metadata and the statistics are items as well.
    assert!(messages >= MESSAGES, "{messages}");
    // 31 bytes a message, decompressed, in buffers that grow by doubling.
    assert!(peak < 31 * MESSAGES * 3, "{peak} bytes");
}

/// 200 MB out of a few kB is no recording.
#[test]
fn a_chunk_that_grows_too_much_is_refused_unread() {
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    let file = one_chunk(20, 10 * MB, Some(Compression::Zstd));
    assert!(file.len() < MB / 2, "{} bytes", file.len());
    let (messages, damages, peak) = read(&file);
    assert_eq!(messages, 0);
    assert!(damages.iter().any(|damage| matches!(damage, Damage::Skipped { .. })), "{damages:?}");
    assert!(peak < 8 * MB, "{peak} bytes");
}

/// Dark pictures shrink to nearly nothing as well, and are read.
#[test]
fn dark_pictures_are_read() {
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    let (messages, damages, _) = read(&one_chunk(4, 12 * MB, Some(Compression::Zstd)));
    assert!(damages.is_empty() && messages >= 4, "{messages} {damages:?}");
}
