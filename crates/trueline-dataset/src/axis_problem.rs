//! Faults of the files of external axes, and their remedies.

/// Why files of external axes cannot be used.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum AxisProblem {
    /// Values of axes without a description.
    #[error("has no `[[axis]]`, but axes.csv exists: state name, kind and what each axis carries")]
    NotDescribed,
    /// Values of an axis in a file of its own and in the file of all.
    #[error("has values of an axis, and axes.csv is there as well")]
    InTwoFiles,
    /// A file of an axis without a description.
    #[error("has values of an axis that cell.toml does not name")]
    OfFileNotDescribed,
    /// An axis that is described and has no values.
    #[error("is not there, and cell.toml has axis `{name}`")]
    WithoutValues {
        /// Its name.
        name: String,
    },
    /// Files of axes beside one of several sensors.
    #[error("is in the folder of one sensor, and the robot of all sensors is beside `sensors`")]
    BesideSensor,
    /// An axis that goes too far from one value to the next.
    #[error(
        "the axis jumps by {step} within {in_s} s: values in the wrong unit, or an angle that wraps around?"
    )]
    Jumps {
        /// How far, with its unit.
        step: String,
        /// In which time.
        in_s: f64,
    },
    /// A reading without a value of an axis.
    #[error("axis `{name}` has values from {from_s} s to {to_s} s only, but there is a reading at {at_s} s")]
    WithoutValue {
        /// Its name.
        name: String,
        /// When something was read.
        at_s: f64,
        /// Its first value.
        from_s: f64,
        /// Its last.
        to_s: f64,
    },
}

impl AxisProblem {
    /// Remedy for the user.
    #[must_use]
    pub fn hint(&self) -> &'static str {
        match self {
            Self::NotDescribed => {
                "cell.toml: [[axis]] name = \"table\", kind = \"rotary\" or \"linear\", carries = \"part\", \"robot\" or \"sensor\""
            }
            Self::InTwoFiles => {
                "leave one of the two out: all axes in axes.csv, or each in its axis-NAME.csv"
            }
            Self::OfFileNotDescribed => "the file is called axis-NAME.csv, by the name in cell.toml",
            Self::WithoutValues { .. } => {
                "write its values: axes.csv with time_s,NAME_deg (or NAME_mm), or a file axis-NAME.csv for each axis"
            }
            Self::BesideSensor => {
                "put cell.toml and axes.csv beside robot.csv: the axes are those of all sensors"
            }
            Self::Jumps { .. } => {
                "angles continue beyond 180°: write 190, not -170; the unit is part of the column's name"
            }
            Self::WithoutValue { .. } => {
                "the axis must be logged over the whole scan, with the robot's clock; leave out the \
                readings where it was not"
            }
        }
    }
}
