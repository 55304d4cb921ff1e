//! The server against clients as they should not be: other hosts, other methods, too long, too slow, too many.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::sync::Arc;
use std::time::{Duration, Instant};
use trueline_cli::serve::http::{Media, Reply};
use trueline_cli::serve::{Limits, LiveServer, Site};

struct Three;

impl Site for Three {
    fn paths(&self) -> &'static [&'static str] {
        &["/", "/fails", "/panics"]
    }

    fn reply(&self, path: &str) -> Result<Reply, String> {
        match path {
            "/" => Ok(Reply::text(Media::Html, "<p>here</p>")),
            "/fails" => Err("not now".to_owned()),
            _ => panic!("a site that panics"),
        }
    }
}

fn server(limits: Limits) -> LiveServer {
    LiveServer::start(SocketAddr::from(([127, 0, 0, 1], 0)), &["cell-pc".to_owned()], limits, Arc::new(Three))
        .unwrap()
}

/// Status and whole reply.
fn asked(server: &LiveServer, request: &str) -> (u16, String) {
    let mut stream = TcpStream::connect(server.address()).unwrap();
    stream.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
    // A server that has refused already may have closed.
    let _refused = stream.write_all(request.as_bytes());
    let mut reply = Vec::new();
    let _reset = stream.read_to_end(&mut reply);
    let reply = String::from_utf8_lossy(&reply).into_owned();
    (reply.split(' ').nth(1).and_then(|status| status.parse().ok()).unwrap_or(0), reply)
}

fn get(server: &LiveServer, path: &str, host: &str) -> (u16, String) {
    asked(server, &format!("GET {path} HTTP/1.1\r\nHost: {host}\r\n\r\n"))
}

#[test]
fn every_reply_forbids_what_a_page_could_be_made_to_do() {
    let server = server(Limits::default());
    for (path, host, status) in [
        ("/", "localhost", 200),
        ("/", "cell-pc:8080", 200),
        ("/fails", "127.0.0.1", 503),
        ("/panics", "127.0.0.1", 500),
        ("/nothing", "127.0.0.1", 404),
        ("/../../etc/passwd", "127.0.0.1", 404),
        ("/", "evil.example", 421),
    ] {
        let (found, reply) = get(&server, path, host);
        assert_eq!(found, status, "{path} {host}: {reply}");
        let lower = reply.to_ascii_lowercase();
        let policy =
            lower.lines().find(|line| line.starts_with("content-security-policy:")).expect("no policy");
        assert!(policy.contains("default-src 'none'") && !policy.contains("unsafe"), "{policy}");
        for forbidden in
            ["x-content-type-options: nosniff", "x-frame-options: deny", "cache-control: no-store"]
        {
            assert!(lower.contains(forbidden), "{path}: {forbidden}");
        }
        assert!(!lower.contains("access-control-allow"), "other pages may read it: {reply}");
        assert_eq!(reply.contains("here"), status == 200, "{path} {host}");
    }
    assert!(get(&server, "/fails", "localhost").1.contains("not now"));
}

#[test]
fn only_reading_is_answered() {
    let server = server(Limits::default());
    for method in ["POST", "PUT", "DELETE", "PATCH", "OPTIONS", "TRACE"] {
        let (status, _) =
            asked(&server, &format!("{method} / HTTP/1.1\r\nHost: localhost\r\nContent-Length: 0\r\n\r\n"));
        assert_eq!(status, 405, "{method}");
    }
    let (status, reply) = asked(&server, "HEAD / HTTP/1.1\r\nHost: localhost\r\n\r\n");
    assert!(status == 200 && !reply.contains("here"), "{reply}");
    for malformed in
        ["GET / HTTP/1.1\r\n\r\n", "GET / HTTP/1.1\r\nHost: a\r\nHost: a\r\n\r\n", "nonsense\r\n\r\n"]
    {
        let (status, reply) = asked(&server, malformed);
        assert!((400..500).contains(&status), "{malformed}: {reply}");
    }
    let long = format!("GET / HTTP/1.1\r\nHost: localhost\r\nX: {}\r\n\r\n", "a".repeat(64 << 10));
    assert!(!asked(&server, &long).1.contains("here"), "a head of 64 KB");
    assert_eq!(get(&server, "/", "localhost").0, 200, "it goes on");
}

#[test]
fn clients_that_say_nothing_are_cut_off_and_the_next_one_is_answered() {
    let limits = Limits { connections: 4, head: Duration::from_millis(300), ..Limits::default() };
    let server = server(limits);
    let begin = Instant::now();
    let silent: Vec<TcpStream> = (0..12)
        .map(|k| {
            let mut stream = TcpStream::connect(server.address()).unwrap();
            if k % 2 == 0 {
                stream.write_all(b"GET / HTTP/1.1\r\nHost: local").unwrap();
            }
            stream
        })
        .collect();
    // Three rounds of four that hold on for 0.3 s each.
    assert_eq!(get(&server, "/", "localhost").0, 200);
    assert!(begin.elapsed() >= Duration::from_millis(250), "nobody had to wait: the limit is none");
    drop(silent);
}

#[test]
fn the_end_waits_for_nobody() {
    let server = server(Limits::default());
    let address = server.address();
    let _silent = TcpStream::connect(address).unwrap();
    let begin = Instant::now();
    drop(server);
    assert!(begin.elapsed() < Duration::from_secs(5), "{:?}", begin.elapsed());
    assert!(TcpStream::connect(address).is_err(), "it still listens");
}

#[test]
fn an_address_that_is_taken_and_a_name_that_is_none_are_told() {
    let first = server(Limits::default());
    let start = |address, name: &str| {
        LiveServer::start(address, &[name.to_owned()], Limits::default(), Arc::new(Three))
    };
    let taken = start(first.address(), "cell-pc").unwrap_err();
    assert!(taken.to_string().contains("cannot listen there") && taken.hint().contains("port"), "{taken}");
    let free = SocketAddr::from(([127, 0, 0, 1], 0));
    assert!(start(free, "cell pc").unwrap_err().to_string().contains("cell pc"));
}
