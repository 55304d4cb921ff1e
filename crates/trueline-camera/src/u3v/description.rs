//! The description of a camera's features, out of its memory.

use super::link::Link;
use crate::error::CameraError;
use std::time::{Duration, Instant};
use telegenic::GenicamError;
use telegenic::genicam::unzip;
use viva_u3v::{U3vError, UsbTransfer};

/// The table of files: how many, then an entry for each \[GenCP 1.2, tables 29 and 30\].
const ENTRIES_AT: u64 = 8;
const ENTRY_BYTES: u64 = 64;
/// Of an entry: kind and form, address, and size.
const ENTRY_USED: usize = 24;
/// A device with more files has the description among the first.
const MOST_ENTRIES: u64 = 16;
/// No description of a camera is longer.
const MOST_BYTES: u64 = 8 << 20;
/// It is read in pieces, and all of it within this.
const PIECE: usize = 1 << 14;
const LONGEST: Duration = Duration::from_secs(30);
const ZIP: &[u8] = b"PK\x03\x04";

/// Reads the description.
///
/// # Errors
/// A table or a file that is invalid, in words; a device that does not answer.
pub(super) fn read<T: UsbTransfer + 'static>(link: &Link<T>, device: &str) -> Result<String, CameraError> {
    let refused =
        |why: &str| CameraError::Usb { device: device.to_owned(), why: format!("description: {why}") };
    let failed = |error: U3vError| refused(&error.to_string());
    let table = link.abrm().manifest_table_address;
    let count = link.read(table, 8).map_err(failed)?;
    let count = word(&count, 0).min(MOST_ENTRIES);
    for number in 0..count {
        let at =
            table.checked_add(ENTRIES_AT + number * ENTRY_BYTES).ok_or_else(|| refused("no such memory"))?;
        let entry = link.read(at, ENTRY_USED).map_err(failed)?;
        // The lowest three bits state its content, six others its form.
        let kind = word(&entry, 0) >> 32;
        let (is_device, form) = (kind & 7 == 0, kind >> 10 & 0x3f);
        if !is_device || form > 1 {
            continue;
        }
        let (address, length) = (word(&entry, 8), word(&entry, 16));
        if !(1..=MOST_BYTES).contains(&length) {
            return Err(refused(&format!("it states a length of {length} bytes")));
        }
        let file = file(link, address, length as usize).map_err(failed)?;
        let is_zip = form == 1 || file.starts_with(ZIP);
        let xml = if is_zip { unzip(&file).map_err(|error| refused(&why(&error)))? } else { file };
        return Ok(String::from_utf8_lossy(&xml).trim_end_matches('\0').to_owned());
    }
    Err(refused("the device's table of files has none"))
}

/// Fault of an archive, without the word for its content.
fn why(error: &GenicamError) -> String {
    match error {
        GenicamError::Xml(why) => why.clone(),
        other => other.to_string(),
    }
}

/// The eight bytes from one on; missing ones are zero.
fn word(bytes: &[u8], at: usize) -> u64 {
    bytes.get(at..).and_then(|rest| rest.first_chunk::<8>()).map_or(0, |bytes| u64::from_le_bytes(*bytes))
}

fn file<T: UsbTransfer + 'static>(link: &Link<T>, address: u64, length: usize) -> Result<Vec<u8>, U3vError> {
    let begin = Instant::now();
    let mut file = Vec::with_capacity(length);
    while file.len() < length {
        if begin.elapsed() > LONGEST {
            return Err(U3vError::Timeout);
        }
        let at = address.checked_add(file.len() as u64);
        let at = at.ok_or(U3vError::Device("states an address of a file outside its memory"))?;
        file.extend(link.read(at, PIECE.min(length - file.len()))?);
    }
    Ok(file)
}
