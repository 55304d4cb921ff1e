//! Messages about alarms to a broker that knows two packets: CONNECT, and PUBLISH with QoS 1; in the open and over TLS.
#![cfg(feature = "mqtt")]

use rustls::pki_types::pem::PemObject;
use rustls::pki_types::{CertificateDer, PrivateKeyDer};
use rustls::{ServerConfig, ServerConnection, StreamOwned};
use serde_json::Value;
use std::io::{Read, Write};
use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::thread;
use std::time::{Duration, Instant};
use trueline_watch::Store;
use trueline_watch::tell::{Courier, Pace, at};

const LONG: Duration = Duration::from_secs(30);
/// Quicker than in a factory: looks come at once, tries a second apart.
const QUICK: Pace =
    Pace { patience: Duration::from_secs(10), look_every: Duration::from_millis(20), first_wait_s: 1 };
const ACCEPTED: u8 = 0;
const NOT_AUTHORISED: u8 = 5;

/// A certificate or key that was made for this test, for 127.0.0.1, up to the year 2099.
fn made(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/tls").join(name)
}

fn packet(stream: &mut impl Read) -> (u8, Vec<u8>) {
    let mut head = [0; 2];
    stream.read_exact(&mut head).unwrap();
    assert!(head[1] < 128, "a short packet has one byte of length");
    let mut body = vec![0; usize::from(head[1])];
    stream.read_exact(&mut body).unwrap();
    (head[0], body)
}

/// Answers a connection; gives the texts behind the protocol's name, which are client, user and password.
fn connected(stream: &mut (impl Read + Write), code: u8) -> Vec<String> {
    let (kind, body) = packet(stream);
    assert_eq!((kind, &body[..6]), (0x10, &b"\x00\x04MQTT"[..]), "CONNECT");
    stream.write_all(&[0x20, 2, 0, code]).unwrap();
    let (mut texts, mut rest) = (Vec::new(), &body[10..]);
    while let [high, low, after @ ..] = rest {
        let (text, next) = after.split_at(usize::from(u16::from_be_bytes([*high, *low])));
        texts.push(String::from_utf8(text.to_vec()).unwrap());
        rest = next;
    }
    texts
}

/// Takes a message, whose `n` is 1, and acknowledges it or goes.
fn published(stream: &mut (impl Read + Write), acknowledges: bool) {
    let (kind, body) = packet(stream);
    // PUBLISH, QoS 1, retained; the topic with its length, the packet's number, the message.
    assert_eq!(kind & 0xf7, 0x33, "PUBLISH");
    assert_eq!(&body[..9], b"\x00\x07cells/7");
    assert_eq!(serde_json::from_slice::<Value>(&body[11..]).unwrap()["n"], 1);
    if acknowledges {
        stream.write_all(&[0x40, 2, body[9], body[10]]).unwrap();
        stream.flush().unwrap();
        // A broker goes on; it is the client that leaves.
        let _left = stream.read_to_end(&mut Vec::new());
    }
}

/// A state with a message for a receiver.
struct Cell {
    store: Store,
    courier: Courier,
    _folder: tempfile::TempDir,
}

impl Cell {
    fn telling(address: &str) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let state = folder.path().join("cell.sqlite");
        let store = Store::open(&state).unwrap();
        let courier = Courier::start(&state, at(address, QUICK.patience).unwrap(), QUICK).unwrap();
        store.add_message(r#"{"n":1}"#).unwrap();
        Self { store, courier, _folder: folder }
    }

    /// Waits until the message is told, or why it is not.
    fn until_told(self) {
        until("it is told", || self.store.receivers().unwrap()[0].waiting == 0);
        drop(self.courier);
    }

    fn until_refused(self) -> String {
        let why = || self.store.receivers().unwrap()[0].error.clone();
        until("it is refused", || why().is_some());
        assert_eq!(self.store.receivers().unwrap()[0].waiting, 1);
        why().unwrap()
    }
}

fn until(what: &str, mut is_so: impl FnMut() -> bool) {
    let begin = Instant::now();
    while !is_so() {
        assert!(begin.elapsed() < LONG, "not so after {LONG:?}: {what}");
        thread::sleep(Duration::from_millis(20));
    }
}

#[test]
fn a_topic_is_told_when_the_broker_has_acknowledged() {
    let broker = TcpListener::bind("127.0.0.1:0").unwrap();
    let cell = Cell::telling(&format!("mqtt://{}/cells/7", broker.local_addr().unwrap()));
    for acknowledges in [false, true] {
        let (mut stream, _) = broker.accept().unwrap();
        assert_eq!(connected(&mut stream, ACCEPTED).len(), 1, "nobody is named");
        published(&mut stream, acknowledges);
    }
    cell.until_told();
}

#[test]
fn a_broker_that_asks_who_it_is_is_given_user_and_password() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("broker.pw");
    std::fs::write(&file, "s3cret\n").unwrap();
    let broker = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = broker.local_addr().unwrap();
    let cell = Cell::telling(&format!("mqtt://cell-7@{address}/cells/7?password-file={}", file.display()));
    let (mut stream, _) = broker.accept().unwrap();
    assert_eq!(connected(&mut stream, NOT_AUTHORISED)[1..], ["cell-7", "s3cret"]);
    drop(stream);
    let (mut stream, _) = broker.accept().unwrap();
    connected(&mut stream, ACCEPTED);
    published(&mut stream, true);
    cell.until_told();
}

/// A broker with a certificate that is signed by `ca.pem`; serves one connection.
fn tls_broker() -> (u16, thread::JoinHandle<bool>) {
    let certificate = CertificateDer::from_pem_file(made("broker.pem")).unwrap();
    let key = PrivateKeyDer::from_pem_file(made("broker.key")).unwrap();
    let config = ServerConfig::builder_with_provider(Arc::new(rustls::crypto::ring::default_provider()))
        .with_safe_default_protocol_versions()
        .unwrap()
        .with_no_client_auth()
        .with_single_cert(vec![certificate], key)
        .unwrap();
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = listener.local_addr().unwrap().port();
    let serve = move || {
        let (stream, _) = listener.accept().unwrap();
        let mut stream = StreamOwned::new(ServerConnection::new(Arc::new(config)).unwrap(), stream);
        // A client that does not trust it goes during the handshake.
        if stream.conn.complete_io(&mut stream.sock).is_err() || stream.conn.is_handshaking() {
            return false;
        }
        connected(&mut stream, ACCEPTED);
        published(&mut stream, true);
        true
    };
    (port, thread::spawn(serve))
}

#[test]
fn a_broker_over_tls_is_told_where_its_certificate_is_vouched_for() {
    let (port, broker) = tls_broker();
    let ca = made("ca.pem");
    let cell = Cell::telling(&format!("mqtts://127.0.0.1:{port}/cells/7?ca={}", ca.display()));
    cell.until_told();
    assert!(broker.join().unwrap());
}

#[test]
fn a_broker_with_another_certificate_is_told_nothing() {
    let ca = format!("?ca={}", made("other_ca.pem").display());
    // The system does not trust it either.
    for trust in [ca.as_str(), ""] {
        let (port, broker) = tls_broker();
        let cell = Cell::telling(&format!("mqtts://127.0.0.1:{port}/cells/7{trust}"));
        let why = cell.until_refused();
        assert!(why.contains("certificate"), "{why}");
        assert!(!broker.join().unwrap());
    }
}

#[test]
fn a_file_that_holds_no_certificate_is_refused_by_name() {
    for file in ["broker.key", "none.pem"] {
        let refused = at(&format!("mqtts://127.0.0.1/cells/7?ca={}", made(file).display()), QUICK.patience);
        let why = refused.err().unwrap().to_string();
        assert!(why.contains(file), "{why}");
    }
}
