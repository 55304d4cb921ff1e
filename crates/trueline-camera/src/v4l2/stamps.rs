//! Meaning of the kernel's stamp of a buffer, on the steady clock.

use crate::latch_clock::LatchSample;
use trueline_live::HostClock;
use v4l::buffer::{Flags, Metadata};

/// Moment that a driver stamps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Stamped {
    /// The beginning of the picture, by the machine's steady clock.
    Beginning,
    /// Its end: the last byte is there.
    End,
    /// By an unknown clock.
    Unknown,
}

impl Stamped {
    /// By the flags of a buffer.
    pub(super) fn by(flags: Flags) -> Self {
        // Parts of the flags are numbers of several bits.
        let of = |mask: Flags| flags.bits() & mask.bits();
        if of(Flags::TIMESTAMP_MASK) != Flags::TIMESTAMP_MONOTONIC.bits() {
            return Self::Unknown;
        }
        match of(Flags::TSTAMP_SRC_MASK) {
            beginning if beginning == Flags::TSTAMP_SRC_SOE.bits() => Self::Beginning,
            _ => Self::End,
        }
    }

    /// In words, for the recording.
    pub(super) fn meaning(self) -> &'static str {
        match self {
            Self::Beginning => {
                "the kernel's, at the beginning of the picture (start of exposure by the driver's word)"
            }
            Self::End => "none of the exposure: the kernel stamps when the last byte is there",
            Self::Unknown => "none: the driver stamps by no known clock",
        }
    }
}

/// The stamp of a buffer by the machine's steady clock, ns.
pub(super) fn machine_ns(meta: &Metadata) -> i64 {
    let (seconds, micros): (i64, i64) = (meta.timestamp.sec, meta.timestamp.usec);
    seconds.saturating_mul(1_000_000_000).saturating_add(micros.saturating_mul(1000))
}

/// The same on the steady clock of a recording, ns.
pub(super) fn steady_ns(machine_ns: i64, clock: HostClock) -> i64 {
    machine_ns.saturating_sub(clock.machine_ahead_ns())
}

/// One question to the machine's clock.
pub(super) fn latch(clock: HostClock) -> LatchSample {
    let before_ns = clock.read().steady_ns;
    let device_ns = before_ns + clock.machine_ahead_ns();
    LatchSample { before_ns, device_ns, after_ns: clock.read().steady_ns }
}

#[cfg(test)]
mod tests {
    use super::*;
    use v4l::Timestamp;

    #[test]
    fn flags_say_what_was_stamped() {
        let monotonic = Flags::TIMESTAMP_MONOTONIC;
        assert_eq!(Stamped::by(monotonic | Flags::TSTAMP_SRC_SOE | Flags::MAPPED), Stamped::Beginning);
        assert_eq!(Stamped::by(monotonic | Flags::DONE), Stamped::End);
        assert_eq!(Stamped::by(Flags::TIMESTAMP_COPY | Flags::TSTAMP_SRC_SOE), Stamped::Unknown);
        assert_eq!(Stamped::by(Flags::DONE), Stamped::Unknown);
    }

    #[test]
    fn the_machines_clock_is_the_steady_one_moved() {
        let clock = HostClock::start();
        let sample = latch(clock);
        // Two readings one after the other.
        assert!((steady_ns(sample.device_ns, clock) - sample.before_ns).abs() < 10_000_000);
        let meta = Metadata { timestamp: Timestamp::new(12, 345_678), ..Metadata::default() };
        assert_eq!(machine_ns(&meta), 12_345_678_000);
    }
}
