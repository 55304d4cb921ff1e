//! What is asked of a GigE Vision camera.

use crate::setup::CameraSetup;
use std::net::Ipv4Addr;

/// Which GigE Vision camera, and what is asked of it.
#[derive(Clone, Debug, PartialEq)]
pub struct GigeSettings {
    /// Its address.
    pub address: Ipv4Addr,
    /// Packet size on the wire, bytes; `None` asks for the largest that the network carries.
    pub packet_size: Option<u16>,
    /// What is set on it.
    pub setup: CameraSetup,
}

impl GigeSettings {
    /// Pictures from the camera at an address, as it is set, but for its triggers, which are off.
    #[must_use]
    pub fn at(address: Ipv4Addr) -> Self {
        Self { address, packet_size: None, setup: CameraSetup::default() }
    }
}
