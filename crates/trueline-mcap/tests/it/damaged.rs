//! For any damage to a file: no panic, no silently altered item, and all remaining data.

use crate::common;

use common::{entries, messages, read_items, recorded, unfinished, unpack};
use proptest::prelude::*;
use std::collections::HashSet;
use std::sync::LazyLock;
use trueline_mcap::{Choice, Damage, Item, survey};

static FINISHED: LazyLock<Vec<u8>> = LazyLock::new(|| recorded(entries(40)));
static UNFINISHED: LazyLock<Vec<u8>> = LazyLock::new(|| unfinished(entries(40)));

fn words(items: &[Item]) -> Vec<String> {
    items.iter().map(|item| format!("{item:?}")).collect()
}

fn count(items: &[Item]) -> usize {
    items.iter().filter(|item| matches!(item, Item::Message { .. })).count()
}

#[test]
fn every_cut_leaves_what_was_before_it() {
    // Every cut is read: the time grows with the square of the length.
    let file = unfinished(entries(16));
    let (whole, _) = read_items(&file);
    let whole = words(&whole);
    let mut before = 0;
    for cut in 0..file.len() {
        let (items, damages) = read_items(&file[..cut]);
        assert!(!damages.is_empty(), "cut at {cut}: not told");
        assert!(count(&items) >= before, "cut at {cut}: less than from a shorter file");
        before = count(&items);
        assert_eq!(words(&items), whole[..items.len()], "cut at {cut}");
    }
    assert!(before > 0);
}

#[test]
fn cuts_in_the_index_of_a_finished_recording_lose_nothing() {
    let (whole, damages) = read_items(&FINISHED);
    assert!(damages.is_empty());
    let data_end = FINISHED.len() - 200;
    for cut in data_end..FINISHED.len() {
        let (items, damages) = read_items(&FINISHED[..cut]);
        assert_eq!(count(&items), count(&whole));
        assert!(
            matches!(damages.as_slice(), [Damage::Truncated { .. } | Damage::Skipped { .. }]),
            "{damages:?}"
        );
    }
}

/// Places of a file's chunks: opcode 6 and a length that leads on.
fn chunks(file: &[u8]) -> Vec<std::ops::Range<usize>> {
    let mut at = 8;
    let mut chunks = Vec::new();
    while at + 9 <= file.len() {
        let length = u64::from_le_bytes(file[at + 1..at + 9].try_into().unwrap()) as usize;
        if file[at] == 6 {
            chunks.push(at..at + 9 + length);
        }
        at += 9 + length;
    }
    chunks
}

/// The first chunk holds nothing but the names of the topics, once for the whole file.
#[test]
fn an_unfinished_recording_without_the_names_of_its_topics_can_be_read() {
    let (whole, _) = read_items(&UNFINISHED);
    let mut file = UNFINISHED.clone();
    let first = chunks(&file)[0].clone();
    file[first.start + 200] ^= 0x10;
    let (items, damages) = read_items(&file);
    assert!(matches!(damages[0], Damage::Chunk { kept: 0, .. }), "{damages:?}");
    assert_eq!(words(&items), words(&whole));
    // Even without the framing: what is behind it is found again.
    file[first.start + 5] = 0xff;
    let (items, damages) = read_items(&file);
    assert!(matches!(damages[0], Damage::Skipped { .. }), "{damages:?}");
    assert_eq!(words(&items), words(&whole));
}

#[test]
fn a_damaged_chunk_costs_itself_alone() {
    let (whole, _) = read_items(&UNFINISHED);
    let whole = words(&whole);
    for (k, chunk) in chunks(&UNFINISHED).into_iter().enumerate().skip(1) {
        let mut file = UNFINISHED.clone();
        file[chunk.end - 20] ^= 1;
        let (items, damages) = read_items(&file);
        let Some(Damage::Chunk { offset, start_ns, end_ns, .. }) = damages.first() else {
            panic!("{damages:?}")
        };
        assert_eq!(*offset as usize, chunk.start);
        assert!(start_ns < end_ns);
        let items = words(&items);
        let set: HashSet<_> = items.iter().collect();
        // Ten entries are up to twenty messages.
        let lost = whole.iter().filter(|item| !set.contains(item)).count();
        assert!((1..=20).contains(&lost), "chunk {k}: {lost} lost");
    }
}

/// Outside of chunks nothing but its own sense protects a record: an index with one bit altered is a message.
#[test]
fn no_record_passes_as_one_of_another_kind() {
    for original in [&FINISHED, &UNFINISHED] {
        let mut at = 8;
        while at + 9 <= original.len() {
            for bit in 0..8 {
                let mut altered = original.to_vec();
                altered[at] ^= 1_u8 << bit;
                check(original, &altered);
            }
            at += 9 + u64::from_le_bytes(original[at + 1..at + 9].try_into().unwrap()) as usize;
        }
    }
}

/// A length altered to lead over the next chunk to the start of a record.
#[test]
fn a_record_that_hides_a_chunk_is_told_and_the_chunk_is_read() {
    let (whole, known) = read_items(&UNFINISHED);
    for chunk in chunks(&UNFINISHED).into_iter().skip(1) {
        let mut at = 8;
        let length = |at: usize| u64::from_le_bytes(UNFINISHED[at + 1..at + 9].try_into().unwrap()) as usize;
        while at + 9 + length(at) < chunk.start {
            at += 9 + length(at);
        }
        // The record before it now ends where it ends.
        let mut file = UNFINISHED.clone();
        file[at + 1..at + 9].copy_from_slice(&((chunk.end - at - 9) as u64).to_le_bytes());
        let (items, damages) = read_items(&file);
        assert!(damages.len() > known.len(), "record {} at {at}: {damages:?}", file[at]);
        assert_eq!(words(&items), words(&whole), "record {} at {at}: {damages:?}", file[at]);
    }
}

#[test]
#[ignore = "takes minutes; a sample of it is below"]
fn no_flipped_bit_of_all_is_taken_as_good() {
    for original in [&FINISHED, &UNFINISHED] {
        for at in 0..original.len() {
            for bit in 0..8 {
                let mut altered = original.to_vec();
                altered[at] ^= 1_u8 << bit;
                check(original, &altered);
            }
        }
    }
}

#[test]
fn damage_is_told_where_a_dataset_is_made() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("a.mcap");
    let mut bytes = UNFINISHED.clone();
    let chunk = chunks(&bytes)[2].clone();
    bytes[chunk.end - 20] ^= 1;
    std::fs::write(&file, &bytes).unwrap();
    assert_eq!(survey(&file).unwrap().damages.len(), 2);
    let unpacked = unpack(&file, &Choice::default(), &folder.path().join("scan")).unwrap();
    let told: Vec<String> = unpacked.damages.iter().map(ToString::to_string).collect();
    assert!(
        told[0].contains("a.mcap: a chunk of") && told[0].contains("s of messages are missing"),
        "{told:?}"
    );
    assert!(told[1].contains("was not finished"), "{told:?}");
    assert!((30..40).contains(&unpacked.robot));
}

#[test]
fn files_that_are_none_are_told() {
    let damages = |bytes: &[u8]| read_items(bytes).1;
    assert_eq!(damages(b""), [Damage::Empty]);
    assert_eq!(damages(&[7; 5000])[0], Damage::NotMcap);
    assert!(matches!(damages(mcap::MAGIC).as_slice(), [Damage::Truncated { offset: 8, lost: 0 }]));
}

/// A length that asks for all memory.
#[test]
fn a_chunk_that_was_never_closed_asks_for_no_memory() {
    let mut file = UNFINISHED.clone();
    let end = file.len() as u64;
    file.push(6);
    file.extend([0xff; 8]);
    file.extend([0; 100]);
    let (items, damages) = read_items(&file);
    assert_eq!(count(&items), count(&read_items(&UNFINISHED).0));
    assert_eq!(damages, [Damage::Truncated { offset: end, lost: 109 }]);
}

fn check(original: &[u8], altered: &[u8]) {
    let (whole, known) = read_items(original);
    let whole: HashSet<String> = words(&whole).into_iter().collect();
    let (items, damages) = read_items(altered);
    let told = damages.iter().any(|damage| !known.contains(damage)) || damages.len() < known.len();
    let is_altered = words(&items).iter().any(|item| !whole.contains(item));
    let is_less = items.len() < whole.len();
    assert!(told || !(is_altered || is_less), "altered {is_altered}, less {is_less}, {damages:?}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1500))]

    #[test]
    fn no_flipped_bit_is_taken_as_good(at in any::<prop::sample::Index>(), bit in 0..8, finished: bool) {
        let original: &[u8] = if finished { &FINISHED } else { &UNFINISHED };
        let mut altered = original.to_vec();
        *at.get_mut(&mut altered) ^= 1_u8 << bit;
        check(original, &altered);
    }

    #[test]
    fn no_number_of_changes_makes_the_reader_panic(
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..20),
        finished: bool,
    ) {
        let mut altered = if finished { FINISHED.clone() } else { UNFINISHED.clone() };
        for (at, byte) in changes {
            *at.get_mut(&mut altered) = byte;
        }
        let (items, _) = read_items(&altered);
        let (original, _) = read_items(if finished { &FINISHED } else { &UNFINISHED });
        prop_assert!(messages(&items, "/tf").len() <= messages(&original, "/tf").len());
    }

    #[test]
    fn no_bytes_make_the_reader_panic(bytes in prop::collection::vec(any::<u8>(), 0..2000), with_magic: bool) {
        let start = if with_magic { mcap::MAGIC } else { b"" };
        read_items(&[start, &bytes].concat());
    }
}
