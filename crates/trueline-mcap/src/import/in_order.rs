//! Stamps that do not rise: sorted, and told.

/// How many stamps come behind a later one.
pub(super) fn late(stamps: impl Iterator<Item = i64>) -> usize {
    let mut newest = i64::MIN;
    let mut late = 0;
    for stamp in stamps {
        late += usize::from(stamp < newest);
        newest = newest.max(stamp);
    }
    late
}

/// Sorts by stamp, equal stamps in their order; reports the disorder.
pub(super) fn sort<T>(items: &mut [T], stamp: impl Fn(&T) -> i64, what: &str) -> Option<String> {
    let late = late(items.iter().map(&stamp));
    items.sort_by_key(stamp);
    late_note(late, what)
}

/// Words for stamps that were out of order.
pub(crate) fn late_note(late: usize, what: &str) -> Option<String> {
    (late > 0).then(|| format!("{late} {what} were recorded behind later ones and have been sorted by stamp"))
}

/// Reports the number of items with the stamp of the one before; they are kept.
pub(super) fn repetitions<T>(items: &[T], stamp: impl Fn(&T) -> i64, what: &str) -> Option<String> {
    let count = items.windows(2).filter(|w| stamp(&w[0]) == stamp(&w[1])).count();
    (count > 0).then(|| format!("{count} {what} have the stamp of the one before"))
}

/// Whether the sender left out the stamps.
pub(crate) fn not_stamped(mut stamps: impl ExactSizeIterator<Item = i64>) -> bool {
    stamps.len() > 1 && stamps.all(|stamp| stamp == 0)
}
