//! Settings of a GigE Vision camera.

use crate::setup::CameraSetup;
use std::net::Ipv4Addr;

/// Choice and settings of a GigE Vision camera.
#[derive(Clone, Debug, PartialEq)]
pub struct GigeSettings {
    /// Its address.
    pub address: Ipv4Addr,
    /// Packet size on the wire, bytes; `None` asks for the largest that the network carries.
    pub packet_size: Option<u16>,
    /// Its settings.
    pub setup: CameraSetup,
}

impl GigeSettings {
    /// Pictures from the camera at an address, with its present settings, but its triggers off.
    #[must_use]
    pub fn at(address: Ipv4Addr) -> Self {
        Self { address, packet_size: None, setup: CameraSetup::default() }
    }
}
