//! Reasons that a drawing of a seam cannot be used with a scan.

/// Reason.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum CadProblem {
    /// A straight line.
    #[error("the CAD curve is straight to {:.3} mm: a straight seam does not need it", bends_m * 1e3)]
    Straight {
        /// Its deviation from a line, m.
        bends_m: f64,
    },
    /// Coordinates in another unit.
    #[error(
        "the CAD curve fits the scan to {:.2} mm if it is scaled by {factor}: {}",
        rms_m * 1e3, unit.words()
    )]
    OtherUnit {
        /// Factor by which it must be multiplied.
        factor: f64,
        /// The unit.
        unit: CadUnit,
        /// Its RMS distance after scaling, m.
        rms_m: f64,
    },
    /// The curve is shorter than the scanned one.
    #[error("the CAD curve is {:.1} mm long, but the scan covers {:.1} mm", length_m * 1e3, scanned_m * 1e3)]
    TooShort {
        /// Its length, m.
        length_m: f64,
        /// The length of the scan's, m.
        scanned_m: f64,
    },
    /// The curve differs from the scanned one.
    #[error(
        "the CAD curve does not fit the scan: at its best place it is {:.2} mm off (RMS; {:.2} mm at most; \
        tolerance {} mm)",
        rms_m * 1e3, worst_m * 1e3, tolerance_m * 1e3
    )]
    Off {
        /// RMS distance, m.
        rms_m: f64,
        /// The farthest, m.
        worst_m: f64,
        /// The tolerance, m.
        tolerance_m: f64,
    },
    /// The curve fits the scan's curve, but not the readings.
    #[error(
        "the CAD curve does not fit the seam points: their residuals are {times:.1} times those from a free \
        curve, and it is {:.2} mm off that curve (tolerance {} mm)",
        rms_m * 1e3, tolerance_m * 1e3
    )]
    NotTheReadings {
        /// Ratio of the residuals to those of a free curve.
        times: f64,
        /// RMS distance of the two curves, m.
        rms_m: f64,
        /// The tolerance, m.
        tolerance_m: f64,
    },
}

/// The probable unit of a drawing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CadUnit {
    /// Metres read as millimetres.
    Metres,
    /// Inches read as millimetres.
    Inches,
    /// Centimetres read as millimetres.
    Centimetres,
    /// Millimetres read as metres.
    NotMetres,
    /// Millimetres read as inches.
    NotInches,
    /// Millimetres read as centimetres.
    NotCentimetres,
}

impl CadUnit {
    /// All of them, each with the factor by which the drawing must be multiplied.
    pub const ALL: [(Self, f64); 6] = [
        (Self::Metres, 1000.0),
        (Self::Inches, 25.4),
        (Self::Centimetres, 10.0),
        (Self::NotMetres, 0.001),
        (Self::NotInches, 1.0 / 25.4),
        (Self::NotCentimetres, 0.1),
    ];

    fn words(self) -> &'static str {
        match self {
            Self::Metres => "its numbers are metres, read as millimetres",
            Self::Inches => "its numbers are inches, read as millimetres",
            Self::Centimetres => "its numbers are centimetres, read as millimetres",
            Self::NotMetres => "its numbers are millimetres, but the file states metres",
            Self::NotInches => "its numbers are millimetres, but the file states inches",
            Self::NotCentimetres => "its numbers are millimetres, but the file states centimetres",
        }
    }
}

impl CadProblem {
    /// Hint for the user.
    #[must_use]
    pub fn hint(&self) -> &'static str {
        match self {
            Self::Straight { .. } => {
                "leave --seam-cad out; --drawn-line holds a straight seam where a drawing has it"
            }
            Self::OtherUnit { .. } => {
                "name the unit in a CSV's header (x_mm, x_in, x_m), or export the DXF in millimetres with its unit ($INSUNITS)"
            }
            Self::TooShort { .. } => "export the whole seam; is its unit right?",
            Self::Off { .. } | Self::NotTheReadings { .. } => {
                "is this the drawing of this seam? If the part differs from it by that much, state \
                --cad-tolerance-mm; otherwise leave --seam-cad out"
            }
        }
    }
}
