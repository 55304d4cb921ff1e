//! Reasons for missing pictures, and their remedies.

/// A camera that gives no pictures that can be used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CameraError {
    /// Nothing answers.
    #[error("no camera answers at {at}")]
    NotFound {
        /// Place of the search.
        at: String,
    },
    /// Another program has it.
    #[error("the camera at {at} is controlled by another program")]
    Busy {
        /// Its address.
        at: String,
    },
    /// It answered once and no longer does.
    #[error("the camera no longer answers; no picture has come for {silent_s:.1} s")]
    Unplugged {
        /// Since the last of a picture came (a packet, or a picture), or since the start if there was none, s.
        silent_s: f64,
    },
    /// An unexpected pixel format.
    #[error("pictures are required as {wanted}, the camera offers {offered}")]
    Format {
        /// The wanted value.
        wanted: String,
        /// The available ones.
        offered: String,
    },
    /// Pictures with colours, without a stated colour of the laser.
    #[error("the camera sends {format}, but the laser's colour is not stated")]
    NoChannel {
        /// The format.
        format: String,
    },
    /// The laser's colour was stated, but pictures have none.
    #[error("the laser's colour was given, and the camera sends {format}, which has no colours")]
    NoColours {
        /// The format.
        format: String,
    },
    /// Pictures of another size than at the start.
    #[error("pictures were {} x {} pixels and now are {} x {}", was[0], was[1], is[0], is[1])]
    FrameSizeChanged {
        /// Columns and rows at the start, px.
        was: [u32; 2],
        /// Columns and rows now, px.
        is: [u32; 2],
    },
    /// An automatic came back on after it was turned off.
    #[error("`{feature}` is on again: {value}")]
    ExposureAuto {
        /// The camera's name for it.
        feature: String,
        /// Its setting.
        value: String,
    },
    /// A feature of the camera that cannot be set or read.
    #[error("camera feature `{name}`: {why}")]
    Feature {
        /// The camera's name for it.
        name: String,
        /// Message of the camera.
        why: String,
    },
    /// A device of Video4Linux that gives no pictures, or other ones than requested.
    #[error("{device}: {why}")]
    Video {
        /// Its file.
        device: String,
        /// The fault.
        why: String,
    },
    /// No such camera at USB.
    #[error("no USB3 Vision camera {}is plugged in{}", wanted(serial.as_deref()), others(found))]
    NotPluggedIn {
        /// The requested serial number; `None` for any.
        serial: Option<String>,
        /// Serial numbers of the cameras that are there.
        found: Vec<String>,
    },
    /// A USB camera that gives no pictures, or other ones than requested.
    #[error("{device}: {why}")]
    Usb {
        /// Maker, model and serial number, as far as known.
        device: String,
        /// The fault.
        why: String,
    },
    /// A recording that cannot be replayed.
    #[error(transparent)]
    Recording(#[from] trueline_dataset::Error),
    /// The operating system refused.
    #[error("network: {0}")]
    Io(#[from] std::io::Error),
}

fn wanted(serial: Option<&str>) -> String {
    serial.map_or_else(String::new, |serial| format!("with the serial number {serial} "))
}

fn others(found: &[String]) -> String {
    if found.is_empty() { String::new() } else { format!("; there are {}", found.join(", ")) }
}

impl CameraError {
    /// Remedy for the user.
    #[must_use]
    pub fn hint(&self) -> String {
        match self {
            Self::NotFound { .. } => {
                "check power, cable and address: camera and adapter must be in the same \
                subnet, and no firewall may hold back UDP port 3956"
                    .to_owned()
            }
            Self::Busy { .. } => {
                "close the maker's viewer or the other program; after a crash the camera frees \
                itself within some seconds"
                    .to_owned()
            }
            Self::Unplugged { .. } => {
                "check power, cable and the switch or hub between; the recording so far is kept".to_owned()
            }
            Self::Format { .. } => {
                "choose one of the formats that the camera offers, and let no other program \
                change it during a scan"
                    .to_owned()
            }
            Self::NoChannel { .. } => "choose red, green or blue (gray uses all three), or a format without \
                colours".to_owned(),
            Self::NoColours { .. } => "leave the colour out, or choose a format with colours (BayerRG8, RGB8, …)".to_owned(),
            Self::FrameSizeChanged { .. } => "leave width, height and binning alone during a scan: the \
                calibration of the camera holds for one size"
                .to_owned(),
            Self::ExposureAuto { feature, .. } => format!(
                "turn `{feature}` off and keep it off: the instant of an exposure moves with its length"
            ),
            Self::Feature { .. } => "see the camera's manual for the allowed values".to_owned(),
            Self::Video { .. } => "`v4l2-ctl --list-devices` and `v4l2-ctl -d DEVICE --list-formats-ext` \
                list devices and formats; your user must be in the group of the device's file (video)"
                .to_owned(),
            Self::NotPluggedIn { .. } => "check plug, cable and power; the serial number is on the camera, and in `lsusb -v` as iSerial".to_owned(),
            Self::Usb { .. } => "close other programs that use the camera; your user must be allowed to open it (on Linux by a udev rule, on \
                Windows it needs the WinUSB driver)"
                .to_owned(),
            Self::Recording(error) => error.hint(),
            Self::Io(error) if error.kind() == std::io::ErrorKind::AddrInUse => {
                "another program on this machine uses the address".to_owned()
            }
            Self::Io(_) => "check the network adapter".to_owned(),
        }
    }
}
