//! Remedies for problems.

use crate::error::Problem;

impl Problem {
    /// Remedy for the user.
    #[must_use]
    pub fn hint(&self) -> String {
        match self {
            Self::UnknownColumn { meant: Some(meant), .. } => {
                format!("is it `{meant}`? {}", self.usual_hint())
            }
            Self::Log(problem) => problem.hint(),
            Self::DatasetOfSensors { first, .. } => {
                format!("name one sensor: {first}; `trueline calibrate` takes all of them")
            }
            _ => self.usual_hint().to_owned(),
        }
    }

    fn usual_hint(&self) -> &str {
        match self {
            Self::MissingColumn { .. }
            | Self::UnknownColumn { .. }
            | Self::OtherSeparator { .. }
            | Self::UnknownUnit { .. }
            | Self::DuplicateColumn
            | Self::NoUnit { .. } => self.column_hint(),
            Self::FieldCount { .. } => "check whether the line is cut off, or a decimal comma is used",
            Self::NotAPlate { .. }
            | Self::PlateTwice { .. }
            | Self::StripeWithoutLength
            | Self::StripeWithoutDirection { .. }
            | Self::StripesWithoutLaserPlane => self.stripe_hint(),
            Self::NoNumberInName
            | Self::NumberTwice { .. }
            | Self::NotAFileName { .. }
            | Self::Picture { .. }
            | Self::NotGray { .. } => self.picture_hint(),
            Self::TimeRunsBackwards { .. } => {
                "check whether the clock jumped or two recordings were joined; \
                sort or split the file"
            }
            Self::MixedDecimals { .. } => "use one decimal sign, and no thousands separator",
            Self::NoRotation { .. }
            | Self::TwoRotations { .. }
            | Self::AmbiguousAngles
            | Self::NoRotationMatrix { .. }
            | Self::QuaternionNotUnit { .. } => self.rotation_hint(),
            Self::NoProfileTimes
            | Self::NoColumnPositions
            | Self::UnknownProfileFormat
            | Self::OnlyProfiles
            | Self::NoPoints { .. }
            | Self::NoReturn { .. }
            | Self::Ply(_) => self.profile_hint(),
            Self::Unreadable { hint, .. } => hint,
            Self::Csv(_) => "the file should be UTF-8 text with one header line, separated by commas",
            Self::MissingCalibration
            | Self::MissingReference
            | Self::NoResult(_)
            | Self::OtherMounting { .. }
            | Self::OtherSensor { .. }
            | Self::NewerResult { .. }
            | Self::NotCalibrated { .. } => self.calibration_hint(),
            Self::Value { key: "stop" | "picture", .. } => {
                "poses.csv has one row for each stop, and each reading names its stop in a column `stop` (or `picture`)"
            }
            Self::Axis(problem) => problem.hint(),
            Self::PointRepeated => "leave one of the two out",
            Self::ForeignRow { .. } => "check that this is the right file for this format",
            Self::RowsDiffer { .. } => "every feature belongs to one image, row by row",
            _ => self.file_hint().unwrap_or_else(|| self.value_hint()),
        }
    }

    /// `None` for a problem that is not about a file as a whole.
    fn file_hint(&self) -> Option<&'static str> {
        Some(match self {
            Self::Missing => {
                "a dataset folder has sensor.toml, robot.csv and features.csv; or whole profiles as profiles.csv or profiles.parquet; or pictures that images/index.csv names"
            }
            Self::Io(_) => "check the path and its permissions",
            Self::AlreadyExists => {
                "name a new one; --force, where a command has it, replaces a folder that trueline wrote"
            }
            Self::OutputIsInput => "name another file, not one of the inputs",
            Self::OutputTwice => "name a file for each",
            Self::NotJsonLines => "name a new file, or the log of the day before",
            Self::FolderWithoutName => "name a new folder in it, for example `scan`: it appears as a whole",
            Self::NotOurs { .. } => "move it away, or name a new folder: only files of trueline are replaced",
            Self::IsFolder | Self::OutputIsFolder => "name a file in it",
            Self::NoFolder { .. } => "create it first, or check its name and the current folder",
            Self::NoPictures { has_features: true } => {
                "they are not needed: `trueline calibrate DATASET` uses features.csv"
            }
            Self::NoPictures { has_features: false } => {
                "put them into images/ with their stamps in images/index.csv; --fps or --stamps-from-name \
                    writes that file"
            }
            Self::NoSuchFile => "check its name, and the current folder",
            Self::NotUtf8 => {
                "save it as UTF-8 text; the usual cause is a letter like µ, ° or ü from an older program"
            }
            Self::NoHeader => {
                "the first line names the columns with their units, for example time_s,x_mm,y_mm,z_mm,qw,qx,qy,qz; `trueline import csv --columns` \
                 names those of a file without"
            }
            Self::OtherTable { .. } => "check whether robot.csv and features.csv are swapped",
            Self::NoRows => "the file has no row of numbers: check whether the recording started",
            _ => return None,
        })
    }

    fn value_hint(&self) -> &'static str {
        match self {
            Self::NotANumber { text } if text.contains(':') => {
                "`trueline import csv` reads clock times and dates, and writes seconds"
            }
            Self::NotANumber { text } if text.is_empty() => "leave out rows without a measurement",
            Self::NotANumber { .. } => "numbers have a decimal point, and no thousands separator or unit",
            Self::NotAStamp { .. } => "check the unit in the column's name (_s, _ms, _us, _ns)",
            Self::NotACount { .. } | Self::NotALine { .. } => "line and frame are numbered 0, 1, 2, …",
            Self::NotPositive { .. } => {
                "write the standard deviation of the column, or leave the column out \
                of features.csv"
            }
            Self::NotACorrelation { .. } => "it is the covariance of both coordinates divided by both sigmas",
            Self::NotFinite { .. } | Self::NotMeasured { .. } => {
                "leave out rows without a measurement; in profiles of a row each, leave the cell empty"
            }
            _ => {
                "compare with a file written by trueline: `trueline simulate` writes datasets, `trueline \
                    plan --example` a cell"
            }
        }
    }

    fn column_hint(&self) -> &'static str {
        match self {
            Self::MissingColumn { .. } => "columns are identified by name; their order does not matter",
            Self::UnknownColumn { .. } => {
                "correct its name or remove the column; `trueline import csv` accepts the names and units of \
                 other programs"
            }
            Self::OtherSeparator { .. } => {
                "--delimiter applies to the robot file and to the features: leave it out, the separator is \
                    recognised in each file"
            }
            Self::UnknownUnit { .. } => {
                "known units: mm, cm, m, µm, in; deg, rad, mrad, gon; s, ms, µs, ns; or map the column: \
                    --robot-map 'x_mm=X [actual]'"
            }
            Self::DuplicateColumn => "keep one of the two; the same quantity in two units counts as two",
            _ => "the name of a column carries its unit, for example _mm, _m, _s, _ms or _ns",
        }
    }

    fn calibration_hint(&self) -> &'static str {
        match self {
            Self::MissingCalibration => "`trueline calibrate DATASET --json result.json` writes one",
            Self::MissingReference => {
                "a reference is a CSV of points x_mm,y_mm,z_mm along the seam, or a TOML with [[lines]] or [circle]"
            }
            Self::NoResult(_) => {
                "a result begins with `{`, as `calibrate --json` writes it; a TOML like initial.toml does \
                    not"
            }
            Self::OtherMounting { .. } => {
                "correct `mounted` in sensor.toml, which states the sensor's carrier, or use the \
                calibration of this cell"
            }
            Self::OtherSensor { .. } => {
                "a camera's hand-eye transform and a profiler's are of different frames: name the result of this sensor"
            }
            Self::NewerResult { .. } => "a newer trueline wrote it: use that, or calibrate again",
            _ => "calibrate from a scan that determines everything: `trueline plan` finds one",
        }
    }

    fn picture_hint(&self) -> &'static str {
        match self {
            Self::NoNumberInName => {
                "pictures without index.csv are named 000001.png, 000002.png, …, or by their stamps"
            }
            Self::NumberTwice { .. } => "the last number in each name must be its own",
            Self::NotAFileName { .. } => "pictures lie in images/, beside index.csv; give their names alone",
            Self::NotGray { .. } => {
                "convert it, for example: magick in.png -colorspace gray -depth 8 out.png"
            }
            _ => {
                "pictures are PNG, JPEG, TIFF or BMP; if the recording was cut off, leave the row of the broken one out of index.csv"
            }
        }
    }

    fn stripe_hint(&self) -> &'static str {
        match self {
            Self::StripesWithoutLaserPlane => "give [laser_plane] in sensor.toml",
            _ => {
                "a seam is where two plates meet, 0 and 1; each stripe is two points of it, further apart than its sigma"
            }
        }
    }

    fn profile_hint(&self) -> &'static str {
        match self {
            Self::NoProfileTimes => {
                "give the stamp of the first and the rate (--profile-start-s, --profile-rate-hz), or a file with one stamp for each \
                 (--profile-times); a column of times needs its unit in its name, `Timestamp [ms]`, unless \
                     its steps imply it"
            }
            Self::OnlyProfiles => "`trueline features DATASET` finds the seam and writes features.csv",
            Self::UnknownProfileFormat => {
                "name it: --profile-format keyence-lj-x, wenglor, … or rows; --help lists all"
            }
            Self::NoPoints { .. } => {
                "check the format; `trueline import csv --help` lists the code for no point of each"
            }
            Self::NoReturn { .. } => {
                "leave out rows without a return (one row per point) or leave the cell empty (one row per \
                 profile); or state the code for no return: `trueline import … --no-return-mm 0`"
            }
            Self::NoColumnPositions => "give them: --x-start-mm and --x-step-mm",
            _ => "ascii or binary PLY with properties x and z of one element `vertex` is read",
        }
    }

    fn rotation_hint(&self) -> &'static str {
        match self {
            Self::QuaternionNotUnit { .. } => {
                "the order must be w, x, y, z; check for x, y, z, w, or Euler angles"
            }
            Self::AmbiguousAngles => {
                "Yaskawa: euler_xyz_fixed_1_deg, _2_deg, _3_deg; Stäubli: euler_xyz_intrinsic_1_deg, …; a rotation vector is in rad"
            }
            Self::NoRotationMatrix { .. } => {
                "rows are r11 r12 r13, …; columns are the axes of the tool in base"
            }
            _ => {
                "give one of: qw, qx, qy, qz; q1 … q4 (w first); a_deg, b_deg, c_deg (KUKA); w_deg, p_deg, r_deg (FANUC); roll_deg, \
                 pitch_deg, yaw_deg; rx_rad, ry_rad, rz_rad (rotation vector); r11 … r33; euler_zyx_intrinsic_1_deg, _2_deg, _3_deg"
            }
        }
    }
}
