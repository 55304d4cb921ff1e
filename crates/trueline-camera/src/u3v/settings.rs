//! Settings of a USB3 Vision camera.

use crate::setup::CameraSetup;

/// Choice and settings of a USB3 Vision camera.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct U3vSettings {
    /// Its serial number; `None` for the only one that is plugged in.
    pub serial: Option<String>,
    /// Its settings.
    pub setup: CameraSetup,
}
