//! What robots speak.

use clap::ValueEnum;

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ProtocolName {
    /// ABB's Externally Guided Motion: the robot speaks first (UDP)
    Egm,
    /// Universal Robots' RTDE: the PC calls (TCP 30004)
    UrRtde,
    /// FANUC's High Speed Position Output: the robot speaks first (UDP)
    FanucHspo,
    /// FANUC's Stream Motion, J519: the PC asks (UDP 60015)
    FanucStreamMotion,
    /// KUKA's Robot Sensor Interface with ONLYSEND: the robot speaks first (UDP)
    KukaRsi,
}

impl ProtocolName {
    /// Port at which the controller listens, if the PC speaks first.
    pub fn controllers_port(self) -> Option<u16> {
        match self {
            Self::UrRtde => Some(trueline_live::ur::PORT),
            Self::FanucStreamMotion => Some(trueline_live::fanuc::STREAM_MOTION_PORT),
            Self::Egm | Self::FanucHspo | Self::KukaRsi => None,
        }
    }
}
