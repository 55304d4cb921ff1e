//! Whether the lengths inside a record fit into it: the reader of records allocates memory by them.

use mcap::records::op;

/// Part of a record's body.
#[derive(Clone, Copy)]
enum Part {
    /// A fixed number of bytes.
    Fixed(usize),
    /// A length in 32 bits, and as many bytes: a text, a list, or a table of numbers.
    Text,
    /// A length in 32 bits, and in that many bytes texts, two and two.
    Words,
    /// A length in 64 bits, and as many bytes.
    Data,
}

use Part::{Data, Fixed, Text, Words};

/// Parts of a record, by the specification of MCAP. Other records are not read.
const fn layout(opcode: u8) -> &'static [Part] {
    match opcode {
        op::HEADER => &[Text, Text],
        op::SCHEMA => &[Fixed(2), Text, Text, Text],
        op::CHANNEL => &[Fixed(4), Text, Text, Words],
        op::MESSAGE => &[Fixed(22)],
        op::MESSAGE_INDEX => &[Fixed(2), Text],
        op::CHUNK_INDEX => &[Fixed(32), Text, Fixed(8), Text, Fixed(16)],
        op::ATTACHMENT => &[Fixed(16), Text, Text, Data, Fixed(4)],
        op::ATTACHMENT_INDEX => &[Fixed(40), Text, Text],
        op::METADATA => &[Text, Words],
        op::METADATA_INDEX => &[Fixed(16), Text],
        op::STATISTICS => &[Fixed(42), Text],
        _ => &[],
    }
}

/// Whether a record's body is complete by its own statements.
#[must_use]
pub(super) fn fit(opcode: u8, body: &[u8]) -> bool {
    behind(opcode, body).is_some()
}

/// Whether a record is longer than its content. Then its length may have been altered, and lead past other records. Of a
/// message the rest is its data, and other records are not known.
#[must_use]
pub(super) fn are_exceeded(opcode: u8, body: &[u8]) -> bool {
    let is_known = opcode != op::MESSAGE && !layout(opcode).is_empty();
    is_known && behind(opcode, body).is_some_and(|rest| !rest.is_empty())
}

/// Bytes of a record's body behind its parts; `None` if they do not fit.
fn behind(opcode: u8, body: &[u8]) -> Option<&[u8]> {
    layout(opcode).iter().try_fold(body, |rest, part| after(*part, rest))
}

/// Bytes after a part; `None` if it does not fit.
fn after(part: Part, rest: &[u8]) -> Option<&[u8]> {
    match part {
        Fixed(bytes) => rest.get(bytes..),
        Text => Some(text(rest)?.1),
        Words => {
            let (mut words, rest) = text(rest)?;
            while !words.is_empty() {
                words = text(words)?.1;
            }
            Some(rest)
        }
        Data => {
            let (length, rest) = rest.split_first_chunk::<8>()?;
            rest.get(usize::try_from(u64::from_le_bytes(*length)).ok()?..)
        }
    }
}

/// A text and the bytes after it.
fn text(rest: &[u8]) -> Option<(&[u8], &[u8])> {
    let (length, rest) = rest.split_first_chunk::<4>()?;
    rest.split_at_checked(usize::try_from(u32::from_le_bytes(*length)).ok()?)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A channel of topic "ab", encoding "c" and the word "k" = "v".
    fn channel() -> Vec<u8> {
        let mut body = vec![1, 0, 2, 0];
        for text in [b"ab".as_slice(), b"c"] {
            body.extend((text.len() as u32).to_le_bytes());
            body.extend(text);
        }
        body.extend(10_u32.to_le_bytes());
        body.extend([1, 0, 0, 0, b'k', 1, 0, 0, 0, b'v']);
        body
    }

    #[test]
    fn a_whole_record_fits_and_a_shorter_one_does_not() {
        let body = channel();
        assert!(fit(op::CHANNEL, &body));
        assert!((0..body.len()).all(|length| !fit(op::CHANNEL, &body[..length])));
    }

    #[test]
    fn a_record_that_goes_on_behind_its_parts_is_seen() {
        let mut body = channel();
        assert!(!are_exceeded(op::CHANNEL, &body));
        body.push(0);
        assert!(fit(op::CHANNEL, &body) && are_exceeded(op::CHANNEL, &body));
        assert!(!are_exceeded(op::MESSAGE, &[0; 30]) && !are_exceeded(0x80, &[0; 30]));
    }

    #[test]
    fn a_length_that_leads_out_of_the_record_is_seen_wherever_it_is() {
        let body = channel();
        // The four lengths, and that of the second word.
        for at in [4, 10, 15, 19, 24] {
            let mut altered = body.clone();
            altered[at + 3] = 0xf0;
            assert!(!fit(op::CHANNEL, &altered), "length at byte {at}");
        }
    }
}
