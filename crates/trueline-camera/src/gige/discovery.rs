//! Discovery of cameras.

use crate::error::CameraError;
use crate::genicam::driver;
use std::net::Ipv4Addr;
use std::time::Duration;
use telegenic::gige::discovery::{DiscoveryConfig, NetworkAdapter, discover as ask};

/// A network adapter of this machine.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Adapter {
    /// The operating system's name for it.
    pub name: String,
    /// Its address.
    pub address: Ipv4Addr,
    /// Its subnet mask.
    pub netmask: Ipv4Addr,
    /// Address of a question to all cameras.
    pub broadcast: Ipv4Addr,
}

/// A camera that answered.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FoundCamera {
    /// Its address.
    pub address: Ipv4Addr,
    /// Maker.
    pub maker: String,
    /// Model.
    pub model: String,
    /// Serial number.
    pub serial: String,
    /// The name that its user gave it.
    pub user_name: String,
    /// Hardware address.
    pub mac: [u8; 6],
    /// The adapter that it answered on.
    pub adapter: String,
    /// Whether it can be used as it is. An address of another subnet answers only this question.
    pub reachable: bool,
}

/// Asks on one adapter, or on all but loopback, and waits so long for answers: cameras may take up to a second.
///
/// # Errors
/// No adapter that can be asked on.
pub fn discover(adapter: Option<&Adapter>, wait: Duration) -> Result<Vec<FoundCamera>, CameraError> {
    let adapters = adapter.map(|adapter| {
        vec![NetworkAdapter {
            name: adapter.name.clone(),
            ip: adapter.address,
            netmask: adapter.netmask,
            broadcast: adapter.broadcast,
        }]
    });
    // On loopback no address is wrong.
    let limited_broadcast = adapter.is_none_or(|adapter| !adapter.address.is_loopback());
    let config =
        DiscoveryConfig { adapters, recv_window: wait, limited_broadcast, ..DiscoveryConfig::default() };
    let found = ask(&config).map_err(|error| driver("discovery", &error))?;
    let cameras = found.into_iter().map(|device| {
        let reachable = telegenic::gige::discovery::is_reachable(&device);
        FoundCamera {
            address: device.info.ip,
            maker: device.info.manufacturer,
            model: device.info.model,
            serial: device.info.serial,
            user_name: device.info.user_defined_name,
            mac: device.info.mac,
            adapter: device.adapter.name,
            reachable,
        }
    });
    Ok(cameras.collect())
}
