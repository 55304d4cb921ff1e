//! The transfers of a device, with a bound on their waiting times, and a stamp for arrivals.

use std::collections::VecDeque;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};
use trueline_live::HostClock;
use viva_u3v::{BulkIn, Completion, U3vError, UsbSpeed, UsbTransfer};

/// A command has been answered within this, however often the device asks for more time.
const LONGEST_ANSWER: Duration = Duration::from_secs(5);
/// Pictures with kept stamps until they are requested: more than are ever under way.
const MOST_PICTURES: usize = 64;
/// First bytes of a picture's leader and trailer, and the place of the picture's number in both.
const LEADER: &[u8] = b"U3VL";
const TRAILER: &[u8] = b"U3VT";
const NUMBER_AT: usize = 8;

/// When a picture came.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Arrival {
    block: u64,
    /// Steady time of its leader, ns.
    pub first_ns: i64,
    /// Steady time of its trailer, ns; `None` before it came.
    pub last_ns: Option<i64>,
}

/// When the pictures under way came.
#[derive(Clone)]
pub(super) struct Arrivals {
    clock: HostClock,
    pictures: Arc<Mutex<VecDeque<Arrival>>>,
}

impl Arrivals {
    /// Nothing yet.
    pub(super) fn new(clock: HostClock) -> Self {
        Self { clock, pictures: Arc::default() }
    }

    /// Steady time, ns.
    pub(super) fn now_ns(&self) -> i64 {
        self.clock.read().steady_ns
    }

    /// When a picture came, which with all older ones is forgotten.
    pub(super) fn take(&self, block: u64) -> Option<Arrival> {
        let mut pictures = locked(&self.pictures);
        let at = pictures.iter().rposition(|arrival| arrival.block == block)?;
        pictures.drain(..=at).next_back()
    }

    /// Notes a transfer that came just now.
    fn note(&self, data: &[u8]) {
        let now_ns = self.now_ns();
        let is_leader = data.starts_with(LEADER);
        if !is_leader && !data.starts_with(TRAILER) {
            return;
        }
        let number = data.get(NUMBER_AT..).and_then(|rest| rest.first_chunk::<8>());
        let Some(block) = number.map(|bytes| u64::from_le_bytes(*bytes)) else { return };
        let mut pictures = locked(&self.pictures);
        if is_leader {
            if pictures.len() >= MOST_PICTURES {
                pictures.pop_front();
            }
            pictures.push_back(Arrival { block, first_ns: now_ns, last_ns: None });
        } else if let Some(arrival) = pictures.iter_mut().rev().find(|arrival| arrival.block == block) {
            arrival.last_ns.get_or_insert(now_ns);
        }
    }
}

/// Data of another thread that panicked are still whole: only numbers are written.
fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The transfers of a device.
pub(super) struct Bounded<T> {
    usb: Arc<T>,
    asked: Mutex<Instant>,
    arrivals: Arrivals,
    /// The stream ends, even if the device continues to send.
    ends: Arc<AtomicBool>,
}

impl<T> Bounded<T> {
    /// For a device with a stream that ends when `ends` is set.
    pub(super) fn new(usb: Arc<T>, arrivals: Arrivals, ends: Arc<AtomicBool>) -> Self {
        Self { usb, asked: Mutex::new(Instant::now()), arrivals, ends }
    }
}

impl<T: UsbTransfer + 'static> UsbTransfer for Bounded<T> {
    fn bulk_write(&self, endpoint: u8, data: &[u8], timeout: Duration) -> Result<usize, U3vError> {
        *locked(&self.asked) = Instant::now();
        self.usb.bulk_write(endpoint, data, timeout)
    }

    fn bulk_read(&self, endpoint: u8, buffer: &mut [u8], timeout: Duration) -> Result<usize, U3vError> {
        let left = LONGEST_ANSWER.saturating_sub(locked(&self.asked).elapsed());
        if left.is_zero() {
            return Err(U3vError::Timeout);
        }
        self.usb.bulk_read(endpoint, buffer, timeout.min(left))
    }

    fn bulk_in(self: &Arc<Self>, endpoint: u8) -> Result<Box<dyn BulkIn>, U3vError> {
        let queue = self.usb.bulk_in(endpoint)?;
        Ok(Box::new(Stamped { queue, arrivals: self.arrivals.clone(), ends: Arc::clone(&self.ends) }))
    }

    fn max_packet_size(&self, endpoint: u8) -> Option<usize> {
        self.usb.max_packet_size(endpoint)
    }

    fn link_speed(&self) -> Option<UsbSpeed> {
        self.usb.link_speed()
    }

    fn is_present(&self) -> Option<bool> {
        self.usb.is_present()
    }
}

/// The transfers of the stream.
struct Stamped {
    queue: Box<dyn BulkIn>,
    arrivals: Arrivals,
    ends: Arc<AtomicBool>,
}

impl BulkIn for Stamped {
    fn submit(&mut self, length: usize) {
        self.queue.submit(length);
    }

    fn pending(&self) -> usize {
        self.queue.pending()
    }

    fn wait_next(&mut self, timeout: Duration) -> Option<Completion> {
        // A device may send useless data for ever, and the stream would continue.
        if self.ends.load(Ordering::Relaxed) {
            return None;
        }
        let completion = self.queue.wait_next(timeout)?;
        // One that was cancelled or failed may have brought something all the same, and the stream uses that.
        if !completion.data.is_empty() {
            self.arrivals.note(&completion.data);
        }
        Some(completion)
    }

    fn cancel_all(&mut self) {
        self.queue.cancel_all();
    }

    fn reset(&mut self) -> Result<(), U3vError> {
        self.queue.reset()
    }

    fn is_present(&self) -> Option<bool> {
        self.queue.is_present()
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;

    /// Waits as long as it is allowed to, in words, and never answers.
    struct Patient(Mutex<Vec<Duration>>);

    impl UsbTransfer for Patient {
        fn bulk_write(&self, _: u8, data: &[u8], _: Duration) -> Result<usize, U3vError> {
            Ok(data.len())
        }

        fn bulk_read(&self, _: u8, _: &mut [u8], timeout: Duration) -> Result<usize, U3vError> {
            locked(&self.0).push(timeout);
            Ok(0)
        }
    }

    #[test]
    fn a_device_that_asks_for_more_time_gets_no_more_than_is_left() {
        let usb = Arc::new(Patient(Mutex::default()));
        let arrivals = Arrivals::new(HostClock::start());
        let bounded = Bounded::new(Arc::clone(&usb), arrivals, Arc::default());
        let asked_ago = |ago: Duration| {
            *locked(&bounded.asked) = Instant::now().checked_sub(ago).unwrap();
            bounded.bulk_read(0x81, &mut [], Duration::from_secs(60)).is_ok()
        };
        assert!(asked_ago(Duration::from_secs(4)));
        let longest = locked(&usb.0)[0];
        assert!(longest <= Duration::from_secs(1), "{longest:?}");
        assert!(!asked_ago(LONGEST_ANSWER), "it was asked again");
        assert_eq!(locked(&usb.0).len(), 1);
    }

    /// A queue with transfers cancelled after all of this had arrived.
    struct Cancelled(Option<Vec<u8>>);

    impl BulkIn for Cancelled {
        fn submit(&mut self, _: usize) {}

        fn pending(&self) -> usize {
            usize::from(self.0.is_some())
        }

        fn wait_next(&mut self, _: Duration) -> Option<Completion> {
            self.0.take().map(|data| Completion::new(data, Err(U3vError::Cancelled)))
        }

        fn cancel_all(&mut self) {}

        fn reset(&mut self) -> Result<(), U3vError> {
            Ok(())
        }
    }

    #[test]
    fn what_came_before_a_transfer_was_cancelled_has_its_stamp() {
        let arrivals = Arrivals::new(HostClock::start());
        let leader = [LEADER, &[0; 4], &5_u64.to_le_bytes()].concat();
        let queue = Box::new(Cancelled(Some(leader)));
        let mut stamped = Stamped { queue, arrivals: arrivals.clone(), ends: Arc::default() };
        assert!(stamped.wait_next(Duration::ZERO).unwrap().status.is_err());
        assert!(arrivals.take(5).is_some(), "its leader came");
    }

    #[test]
    fn stamps_are_kept_of_so_many_pictures_and_found_by_their_number() {
        let arrivals = Arrivals::new(HostClock::start());
        let framing = |prefix: &[u8], block: u64| [prefix, &[0; 4], &block.to_le_bytes()].concat();
        for block in 0..MOST_PICTURES as u64 + 3 {
            arrivals.note(&framing(LEADER, block));
        }
        arrivals.note(&framing(TRAILER, 9));
        arrivals.note(b"U3VL and too short");
        assert_eq!(arrivals.take(2), None, "forgotten");
        let arrival = arrivals.take(9).unwrap();
        assert!(arrival.last_ns.unwrap() >= arrival.first_ns);
        assert_eq!(
            (arrivals.take(8), arrivals.take(10).unwrap().last_ns),
            (None, None),
            "older ones are gone"
        );
    }
}
