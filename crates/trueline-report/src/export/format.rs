//! One way to write a mounting.

use crate::export::mounting::Mounting;

/// Why a mounting cannot be written in a format.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Unsupported {
    /// The format has no place for the third radial coefficient of the lens.
    #[error("Kalibr's radtan has no k3, and the camera's is not zero")]
    ThirdRadialCoefficient,
    /// The format cannot do without the time offset.
    #[error("the time offset is not known")]
    NoTimeOffset,
}

/// Whom a format is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Group {
    /// Controllers of robots.
    Robot,
    /// ROS.
    Ros,
    /// Programs and programming languages.
    Program,
}

/// One way to write a mounting.
#[derive(Clone, Copy, Debug)]
pub struct Format {
    /// Its name on the command line.
    pub name: &'static str,
    /// Other names for it.
    pub aliases: &'static [&'static str],
    /// Its name in a report.
    pub title: &'static str,
    /// Whom it is for.
    pub group: Group,
    /// Units, order and axes, in words.
    pub convention: &'static str,
    pub(crate) write: fn(&Mounting) -> Result<String, Unsupported>,
}

impl Format {
    /// The text.
    ///
    /// # Errors
    /// Content that the format cannot hold.
    pub fn text(&self, mounting: &Mounting) -> Result<String, Unsupported> {
        (self.write)(mounting)
    }
}
