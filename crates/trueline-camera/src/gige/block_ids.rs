//! The counter of a GigE Vision stream, without its wraps.

/// The 16 bit counter goes from this back to 1: 0 is never sent.
const LAST_OF_16_BITS: i64 = 0xffff;

/// Turns a counter that wraps into a monotonic one.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct BlockIds {
    last: Option<(u64, u64)>,
}

/// A whole picture may follow this many lost ones; beyond that their number is unknown.
const MOST_LOST: i64 = 10_000;
/// An incomplete picture may follow this many: one stray packet with a strange number makes such a picture.
const MOST_LOST_BEFORE_A_PART: i64 = 64;

impl BlockIds {
    /// The unwrapped number of a block; pictures come in the order of the stream. `None` for a block that is no
    /// picture of the stream: a part of one, with a number that the counter cannot have reached.
    pub(super) fn unwrapped(&mut self, id: u64, is_whole: bool) -> Option<u64> {
        let number = match self.last {
            None => is_whole.then_some(id)?,
            Some((last_id, number)) => {
                let ahead = id.wrapping_sub(last_id).cast_signed();
                // A counter of 64 bits never falls; one of 16 bits falls by nearly all of its range when it wraps.
                let wraps = (-LAST_OF_16_BITS..-LAST_OF_16_BITS / 2).contains(&ahead);
                let ahead = if wraps { ahead + LAST_OF_16_BITS } else { ahead };
                let most = if is_whole { MOST_LOST } else { MOST_LOST_BEFORE_A_PART };
                match u64::try_from(ahead) {
                    Ok(ahead @ 1..) if ahead.cast_signed() <= most => number.saturating_add(ahead),
                    // A camera that restarted: the number of lost pictures is unknown.
                    _ if is_whole => number.saturating_add(1),
                    _ => return None,
                }
            }
        };
        self.last = Some((id, number));
        Some(number)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn unwrapped(ids: &[u64]) -> Vec<u64> {
        let mut counter = BlockIds::default();
        ids.iter().filter_map(|id| counter.unwrapped(*id, true)).collect()
    }

    #[test]
    fn a_stray_packet_with_a_strange_number_leaves_no_trace() {
        for strange in [u64::MAX, 1 << 63, 18_446_744_073_709_486_256, 70_000, 5, 0, 1 << 32] {
            let mut counter = BlockIds::default();
            assert_eq!(counter.unwrapped(strange, false), None, "nothing is known before the first picture");
            let numbers: Vec<Option<u64>> = [(1000, true), (strange, false), (1001, true), (1003, false)]
                .into_iter()
                .map(|(id, is_whole)| counter.unwrapped(id, is_whole))
                .collect();
            assert_eq!(numbers, [Some(1000), None, Some(1001), Some(1003)], "{strange}");
        }
        assert_eq!(unwrapped(&[1000, 1 << 40, 1, 2]), [1000, 1001, 1002, 1003], "whole ones began again");
        // From the largest number to 1 is a gap of one, as from any number to the next but one.
        assert_eq!(unwrapped(&[1000, u64::MAX, 1]), [1000, 1001, 1003]);
    }

    #[test]
    fn a_wrap_skips_zero_and_gaps_stay() {
        assert_eq!(unwrapped(&[0xfffd, 0xfffe, 0xffff, 1, 2, 5]), [65533, 65534, 65535, 65536, 65537, 65540]);
        assert_eq!(unwrapped(&[0xfffe, 2]), [65534, 65537], "0xffff and 1 were lost");
    }

    #[test]
    fn long_counters_do_not_wrap_and_a_restart_goes_on() {
        assert_eq!(unwrapped(&[65_535, 65_536, 65_540]), [65_535, 65_536, 65_540]);
        assert_eq!(unwrapped(&[100, 101, 1, 2]), [100, 101, 102, 103]);
    }
}
