//! The pages of a cell's folder: what they say, that they change nothing, and that they work behind a proxy.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

use std::fs;
use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, SystemTime};
use trueline_cli::serve::{FolderSite, Limits, LiveServer, Prefix, Site};

fn text(site: &FolderSite, path: &str) -> String {
    String::from_utf8(site.reply(path).unwrap().body).unwrap()
}

/// The word of each step, in order.
fn progress(page: &str) -> Vec<&str> {
    let steps = page.split("id=\"step-").skip(1);
    steps.map(|step| step.split("class=\"state ").nth(1).unwrap().split(['>', '<']).nth(1).unwrap()).collect()
}

fn result(status: &str, reasons: &str) -> String {
    format!(
        r#"{{ "schema_version": 3, "status": "{status}", "reasons": [{reasons}], "time_offset_s": 0.017663,
            "tool_from_camera": {{ "translation_mm": [61.97, 0.01, 145.0], "rotation_wxyz": [1, 0, 0, 0] }},
            "sigma": {{ "time_offset_s": 0.00013, "rotation_rad": [0.001, 0.001, 0.001], "translation_mm": [0.2, 0.2, 0.3] }} }}"#
    )
}

/// An old file, so that nothing counts as being written.
fn write_old(file: &Path, content: &str) {
    fs::create_dir_all(file.parent().unwrap()).unwrap();
    fs::write(file, content).unwrap();
    let old = SystemTime::now() - Duration::from_secs(600);
    fs::File::options().write(true).open(file).unwrap().set_modified(old).unwrap();
}

#[test]
fn the_first_scan_shows_each_step_its_command_line_and_what_is_done() {
    let folder = tempfile::tempdir().unwrap();
    let cell = folder.path().join("my cell");
    fs::create_dir(&cell).unwrap();
    let site = FolderSite::of(cell.clone(), "");
    let page = text(&site, "/first-scan/");
    assert_eq!(progress(&page), ["next", "later", "later", "later", "later", "later"]);
    for command in [
        "trueline listen --bind",
        "--protocol ur-rtde",
        "trueline record --bind",
        "trueline plan --example",
        "trueline calibrate &#39;",
        "trueline export &#39;",
        "/my cell/result.json&#39; --as kuka-tool",
    ] {
        assert!(page.contains(command), "{command}");
    }
    write_old(&cell.join("link.json"), "{}");
    write_old(&cell.join("sensor.toml"), "kind = \"profiler\"");
    write_old(&cell.join("plan/path.csv"), "");
    assert_eq!(progress(&text(&site, "/first-scan/")), ["done", "done", "done", "next", "later", "later"]);
    write_old(&cell.join("scan-1/recording.mcap"), "abc");
    write_old(
        &cell.join("result.json"),
        &result("not_accepted", r#"{ "code": "x", "text": "too <few> tilts" }"#),
    );
    let page = text(&site, "/first-scan/");
    assert_eq!(progress(&page), ["done", "done", "done", "done", "next", "later"]);
    assert!(page.contains("/my cell/scan-1&#39; --json") && page.contains("too &lt;few&gt; tilts"), "{page}");
    write_old(&cell.join("result.json"), &result("accepted", ""));
    let page = text(&site, "/first-scan/");
    assert_eq!(progress(&page), ["done", "done", "done", "done", "done", "next"]);
    for number in ["17.663 ± 0.130", "61.970, 0.010, 145.000", "1.000000, 0.000000"] {
        assert!(page.contains(number), "{number}");
    }
    write_old(&cell.join("result.json"), "{ \"tool_from_camera\": 7 ");
    assert!(text(&site, "/first-scan/").contains("result.json cannot be read"));
}

/// A scan that was recorded elsewhere leaves no traces of the steps before it.
#[test]
fn steps_before_a_scan_that_is_there_are_skipped() {
    let folder = tempfile::tempdir().unwrap();
    let site = FolderSite::of(folder.path().to_owned(), "");
    let is_at = |words: [&str; 6]| assert_eq!(progress(&text(&site, "/first-scan/")), words);
    write_old(&folder.path().join("sensor.toml"), "kind = \"profiler\"");
    is_at(["next", "done", "later", "later", "later", "later"]);
    write_old(&folder.path().join("scan/robot.csv"), "time_s");
    is_at(["skipped", "done", "skipped", "done", "next", "later"]);
    write_old(&folder.path().join("result.json"), &result("accepted", ""));
    is_at(["skipped", "done", "skipped", "done", "done", "next"]);
}

#[test]
fn recordings_are_listed_and_one_that_grows_is_said_to() {
    let folder = tempfile::tempdir().unwrap();
    let site = FolderSite::of(folder.path().to_owned(), "");
    assert!(text(&site, "/recordings/").contains("Nothing has been recorded yet"));
    write_old(&folder.path().join("old/robot.csv"), "time_s");
    fs::create_dir(folder.path().join("<now>")).unwrap();
    fs::write(folder.path().join("<now>/recording.mcap"), vec![0; 1_500_000]).unwrap();
    let page = text(&site, "/recordings/");
    let [now, old] = ["&lt;now&gt;</th><td>being written</td><td>1.5", "old</th><td>finished</td>"]
        .map(|row| page.find(row));
    assert!(now.is_some() && now < old, "the newest first: {page}");
    assert!(text(&site, "/watch/").contains("No weld has been watched yet"));
    assert!(text(&site, "/history/").contains("No weld has been watched yet"));
    let gone = FolderSite::of(folder.path().join("nothing"), "");
    assert!(gone.reply("/").unwrap_err().contains("cannot be read"));
}

fn asked(server: &LiveServer, method: &str, path: &str) -> (u16, String) {
    let mut stream = TcpStream::connect(server.address()).unwrap();
    stream.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
    write!(stream, "{method} {path} HTTP/1.1\r\nHost: localhost\r\n\r\n").unwrap();
    let mut reply = String::new();
    let _reset = stream.read_to_string(&mut reply);
    (reply.split(' ').nth(1).and_then(|status| status.parse().ok()).unwrap_or(0), reply)
}

/// Every address that stands in a page, as a browser would ask for it.
fn addresses(page: &str) -> Vec<String> {
    let found = page.split(['"', '\'']).filter(|part| part.starts_with('/'));
    found.map(str::to_owned).collect()
}

/// A proxy that removes the prefix asks for "/watch/", one that keeps it for "/cells/7/watch/"; the browser asks the proxy
/// for the page's links.
#[test]
fn behind_a_proxy_every_link_leads_somewhere() {
    let folder = tempfile::tempdir().unwrap();
    let prefix = Prefix::new("/cells/7").unwrap();
    let site = Arc::new(FolderSite::of(folder.path().to_owned(), prefix.text()));
    let address = SocketAddr::from(([127, 0, 0, 1], 0));
    let server = LiveServer::start_under(&prefix, address, &[], Limits::default(), site).unwrap();
    let (status, page) = asked(&server, "GET", "/cells/7/");
    assert_eq!(status, 200);
    let links = addresses(&page);
    assert!(links.len() > 8, "{links:?}");
    // Without it browsers ask for /favicon.ico, which is not there.
    assert!(links.iter().any(|link| link == "/cells/7/live.svg"), "{links:?}");
    for link in links {
        let stripped =
            link.strip_prefix("/cells/7").unwrap_or_else(|| panic!("{link}: outside of the prefix"));
        for path in [link.as_str(), stripped] {
            assert_eq!(asked(&server, "GET", path).0, 200, "{path}");
        }
    }
    // Typed without the last slash.
    for path in ["/cells/7", "/cells/7/watch", "/watch", "/cells/7/first-scan"] {
        assert_eq!(asked(&server, "GET", path).0, 200, "{path}");
    }
    assert!(asked(&server, "GET", "/cells/7/history").1.contains("<title>History"));
    for path in ["/cells/8/", "/cells/77", "/cells", "/cells/7/nothing"] {
        assert_eq!(asked(&server, "GET", path).0, 404, "{path}");
    }
}

/// No request changes anything in the folder.
#[test]
fn no_request_changes_anything() {
    let folder = tempfile::tempdir().unwrap();
    write_old(&folder.path().join("scan/robot.csv"), "time_s");
    write_old(&folder.path().join("result.json"), &result("accepted", ""));
    let listed = || {
        let mut all = Vec::new();
        let mut waiting = vec![folder.path().to_owned()];
        while let Some(path) = waiting.pop() {
            let meta = fs::metadata(&path).unwrap();
            if meta.is_dir() {
                waiting.extend(fs::read_dir(&path).unwrap().map(|entry| entry.unwrap().path()));
            }
            all.push((path, meta.modified().unwrap(), meta.len()));
        }
        all.sort();
        all
    };
    let before = listed();
    let site = Arc::new(FolderSite::of(folder.path().to_owned(), ""));
    let server =
        LiveServer::start(SocketAddr::from(([127, 0, 0, 1], 0)), &[], Limits::default(), site).unwrap();
    for path in ["/", "/first-scan/", "/recordings/", "/watch/", "/history/", "/metrics"] {
        assert_eq!(asked(&server, "GET", path).0, 200, "{path}");
        for method in ["POST", "PUT", "DELETE", "PATCH", "OPTIONS", "TRACE", "PROPFIND"] {
            assert_eq!(asked(&server, method, path).0, 405, "{method} {path}");
        }
    }
    assert_eq!(listed(), before);
}
