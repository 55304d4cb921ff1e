//! Why a result cannot place points while the robot runs.

/// Why a result cannot place points while it runs.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RunTimeError {
    /// The sensor file is another one.
    #[error("the sensor file is not the one that the result belongs to, {name}")]
    OtherSensorFile {
        /// The name of the one that it belongs to.
        name: String,
    },
    /// The result has no covariance of time offset and hand-eye transform.
    #[error("the result states no covariance of time offset and hand-eye transform")]
    NoCovariance,
    /// The time offset changes with time.
    #[error(
        "the clocks drift by {drift_ppm:.1} ppm against each other, so that the time offset held in the scan only"
    )]
    Drift {
        /// By how much, parts in a million.
        drift_ppm: f64,
    },
    /// An axis is not placed by the result.
    #[error("axis {name}: its place is missing in the result")]
    AxisUnknown {
        /// Its name.
        name: String,
    },
    /// An axis was named that the result does not have.
    #[error("there is no axis {name} in the result")]
    NoSuchAxis {
        /// Its name.
        name: String,
    },
}

impl RunTimeError {
    /// The remedy.
    #[must_use]
    pub fn hint(&self) -> &'static str {
        match self {
            Self::OtherSensorFile { .. } => {
                "take the sensor file that was calibrated, or calibrate again with this one"
            }
            Self::NoCovariance => {
                "take the JSON of `trueline calibrate --json` of a scan that shows all of them"
            }
            Self::Drift { .. } => {
                "let both clocks follow one (PTP, NTP), or stamp both streams on one PC; then calibrate again"
            }
            Self::AxisUnknown { .. } => {
                "scan while it moves; if it stands at the same place as in the scan, name it as standing"
            }
            Self::NoSuchAxis { .. } => "the names must be those of `axes` in the result",
        }
    }
}
