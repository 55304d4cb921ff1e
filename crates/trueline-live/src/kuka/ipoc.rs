//! `IPOC`: the controller's count of its interpolation cycles, which an answer repeats digit by digit.

/// Digits of the longest count, 64 bits.
const MOST_DIGITS: usize = 20;

/// A count as it was written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Ipoc {
    digits: [u8; MOST_DIGITS],
    length: usize,
    ms: u64,
}

impl Ipoc {
    /// Reads digits; `None` for anything else.
    #[must_use]
    pub fn read(text: &str) -> Option<Self> {
        let is_plain = text.len() <= MOST_DIGITS && text.bytes().all(|byte| byte.is_ascii_digit());
        let ms = text.parse().ok().filter(|_| is_plain)?;
        let mut digits = [0; MOST_DIGITS];
        digits[..text.len()].copy_from_slice(text.as_bytes());
        Some(Self { digits, length: text.len(), ms })
    }

    /// The count, in ms.
    #[must_use]
    pub fn ms(&self) -> u64 {
        self.ms
    }

    /// Its digits as they came, zeros in front included.
    #[must_use]
    pub fn digits(&self) -> &[u8] {
        &self.digits[..self.length]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits_are_kept_as_they_came_and_nothing_else_is_taken() {
        for (text, ms) in [("4208163634", 4_208_163_634), ("007", 7), ("18446744073709551615", u64::MAX)] {
            let read = Ipoc::read(text).map(|ipoc| (ipoc.ms(), ipoc.digits().to_vec()));
            assert_eq!(read, Some((ms, text.as_bytes().to_vec())));
        }
        for text in
            ["", "+1", "-1", "1.0", "1 2", "1<2", "18446744073709551616", "000000000000000000001", "١"]
        {
            assert_eq!(Ipoc::read(text), None, "{text}");
        }
    }
}
