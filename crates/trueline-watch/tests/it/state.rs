//! The state: kept through kills, with two users at once, never written twice, and refused in wrong places.

use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::Barrier;
use trueline_dataset::Recording;
use trueline_sim::production::{Change, Layout, Production, ScheduledChange, piece};
use trueline_watch::{HistoryOf, Store, WatchError, Watched, watch};

/// The environment variable that makes a copy of this test program a worker.
const WORKER: &str = "TRUELINE_WATCH_WORKER";

fn production() -> Production {
    // Half the edge: as short as a weld can be and still quick to simulate.
    let mut production = Layout::CheckScan.production();
    production.speed_m_s = 0.12;
    production
}

fn watched(recording: &Recording) -> Watched {
    let guess = recording.truth.as_ref().unwrap().parameters;
    Watched { name: "test".to_owned(), sha256: "0".to_owned(), guess, result: None, tolerance_m: None }
}

/// Not a test by itself: watches pieces from a number on, and says each that is finished.
#[test]
fn worker() {
    let Ok(what) = std::env::var(WORKER) else { return };
    let (file, first) = what.rsplit_once(':').unwrap();
    let store = Store::open(Path::new(file)).unwrap();
    let production = production();
    let calibration = watched(&piece(&production, 0, 1));
    for number in first.parse::<usize>().unwrap().. {
        watch(&store, &calibration, &format!("piece {number}"), &piece(&production, number, 1)).unwrap();
        println!("\nfinished {number}");
        std::io::stdout().flush().unwrap();
    }
}

fn start_worker(file: &Path, first: usize) -> Child {
    Command::new(std::env::current_exe().unwrap())
        .args(["state::worker", "--exact", "--nocapture", "--test-threads=1"])
        .env(WORKER, format!("{}:{first}", file.display()))
        .stdout(Stdio::piped())
        .spawn()
        .unwrap()
}

/// Numbers of the pieces that a worker finished, until so many; then it is killed.
fn finished_until_killed(mut worker: Child, pieces: usize) -> Vec<usize> {
    let mut lines = BufReader::new(worker.stdout.take().unwrap()).lines();
    let mut finished = Vec::new();
    let number = |line: String| line.strip_prefix("finished ").map(|n| n.parse::<usize>().unwrap());
    while finished.len() < pieces {
        let line = lines.next().expect("the worker has ended by itself: its words stand above").unwrap();
        finished.extend(number(line));
    }
    worker.kill().unwrap();
    worker.wait().unwrap();
    // Its text before its end.
    finished.extend(lines.map_while(Result::ok).filter_map(number));
    finished
}

fn state(folder: &tempfile::TempDir) -> PathBuf {
    folder.path().join("cell.sqlite")
}

fn names(store: &Store) -> Vec<String> {
    let calibrations = store.calibrations().unwrap();
    assert_eq!(calibrations.len(), 1);
    store.history(calibrations[0].id, usize::MAX).unwrap().into_iter().map(|row| row.name).collect()
}

#[test]
fn no_finished_weld_is_lost_when_programs_are_killed() {
    let folder = tempfile::tempdir().unwrap();
    let file = state(&folder);
    let mut told = Vec::new();
    for (round, pieces) in [3, 1, 4].into_iter().enumerate() {
        // Two at once, each with pieces of its own.
        let workers = [0, 500].map(|first| start_worker(&file, first + 100 * round));
        for worker in workers {
            told.extend(finished_until_killed(worker, pieces));
        }
    }
    let kept = names(&Store::open(&file).unwrap());
    for number in &told {
        assert!(kept.contains(&format!("piece {number}")), "piece {number} was told of and is lost");
    }
    let mut unique = kept.clone();
    unique.sort();
    unique.dedup();
    assert_eq!(unique.len(), kept.len(), "a piece is there twice");
    assert!(told.len() >= 16);
}

/// Setting the journal of a new file is what the library refuses at once when another program is about it. Of a
/// hundred times four openings at least one failed in each of six runs before they were tried again.
#[test]
fn programs_that_open_a_new_state_at_once_all_get_it() {
    let folder = tempfile::tempdir().unwrap();
    for round in 0..100 {
        let file = folder.path().join(format!("cell-{round}.sqlite"));
        let together = Barrier::new(4);
        std::thread::scope(|scope| {
            for _ in 0..4 {
                scope.spawn(|| {
                    together.wait();
                    let opened = Store::open(&file);
                    assert!(opened.is_ok(), "{:?}", opened.err());
                });
            }
        });
    }
}

#[test]
fn a_weld_is_told_once_more_and_not_counted_twice() {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::open(&state(&folder)).unwrap();
    let recording = piece(&production(), 0, 1);
    let calibration = watched(&recording);
    let first = watch(&store, &calibration, "a", &recording).unwrap();
    let again = watch(&store, &calibration, "a copy of it", &recording).unwrap();
    assert_eq!(first.to_json(), again.to_json());
    assert_eq!(names(&store), ["a"]);
}

#[test]
fn a_change_raises_an_alarm_that_stands_and_names_the_first_weld_after_it() {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::open(&state(&folder)).unwrap();
    let mut production = production();
    let calibration = watched(&piece(&production, 0, 1));
    let told = |production: &Production, number: usize| {
        watch(&store, &calibration, &format!("piece {number}"), &piece(production, number, 1)).unwrap()
    };
    for number in 0..6 {
        let line = told(&production, number);
        assert!(!line.is_alarm(), "{}", line.to_json());
        assert!(line.blind_to.contains(&"seam".to_owned()), "the fixture has not been learnt");
    }
    production.change = Some(ScheduledChange { change: Change::Timing(1e-3), piece: 6, after: 0.0 });
    for number in 6..9 {
        let line = told(&production, number).to_json();
        assert_eq!(line["alarm"]["kind"], "timing", "{line}");
        assert_eq!(line["alarm"]["since"], "piece 6", "{line}");
        let change = &line["alarm"]["change"];
        let off = change["time_offset_ms"].as_f64().unwrap() - 1.0;
        let sigma = change["sigma"]["time_offset_ms"].as_f64().unwrap();
        assert!(off.abs() < 4.0 * sigma && sigma < 0.1, "{line}");
    }
    let history = store.history(1, 100).unwrap();
    let alarms: Vec<Option<i64>> = history.iter().map(|row| row.alarm.as_ref().map(|a| a.since)).collect();
    assert_eq!(alarms[..6], [None; 6]);
    assert_eq!(alarms[6..], [Some(history[6].number); 3]);
}

#[test]
fn files_of_others_and_of_newer_programs_are_left_alone() {
    let folder = tempfile::tempdir().unwrap();
    let foreign = folder.path().join("other.sqlite");
    let connection = rusqlite::Connection::open(&foreign).unwrap();
    connection.execute_batch("CREATE TABLE theirs (a)").unwrap();
    assert!(Store::open(&foreign).unwrap_err().to_string().contains("another program"));
    let tables: i64 = connection.query_row("SELECT count(*) FROM sqlite_schema", [], |r| r.get(0)).unwrap();
    assert_eq!(tables, 1, "something was written");
    let newer = state(&folder);
    drop(Store::open(&newer).unwrap());
    let connection = rusqlite::Connection::open(&newer).unwrap();
    connection.pragma_update(None, "user_version", 99).unwrap();
    assert!(Store::open(&newer).unwrap_err().to_string().contains("version 99"));
    let text = folder.path().join("text");
    std::fs::write(&text, "no database, but long enough to be taken for one at first sight").unwrap();
    assert!(Store::open(&text).is_err());
}

#[test]
fn a_weld_that_cannot_be_used_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::open(&state(&folder)).unwrap();
    let mut recording = piece(&production(), 0, 1);
    let calibration = watched(&recording);
    recording.features.truncate(12);
    let error = watch(&store, &calibration, "short", &recording).unwrap_err();
    assert!(matches!(error, WatchError::Weld(_)), "{error}");
    assert!(store.calibrations().unwrap().is_empty());
}

/// As version 1 of the tables was written by the program that made them: five pieces, the clock 1 ms late from piece 3 on.
#[test]
fn a_state_of_the_first_version_goes_on() {
    let folder = tempfile::tempdir().unwrap();
    let file = state(&folder);
    std::fs::write(&file, include_bytes!("../data/state-v1.sqlite")).unwrap();
    let before = Store::open_to_read(&file).unwrap();
    let old = before.history(1, 100).unwrap();
    assert!(before.receivers().unwrap().is_empty());
    assert_eq!(before.calibrations().unwrap()[0].welds, 5);
    drop(before);
    assert_eq!(
        old.iter().map(|row| row.alarm.as_ref().map(|a| a.since)).collect::<Vec<_>>(),
        [None, None, None, Some(3), Some(3)]
    );
    let store = Store::open(&file).unwrap();
    assert_eq!(store.history(1, 100).unwrap(), old, "a row has changed");
    let mut production = production();
    let calibration = watched(&piece(&production, 0, 1));
    production.change = Some(ScheduledChange { change: Change::Timing(1e-3), piece: 3, after: 0.0 });
    let again = watch(&store, &calibration, "piece 4", &piece(&production, 4, 1)).unwrap();
    assert!(again.told_before.is_some() && again.is_alarm());
    let next = watch(&store, &calibration, "piece 5", &piece(&production, 5, 1)).unwrap().to_json();
    assert_eq!(
        (&next["alarm"]["kind"], &next["alarm"]["since"]),
        (&"timing".into(), &"piece 3".into()),
        "{next}"
    );
    assert_eq!(store.calibrations().unwrap()[0].welds, 6);
    drop(store);
    assert_eq!(Store::open(&file).unwrap().history(1, 100).unwrap().len(), 6);
}

#[test]
fn an_alarm_is_told_once_and_is_due_again_where_it_was_not_taken() {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::open(&state(&folder)).unwrap();
    let mut production = production();
    let calibration = watched(&piece(&production, 0, 1));
    let receiver = store.receiver("http://cell-pc/alarm", "cell-pc").unwrap();
    production.change = Some(ScheduledChange { change: Change::Timing(1e-3), piece: 4, after: 0.0 });
    for number in 0..6 {
        watch(&store, &calibration, &format!("piece {number}"), &piece(&production, number, 1)).unwrap();
    }
    let message = store.take_message(receiver, 1000, 1030).unwrap().unwrap();
    let body: serde_json::Value = serde_json::from_str(&message.body).unwrap();
    assert_eq!((&body["event"], &body["alarm"]["since"]), (&"raised".into(), &"piece 4".into()), "{body}");
    assert!(body["text"].as_str().unwrap().starts_with("cell: ALARM. Pictures arrive "), "{body}");
    assert_eq!(store.take_message(receiver, 1029, 2000).unwrap(), None, "it is taken");
    store.not_told(receiver, 1100, "no answer").unwrap();
    assert_eq!(store.take_message(receiver, 1099, 2000).unwrap(), None, "it is not due");
    assert_eq!(store.take_message(receiver, 1100, 1130).unwrap().unwrap().tries, 1);
    store.told(receiver, message.id).unwrap();
    assert_eq!(store.take_message(receiver, 5000, 5030).unwrap(), None, "an alarm that stands is told once");
    // A receiver that comes late is told nothing old.
    let late = store.receiver("http://other/alarm", "other").unwrap();
    assert_eq!(store.take_message(late, 5000, 5030).unwrap(), None);
}

#[test]
fn old_welds_are_forgotten_and_what_the_detector_needs_is_not() {
    let folder = tempfile::tempdir().unwrap();
    let file = state(&folder);
    let store = Store::open(&file).unwrap();
    let production = production();
    let calibration = watched(&piece(&production, 0, 1));
    watch(&store, &calibration, "piece 0", &piece(&production, 0, 1)).unwrap();
    let connection = rusqlite::Connection::open(&file).unwrap();
    connection.execute_batch(&copies(300)).unwrap();
    connection
        .execute_batch("INSERT INTO alarms (weld, kind, since, p_log10) SELECT id, 'timing', 1, -9 FROM welds WHERE id % 7 = 0")
        .unwrap();
    let welds = || store.calibrations().unwrap()[0].welds;
    assert_eq!(welds(), 301);
    assert_eq!(store.forget_before(2_000).unwrap(), 0, "all are younger");
    let year_3000 = 32_503_680_000;
    // Piece 0 has a statistic that the detector looks back on: it stays, however old.
    let forgotten: Vec<usize> = (0..5).map(|_| store.forget_before(year_3000).unwrap()).collect();
    assert_eq!(forgotten, [100, 100, 100, 0, 0]);
    assert_eq!(welds(), 1);
    let rest = store.history(1, 1000).unwrap();
    assert_eq!(rest.iter().map(|row| row.number).collect::<Vec<_>>(), [0]);
    let alarms: i64 = connection.query_row("SELECT count(*) FROM alarms", [], |row| row.get(0)).unwrap();
    assert_eq!(alarms, 0, "alarms go with their welds");
}

/// Copies of the first weld, each with a content of its own and without a statistic.
fn copies(count: usize) -> String {
    format!(
        "WITH RECURSIVE n (k) AS (SELECT 1 UNION ALL SELECT k + 1 FROM n WHERE k < {count}) \
         INSERT INTO welds (calibration, part, content, name, watched_s, used, outliers, noise_factor, estimates, p_log10, line) \
         SELECT calibration, part, 'copy ' || k, 'copy ' || k, watched_s, used, outliers, noise_factor, estimates, p_log10, \
         line FROM n, welds WHERE welds.id = 1"
    )
}

/// Welds of another calibration between, whose history begins and ends there.
#[test]
fn the_calibration_in_use_is_that_of_the_last_weld() {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::open(&state(&folder)).unwrap();
    let production = production();
    let known = watched(&piece(&production, 0, 1));
    let other = Watched { name: "other".to_owned(), sha256: "1".to_owned(), ..known.clone() };
    assert_eq!(store.in_use().unwrap(), None);
    let said = [&known, &known, &other, &known].into_iter().enumerate().map(|(number, calibration)| {
        let line = watch(&store, calibration, "weld", &piece(&production, number, 1)).unwrap();
        (store.in_use().unwrap(), line.history)
    });
    let expected = [
        (Some(1), HistoryOf::New(None)),
        (Some(1), HistoryOf::Same),
        (Some(2), HistoryOf::New(Some("test".to_owned()))),
        (Some(1), HistoryOf::Resumed("other".to_owned())),
    ];
    assert_eq!(said.collect::<Vec<_>>(), expected);
}

/// Whoever is told of alarms learns that one is closed by another calibration, and of it anew when the first is in use again.
#[test]
fn an_alarm_of_a_calibration_that_is_replaced_is_closed() {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::open(&state(&folder)).unwrap();
    let mut production = production();
    let known = watched(&piece(&production, 0, 1));
    let other = Watched { name: "other".to_owned(), sha256: "1".to_owned(), ..known.clone() };
    let receiver = store.receiver("http://cell-pc/alarm", "cell-pc").unwrap();
    production.change = Some(ScheduledChange { change: Change::Timing(1e-3), piece: 3, after: 0.0 });
    let mut texts = Vec::new();
    for (number, calibration) in [&known, &known, &known, &known, &other, &known].into_iter().enumerate() {
        watch(&store, calibration, &format!("piece {number}"), &piece(&production, number, 1)).unwrap();
        while let Some(message) = store.take_message(receiver, 1000, 1000).unwrap() {
            let body: serde_json::Value = serde_json::from_str(&message.body).unwrap();
            texts.push((number, body["event"].as_str().unwrap().to_owned()));
            store.told(receiver, message.id).unwrap();
        }
    }
    // The time offset of neither is known: the first weld of the other one is right for it.
    let expected =
        [(3, "raised"), (4, "ended"), (5, "raised")].map(|(number, event)| (number, event.to_owned()));
    assert_eq!(texts, expected);
}
