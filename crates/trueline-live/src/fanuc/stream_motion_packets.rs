//! Packets of Stream Motion (J519), in its two forms: versions 1 and 2, and versions 3 and 4. Only the parts for a
//! listener.

use super::hspo::array;
use crate::frame_filter::PacketError;
use crate::zyx_angles;
use trueline_geometry::Pose;

/// Ends the stream, in both forms.
pub const STOP: u32 = 2;
/// Begins it, versions 1 and 2.
pub(crate) const START_OLD: u32 = 0;
/// Asks for the version, versions 1 and 2; the answer has it in its head.
pub(crate) const VERSION_REQUEST: u32 = 6;
/// Request for the controller's capabilities, versions 3 and 4; the answer has the same type.
pub(crate) const CAPABILITY: u32 = 7;
/// Begins it, versions 3 and 4.
pub const START: u32 = 200;
/// Selects the signals in the statuses, versions 3 and 4; the answer has the same type.
pub const SIGNALS: u32 = 203;
/// Status of versions 1 and 2.
pub(crate) const STATUS_OLD: u32 = 0;
/// Status of version 3.
pub(crate) const STATUS_3: u32 = 202;
/// Status of version 4.
pub(crate) const STATUS_4: u32 = 204;

/// A head alone: start, stop, version request.
#[must_use]
pub fn head(kind: u32, version: u32) -> Vec<u8> {
    words(&[kind, version])
}

/// Numbers of four bytes.
#[must_use]
pub fn words(words: &[u32]) -> Vec<u8> {
    words.iter().flat_map(|word| word.to_be_bytes()).collect()
}

/// A number of four bytes.
#[must_use]
pub fn word(bytes: &[u8], place: usize) -> Option<u32> {
    array(bytes, 4 * place).map(u32::from_be_bytes)
}

/// Capabilities of a controller.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Capability {
    /// Version to be used.
    pub version: u32,
    /// Time between statuses, ms.
    pub sampling_ms: u32,
    /// Poses are of the tool, not of the faceplate.
    pub tool: bool,
}

impl Capability {
    /// Reads an answer; `None` if it is not one.
    #[must_use]
    pub fn read(bytes: &[u8]) -> Option<Self> {
        let is_one = bytes.len() == 28 && word(bytes, 0) == Some(CAPABILITY);
        is_one.then_some(())?;
        Some(Self { sampling_ms: word(bytes, 3)?, version: word(bytes, 5)?, tool: word(bytes, 6)? == 1 })
    }
}

/// Content of a status.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Status {
    /// Counts the statuses.
    pub sequence: u32,
    /// ms.
    pub time_ms: u32,
    /// Some program streams motion: commands are awaited.
    pub awaits_commands: bool,
    /// In error or emergency stop, where the version tells.
    pub stopped: Option<&'static str>,
    /// `base_from_tool` or `base_from_flange`.
    pub pose: Pose,
    /// The signal field. In versions 3 and 4 it holds the requested signals ([`SIGNALS`]), or is meaningless if none were
    /// requested. In versions 1 and 2 it is `None` if no command named a signal.
    pub signals: Option<u64>,
}

/// Reads a status of any version.
///
/// # Errors
/// Another packet, or one that cannot be.
pub fn status(bytes: &[u8]) -> Result<Status, PacketError> {
    let length = PacketError::Length { found: bytes.len() };
    let kind = word(bytes, 0).ok_or(length)?;
    let (time_at, pose_at, signals_at) = match (kind, bytes.len()) {
        (STATUS_OLD, 132) => (20, 24, 13),
        (STATUS_3, 388) => (16, 20, 132),
        (STATUS_4, 416) => (16, 20, 160),
        (STATUS_OLD | STATUS_3 | STATUS_4, _) => return Err(length),
        (CAPABILITY | VERSION_REQUEST | SIGNALS, _) => {
            return Err(PacketError::NotNeeded("an answer about versions or signals"));
        }
        (found, _) => return Err(PacketError::Kind { found }),
    };
    let mut figures = [0.0; 6];
    for (k, figure) in figures.iter_mut().enumerate() {
        *figure = f64::from(f32::from_be_bytes(array(bytes, pose_at + 4 * k).ok_or(length)?));
    }
    let [x, y, z, w, p, r] = figures;
    let rotation = zyx_angles::from_wpr_deg([w, p, r]);
    Ok(Status {
        sequence: word(bytes, 2).ok_or(length)?,
        time_ms: u32::from_be_bytes(array(bytes, time_at).ok_or(length)?),
        awaits_commands: bytes[12] & 1 != 0,
        stopped: stopped(kind, bytes),
        pose: zyx_angles::pose_from_mm([x, y, z], rotation).ok_or(PacketError::NotFinite)?,
        signals: match kind {
            STATUS_OLD => signals_of_command(bytes, signals_at),
            // These alone are little endian.
            _ => array(bytes, signals_at).map(u64::from_le_bytes),
        },
    })
}

/// Versions 1 and 2 contain the signals named by a command: their type (0 is none), first number, mask and value.
fn signals_of_command(bytes: &[u8], at: usize) -> Option<u64> {
    let [mask, value] = [at + 3, at + 5].map(|at| array(bytes, at).map(u16::from_be_bytes));
    (bytes[at] != 0).then_some(u64::from(mask? & value?))
}

/// Versions 1 and 2 have no robot status, only "system ready" (bit 2).
fn stopped(kind: u32, bytes: &[u8]) -> Option<&'static str> {
    if kind == STATUS_OLD {
        return (bytes[12] & 4 == 0).then_some("not ready (SYSRDY is off)");
    }
    match bytes[13] {
        status if status & 4 != 0 => Some("emergency stop"),
        status if status & 1 != 0 => Some("in error"),
        _ => None,
    }
}
