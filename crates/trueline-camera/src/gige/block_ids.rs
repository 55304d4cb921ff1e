//! The counter of a GigE Vision stream, without its wraps.

/// The 16 bit counter goes from this back to 1: 0 is never sent.
const LAST_OF_16_BITS: i64 = 0xffff;

/// Makes a counter that never falls out of one that wraps.
#[derive(Clone, Copy, Debug, Default)]
pub struct BlockIds {
    last: Option<(u64, u64)>,
}

impl BlockIds {
    /// The unwrapped number of a block; pictures come in the order of the stream.
    pub fn unwrapped(&mut self, id: u64) -> u64 {
        let number = match self.last {
            None => id,
            Some((last_id, number)) => {
                let ahead = id.wrapping_sub(last_id).cast_signed();
                // A counter of 64 bits never falls; one of 16 bits falls by nearly all of its range when it wraps.
                let ahead = if ahead < -LAST_OF_16_BITS / 2 { ahead + LAST_OF_16_BITS } else { ahead };
                // Any other fall is a camera that began again: how many pictures that cost nobody knows.
                number.saturating_add(u64::try_from(ahead).unwrap_or(0).max(1))
            }
        };
        self.last = Some((id, number));
        number
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn unwrapped(ids: &[u64]) -> Vec<u64> {
        let mut counter = BlockIds::default();
        ids.iter().map(|id| counter.unwrapped(*id)).collect()
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
