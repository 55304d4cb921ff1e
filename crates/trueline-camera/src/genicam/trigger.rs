//! Setting a camera's triggers.

use super::features::{Features, set_if_there};
use crate::error::CameraError;
use crate::trigger::{Trigger, TriggerEdge};

const SELECTOR: &str = "TriggerSelector";
const MODE: &str = "TriggerMode";
const SOURCE: &str = "TriggerSource";
const ACTIVATION: &str = "TriggerActivation";
/// The trigger that begins a picture, or the frame of a profiler.
const FRAME: &str = "FrameStart";
/// The trigger that begins a row of a profiler.
const LINE: &str = "LineStart";
/// A source that is a command of the program.
const SOFTWARE: &str = "Software";

/// Trigger of a camera.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Waits {
    /// For each picture, in the camera's words; `None` if it runs freely.
    pub for_frame: Option<String>,
    /// For each row of a picture.
    pub for_line: Option<String>,
}

impl Waits {
    /// In words; `None` if it runs freely.
    pub(super) fn told(&self) -> Option<String> {
        match (&self.for_frame, &self.for_line) {
            (Some(frame), None) => Some(frame.clone()),
            (None, Some(line)) => Some(format!("{line}, each a row")),
            (Some(frame), Some(line)) => Some(format!("{frame}, and each row {line}")),
            (None, None) => None,
        }
    }
}

/// Sets the triggers as requested.
///
/// # Errors
/// Features that the camera does not have, and a source that nothing would fire.
pub(super) fn set(camera: &mut dyn Features, trigger: &Trigger) -> Result<Waits, CameraError> {
    let selectors = selectors(camera)?;
    match trigger {
        Trigger::Off => selectors.iter().try_for_each(|name| turn_off(camera, name.as_deref()))?,
        Trigger::AsSet => {}
        Trigger::Input { source, edge } => {
            for name in selectors.iter().filter(|name| name.as_deref().is_some_and(|name| name != FRAME)) {
                turn_off(camera, name.as_deref())?;
            }
            turn_on(camera, &selectors, source, *edge)?;
        }
    }
    found(camera, &selectors)
}

/// The triggers of a camera; one without a name if it has no selector.
fn selectors(camera: &mut dyn Features) -> Result<Vec<Option<String>>, CameraError> {
    if !camera.has_feature(MODE) {
        return Ok(Vec::new());
    }
    if !camera.has_feature(SELECTOR) {
        return Ok(vec![None]);
    }
    let names = camera.enum_entries(SELECTOR)?;
    Ok(names.into_iter().map(Some).collect())
}

/// Selects one trigger for the following settings; `false` if the camera does not have it now.
fn select(camera: &mut dyn Features, selector: Option<&str>) -> Result<bool, CameraError> {
    let Some(name) = selector else { return Ok(true) };
    match camera.set_enum(SELECTOR, name) {
        Ok(()) => {}
        Err(refusal) if refusal.is_silence() => return Err(refusal.into()),
        Err(_) => return Ok(false),
    }
    // The driver's memory is of the previous trigger.
    camera.forget()?;
    Ok(true)
}

fn turn_off(camera: &mut dyn Features, selector: Option<&str>) -> Result<(), CameraError> {
    if select(camera, selector)? { set_if_there(camera, MODE, "Off") } else { Ok(()) }
}

fn turn_on(
    camera: &mut dyn Features,
    selectors: &[Option<String>],
    source: &str,
    edge: Option<TriggerEdge>,
) -> Result<(), CameraError> {
    if source == SOFTWARE {
        return Err(nothing_fires());
    }
    if selectors.is_empty() {
        return Err(refused(MODE, "the camera has no such feature: it cannot be triggered".to_owned()));
    }
    let frame = selectors.iter().find(|name| name.as_deref().is_none_or(|name| name == FRAME));
    let Some(frame) = frame else {
        let others: Vec<&str> = selectors.iter().flatten().map(String::as_str).collect();
        return Err(refused(SELECTOR, format!("expected {FRAME}, the camera offers {}", others.join(", "))));
    };
    if !select(camera, frame.as_deref())? {
        return Err(refused(SELECTOR, format!("{FRAME} cannot be selected now")));
    }
    choose(camera, SOURCE, source)?;
    if let Some(edge) = edge {
        choose(camera, ACTIVATION, edge.name())?;
    }
    choose(camera, MODE, "On")
}

/// Sets an enumeration that the camera must have, to an entry that it must offer.
fn choose(camera: &mut dyn Features, name: &str, entry: &str) -> Result<(), CameraError> {
    if !camera.has_feature(name) {
        return Err(refused(
            name,
            format!("{entry} was requested, but the camera does not have this feature"),
        ));
    }
    let offered = camera.enum_entries(name)?;
    if !offered.iter().any(|offered| offered == entry) {
        let offered = offered.join(", ");
        return Err(refused(name, format!("{entry} was requested; the camera offers {offered}")));
    }
    Ok(camera.set_enum(name, entry)?)
}

/// Which triggers are on; that of the frame stays selected.
fn found(camera: &mut dyn Features, selectors: &[Option<String>]) -> Result<Waits, CameraError> {
    let mut waits = Waits::default();
    for selector in selectors {
        if !select(camera, selector.as_deref())? {
            continue;
        }
        let Some(told) = told(camera)? else { continue };
        match selector.as_deref() {
            Some(LINE) => waits.for_line = Some(told),
            None | Some(FRAME) => waits.for_frame = Some(told),
            // A trigger of a whole burst or of the acquisition: pictures wait for it as well.
            Some(other) => waits.for_frame = Some(format!("{told} ({other})")),
        }
    }
    if selectors.iter().flatten().any(|name| name == FRAME) {
        select(camera, Some(FRAME))?;
    }
    Ok(waits)
}

/// The trigger that is selected, in the camera's words; `None` if it is off.
fn told(camera: &mut dyn Features) -> Result<Option<String>, CameraError> {
    let mode = camera.get_enum(MODE)?;
    if mode == "Off" {
        return Ok(None);
    }
    let mut words = Vec::new();
    for name in [SOURCE, ACTIVATION] {
        if camera.has_feature(name) {
            match camera.get_enum(name) {
                Ok(value) => words.push(value),
                Err(refusal) if refusal.is_silence() => return Err(refusal.into()),
                // Not reported for this source.
                Err(_) => {}
            }
        }
    }
    if words.first().is_some_and(|source| source == SOFTWARE) {
        return Err(nothing_fires());
    }
    Ok(Some(words.join(" ")))
}

fn nothing_fires() -> CameraError {
    let why = "it is Software, which this program does not support: the network would delay each picture. \
               Name an input, or use the camera's own clock";
    refused(SOURCE, why.to_owned())
}

fn refused(name: &str, why: String) -> CameraError {
    CameraError::Feature { name: name.to_owned(), why }
}
