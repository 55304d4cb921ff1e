//! The languages of robots, by name.

use super::waypoints::Waypoints;
use super::{krl, ls, rapid_path, table, urscript};

/// A language of robots.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Language {
    /// ABB.
    Rapid,
    /// KUKA.
    Krl,
    /// Universal Robots.
    UrScript,
    /// FANUC.
    Ls,
    /// A table of poses and times.
    Csv,
}

impl Language {
    /// All of them.
    pub const ALL: [Self; 5] = [Self::Rapid, Self::Krl, Self::UrScript, Self::Ls, Self::Csv];

    /// The name on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Rapid => "rapid",
            Self::Krl => "krl",
            Self::UrScript => "urscript",
            Self::Ls => "ls",
            Self::Csv => "csv",
        }
    }

    /// Name of the file that a controller expects.
    #[must_use]
    pub fn file_name(self) -> &'static str {
        match self {
            Self::Rapid => "TruelineScan.mod",
            Self::Krl => "trueline_scan.src",
            Self::UrScript => "trueline_scan.script",
            Self::Ls => "tl_scan.ls",
            Self::Csv => "waypoints.csv",
        }
    }

    /// Destination of that file.
    #[must_use]
    pub fn goes_to(self) -> &'static str {
        match self {
            Self::Rapid => "a task of the controller, by RobotStudio or FlexPendant (Load module)",
            Self::Krl => r"KRC:\R1\Program",
            Self::UrScript => "a Script node of PolyScope (From file)",
            Self::Ls => {
                "the controller's MD: device; it reads .LS with the option ASCII Upload, or after MakeTP"
            }
            Self::Csv => "any program that reads tables",
        }
    }

    /// The program for a path.
    #[must_use]
    pub fn program(self, path: &Waypoints) -> String {
        match self {
            Self::Rapid => rapid_path::program(path),
            Self::Krl => krl::program(path),
            Self::UrScript => urscript::program(path),
            Self::Ls => ls::program(path),
            Self::Csv => table::program(path),
        }
    }
}
