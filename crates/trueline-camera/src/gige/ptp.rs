//! Whether the camera's clock follows another by IEEE 1588.

use crate::genicam::Features;

/// The state of the precision time protocol in the camera.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum PtpState {
    /// The camera does not have it.
    Unsupported,
    /// It is switched off.
    Off,
    /// The camera's clock follows that of the network.
    Slave,
    /// On, in another state, in the camera's words: its clock is no better than without.
    Other(String),
}

/// Switch, command that latches the state, and the state, by the present standard and by the one before.
const NAMES: [[&str; 3]; 3] = [
    ["PtpEnable", "PtpDataSetLatch", "PtpStatus"],
    ["GevIEEE1588", "GevIEEE1588DataSetLatch", "GevIEEE1588StatusLatched"],
    ["GevIEEE1588", "GevIEEE1588DataSetLatch", "GevIEEE1588Status"],
];

/// Reads the state.
pub(super) fn state(camera: &mut dyn Features) -> PtpState {
    let Some([switch, latch, status]) = NAMES
        .into_iter()
        .find(|[switch, _, status]| camera.has_feature(switch) && camera.has_feature(status))
    else {
        return PtpState::Unsupported;
    };
    match camera.get_boolean(switch) {
        Ok(true) => {}
        Ok(false) => return PtpState::Off,
        Err(refusal) => return PtpState::Other(refusal.error.to_string()),
    }
    if camera.has_feature(latch) {
        let _ = camera.execute(latch);
    }
    match camera.get_enum(status) {
        Ok(word) if word == "Slave" => PtpState::Slave,
        Ok(word) => PtpState::Other(word),
        Err(refusal) => PtpState::Other(refusal.error.to_string()),
    }
}
