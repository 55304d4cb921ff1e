//! Every report in a real browser: nothing is loaded, nothing complains, every chart shows all its points.
//!
//! Needs Chromium: see `common/chromium.rs`.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

#[path = "it/common/chromium.rs"]
mod chromium;

use chromium::attribute;
use serde_json::Value;
use std::fs;
use std::path::Path;
use std::process::Command;

struct Look {
    width: u32,
    dark: bool,
}

/// The page as the browser has built it, and what it said meanwhile.
fn open(browser: &Path, folder: &Path, report: &Path, look: &Look, more: &[&str]) -> [String; 2] {
    let address = format!("file://{}", report.display());
    let scheme = format!("--blink-settings=preferredColorScheme={}", if look.dark { 0 } else { 1 });
    let all = [&["--hide-scrollbars", "--virtual-time-budget=30000", &scheme], more].concat();
    chromium::opened(browser, folder, &address, look.width, &all)
}

/// The charts that the page should draw, with their numbers of points.
fn expected(report: &Path) -> Vec<(String, u64)> {
    let text = fs::read_to_string(report).unwrap();
    let start = text.find("<script id=\"data\" type=\"application/json\">").unwrap();
    let json = text[start..].split_once('>').unwrap().1.split("</script>").next().unwrap();
    let data: Value = serde_json::from_str(json).unwrap();
    let charts = data["charts"].as_array().unwrap().iter();
    charts.map(|c| (c["id"].as_str().unwrap().to_owned(), c["points"].as_u64().unwrap())).collect()
}

fn check(browser: &Path, folder: &Path, report: &Path, look: &Look) {
    let [page, said] = open(browser, folder, report, look, &["--dump-dom"]);
    let what = format!("{} at {} px, dark: {}", report.display(), look.width, look.dark);
    let root = page.split_once("<head>").map_or("", |(root, _)| root);
    assert!(!said.contains(":CONSOLE"), "{what}: {said}");
    assert_eq!(attribute(root, "data-problems"), Some(""), "{what}");
    assert_eq!(attribute(root, "data-requests"), Some("0"), "{what}");
    assert_eq!(attribute(root, "data-overflow"), Some("0"), "{what}: it is wider than the window");
    assert_eq!(attribute(root, "data-theme"), Some(if look.dark { "dark" } else { "light" }), "{what}");
    let charts = expected(report);
    assert!(!charts.is_empty());
    for (id, points) in charts {
        let element = page.split('<').find(|element| element.contains(&format!("id=\"{id}\""))).unwrap();
        let shown = attribute(element, "data-points").map(str::to_owned);
        assert_eq!(shown, Some(points.to_string()), "{what}: chart {id}");
    }
}

fn trueline(folder: &Path, arguments: &[&str]) {
    let output =
        Command::new(env!("CARGO_BIN_EXE_trueline")).current_dir(folder).args(arguments).output().unwrap();
    assert!(output.status.code().unwrap() < 2, "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
}

#[test]
fn every_report_draws_all_its_charts_and_loads_nothing() {
    let Some(browser) = chromium::browser("reports") else { return };
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path();
    for arguments in [
        &["demo", "--quiet"][..],
        &["plan", "--example", "--out", "plan", "--tries", "200", "--shape", "s", "--quiet"],
        &["reproduce", "--out", "paper", "--repeats", "1", "--quiet"],
        &["simulate", "--preset", "profiler", "--outliers", "0.1", "--out", "profile", "--quiet"],
        &["calibrate", "profile", "--json", "profile.json", "--report", "profile.html", "--quiet"],
        &["evaluate", "profile", "--calibration", "profile.json", "--report", "evaluated.html", "--quiet"],
        &["simulate", "--preset", "constant-attitude", "--out", "partial", "--quiet"],
        &["calibrate", "partial", "--report", "partial.html", "--quiet"],
        &["simulate", "--images", "--duration-s", "2", "--out", "pictures", "--quiet"],
        &["features", "pictures", "--report", "features.html", "--quiet"],
        &["calibrate", "pictures", "--report", "pictures.html", "--quiet"],
    ] {
        trueline(folder, arguments);
    }
    let wide = Look { width: 1400, dark: false };
    for report in [
        "trueline-demo/report.html",
        "plan/report.html",
        "paper/report.html",
        "profile.html",
        "evaluated.html",
        "partial.html",
        "features.html",
        "pictures.html",
    ] {
        let report = folder.join(report);
        check(&browser, folder, &report, &wide);
        // A scan of a minute stays below 4 MB; these are shorter.
        assert!(fs::metadata(&report).unwrap().len() < 3_000_000, "{}", report.display());
    }
    for look in [Look { width: 520, dark: true }, Look { width: 1400, dark: true }] {
        check(&browser, folder, &folder.join("trueline-demo/report.html"), &look);
    }
    let pdf = folder.join("report.pdf");
    let print = format!("--print-to-pdf={}", pdf.display());
    open(
        &browser,
        folder,
        &folder.join("trueline-demo/report.html"),
        &wide,
        &[&print, "--no-pdf-header-footer"],
    );
    let printed = fs::read(pdf).unwrap();
    // Text and tables alone are some 60 kB; charts come on top.
    assert!(printed.starts_with(b"%PDF") && printed.len() > 150_000, "{} bytes", printed.len());
}

/// A text that marks the page where a browser obeys it.
const EVIL: &str = "\"'><img src=x onerror=document.documentElement.dataset.obeyed=1>";

#[test]
fn names_of_strangers_are_text_and_a_script_that_gets_into_a_report_does_not_run() {
    let Some(browser) = chromium::browser("reports") else { return };
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path();
    let look = Look { width: 1400, dark: false };
    trueline(folder, &["simulate", "--preset", "quick", "--out", EVIL, "--quiet"]);
    trueline(folder, &["calibrate", EVIL, "--json", "result.json", "--report", "evil.html", "--quiet"]);
    let report = folder.join("evil.html");
    assert!(fs::read_to_string(&report).unwrap().contains("onerror=document"), "the name is on the page");
    check(&browser, folder, &report, &look);
    let obeyed = |report: &Path| {
        let [page, _] = open(&browser, folder, report, &look, &["--dump-dom"]);
        attribute(page.split_once("<head>").unwrap().0, "data-obeyed").is_some()
    };
    assert!(!obeyed(&report));

    // As if a text had not been escaped: the policy stops it, and without the policy it would run.
    let page = fs::read_to_string(&report).unwrap();
    let script = "<script>document.documentElement.dataset.obeyed=1</script>";
    for (name, injected) in [("image.html", EVIL), ("script.html", script)] {
        let file = folder.join(name);
        fs::write(&file, page.replace("<footer>", &format!("<footer>{injected}"))).unwrap();
        assert!(!obeyed(&file), "{name}");
        let open_to_all = fs::read_to_string(&file).unwrap().replacen("Content-Security-Policy", "x", 1);
        fs::write(&file, open_to_all).unwrap();
        assert!(obeyed(&file), "{name}: this test sees nothing");
    }
}
