//! The text of the pages and the metrics.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

#[path = "it/common/live_sites.rs"]
mod common;

use common::{Growing, offer_picture, state_with_an_alarm, state_within_tolerance};
use trueline_cli::serve::http::Media;
use trueline_cli::serve::{Site, WatchSite};

fn text(site: &dyn Site, path: &str) -> String {
    String::from_utf8(site.reply(path).unwrap().body).unwrap()
}

/// Nothing in a page may run or style by itself: the policy would block it.
fn is_inert(page: &str) {
    assert!(
        !page.contains("<style")
            && !page.contains(" style=")
            && !page.contains(" onerror=")
            && !page.contains("javascript:")
    );
    assert_eq!(page.matches("<script").count(), 1);
    assert!(page.contains("<script src=\"/live.js\" defer></script>"));
}

#[test]
fn a_page_tells_state_alarm_and_evidence_of_every_cell() {
    let folder = tempfile::tempdir().unwrap();
    let state = state_with_an_alarm(folder.path());
    let site = WatchSite::of(vec![state, folder.path().join("missing.sqlite")]);
    let page = text(&site, "/");
    assert!(!page.contains("<img src=x"), "a name became markup");
    is_inert(&page.replace("&lt;img src=x onerror=alert(1)&gt;", ""));
    for expected in [
        "cell-7",
        "ALARM: Pictures arrive ",
        "later since weld 4 (&lt;img src=x onerror=alert(1)&gt;), seam points are ",
        "Look at exposure, driver, network and clocks, or calibrate again.",
        "the camera&#39;s time offset has changed",
        "These welds are blind to: seam.",
        "Active alarm",
        "blind to",
        "fixture",
        "learning: 4 of 30 parts",
        "plc.example: 1 message",
        "missing",
        "cannot be read",
    ] {
        assert!(page.contains(expected), "{expected}: {page}");
    }
    assert!(!page.contains("secret"), "an address with its token");
    // Each number of the evidence has its ±, and 1 ms is within it.
    let row = page.split("<th scope=\"row\">time offset</th><td>").nth(1).unwrap().split('<').next().unwrap();
    let [value, sigma] =
        [0, 1].map(|k| row.trim_end_matches(" ms").split(" ± ").nth(k).unwrap().parse::<f64>().unwrap());
    assert!((value - 1.0).abs() < 4.0 * sigma && sigma < 0.1, "{row}");
    // Four lines of probabilities and a limit; one dot a weld that shows its time offset.
    assert!(page.matches("class=\"limit\"").count() >= 1 && page.matches("class=\"dot a\"").count() >= 6);
    assert!(!page.contains("NaN"));
}

/// The same change where it is within the tolerance, and after a repair was reported.
#[test]
fn what_is_within_the_tolerance_is_amber_and_no_alarm() {
    let folder = tempfile::tempdir().unwrap();
    let site = WatchSite::of(vec![state_within_tolerance(folder.path())]);
    let page = text(&site, "/");
    assert!(page.contains("class=\"state mind\">Changed within the tolerance: Pictures arrive "), "{page}");
    assert!(!page.contains("ALARM"), "{page}");
    let metrics = text(&site, "/metrics");
    for expected in [
        "trueline_watch_alarm{cell=\"cell-8\",kind=\"timing\"} 0.0",
        "trueline_watch_changed_within_tolerance{cell=\"cell-8\",kind=\"timing\"} 1.0",
        "trueline_watch_tolerance_meters{cell=\"cell-8\"} 0.001",
    ] {
        assert!(metrics.contains(expected), "{expected}:\n{metrics}");
    }
    let line = metrics.lines().find(|line| line.starts_with("trueline_watch_seam_error_meters{")).unwrap();
    let error_m: f64 = line.rsplit(' ').next().unwrap().parse().unwrap();
    // 1 ms at the 0.12 m/s of these scans, and what their swing adds.
    assert!((1.1e-4..3e-4).contains(&error_m), "{line}");
}

#[test]
fn metrics_are_open_metrics_with_units_and_labels() {
    let folder = tempfile::tempdir().unwrap();
    let site = WatchSite::of(vec![state_with_an_alarm(folder.path())]);
    assert_eq!(site.reply("/metrics").unwrap().media, Media::Metrics);
    let metrics = text(&site, "/metrics");
    for expected in [
        "trueline_watch_welds{cell=\"cell-7\"} 6.0",
        "trueline_watch_alarm{cell=\"cell-7\",kind=\"timing\"} 1.0",
        "trueline_watch_alarm{cell=\"cell-7\",kind=\"bracket\"} 0.0",
        "trueline_watch_blind{cell=\"cell-7\",change=\"seam\"} 1.0",
        "trueline_watch_blind{cell=\"cell-7\",change=\"timing\"} 0.0",
        "trueline_watch_blind{cell=\"cell-7\",change=\"bracket turn about depth\"} 0.0",
        "trueline_watch_messages_waiting{cell=\"cell-7\",receiver=\"plc.example\"} 1.0",
        "# UNIT trueline_watch_time_offset_change_seconds seconds",
    ] {
        assert!(metrics.contains(expected), "{expected}:\n{metrics}");
    }
    let value = |name: &str| -> f64 {
        let line = metrics.lines().find(|line| line.starts_with(name)).unwrap();
        line.rsplit(' ').next().unwrap().parse().unwrap()
    };
    assert!(value("trueline_watch_evidence{cell=\"cell-7\",kind=\"timing\"}") > 6.25);
    // One weld alone, in seconds.
    assert!((value("trueline_watch_time_offset_change_seconds{") - 1e-3).abs() < 2e-4);
    assert!(metrics.ends_with("# EOF\n"));
    let missing = WatchSite::of(vec![folder.path().join("missing.sqlite")]);
    assert!(missing.reply("/metrics").is_err(), "no numbers are not zero");
}

#[test]
fn a_recording_is_shown_with_its_pose_losses_estimate_and_what_is_missing() {
    let growing = Growing::new();
    assert!(text(&growing.site, "/").contains("Nothing received yet"));
    assert!(growing.site.reply("/picture.png").is_err());
    growing.grow(0.5);
    growing.grow(1.0);
    offer_picture(&growing.picture, 17);
    let page = text(&growing.site, "/");
    is_inert(&page);
    for expected in [
        "travelling: 250 Hz",
        "x y z (mm)",
        "6 of 304 (2.0 %)",
        "in 280 (93 %)",
        "/picture.png?frame=17",
        "the seam is marked",
        "cx=\"320.5\" cy=\"200.5\"",
        " ms</td>",
        "± ",
    ] {
        assert!(page.contains(expected), "{expected}: {page}");
    }
    assert!(!page.contains("NaN"));
    let png = growing.site.reply("/picture.png").unwrap();
    assert_eq!(png.media, Media::Png);
    let mut reader = png::Decoder::new(std::io::Cursor::new(png.body)).read_info().unwrap();
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut pixels).unwrap();
    assert_eq!((info.width, info.height), (640, 480));
    assert!(pixels[200 * 640 + 320] > 200 && pixels[10] < 60, "the stripe is where it was");
}
