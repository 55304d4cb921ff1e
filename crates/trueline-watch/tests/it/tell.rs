//! Messages about alarms against receivers as they are in factories: dead, silent, refusing, sending elsewhere, told by two.
#![cfg(feature = "webhook")]

use serde_json::Value;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver as Ear, channel};
use std::thread;
use std::time::{Duration, Instant};
use trueline_watch::Store;
use trueline_watch::tell::{Courier, Pace, at};

const LONG: Duration = Duration::from_secs(30);

/// Quicker than in a factory: looks come at once, tries a second apart.
const QUICK: Pace =
    Pace { patience: Duration::from_secs(10), look_every: Duration::from_millis(20), first_wait_s: 1 };

fn state(folder: &tempfile::TempDir) -> PathBuf {
    folder.path().join("cell.sqlite")
}

fn courier(state: &Path, address: &str) -> Courier {
    Courier::start(state, at(address, QUICK.patience).unwrap(), QUICK).unwrap()
}

fn address(of: SocketAddr) -> String {
    format!("http://{of}/alarm?token=secret")
}

/// Reads one request; its body.
fn request(stream: &mut TcpStream) -> Value {
    let mut reader = BufReader::new(stream);
    let (mut length, mut line) = (0, String::new());
    loop {
        line.clear();
        reader.read_line(&mut line).unwrap();
        if let Some(value) = line.to_ascii_lowercase().strip_prefix("content-length:") {
            length = value.trim().parse().unwrap();
        }
        if line.trim().is_empty() {
            break;
        }
    }
    let mut body = vec![0; length];
    reader.read_exact(&mut body).unwrap();
    serde_json::from_slice(&body).unwrap()
}

/// Answers every request alike and hands its body on.
fn listening(listener: TcpListener, answer: &'static str) -> Ear<Value> {
    let (send, ear) = channel();
    thread::spawn(move || {
        for stream in listener.incoming() {
            let mut stream = stream.unwrap();
            let body = request(&mut stream);
            let _gone = stream.write_all(answer.as_bytes());
            if send.send(body).is_err() {
                return;
            }
        }
    });
    ear
}

const WELL: &str = "HTTP/1.1 204 No Content\r\nConnection: close\r\n\r\n";

fn waiting(store: &Store) -> (usize, Option<String>) {
    let receivers = store.receivers().unwrap();
    assert_eq!(receivers.len(), 1);
    assert!(!receivers[0].name.contains("secret"));
    (receivers[0].waiting, receivers[0].error.clone())
}

fn until(what: &str, mut is_so: impl FnMut() -> bool) {
    let begin = Instant::now();
    while !is_so() {
        assert!(begin.elapsed() < LONG, "not so after {LONG:?}: {what}");
        thread::sleep(Duration::from_millis(20));
    }
}

#[test]
fn a_receiver_that_is_dead_at_first_is_told_everything_in_order() {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::open(&state(&folder)).unwrap();
    store.add_message(r#"{"text":"before anybody listened"}"#).unwrap();
    let free = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
    let courier = courier(&state(&folder), &address(free));
    for n in 0..3 {
        store.add_message(&format!(r#"{{"n":{n}}}"#)).unwrap();
    }
    until("the first try has failed", || waiting(&store).1.is_some());
    assert_eq!(waiting(&store).0, 3);
    let ear = listening(TcpListener::bind(free).unwrap(), WELL);
    let told: Vec<Value> = (0..3).map(|_| ear.recv_timeout(LONG).unwrap()).collect();
    let numbers: Vec<_> = told.iter().map(|body| (body["id"].as_i64(), body["n"].as_i64())).collect();
    // Number 1 is older than this receiver.
    assert_eq!(numbers, [(Some(2), Some(0)), (Some(3), Some(1)), (Some(4), Some(2))]);
    drop(courier);
    assert_eq!(waiting(&store), (0, None));
}

#[test]
fn a_receiver_that_never_answers_delays_no_weld_and_a_kill_meanwhile_loses_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::open(&state(&folder)).unwrap();
    let silent = TcpListener::bind("127.0.0.1:0").unwrap();
    let courier = courier(&state(&folder), &address(silent.local_addr().unwrap()));
    store.add_message(r#"{"n":1}"#).unwrap();
    let (mut stream, _) = silent.accept().unwrap();
    assert_eq!(request(&mut stream)["n"], 1);
    // It has been asked and says nothing; welds go on.
    let begin = Instant::now();
    let transaction = store.begin().unwrap();
    store.add_message(r#"{"n":2}"#).unwrap();
    store.commit(transaction).unwrap();
    assert!(begin.elapsed() < Duration::from_secs(2), "a weld has waited {:?}", begin.elapsed());
    // As if it were killed now.
    std::mem::forget(courier);
    assert_eq!(waiting(&store).0, 2, "a message is lost");
}

#[test]
fn refusals_redirections_and_endless_answers_are_no_success() {
    let elsewhere = TcpListener::bind("127.0.0.1:0").unwrap();
    elsewhere.set_nonblocking(true).unwrap();
    let to = elsewhere.local_addr().unwrap();
    let redirection: &'static str = Box::leak(
        format!("HTTP/1.1 307 Elsewhere\r\nLocation: http://{to}/\r\nContent-Length: 0\r\n\r\n")
            .into_boxed_str(),
    );
    let endless: &'static str =
        Box::leak(format!("HTTP/1.1 200 OK\r\n{}", "X: y\r\n".repeat(200_000)).into_boxed_str());
    for (answer, why) in [
        ("HTTP/1.1 500 No\r\nContent-Length: 0\r\n\r\n", "500"),
        ("HTTP/1.1 404 No\r\nContent-Length: 0\r\n\r\n", "404"),
        (redirection, "307"),
        (endless, ""),
        ("\x00\x01nonsense\r\n\r\n", ""),
        ("", ""),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::open(&state(&folder)).unwrap();
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let courier = courier(&state(&folder), &address(listener.local_addr().unwrap()));
        let ear = listening(listener, answer);
        store.add_message(r#"{"n":1}"#).unwrap();
        ear.recv_timeout(LONG).unwrap();
        until("it is known to have failed", || waiting(&store).1.is_some());
        let (left, error) = waiting(&store);
        assert!(left == 1 && error.as_ref().unwrap().contains(why), "{answer:.40}: {error:?}");
        drop(courier);
    }
    assert!(elsewhere.accept().is_err(), "it went where it was sent");
}

#[test]
fn two_programs_tell_every_message_once() {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::open(&state(&folder)).unwrap();
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let to = address(listener.local_addr().unwrap());
    let ear = listening(listener, WELL);
    let couriers = [courier(&state(&folder), &to), courier(&state(&folder), &to)];
    for n in 0..12 {
        store.add_message(&format!(r#"{{"n":{n}}}"#)).unwrap();
    }
    until("all are told", || waiting(&store).0 == 0);
    drop(couriers);
    let told: Vec<i64> = ear.try_iter().map(|body| body["n"].as_i64().unwrap()).collect();
    assert_eq!(told, (0..12).collect::<Vec<_>>());
}

#[test]
fn what_is_no_address_is_refused() {
    for wrong in ["cell-pc", "ftp://a/b", "http://", "mqtt://host", "mqtts://host:x/topic", "mqtt://host/a/#"]
    {
        assert!(at(wrong, QUICK.patience).is_err(), "{wrong}");
    }
}
