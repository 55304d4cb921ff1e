//! What is asked of a USB3 Vision camera.

use crate::setup::CameraSetup;

/// Which USB3 Vision camera, and what is asked of it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct U3vSettings {
    /// Its serial number; `None` for the only one that is plugged in.
    pub serial: Option<String>,
    /// What is set on it.
    pub setup: CameraSetup,
}
