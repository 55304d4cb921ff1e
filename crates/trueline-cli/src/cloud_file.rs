//! The file that a cloud is written to, by its ending.

use crate::failure::Failure;
use std::fs::File;
use std::io::{self, BufWriter};
use std::path::Path;
use trueline_mcap::CloudFile;
use trueline_report::export::cloud::{self, CloudColumns, CloudForm, CloudPoint, CloudSink};

/// Ending of a file for viewers of recordings.
const MCAP: &str = "mcap";

/// How a cloud is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum CloudOut {
    /// As points.
    Form(CloudForm),
    /// As a message for each frame.
    Mcap,
}

impl CloudOut {
    /// By a file's ending; known before the work is done.
    ///
    /// # Errors
    /// An ending of no form, and a form that this program was built without.
    pub(crate) fn of(out: &Path) -> Result<Self, Failure> {
        if out.extension().is_some_and(|ending| ending.eq_ignore_ascii_case(MCAP)) {
            return Ok(Self::Mcap);
        }
        let endings = CloudForm::ALL.map(|(_, ending)| format!(".{ending}")).join(", ");
        let form = CloudForm::of(out).ok_or_else(|| {
            Failure::new(
                format!("`--out {}`: expected a file that ends in one of {endings}, .{MCAP}", out.display()),
                "for example --out cloud.ply",
            )
        })?;
        if form.is_built_in() {
            return Ok(Self::Form(form));
        }
        Err(Failure::new(
            format!("`--out {}`: this program was built without that format", out.display()),
            format!("write .ply, .pcd or .{MCAP}; {}", crate::args::left_out::how_to_build()),
        ))
    }

    /// Columns that the format cannot hold.
    pub(crate) fn leaves_out(self, columns: CloudColumns) -> Vec<&'static str> {
        match self {
            Self::Form(form) => form.leaves_out(columns),
            Self::Mcap => Vec::new(),
        }
    }

    /// Writes a file; `fill` hands the points over, a frame at a time.
    ///
    /// # Errors
    /// Error of `fill`, of the operating system or of the format's library.
    pub(crate) fn write<E: From<io::Error>>(
        self,
        file: &File,
        columns: CloudColumns,
        fill: &mut dyn FnMut(&mut dyn CloudSink) -> Result<(), E>,
    ) -> Result<(), E> {
        match self {
            Self::Form(form) => cloud::write(file, form, columns, fill),
            Self::Mcap => {
                let optional =
                    [(columns.intensity, "intensity"), (columns.sigma, "sigma"), (columns.frame, "frame")];
                let names: Vec<&str> =
                    optional.into_iter().filter_map(|(is_there, name)| is_there.then_some(name)).collect();
                let file = CloudFile::create(BufWriter::new(file), &names).map_err(io::Error::other)?;
                let mut sink = McapSink { file, columns, numbers: Vec::new() };
                fill(&mut sink)?;
                sink.file.finish().map_err(|error| io::Error::other(error).into())
            }
        }
    }
}

/// Writes each frame as a message.
struct McapSink<'a> {
    file: CloudFile<BufWriter<&'a File>>,
    columns: CloudColumns,
    numbers: Vec<f64>,
}

impl CloudSink for McapSink<'_> {
    fn take(&mut self, points: &[CloudPoint]) -> io::Result<()> {
        // Of a frame without points there is nothing to see.
        let Some(first) = points.first() else { return Ok(()) };
        self.numbers.clear();
        for point in points {
            self.numbers.extend(point.in_base_m);
            if self.columns.intensity {
                self.numbers.push(point.intensity.unwrap_or(f64::NAN));
            }
            if self.columns.sigma {
                self.numbers.push(point.sigma_m.unwrap_or(f64::NAN));
            }
            if self.columns.frame {
                self.numbers.push(point.frame as f64);
            }
        }
        self.file.frame(first.exposed_ns, &self.numbers).map_err(io::Error::other)
    }
}
