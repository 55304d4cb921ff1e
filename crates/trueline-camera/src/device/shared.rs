//! State shared by the device's threads.

use super::device_clock::RunningClock;
use super::facts::{DeviceCounts, SentFrame};
use super::registers::Registers;
use super::settings::DeviceSettings;
use super::words::locked;
use std::collections::VecDeque;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;
use trueline_live::HostClock;

/// Pictures that can be sent again.
const PICTURES_KEPT: usize = 6;
/// Facts that are kept.
const FACTS_KEPT: usize = 4096;
/// Threads look this often whether they are to stop.
pub(super) const LOOK: Duration = Duration::from_millis(20);

/// The packets of a picture.
pub(super) type PacketList = Arc<Vec<Vec<u8>>>;

/// State shared by the device's threads.
pub(super) struct Shared {
    pub host: HostClock,
    pub clock: RunningClock,
    pub settings: DeviceSettings,
    pub registers: Mutex<Registers>,
    counts: Mutex<DeviceCounts>,
    sent: Mutex<VecDeque<SentFrame>>,
    /// By block id.
    again: Mutex<VecDeque<(u64, PacketList)>>,
    stop: AtomicBool,
    unplugged: AtomicBool,
}

impl Shared {
    pub(super) fn new(settings: DeviceSettings, host: HostClock) -> Self {
        Self {
            host,
            clock: RunningClock::start(settings.clock, host.read().steady_ns),
            registers: Mutex::new(Registers::new(&settings)),
            settings,
            counts: Mutex::default(),
            sent: Mutex::default(),
            again: Mutex::default(),
            stop: AtomicBool::new(false),
            unplugged: AtomicBool::new(false),
        }
    }

    pub(super) fn now_ns(&self) -> i64 {
        self.host.read().steady_ns
    }

    pub(crate) fn is_stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    pub(super) fn stop(&self) {
        self.stop.store(true, Ordering::Relaxed);
    }

    pub(crate) fn is_unplugged(&self) -> bool {
        self.unplugged.load(Ordering::Relaxed)
    }

    pub(super) fn unplug(&self) {
        self.unplugged.store(true, Ordering::Relaxed);
    }

    pub(super) fn count(&self, change: impl FnOnce(&mut DeviceCounts)) {
        change(&mut locked(&self.counts));
    }

    pub(super) fn counts(&self) -> DeviceCounts {
        *locked(&self.counts)
    }

    pub(super) fn keep(&self, block_id: u64, packets: PacketList) {
        let mut again = locked(&self.again);
        again.truncate(PICTURES_KEPT - 1);
        again.push_front((block_id, packets));
    }

    pub(super) fn kept(&self, block_id: u64) -> Option<PacketList> {
        locked(&self.again).iter().find(|(id, _)| *id == block_id).map(|(_, packets)| Arc::clone(packets))
    }

    pub(super) fn tell(&self, frame: SentFrame) {
        let mut sent = locked(&self.sent);
        if sent.len() >= FACTS_KEPT {
            sent.pop_front();
        }
        sent.push_back(frame);
    }

    pub(super) fn sent(&self) -> Vec<SentFrame> {
        locked(&self.sent).iter().copied().collect()
    }

    /// Sleeps until a steady time, ns; `false` if the device was stopped meanwhile.
    pub(crate) fn sleep_until(&self, at_ns: i64) -> bool {
        loop {
            if self.is_stopped() {
                return false;
            }
            let left_ns = u64::try_from(at_ns - self.now_ns()).unwrap_or(0);
            if left_ns == 0 {
                return true;
            }
            std::thread::sleep(Duration::from_nanos(left_ns).min(LOOK));
        }
    }
}
