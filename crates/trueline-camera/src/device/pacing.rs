//! Packets leave no faster than the network carries them.

/// Bytes around a packet on the wire: internet and UDP headers, Ethernet frame, preamble and gap.
const AROUND_BYTES: usize = 28 + 38;
/// Waits shorter than this are saved up: sleeping takes longer anyway, ns.
const SHORTEST_WAIT_NS: i64 = 100_000;

/// The pace of one picture.
pub(super) struct Pacing {
    start_ns: i64,
    ns_per_byte: f64,
    bytes: usize,
}

impl Pacing {
    /// From a steady time on, ns, at a speed, bit/s; 0 for no limit.
    pub(super) fn start(start_ns: i64, bits_per_s: f64) -> Self {
        let ns_per_byte = if bits_per_s > 0.0 { 8e9 / bits_per_s } else { 0.0 };
        Self { start_ns, ns_per_byte, bytes: 0 }
    }

    /// Time until which to wait before the next packet, ns, if it is worth it; a packet of `bytes` follows.
    pub(crate) fn wait_until_ns(&mut self, now_ns: i64, bytes: usize) -> Option<i64> {
        let due_ns = self.start_ns.saturating_add((self.bytes as f64 * self.ns_per_byte) as i64);
        self.bytes += bytes + AROUND_BYTES;
        (due_ns - now_ns >= SHORTEST_WAIT_NS).then_some(due_ns)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_megabyte_takes_its_time_and_no_limit_takes_none() {
        let mut pacing = Pacing::start(1000, 1e9);
        let mut now_ns = 1000;
        for _ in 0..700 {
            now_ns = pacing.wait_until_ns(now_ns, 1434).unwrap_or(now_ns);
        }
        let took_ms = (now_ns - 1000) as f64 * 1e-6;
        assert!((8.2..8.4).contains(&took_ms), "{took_ms}");
        let mut free = Pacing::start(0, 0.0);
        assert!((0..100).all(|_| free.wait_until_ns(0, 1434).is_none()));
    }
}
