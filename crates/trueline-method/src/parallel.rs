//! Parallel work on threads. Results are in the order of the items.

use std::sync::atomic::{AtomicUsize, Ordering};

/// Applies `work` to the items 0 to `count`, on at most `threads` threads. With one thread it runs on the caller's.
pub(crate) fn map<R: Send>(threads: usize, count: usize, work: impl Fn(usize) -> R + Sync) -> Vec<R> {
    if threads <= 1 || count <= 1 {
        return (0..count).map(work).collect();
    }
    let next = AtomicUsize::new(0);
    let mut all: Vec<(usize, R)> = std::thread::scope(|scope| {
        let worker = || {
            let mut own = Vec::new();
            loop {
                let item = next.fetch_add(1, Ordering::Relaxed);
                if item >= count {
                    return own;
                }
                own.push((item, work(item)));
            }
        };
        let workers: Vec<_> = (0..threads.min(count)).map(|_| scope.spawn(worker)).collect();
        // A panic of a worker is propagated.
        workers
            .into_iter()
            .flat_map(|worker| worker.join().unwrap_or_else(|e| std::panic::resume_unwind(e)))
            .collect()
    });
    all.sort_by_key(|(item, _)| *item);
    all.into_iter().map(|(_, result)| result).collect()
}

/// Applies `work` to the items, and keeps its `Some` results.
pub(crate) fn filter_map<T: Sync, R: Send>(
    threads: usize,
    items: &[T],
    work: impl Fn(&T) -> Option<R> + Sync,
) -> Vec<R> {
    map(threads, items.len(), |item| work(&items[item])).into_iter().flatten().collect()
}

#[cfg(test)]
mod tests {
    use super::map;

    #[test]
    fn results_come_in_order_however_long_each_takes() {
        let work = |item: usize| {
            // The first items take longest and therefore finish last.
            std::thread::sleep(std::time::Duration::from_micros(200 * (8 - item as u64)));
            item * item
        };
        let expected: Vec<usize> = (0..8).map(|item| item * item).collect();
        for threads in [1, 3, 16] {
            assert_eq!(map(threads, 8, work), expected);
        }
        assert!(map(4, 0, work).is_empty());
    }
}
