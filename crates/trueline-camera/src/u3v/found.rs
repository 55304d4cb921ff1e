//! Looking for a camera at USB.

use super::errors::of_device;
use crate::error::CameraError;
use viva_u3v::{NusbTransfer, U3vDeviceInfo, discover};

/// Opens the camera with a serial number, or the only one; returns the serial number of its plug.
///
/// # Errors
/// None that fits, several, or one that cannot be opened.
pub(super) fn open(serial: Option<&str>) -> Result<(NusbTransfer, Option<String>), CameraError> {
    let all = discover().map_err(|error| of_device("usb", "looking for cameras", &error))?;
    let camera = choose(&all, serial)?;
    let usb = NusbTransfer::open(camera);
    let usb = usb.map_err(|error| of_device(&name(camera), "it cannot be opened", &error))?;
    Ok((usb, camera.serial.clone()))
}

fn choose<'a>(all: &'a [U3vDeviceInfo], serial: Option<&str>) -> Result<&'a U3vDeviceInfo, CameraError> {
    let fits = |camera: &&U3vDeviceInfo| serial.is_none() || camera.serial.as_deref() == serial;
    let mut fitting = all.iter().filter(fits);
    let found = || all.iter().map(name).collect::<Vec<_>>();
    match (fitting.next(), fitting.next()) {
        (Some(camera), None) => Ok(camera),
        (None, _) => Err(CameraError::NotPluggedIn { serial: serial.map(str::to_owned), found: found() }),
        (Some(_), Some(_)) => {
            let why = format!("several cameras fit: {}; name one by its serial number", found().join(", "));
            Err(CameraError::Usb { device: "usb".to_owned(), why })
        }
    }
}

fn name(camera: &U3vDeviceInfo) -> String {
    match (&camera.serial, &camera.model) {
        (Some(serial), Some(model)) => format!("{serial} ({model})"),
        (Some(serial), None) => serial.clone(),
        (None, _) => camera.to_string(),
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;

    fn camera(serial: Option<&str>) -> U3vDeviceInfo {
        U3vDeviceInfo {
            bus: "001".to_owned(),
            address: 7,
            vendor_id: 0x1234,
            product_id: 0x5678,
            serial: serial.map(str::to_owned),
            manufacturer: None,
            model: Some("Eye".to_owned()),
            speed: None,
        }
    }

    #[test]
    fn a_camera_is_chosen_by_its_serial_number_or_if_it_is_the_only_one() {
        let two = [camera(Some("A1")), camera(Some("A2"))];
        assert_eq!(choose(&two, Some("A2")).unwrap().serial.as_deref(), Some("A2"));
        assert_eq!(choose(&two[..1], None).unwrap().serial.as_deref(), Some("A1"));
        let told = |all: &[U3vDeviceInfo], serial| choose(all, serial).unwrap_err().to_string();
        assert_eq!(told(&[], None), "no USB3 Vision camera is plugged in");
        let expected =
            "no USB3 Vision camera with the serial number A is plugged in; there are A1 (Eye), A2 (Eye)";
        assert_eq!(told(&two, Some("A")), expected, "the beginning of a number is not the number");
        assert!(told(&two, None).contains("several cameras fit: A1 (Eye), A2 (Eye)"));
        assert!(told(&[camera(Some("A1")), camera(Some("A1"))], Some("A1")).contains("several"));
        assert!(told(&[camera(None)], Some("A1")).contains("1234:5678"), "one without a serial number");
    }
}
