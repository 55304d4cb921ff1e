//! `images/index.csv`: the frames of a scan, and where each one's picture is.

use crate::dialect::{plain_file, quoted};
use crate::error::{Error, Problem};
use crate::stamp;
use crate::stop_poses::StopPoses;
use crate::table::{self, ColumnSpec, Table, optional, required};
use crate::unit::Quantity;
use std::borrow::Cow;
use std::fs;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

const TIME: usize = 0;
const FILE: usize = 1;
const FRAME: usize = 2;
const DEVICE_TIME: usize = 3;

const COLUMNS: [ColumnSpec<'static>; 4] = [
    required("time", Quantity::Time),
    required("file", Quantity::Text),
    optional("frame", Quantity::Count),
    optional("device_time", Quantity::Time),
];

/// One frame: when it was stamped and which file holds it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FrameFile {
    /// Stamp on arrival, ns.
    pub stamp_ns: i64,
    /// Frame counter; the row's place in the index where the index has no counter.
    pub frame: u64,
    /// Stamp of the camera's own clock, ns, where recorded.
    pub device_ns: Option<i64>,
    /// The picture.
    pub path: PathBuf,
}

/// The index of a dataset folder.
#[must_use]
pub fn index_of(dataset: &Path) -> PathBuf {
    dataset.join("images").join("index.csv")
}

/// Whether a dataset folder names pictures: in their index, or one for each stop of the robot.
///
/// # Errors
/// Stops that cannot be read.
pub fn are_named_in(dataset: &Path) -> Result<bool, Error> {
    Ok(match StopPoses::of(dataset)? {
        Some(stops) => stops.pictures()?.is_some(),
        None => index_of(dataset).exists(),
    })
}

/// Reads the index of a dataset folder, or the pictures of its stops.
///
/// # Errors
/// Any text but a clean table with rising stamps and files in the folder of the index.
pub fn read_index(dataset: &Path) -> Result<Vec<FrameFile>, Error> {
    if let Some(stops) = StopPoses::of(dataset)?
        && let Some(pictures) = stops.pictures()?
    {
        let frame = |(number, (stamp_ns, path)): (usize, (i64, PathBuf))| FrameFile {
            stamp_ns,
            frame: number as u64,
            device_ns: None,
            path,
        };
        return Ok(pictures.into_iter().enumerate().map(frame).collect());
    }
    let file = index_of(dataset);
    if !file.exists() && dataset.is_dir() {
        let has_features = dataset.join("features.csv").exists();
        return Err(Error::in_file(&file, Problem::NoPictures { has_features }));
    }
    read_rows(&file, &plain_file(&file)?, &dataset.join("images"))
}

/// Whether a name is that of a column of an index.
#[must_use]
pub(crate) fn is_column(name: &str) -> bool {
    table::is_one_of(name, &COLUMNS)
}

/// Reads the rows of an index, of pictures in a folder.
///
/// # Errors
/// As [`read_index`].
pub(crate) fn read_rows(file: &Path, bytes: &[u8], folder: &Path) -> Result<Vec<FrameFile>, Error> {
    let mut table = Table::open(file, bytes, &COLUMNS)?;
    let mut frames: Vec<FrameFile> = Vec::new();
    while table.next_row()? {
        let stamp_ns = table.stamp_ns(TIME)?;
        if let Some(last) = frames.last()
            && stamp_ns < last.stamp_ns
        {
            let (previous_s, this_s) = (stamp::seconds(last.stamp_ns), stamp::seconds(stamp_ns));
            return Err(table.error_in(TIME, Problem::TimeRunsBackwards { previous_s, this_s }));
        }
        frames.push(FrameFile {
            stamp_ns,
            frame: table.count(FRAME)?.unwrap_or(frames.len() as u64),
            device_ns: table.optional_stamp_ns(DEVICE_TIME)?,
            path: folder.join(file_name(&table)?),
        });
    }
    if frames.is_empty() {
        return Err(Error::in_file(file, Problem::NoRows));
    }
    Ok(frames)
}

/// A name inside the folder: an index must not lead anywhere else. Some write it as seen from the dataset, with
/// `images/` before it.
fn file_name(table: &Table<'_>) -> Result<String, Error> {
    let name = table.text(FILE).unwrap_or_default();
    let name = name.strip_prefix("images/").unwrap_or(name);
    let inside = Path::new(name).components().all(|c| matches!(c, std::path::Component::Normal(_)));
    if name.is_empty() || !inside {
        return Err(table.error_in(FILE, Problem::NotAFileName { text: name.to_owned() }));
    }
    Ok(name.to_owned())
}

/// The name of a picture as a table has it.
fn name_in_index(frame: &FrameFile) -> Result<Cow<'_, str>, Error> {
    let name = frame.path.file_name().unwrap_or_default();
    // Blanks around a field are not read.
    let text = name.to_str().filter(|text| text.trim() == *text && !text.is_empty());
    let not_a_name = || Problem::NotAFileName { text: name.to_string_lossy().into_owned() };
    text.map(quoted).ok_or_else(|| Error::in_file(&frame.path, not_a_name()))
}

/// Writes the index of a dataset folder; it must not exist. Stamps of the camera's own clock are written if every frame
/// has one.
///
/// # Errors
/// Error of the operating system; a name that begins or ends with a blank or is not text, because the table would be read
/// differently.
pub fn write_index(dataset: &Path, frames: &[FrameFile]) -> Result<(), Error> {
    let file = index_of(dataset);
    if file.exists() {
        return Err(Error::in_file(&file, Problem::AlreadyExists));
    }
    let names = frames.iter().map(name_in_index).collect::<Result<Vec<_>, _>>()?;
    let device = frames.iter().all(|frame| frame.device_ns.is_some());
    let write = || {
        let mut out = BufWriter::new(fs::File::create(&file)?);
        writeln!(out, "time_s,file,frame{}", if device { ",device_time_s" } else { "" })?;
        for (frame, name) in frames.iter().zip(&names) {
            write!(out, "{},{name},{}", stamp::format_seconds(frame.stamp_ns), frame.frame)?;
            if let (true, Some(device_ns)) = (device, frame.device_ns) {
                write!(out, ",{}", stamp::format_seconds(device_ns))?;
            }
            writeln!(out)?;
        }
        out.flush()
    };
    write().map_err(|e| Error::in_file(&file, Problem::Io(e)))
}
