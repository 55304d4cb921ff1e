//! Address of a live camera.

use std::net::Ipv4Addr;
use std::str::FromStr;
use trueline_cell::{CameraChoice, CameraSetup};

/// Address of a live camera: `192.168.1.64`, `usb:SERIAL`, `usb`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum CameraAddress {
    /// A GigE Vision camera at an address.
    GigE(Ipv4Addr),
    /// A USB3 Vision camera by its serial number, or the only one that is plugged in.
    #[cfg(feature = "u3v")]
    Usb(Option<String>),
}

impl CameraAddress {
    /// This camera, with something set.
    pub(crate) fn choice(&self, setup: CameraSetup) -> CameraChoice {
        match self {
            Self::GigE(address) => CameraChoice::GigE(*address, setup),
            #[cfg(feature = "u3v")]
            Self::Usb(serial) => CameraChoice::U3v(serial.clone(), setup),
        }
    }
}

impl FromStr for CameraAddress {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match (text, text.strip_prefix("usb:")) {
            ("usb", _) => usb(None),
            (_, Some("")) => {
                Err("expected a serial number behind usb: (or usb alone, for the only camera)".to_owned())
            }
            (_, Some(serial)) => usb(Some(serial)),
            _ => text.parse().map(Self::GigE).map_err(|_| {
                "expected the address of a GigE Vision camera (192.168.1.64), or usb:SERIAL".to_owned()
            }),
        }
    }
}

#[cfg(feature = "u3v")]
fn usb(serial: Option<&str>) -> Result<CameraAddress, String> {
    Ok(CameraAddress::Usb(serial.map(str::to_owned)))
}

#[cfg(not(feature = "u3v"))]
fn usb(_: Option<&str>) -> Result<CameraAddress, String> {
    Err("this program was built without USB3 Vision: build it with the feature `u3v`".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_camera_is_an_address_or_at_usb() {
        let gige = CameraAddress::GigE(Ipv4Addr::new(192, 168, 1, 64));
        assert_eq!("192.168.1.64".parse(), Ok(gige));
        for wrong in ["", "192.168.1", "usb:", "USB:1", "usb1", "::1"] {
            let told = wrong.parse::<CameraAddress>().err().unwrap_or_default();
            assert!(told.starts_with("expected"), "{wrong}: {told}");
        }
    }

    #[cfg(feature = "u3v")]
    #[test]
    fn usb_is_with_a_serial_number_or_without() {
        assert_eq!("usb".parse(), Ok(CameraAddress::Usb(None)));
        assert_eq!("usb:A:1".parse(), Ok(CameraAddress::Usb(Some("A:1".to_owned()))));
    }

    #[cfg(not(feature = "u3v"))]
    #[test]
    fn usb_is_refused_by_the_name_of_the_feature() {
        for text in ["usb", "usb:A1"] {
            let told = text.parse::<CameraAddress>().err().unwrap_or_default();
            assert!(told.contains("`u3v`"), "{told}");
        }
    }
}
