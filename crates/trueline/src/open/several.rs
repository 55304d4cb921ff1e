//! Several scans of one sensor, taken together.

use crate::open::error::OpenError;
use crate::open::observer::{OpenObserver, Told};
use crate::open::opened::{How, Opened, open};
use std::path::PathBuf;
use trueline_dataset::join;
use trueline_dataset::sensor_setup::Mounted;

/// Reads several scans of one sensor as one. Their pictures stay with each.
///
/// # Errors
/// As [`open`], and scans of different sensors.
pub fn open_all(paths: &[PathBuf], how: &How, observer: &dyn OpenObserver) -> Result<Opened, OpenError> {
    let mut opened = paths.iter().map(|path| open(path, how, observer)).collect::<Result<Vec<_>, _>>()?;
    if opened.iter().any(|scan| scan.recording.setup.mounted == Mounted::Fixed) {
        observer.told(&Told::FixedSensor);
    }
    if opened.len() == 1 {
        return Ok(opened.remove(0));
    }
    let stamp_meaning = opened.iter().find_map(|scan| scan.stamp_meaning.clone());
    let joined = join::join(opened.into_iter().map(|scan| scan.recording).collect())?;
    let on_an_axis = joined.recording.axes.iter().map(|axis| axis.name.as_str()).next();
    observer.told(&on_an_axis.map_or(Told::Together(paths.len()), |axis| Told::OnAnAxis(paths.len(), axis)));
    joined.shifted.iter().for_each(|index| observer.told(&Told::Shifted(&paths[*index])));
    Ok(Opened { recording: joined.recording, pictures: None, stamp_meaning, trigger: None })
}
