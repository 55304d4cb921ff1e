//! A path as the program of a robot: RAPID, KRL, URScript, FANUC's LS, or a table.
//!
//! The robot moves by its own program, and the PC only listens. Every program approaches the first pose by a joint move, keeps the
//! path's own times, and says in its head that nobody has run it on a controller and that reach and collisions are not checked.

pub mod krl;
pub mod ls;
pub mod rapid_path;
pub mod table;
pub mod urscript;
pub mod waypoints;

pub use waypoints::{Waypoint, Waypoints};

/// What every program says of itself, a line each.
const WARNING: [&str; 4] = [
    "Written by trueline. NOT TRIED ON A REAL CONTROLLER: check it in the maker's simulation first,",
    "then run it slowly, with the enabling device in hand.",
    "Reach, singularities and collisions of the arm are not checked.",
    "The poses are those of the tool whose poses the calibration is relative to: keep that tool active.",
];

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
