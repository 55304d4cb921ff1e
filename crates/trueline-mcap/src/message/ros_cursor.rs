//! Reads the fields of a ROS message one after the other, in both forms that ROS has had.
//!
//! They differ in three values only: the byte order of a number, its alignment, and whether a text counts a zero at its end.
//! CDR, the form of ROS 2, aligns to the size of the number from the byte behind its four bytes of preamble; the form of ROS
//! 1 does not align.

use crate::message::content_error::ContentError;

/// A place in a message.
#[derive(Clone, Debug)]
pub struct RosCursor<'a> {
    bytes: &'a [u8],
    at: usize,
    big_endian: bool,
    /// Numbers are aligned to their size, but at most to this.
    most_alignment: usize,
    /// CDR may be filled up to a multiple of this at its end.
    padding: usize,
    text_ends_in_zero: bool,
}

type Read<T> = Result<T, ContentError>;

impl<'a> RosCursor<'a> {
    /// The first field of a ROS 2 message.
    ///
    /// # Errors
    /// A representation that is not plain CDR, or no bytes.
    pub fn ros2(bytes: &'a [u8]) -> Read<Self> {
        let Some((&[high, low, _, _], bytes)) = bytes.split_first_chunk::<4>() else {
            return Err(ContentError::CutOff { field: "the preamble" });
        };
        let found = u16::from_be_bytes([high, low]);
        let (big_endian, most_alignment) = match found {
            0x0000 => (true, 8),
            0x0001 => (false, 8),
            // The second version of CDR aligns to four at most.
            0x0006 => (true, 4),
            0x0007 => (false, 4),
            _ => return Err(ContentError::Representation { found }),
        };
        Ok(Self { bytes, at: 0, big_endian, most_alignment, padding: 7, text_ends_in_zero: true })
    }

    /// The first field of a ROS 1 message.
    #[must_use]
    pub fn ros1(bytes: &'a [u8]) -> Self {
        Self { bytes, at: 0, big_endian: false, most_alignment: 1, padding: 0, text_ends_in_zero: false }
    }

    fn take(&mut self, count: usize, field: &'static str) -> Read<&'a [u8]> {
        let end = self.at.checked_add(count).filter(|end| *end <= self.bytes.len());
        let end = end.ok_or(ContentError::CutOff { field })?;
        let taken = &self.bytes[self.at..end];
        self.at = end;
        Ok(taken)
    }

    fn number<const N: usize>(&mut self, field: &'static str) -> Read<[u8; N]> {
        let alignment = N.min(self.most_alignment);
        self.take(self.at.next_multiple_of(alignment) - self.at, field)?;
        let mut number = [0; N];
        number.copy_from_slice(self.take(N, field)?);
        if self.big_endian {
            number.reverse();
        }
        Ok(number)
    }

    /// One byte.
    ///
    /// # Errors
    /// The end of the bytes; so for all that follow.
    pub fn u8(&mut self, field: &'static str) -> Read<u8> {
        Ok(u8::from_le_bytes(self.number(field)?))
    }

    /// Four bytes, of 0 and more.
    ///
    /// # Errors
    /// The end of the bytes.
    pub fn u32(&mut self, field: &'static str) -> Read<u32> {
        Ok(u32::from_le_bytes(self.number(field)?))
    }

    /// Four bytes with a sign.
    ///
    /// # Errors
    /// The end of the bytes.
    pub fn i32(&mut self, field: &'static str) -> Read<i32> {
        Ok(i32::from_le_bytes(self.number(field)?))
    }

    /// A number of four bytes, also one that is not finite.
    ///
    /// # Errors
    /// The end of the bytes.
    pub(crate) fn any_f32(&mut self, field: &'static str) -> Read<f32> {
        Ok(f32::from_le_bytes(self.number(field)?))
    }

    /// A number of eight bytes, also one that is not finite.
    ///
    /// # Errors
    /// The end of the bytes.
    pub(crate) fn any_f64(&mut self, field: &'static str) -> Read<f64> {
        Ok(f64::from_le_bytes(self.number(field)?))
    }

    /// A finite number of eight bytes.
    ///
    /// # Errors
    /// The end of the bytes, NaN or infinity.
    pub fn f64(&mut self, field: &'static str) -> Read<f64> {
        let value = self.any_f64(field)?;
        if value.is_finite() { Ok(value) } else { Err(ContentError::NotFinite { field }) }
    }

    /// `N` of them.
    ///
    /// # Errors
    /// As [`RosCursor::f64`].
    pub(crate) fn f64s<const N: usize>(&mut self, field: &'static str) -> Read<[f64; N]> {
        let mut values = [0.0; N];
        for value in &mut values {
            *value = self.f64(field)?;
        }
        Ok(values)
    }

    /// The number of elements that follow, each of at least `least_bytes`: never more than there are bytes for.
    ///
    /// # Errors
    /// The end of the bytes.
    pub fn count(&mut self, least_bytes: usize, field: &'static str) -> Read<usize> {
        let count = self.u32(field)? as usize;
        let left = self.bytes.len() - self.at;
        if count.checked_mul(least_bytes).is_none_or(|bytes| bytes > left) {
            return Err(ContentError::CutOff { field });
        }
        Ok(count)
    }

    /// Bytes with their number before them.
    ///
    /// # Errors
    /// The end of the bytes.
    pub fn bytes(&mut self, field: &'static str) -> Read<&'a [u8]> {
        let count = self.count(1, field)?;
        self.take(count, field)
    }

    /// A text.
    ///
    /// # Errors
    /// The end of the bytes, or bytes that are not text.
    pub fn text(&mut self, field: &'static str) -> Read<&'a str> {
        let mut bytes = self.bytes(field)?;
        if self.text_ends_in_zero
            && let [text @ .., last] = bytes
        {
            bytes = if *last == 0 { text } else { return Err(ContentError::NotText { field }) };
        }
        std::str::from_utf8(bytes).map_err(|_| ContentError::NotText { field })
    }

    /// The end of the message.
    ///
    /// # Errors
    /// More bytes than padding explains: the message is of another type.
    pub fn end(&self) -> Read<()> {
        let bytes = self.bytes.len() - self.at;
        if bytes <= self.padding { Ok(()) } else { Err(ContentError::TooLong { bytes }) }
    }
}
