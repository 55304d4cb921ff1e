//! How large a picture may be, before memory is set aside for it.

/// More pixels are refused.
const MOST_PIXELS: usize = 1 << 28;
/// Deflate expands one byte to 1,032 at most, and the other codes of single-coloured pictures about as much: a larger claim
/// is a wrong size.
const MOST_EXPANSION: u64 = 1100;
/// Small pictures are accepted in any storage.
const SMALL: u64 = 1 << 20;

/// The bytes that a picture of that width and height, px, needs when it is decoded from `stored` bytes.
///
/// # Errors
/// A size that is invalid or too large, in words.
pub(crate) fn bytes([width, height]: [usize; 2], bytes_a_pixel: usize, stored: u64) -> Result<usize, String> {
    let pixels = width.checked_mul(height).filter(|&n| n > 0 && n <= MOST_PIXELS);
    let bytes = pixels.map(|pixels| pixels * bytes_a_pixel);
    let possible = SMALL.max(stored.saturating_mul(MOST_EXPANSION));
    match bytes {
        None => Err(format!("{width} x {height} pixels cannot be read")),
        Some(bytes) if bytes as u64 > possible => {
            Err(format!("{width} x {height} pixels do not come out of {stored} bytes"))
        }
        Some(bytes) => Ok(bytes),
    }
}
