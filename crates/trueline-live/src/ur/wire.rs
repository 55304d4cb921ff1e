//! Packages of RTDE: size, kind, payload, all big endian. TCP may split and glue them at will.

/// `V`: the version of the protocol.
pub const VERSION: u8 = b'V';
/// `v`: the controller's software.
pub(crate) const CONTROLLER: u8 = b'v';
/// `M`: words, either way at any time.
pub const TEXT: u8 = b'M';
/// `O`: the fields wanted.
pub const OUTPUTS: u8 = b'O';
/// `I`: the fields to be written; we never do.
pub(crate) const INPUTS: u8 = b'I';
/// `S`: begin.
pub const START: u8 = b'S';
/// `P`: pause.
pub(crate) const PAUSE: u8 = b'P';
/// `U`: the fields.
pub const DATA: u8 = b'U';

/// Bytes of size and kind.
const HEAD: usize = 3;

/// A package.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Package<'a> {
    /// Its kind, a letter.
    pub kind: u8,
    /// The content after the head.
    pub payload: &'a [u8],
    /// All of it.
    pub whole: &'a [u8],
}

/// A size that cannot be.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("a package of {size} bytes; three are the least: this is not RTDE")]
pub struct BadSize {
    /// Its stated size.
    pub size: u16,
}

/// A package to be sent.
///
/// # Panics
/// Never: the caller's types keep it below the longest package.
#[must_use]
pub fn package(kind: u8, payload: &[u8]) -> Vec<u8> {
    let size = u16::try_from(HEAD + payload.len()).unwrap_or(u16::MAX);
    let mut bytes = Vec::with_capacity(HEAD + payload.len());
    bytes.extend(size.to_be_bytes());
    bytes.push(kind);
    bytes.extend(payload);
    bytes
}

/// The first package of the received bytes, if it is whole.
///
/// # Errors
/// [`BadSize`]: the stream cannot be followed any further.
pub fn first(bytes: &[u8]) -> Result<Option<Package<'_>>, BadSize> {
    let [high, low, kind, ..] = bytes else { return Ok(None) };
    let size = u16::from_be_bytes([*high, *low]);
    if usize::from(size) < HEAD {
        return Err(BadSize { size });
    }
    let Some(whole) = bytes.get(..usize::from(size)) else { return Ok(None) };
    Ok(Some(Package { kind: *kind, payload: &whole[HEAD..], whole }))
}

/// Words of protocol 2: severity (0 exception, 1 error, 2 warning, 3 information) and message.
#[must_use]
pub fn text(payload: &[u8]) -> Option<(u8, String)> {
    let (length, rest) = payload.split_first()?;
    let (words, rest) = rest.split_at_checked(usize::from(*length))?;
    let (length, rest) = rest.split_first()?;
    let level = rest.get(usize::from(*length))?;
    Some((*level, String::from_utf8_lossy(words).into_owned()))
}
