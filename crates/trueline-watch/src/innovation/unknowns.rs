//! Positions of a weld's unknowns: θ, four of each seam, two of each seam's bow. With whole stripes, the plates
//! follow, each with its roll about the seam and its surface.

use super::linearized::{BOW, LOCAL, SEAM};
use crate::parameters::CALIBRATION;
use trueline_model::Plate;

/// Roll and surface of a plate.
const PLATE: usize = 1 + Plate::SURFACE;
/// Number of local columns of a stripe: those of a feature and of its plate.
pub(crate) const LOCAL_OF_STRIPE: usize = LOCAL + PLATE;

/// The unknowns of a weld.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Unknowns {
    /// Number of seams.
    pub seams: usize,
    /// Whether plates are included.
    pub plates: bool,
}

impl Unknowns {
    /// Their number.
    pub(crate) const fn size(self) -> usize {
        self.first_plate() + if self.plates { 2 * PLATE * self.seams } else { 0 }
    }

    /// First column of a seam's bow.
    pub(crate) const fn bow(self, seam: usize) -> usize {
        CALIBRATION + 4 * self.seams + 2 * seam
    }

    const fn first_plate(self) -> usize {
        CALIBRATION + 6 * self.seams
    }

    /// Columns of the roll of every plate; its surface follows.
    pub(crate) fn rolls(self) -> impl Iterator<Item = usize> {
        (self.first_plate()..self.size()).step_by(PLATE)
    }

    /// Position of a seam's local column among all.
    pub(crate) const fn place(self, local: usize, seam: usize, plate: usize) -> usize {
        if local < SEAM {
            local
        } else if local < BOW {
            CALIBRATION + 4 * seam + local - SEAM
        } else if local < LOCAL {
            self.bow(seam) + local - BOW
        } else {
            self.first_plate() + PLATE * (2 * seam + plate) + local - LOCAL
        }
    }
}
