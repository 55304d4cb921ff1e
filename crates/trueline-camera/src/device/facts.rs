//! Facts about the device, on this machine's clock: the truth of a test.

use std::fmt;

/// A picture that was sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SentFrame {
    /// Its number in the stream: 1 to 65535, again and again.
    pub block_id: u16,
    /// Stamp in its leader: the device's clock when the exposure started, ns.
    pub device_ns: i64,
    /// Steady time when the exposure started, ns.
    pub exposure_start_ns: i64,
    /// Steady time before the first packet was sent, ns.
    pub first_packet_ns: i64,
    /// Steady time after the last packet was sent, ns.
    pub last_packet_ns: i64,
}

/// Counts of the device so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DeviceCounts {
    /// Exposures.
    pub exposed: u64,
    /// Signals that came while an exposure was under way or being read out: no picture begins.
    pub missed_triggers: u64,
    /// Pictures sent.
    pub sent: u64,
    /// Pictures dropped on purpose.
    pub dropped: u64,
    /// Pictures dropped because they were not ready in time.
    pub late: u64,
    /// Pictures dropped because those before them were still being sent.
    pub link_busy: u64,
    /// Packets of pictures, lost ones included.
    pub packets: u64,
    /// Packets lost on purpose.
    pub lost_packets: u64,
    /// Packets sent again.
    pub resent_packets: u64,
    /// Packets requested again after they were discarded.
    pub forgotten_packets: u64,
    /// Times the clock was latched.
    pub latches: u64,
    /// Commands refused because another program has control.
    pub denied: u64,
    /// Times a program fell silent and lost control.
    pub heartbeats_lost: u64,
    /// Packets that this machine refused to send.
    pub send_errors: u64,
}

impl fmt::Display for DeviceCounts {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { exposed, sent, dropped, late, link_busy, packets, lost_packets, resent_packets, .. } =
            self;
        write!(
            f,
            "{exposed} exposures, {sent} pictures sent, {dropped} dropped (on purpose, or without a pose of \
             the robot), {late} not drawn in time, {link_busy} for lack of bandwidth; {packets} packets, {lost_packets} lost on purpose, \
             {resent_packets} sent again"
        )
    }
}
