//! Processing of a weld: read the state, judge, store, and report.

use crate::alarm_message::{self, Event};
use crate::detect::change::Confidence;
use crate::detect::inside::CutWeld;
use crate::detect::scatter::{self, LESSONS};
use crate::detect::sensor_axes::SensorAxes;
use crate::detect::{
    Alarm, Change, History, Judgement, Movement, PieceInformation, Regime, Scatter, blindness, judge,
};
use crate::innovation::{Evidence, Weld, WeldError, shape_origin_m};
use crate::kept_regimes::{self, Lists, found_anew};
use crate::parameters::{CALIBRATION, Kind, UNITS};
use crate::reference::{Part, Reference};
use crate::store::{
    KEPT_STATISTICS, NewAlarm, NewWeld, Standing, Store, StoreError, StoredPart, StoredPiece, weld_number,
};
use crate::told::Told;
use crate::weld_content::content;
use crate::weld_line::{HistoryOf, Learning, WeldLine};
use nalgebra::{Matrix3, Vector3};
use std::time::{SystemTime, UNIX_EPOCH};
use trueline_dataset::axes::Carries;
use trueline_dataset::result_file::ResultFile;
use trueline_dataset::{Guess, Recording, Sensor};
use trueline_geometry::Line;
use trueline_model::LaserSheet;

/// The sensor's file among the inputs of a result and of a recording.
const SENSOR: &str = "sensor.toml";

/// The calibration that is watched.
#[derive(Clone, Debug)]
pub struct Watched {
    /// The name under which it came.
    pub name: String,
    /// SHA-256 of its file: another one begins a history of its own.
    pub sha256: String,
    /// Its value.
    pub guess: Guess,
    /// The whole result, if there is one.
    pub result: Option<ResultFile>,
    /// Tolerated displacement of seam points, m.
    pub tolerance_m: Option<f64>,
}

/// Why a weld could not be watched.
#[derive(Debug, thiserror::Error)]
pub enum WatchError {
    /// The weld cannot be used.
    #[error(transparent)]
    Weld(#[from] WeldError),
    /// The state cannot be used.
    #[error(transparent)]
    Store(#[from] StoreError),
}

impl WatchError {
    /// Hint for the user.
    #[must_use]
    pub fn hint(&self) -> &'static str {
        match self {
            Self::Weld(error) => error.hint(),
            Self::Store(error) => error.hint(),
        }
    }
}

impl Watched {
    /// Whether a weld was recorded with another sensor.toml than the calibration's; `None` if one of the two
    /// is unknown.
    pub(crate) fn sensor_file_differs(&self, weld: &Recording) -> Option<bool> {
        let result = self.result.as_ref()?;
        let named = result.sensor.file.as_ref().map(|file| &file.sha256);
        let made_with = named.or_else(|| result.inputs.get(SENSOR))?;
        Some(made_with != weld.inputs.get(SENSOR)?)
    }

    fn reference(&self, shape_origin_m: [f64; 2]) -> Reference {
        match &self.result {
            Some(result) => Reference::of_result(self.guess, result, shape_origin_m),
            None => Reference::of_value(self.guess, shape_origin_m),
        }
    }
}

/// Watches one weld: its report is stored before it is returned. A weld that was watched before is reported again unchanged.
///
/// # Errors
/// A weld or a state that cannot be used; nothing is kept of it then.
pub fn watch(
    store: &Store,
    calibration: &Watched,
    name: &str,
    recording: &Recording,
) -> Result<WeldLine, WatchError> {
    let origin_m = match store.calibration(&calibration.sha256)? {
        Some((_, origin_m)) => origin_m,
        None => shape_origin_m(recording, &calibration.guess)?,
    };
    let content = content(recording);
    let now_s = now_s();
    let transaction = store.begin()?;
    let before = store.calibration_of_last_weld()?;
    let names = (calibration.sha256.as_str(), calibration.name.as_str());
    let (id, origin_m) = store.add_calibration(names, now_s, calibration.guess.time_offset_s, origin_m)?;
    if let Some((row, line)) = store.line_of(id, &content)? {
        store.commit(transaction)?;
        return Ok(WeldLine::again(weld_number(row), line));
    }
    let reference = calibration.reference(origin_m);
    let mut parts = store.parts(id)?;
    let known: Vec<Part> = parts.iter().map(|stored| stored.part.clone()).collect();
    let weld = Weld::of_known(recording, &reference, &known)?;
    let own = own_part(store, id, &mut parts, weld.seams())?;
    let evidence = weld.evidence(&parts[own].part, &reference)?;
    let pieces = store.pieces(id)?;
    let next_row = store.next_row()?;
    let oldest = pieces.first().map_or(next_row, |piece| piece.id);
    let stored = Some(store.regimes(id, oldest)?).filter(|kept| !kept.is_empty());
    let kept = stored
        .unwrap_or_else(|| found_anew(Lists { pieces: &pieces, parts: &parts, next_row }, &reference.prior));
    let standing = store.standing(id)?.filter(|_| kept.last().is_some_and(|regime| regime.fault.is_some()));
    let in_control = learn(store, kept_regimes::good(&pieces, &kept), &mut parts[own])?;
    let axes = sensor_axes(recording, &calibration.guess);
    let movement = Movement::of(weld.features(), &axes, origin_m);
    let number = weld_number(next_row);
    let lists = Lists { pieces: &pieces, parts: &parts, next_row };
    let axis = axis_under_part(recording);
    let seen = Seen { reference: &reference, lists, own, evidence: &evidence, axis };
    let (judgement, information) = seen.judged(&lists.places(&kept));
    let tolerance = (calibration.tolerance_m, standing.as_ref().is_some_and(|change| change.is_within));
    let mut line = seen.line((number, name), &judgement, blindness::blind_to(&information, &axes));
    line.alarm = judgement.alarm.as_ref().map(|alarm| seen.told((number, name), alarm, &movement, tolerance));
    let claimed = kept.last().filter(|regime| regime.claimed).map(|regime| weld_number(regime.first));
    line.alarm.iter_mut().for_each(|told| told.was_claimed = claimed == Some(told.since_number));
    let learnt = in_control + usize::from(judgement.alarm.is_none());
    line.learning.iter_mut().for_each(|learning| learning.pieces = learnt);
    line.sensor_file_differs = calibration.sensor_file_differs(recording);
    line.calibration = calibration.name.clone();
    line.history = HistoryOf::after(before.clone(), id, pieces.len());
    line.blindness_is_news = is_news(store.last_line(id)?, &line.blind_to, now_s);
    line.stamps_treated_alike = weld.stamps_as(reference.dejittered);
    let now = line.alarm.as_ref().map(|told| standing_of(told, judgement.is_another));
    // A receiver that has received another calibration's alarm in the meantime receives this one's again.
    let is_same = line.history == HistoryOf::Same;
    line.event = Event::between(standing.as_ref().filter(|_| is_same), now.as_ref());
    if let Some(replaced) = before.filter(|_| !is_same) {
        close_alarm_of(store, replaced, calibration, now_s, number)?;
    }
    store.add_weld(id, &seen.kept(&line, content, now_s, &judgement, &information))?;
    let regimes = lists.rows(&judgement.regimes, &kept);
    store.keep_regimes(id, oldest, &regimes)?;
    store.drop_statistics(&lists.too_old(&regimes, KEPT_STATISTICS))?;
    tell_event(store, &line, now_s)?;
    store.commit(transaction)?;
    Ok(line)
}

/// The number of the part that a weld is a piece of; one that was not seen before is added.
fn own_part(
    store: &Store,
    id: i64,
    parts: &mut Vec<StoredPart>,
    seams: Vec<Line>,
) -> Result<usize, StoreError> {
    if let Some(own) = parts.iter().position(|part| part.part.is_like(&seams)) {
        return Ok(own);
    }
    let part = Part { lines: seams };
    parts.push(StoredPart { id: store.add_part(id, &part)?, part, scatter: None });
    Ok(parts.len() - 1)
}

fn standing_of(told: &Told, is_another: bool) -> Standing {
    let kind = told.alarm.change.kind.name().to_owned();
    Standing { kind, is_within: told.is_within, is_another }
}

/// Closes the alarm of a calibration replaced by another one: no later weld would clear it.
fn close_alarm_of(
    store: &Store,
    (replaced, its_name): (i64, String),
    by: &Watched,
    now_s: i64,
    number: i64,
) -> Result<(), StoreError> {
    if store.alarm_of_last_weld(replaced)?.is_none() {
        return Ok(());
    }
    let names = [its_name.as_str(), by.name.as_str()];
    store.add_message(&alarm_message::replaced(&store.cell(), names, now_s, number).to_string())?;
    Ok(())
}

/// Keeps a message of a weld's event, if any.
fn tell_event(store: &Store, line: &WeldLine, now_s: i64) -> Result<(), StoreError> {
    let Some(event) = line.event else { return Ok(()) };
    let body = alarm_message::body(event, &store.cell(), &line.calibration, now_s, &line.to_json());
    store.add_message(&body.to_string())?;
    Ok(())
}

/// Duration of a shift, s.
const SHIFT_S: i64 = 8 * 3600;

/// Whether the blindness of the welds is to be reported: once a shift, and when it has changed since the last
/// weld.
fn is_news(last: Option<(String, i64)>, blind_to: &[String], now_s: i64) -> bool {
    let Some((line, then_s)) = last else { return true };
    let before: Option<serde_json::Value> = serde_json::from_str(&line).ok();
    let is_same = before.is_some_and(|line| line["blind_to"] == serde_json::json!(blind_to));
    !is_same || then_s.div_euclid(SHIFT_S) != now_s.div_euclid(SHIFT_S)
}

/// Learns the scatter of a part when the number of its good pieces reaches the next lesson.
/// Returns that number.
fn learn<'a>(
    store: &Store,
    good: impl Iterator<Item = &'a StoredPiece>,
    own: &mut StoredPart,
) -> Result<usize, StoreError> {
    let statistics: Vec<_> =
        good.filter(|piece| piece.part == own.id).map(|piece| &piece.statistic).collect();
    let known = own.scatter.as_ref().map_or(0, |scatter| scatter.pieces);
    let Some(lesson) = scatter::lesson(statistics.len()).filter(|lesson| *lesson > known) else {
        return Ok(statistics.len());
    };
    if let Some(learnt) = scatter::learnt(&statistics[..lesson], &own.part) {
        store.keep_scatter(own.id, &learnt)?;
        own.scatter = Some(learnt);
    }
    Ok(statistics.len())
}

/// Inputs of a judgement.
struct Seen<'a> {
    reference: &'a Reference,
    lists: Lists<'a>,
    own: usize,
    evidence: &'a Evidence,
    axis: Option<String>,
}

impl Seen<'_> {
    fn scatter(&self) -> Option<&Scatter> {
        self.lists.parts[self.own].scatter.as_ref()
    }

    fn judged(&self, regimes: &[Regime]) -> (Judgement, Vec<PieceInformation>) {
        let own = &self.lists.parts[self.own];
        let last = PieceInformation::of(&self.evidence.statistic, self.own, &own.part, own.scatter.as_ref());
        let mut pieces = self.lists.information();
        pieces.push(last);
        let scatters = self.lists.scatters();
        let cut = CutWeld {
            chunks: &self.evidence.chunks,
            bow_prior: &self.evidence.bow_prior,
            part: &own.part,
            dispersion: self.scatter().map_or([1.0; 4], |scatter| scatter.dispersion),
            freedom: self.evidence.statistic.freedom(),
        };
        let history = History { pieces: &pieces, prior: &self.reference.prior, scatters: &scatters, regimes };
        (judge(&history, Some(&cut)), pieces)
    }

    fn weld(&self, place: usize, (number, name): (i64, &str)) -> (i64, String) {
        let before = self.lists.pieces.get(place);
        before.map_or_else(|| (number, name.to_owned()), |piece| (weld_number(piece.id), piece.name.clone()))
    }

    fn told(
        &self,
        own: (i64, &str),
        alarm: &Alarm,
        movement: &Movement,
        tolerance: (Option<f64>, bool),
    ) -> Told {
        let welds = [alarm.since.piece, alarm.out_since].map(|place| self.weld(place, own));
        let error = movement.by(&alarm.change, &self.lists.parts[alarm.part].part);
        Told { axis: self.axis.clone(), ..Told::of(alarm.clone(), welds, error, tolerance) }
    }

    fn line(&self, own: (i64, &str), judgement: &Judgement, blind_to: Vec<String>) -> WeldLine {
        let statistic = &self.evidence.statistic;
        WeldLine {
            number: own.0,
            weld: own.1.to_owned(),
            used: statistic.used,
            outliers: statistic.outliers,
            noise_factor: statistic.noise_factor,
            blind_to,
            blindness_is_news: true,
            alarm: None,
            good_since: judgement.good_since.map(|place| self.weld(place, own)),
            event: None,
            sensor_file_differs: None,
            part: self.lists.parts[self.own].id,
            calibration: String::new(),
            history: HistoryOf::Same,
            learning: self.scatter().is_none().then_some(Learning { pieces: 0, needed: LESSONS[0] }),
            p_log10: judgement.p_log10,
            stamps_treated_alike: true,
            told_before: None,
        }
    }

    fn kept(
        &self,
        line: &WeldLine,
        content: String,
        watched_s: i64,
        judgement: &Judgement,
        information: &[PieceInformation],
    ) -> NewWeld {
        let alarm = line.alarm.as_ref().map(|told| NewAlarm {
            kind: told.alarm.change.kind.name(),
            since: self.lists.pieces.get(told.alarm.since.piece).map(|piece| piece.id),
            p_log10: told.alarm.change.p_log10,
            is_within: told.is_within,
        });
        NewWeld {
            name: line.weld.clone(),
            content,
            watched_s,
            part: line.part,
            statistic: self.evidence.statistic.clone(),
            estimates: information.last().map(estimates).unwrap_or_default(),
            p_log10: judgement.p_log10,
            line: line.to_json().to_string(),
            alarm,
        }
    }
}

/// Each column of θ as if nothing else had changed, `None` below the smallest change that a piece can show.
/// Then each as if nothing of another kind had, `None` if the piece does not show it independently.
fn estimates(piece: &PieceInformation) -> Vec<Option<[f64; 2]>> {
    let alone = |k: usize| {
        let information = piece.within.matrix[(k, k)];
        let shown = information > crate::detect::change::VISIBLE;
        shown
            .then(|| [piece.within.vector[k] / information, information.sqrt().recip()].map(|x| x * UNITS[k]))
    };
    let known = Confidence { noise_freedom: piece.freedom, taught_by: 0, dispersion: 1.0, pieces: 1 };
    let by_kind = Kind::ALL.into_iter().filter(|kind| *kind != Kind::Seam).flat_map(|kind| {
        let columns: Vec<usize> = kind.columns().collect();
        let own = Change::of(kind, &piece.within.restricted(&columns), None, known);
        own.value.into_iter().zip(own.sigma).map(|(value, sigma)| Some([value?, sigma?])).collect::<Vec<_>>()
    });
    (0..CALIBRATION).map(alone).chain(by_kind).collect()
}

/// Names of the axes that carry the part.
fn axis_under_part(recording: &Recording) -> Option<String> {
    let axes = recording.axes.iter().filter(|axis| axis.carries == Carries::Part);
    let names: Vec<&str> = axes.map(|axis| axis.name.as_str()).collect();
    (!names.is_empty()).then(|| names.join(", "))
}

/// The sensor's axes in the tool frame.
fn sensor_axes(recording: &Recording, guess: &Guess) -> SensorAxes {
    let sheet = match &recording.sensor {
        Sensor::CameraLaser { laser_plane_in_camera, .. }
        | Sensor::Points { laser_plane_in_camera: Some(laser_plane_in_camera) } => {
            LaserSheet::from_plane(*laser_plane_in_camera)
        }
        Sensor::Profiler | Sensor::Points { laser_plane_in_camera: None } => LaserSheet::of_profiler(),
    };
    let (across, depth): (Vector3<f64>, Vector3<f64>) =
        (sheet.axes().column(0).into(), sheet.axes().column(1).into());
    let in_tool = |axis: &Vector3<f64>| guess.tool_from_camera.rotation * axis;
    let along = across.cross(&depth);
    SensorAxes {
        tool_from_axes: Matrix3::from_columns(&[in_tool(&across), in_tool(&along), in_tool(&depth)]),
    }
}

fn now_s() -> i64 {
    SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |d| d.as_secs().cast_signed())
}
