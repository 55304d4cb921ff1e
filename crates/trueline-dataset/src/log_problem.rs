//! Faults of another program's log, and their remedies.

use crate::unit::MM_PER_M;

/// Why a log of another program cannot be used as it is.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LogProblem {
    /// A column that the user mapped is not there.
    #[error(
        "there is no column `{theirs}`, which the map names for {ours}{}; the header has: {found}",
        meant.as_ref().map(|name| format!(" (`{name}` is the most similar)")).unwrap_or_default()
    )]
    MappedColumnMissing {
        /// Our name.
        ours: String,
        /// The user's name.
        theirs: String,
        /// The most similar name of the header.
        meant: Option<String>,
        /// Whether the user wrote theirs=ours.
        reversed: bool,
        /// The header as found.
        found: String,
    },
    /// An axis with values that could be angles or lengths.
    #[error("axis `{name}`: column `{theirs}` names no unit")]
    AxisWithoutUnit {
        /// Its name.
        name: String,
        /// Its column.
        theirs: String,
    },
    /// An axis with two contradicting descriptions.
    #[error("axis `{name}` has {what} in cell.toml, but --axis states something else")]
    AxisContradicts {
        /// Its name.
        name: String,
        /// The statement there.
        what: String,
    },
    /// An axis that is described, and no column is named for it.
    #[error("cell.toml has axis `{name}`, and no --axis names its column")]
    AxisNotNamed {
        /// Its name.
        name: String,
    },
    /// Axes in columns of the log and in a file of their own.
    #[error("is there, and --axis names columns of the log as well")]
    AxesTwice,
    /// Rows without a line of names before them.
    #[error("no header line: the file begins with a row of {columns}")]
    NoNames {
        /// Cells of the first row.
        columns: usize,
    },
    /// More or fewer names than columns.
    #[error("`--columns` names {named} columns, and the rows have {found}")]
    NamesDiffer {
        /// How many the user named.
        named: usize,
        /// Their number.
        found: usize,
    },
    /// A cell of another kind than those above it.
    #[error("expected {like}, found `{text}`")]
    NotATime {
        /// The cell.
        text: String,
        /// Form of the first one.
        like: &'static str,
    },
    /// A date with interchangeable day and month.
    #[error("day and month of `{text}` are ambiguous")]
    AmbiguousDate {
        /// The cell.
        text: String,
    },
    /// More values in a row than the stated positions have room for.
    #[error("{found} values, but a start of {first_mm} mm and a pitch of {step_mm} mm require {expected}")]
    MoreValues {
        /// Values of the row.
        found: usize,
        /// Heights of a row that begins and ends at the same distance from the middle.
        expected: usize,
        /// Position of the first, mm.
        first_mm: f64,
        /// Distance of two, mm.
        step_mm: f64,
    },
    /// Fewer stamps than profiles, and not one for every several.
    #[error("{stamps} stamps for {profiles} profiles")]
    StampsDiffer {
        /// How many stamps there are.
        stamps: usize,
        /// Number of profiles.
        profiles: usize,
    },
    /// A YAML file of a camera, in place of a sensor with its laser plane.
    #[error("is a camera without its laser plane")]
    CameraAlone {
        /// The camera as sensor.toml has it.
        toml: String,
    },
    /// A YAML file of a camera without the size of its pictures.
    #[error("is a camera without the size of its pictures")]
    CameraWithoutSize,
    /// Positions that no robot has.
    #[error("the positions lie up to {} from the origin of the base", length(*furthest_m))]
    Reach {
        /// Distance of the furthest, m.
        furthest_m: f64,
    },
    /// Pictures whose names have several numbers that change.
    #[error("the names have several numbers that change, and their orders differ: `{one}`, `{other}`")]
    SeveralNumbers {
        /// A name.
        one: String,
        /// The next one by its last number.
        other: String,
    },
}

impl LogProblem {
    /// Remedy for the user.
    #[must_use]
    pub fn hint(&self) -> String {
        match self {
            Self::MappedColumnMissing { ours, theirs, reversed: true, .. } => {
                format!("the order is ours=theirs: --robot-map '{theirs}={ours}' (or --features-map)")
            }
            Self::MappedColumnMissing { ours, meant, .. } if ours.starts_with("axis ") => {
                let name = ours.trim_start_matches("axis ");
                format!("write --axis {name}_deg={} (or {name}_mm)", meant.as_deref().unwrap_or("COLUMN"))
            }
            Self::AxisWithoutUnit { name, theirs } => {
                format!("does it turn or shift? --axis {name}_deg={theirs}, or --axis {name}_mm={theirs}")
            }
            Self::AxisContradicts { .. } => "correct one of the two".to_owned(),
            Self::AxisNotNamed { name } => {
                format!("name it: --axis {name}_deg=COLUMN (or {name}_mm); or leave all --axis out and write axes.csv")
            }
            Self::AxesTwice => "leave the file out, or --axis".to_owned(),
            Self::MappedColumnMissing { ours, meant, .. } => {
                let theirs = meant.as_deref().unwrap_or("THEIRS");
                format!("write ours=theirs: --robot-map '{ours}={theirs}' (or --features-map)")
            }
            Self::NoNames { .. } => {
                "name them in their order: --columns time_s,x_mm,y_mm,z_mm,qw,qx,qy,qz (--features-columns for the features), or with the \
                 names of a maker and --robot; `-` is not used"
                    .to_owned()
            }
            Self::NamesDiffer { .. } => "name every column once; `-` is one that is not used".to_owned(),
            Self::NotATime { .. } => "all times of a column must have one format: check whether a second log \
                follows".to_owned(),
            Self::AmbiguousDate { .. } => {
                "write the year first: 2026-03-04 is the 4th of March".to_owned()
            }
            Self::MoreValues { .. } => {
                "if the first column is a counter or a time, name it in the header (No., time_s); else \
                    correct --x-start-mm and --x-step-mm".to_owned()
            }
            Self::StampsDiffer { .. } => {
                "give one stamp per profile; or one per block of profiles, for its first, with \
                    --profile-rate-hz".to_owned()
            }
            Self::CameraAlone { toml } => format!(
                "`trueline sensor laser-plane PICTURES --board … --sensor THIS_FILE --out sensor.toml` measures it. If it is known, copy \
                 these lines into sensor.toml, with the plane's own:\n\n{}\n[laser_plane]\nnormal = [ , , ]\noffset_mm =\n",
                toml.trim_end()
            ),
            Self::CameraWithoutSize => {
                "add two lines with the size in px of the pictures that it was calibrated with: `image_width: WIDTH` and `image_height: HEIGHT`"
                    .to_owned()
            }
            Self::Reach { furthest_m } => {
                let [is, read_as] = if *furthest_m > 1.0 { ["mm", "m"] } else { ["m", "mm"] };
                format!(
                    "they were read as {read_as} and are probably {is}: write the unit into the header (x_{is}, y_{is}, z_{is}), or name it: \
                     --robot-map x_{is}=x,y_{is}=y,z_{is}=z"
                )
            }
            Self::SeveralNumbers { .. } => {
                "rename them so that the stamp is the last number, or write images/index.csv: time_s,file".to_owned()
            }
        }
    }
}

/// A length that may be far from usual, in the unit that suits it.
fn length(m: f64) -> String {
    if m > 1.0 { format!("{m:.0} m") } else { format!("{:.2} mm", m * MM_PER_M) }
}
