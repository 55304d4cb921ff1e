//! `<Sen>` without any correction: the one answer that is ever given to a controller.

use super::ethernet_config::EthernetConfig;
use super::ipoc::Ipoc;
use std::fmt::Write;

/// Elements that hold corrections, of the pose, the axes and the external axes, in KUKA's manuals and public drivers.
const CORRECTIONS: [&str; 6] = ["RKorr", "AKorr", "EKorr", "RK", "AK", "EK"];
/// Their attributes.
const POSE: [&str; 6] = ["X", "Y", "Z", "A", "B", "C"];
const AXES: [&str; 12] = ["A1", "A2", "A3", "A4", "A5", "A6", "E1", "E2", "E3", "E4", "E5", "E6"];

/// The answer of one configuration. All of it is fixed when it is made, except the count that it repeats: no correction can
/// be put into it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ZeroAnswer {
    before_ipoc: String,
    left_out: Vec<String>,
}

/// Why a controller is not answered.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NoAnswer {
    /// It awaits none.
    #[error("ONLYSEND is TRUE there: the controller awaits no answer")]
    OnlySends,
    /// It sends to another port than the PC listens at.
    #[error("PORT is {configured} there, and this PC listens at {bound}")]
    Port {
        /// The configured port.
        configured: u16,
        /// Port of the PC.
        bound: u16,
    },
}

impl ZeroAnswer {
    /// The answer for a controller with this configuration, which sends to a port: its name and a zero for every correction that it takes.
    /// Anything else that it takes is left out.
    ///
    /// # Errors
    /// A controller that awaits no answer, or sends to somebody else.
    pub fn of(config: &EthernetConfig, bound: u16) -> Result<Self, NoAnswer> {
        if config.only_sends {
            return Err(NoAnswer::OnlySends);
        }
        if config.port != bound {
            return Err(NoAnswer::Port { configured: config.port, bound });
        }
        let (corrections, left_out): (Vec<_>, Vec<_>) =
            config.receives.iter().cloned().partition(|tag| is_correction(tag));
        let mut before_ipoc = format!("<Sen Type=\"{}\">", config.sentype);
        for element in CORRECTIONS {
            let of_it = corrections.iter().filter_map(|tag| tag.strip_prefix(element)?.strip_prefix('.'));
            let zeros = of_it.fold(String::new(), |mut zeros, attribute| {
                let _infallible = write!(zeros, " {attribute}=\"0.0\"");
                zeros
            });
            if !zeros.is_empty() {
                let _infallible = write!(before_ipoc, "<{element}{zeros}/>");
            }
        }
        before_ipoc.push_str("<IPOC>");
        Ok(Self { before_ipoc, left_out })
    }

    /// The answer to a message.
    #[must_use]
    pub(crate) fn to(&self, ipoc: &Ipoc) -> Vec<u8> {
        [self.before_ipoc.as_bytes(), ipoc.digits(), b"</IPOC></Sen>"].concat()
    }

    /// Elements that the controller reads but does not receive, if any.
    #[must_use]
    pub(crate) fn left_out(&self) -> Option<String> {
        let names = self.left_out.join(", ");
        (!names.is_empty())
            .then(|| format!("no value is sent for {names}: HOLDON sets the reaction of the controller"))
    }
}

fn is_correction(tag: &str) -> bool {
    tag.split_once('.').is_some_and(|(element, attribute)| {
        let attributes: &[&str] = if element.starts_with('R') { &POSE } else { &AXES };
        CORRECTIONS.contains(&element) && attributes.contains(&attribute)
    })
}
