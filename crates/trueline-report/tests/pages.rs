//! The numbers in the report of a calibration.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use sha2::{Digest, Sha256};
use trueline_dataset::Recording;
use trueline_method::{Calibration, Config, Hold, calibrate};
use trueline_report::calibration_page::{Source, html, page};
use trueline_report::page::{Block, Drawn, Page, Series};
use trueline_sim::{PlateForm, Plates, Preset, scan_plates, simulate};

fn page_of(recording: &Recording, calibration: &Calibration) -> Page {
    page(&Source { calibration, recording, title: "t", command: "c", probable_cause: None, frames: &[] })
}

fn series<'a>(page: &'a Page, id: &str) -> &'a [Series] {
    let blocks = page.sections.iter().flat_map(|section| &section.blocks);
    let mut found = blocks.filter_map(|block| match block {
        Block::Chart(chart) if chart.id == id => Some(chart),
        _ => None,
    });
    let Drawn::Plot { series, .. } = &found.next().unwrap().drawn else { panic!("{id} is no plot") };
    series
}

fn slope(page: &Page, series: &Series) -> f64 {
    let pairs = page.columns.values(series.x).iter().zip(page.columns.values(series.y));
    let (product, square) =
        pairs.fold((0.0, 0.0), |(p, s), (x, y)| (p + f64::from(x * y), s + f64::from(x * x)));
    product / square
}

#[test]
fn the_dashed_line_slopes_as_the_points_of_an_offset_that_is_too_small_do() {
    let recording = simulate(&Preset::Paper.scenario(), 2).unwrap();
    let mut guess = recording.truth.as_ref().unwrap().parameters;
    guess.time_offset_s -= 1e-3;
    let config = Config { hold: vec![Hold::TimeOffset], ..Config::default() };
    let calibration = calibrate(&recording, Some(&guess), &config).unwrap();
    let page = page_of(&recording, &calibration);
    let [features, line] = series(&page, "residual-speed") else { panic!("points and a line") };
    // 1 ms against the 0.1 ms of the line, less what the hand-eye takes up of it.
    let ratio = slope(&page, features) / slope(&page, line);
    assert!((8.0..11.0).contains(&ratio), "{ratio}");
}

#[test]
fn before_and_after_are_of_the_same_features_and_after_is_on_the_line() {
    let mut scenario = Preset::Quick.scenario();
    scenario.disturbance.outlier_fraction = 0.2;
    let recording = simulate(&scenario, 3).unwrap();
    let calibration = calibrate(&recording, None, &Config::default()).unwrap();
    let page = page_of(&recording, &calibration);
    for id in ["seam-2", "seam-3"] {
        let [before, after] = series(&page, id) else { panic!("before and after") };
        // Without the offset some features at an end of the recording find no pose, or find one.
        let (n, m) = (page.columns.len(before.x), page.columns.len(after.x));
        assert!(n.abs_diff(m) <= 2, "{n} {m}");
        let rms = |s: &Series| {
            let y = page.columns.values(s.y);
            (y.iter().map(|y| f64::from(*y).powi(2)).sum::<f64>() / y.len() as f64).sqrt()
        };
        // 0.03 mm of noise, and 17.73 ms at some 20 mm/s.
        assert!(rms(after) < 0.06 && rms(before) > 0.1, "{} {}", rms(before), rms(after));
    }
}

#[test]
fn what_is_said_cannot_end_the_page() {
    let recording = simulate(&Preset::ConstantAttitude.scenario(), 1).unwrap();
    let calibration = calibrate(&recording, None, &Config::default()).unwrap();
    let evil = "</script><script>alert(1)</script>{{data}}\"";
    let text = html(&Source {
        calibration: &calibration,
        recording: &recording,
        title: evil,
        command: evil,
        probable_cause: Some(evil),
        frames: &[],
    });
    assert!(!text.contains("<script>alert") && text.contains("&lt;script&gt;alert(1)"));
    // A browser runs the scripts of the program and no other.
    let policy = text.split_once("script-src ").unwrap().1.split_once(';').unwrap().0;
    assert!(policy.split(' ').all(|allowed| allowed.starts_with("'sha256-")), "{policy}");
    let scripts: Vec<&str> =
        text.split("<script>").skip(1).map(|rest| rest.split_once("</script>").unwrap().0).collect();
    assert_eq!(scripts.len(), policy.split(' ').count());
    for script in scripts {
        let hash = STANDARD.encode(Sha256::digest(script));
        assert!(policy.contains(&hash), "no hash of {script:.60}");
    }
    // A constant attitude is refused with the motion that cures it, first thing on the page.
    let verdict =
        text.find("class=\"verdict bad\">Not accepted: the sensor was tilted too little. Tilt it").unwrap();
    let cause = text.find("Probable cause").unwrap();
    let (advice, drawing) = (
        text.find("Tilt the torch by at least ±10°").unwrap(),
        text.find("<figure class=\"wide drawing\">").unwrap(),
    );
    assert!(
        verdict < cause && cause < advice && advice < drawing,
        "the cause comes before what follows from it"
    );
    assert_eq!(text.matches("by at least ±10° about two different axes").count(), 1, "a reason is told once");
}

#[test]
fn the_error_of_a_seam_point_comes_first_with_its_budget_and_the_numbers_add_up() {
    let recording = simulate(&Preset::Quick.scenario(), 1).unwrap();
    let calibration = calibrate(&recording, None, &Config::default()).unwrap();
    let error = calibration.findings.checks.seam_error.unwrap();
    let page = page_of(&recording, &calibration);
    let [Block::Cards(cards), Block::Table(table), ..] = page.sections[0].blocks.as_slice() else {
        panic!("{:?}", page.sections[0].blocks)
    };
    assert_eq!(cards[0].name, "Error of a seam point");
    assert!(cards[0].values[0].ends_with("from the scan alone") && cards[0].values[1].ends_with("in total"));
    let number = |text: &str| text.trim_matches(|c: char| !c.is_ascii_digit()).parse::<f64>().unwrap();
    let sizes: Vec<f64> = table.rows.iter().map(|row| number(&row.cells[1])).collect();
    assert!(sizes.is_sorted_by(|a, b| a >= b), "{sizes:?}");
    assert!(table.rows.iter().all(|row| !row.cells[3].is_empty()));
    // Parts below 0.5 % of the variance are left out, six of them at most, and each is rounded to two digits.
    let sum = sizes.iter().map(|mm| mm * mm).sum::<f64>().sqrt();
    assert!((sum / (1e3 * error.rms_m) - 1.0).abs() < 0.06, "{sum} {}", error.rms_m);
}

/// Heights of a chart's cells by their place along the seam, mm.
fn heights(page: &Page, id: &str) -> Vec<[f64; 2]> {
    let blocks = page.sections.iter().flat_map(|section| &section.blocks);
    let mut found = blocks.filter_map(|block| match block {
        Block::Chart(chart) if chart.id == id => Some(&chart.drawn),
        _ => None,
    });
    let Some(Drawn::Heat(heat)) = found.next() else { panic!("{id} is no map") };
    heat.cells.iter().map(|cell| [cell[0], cell[2]]).collect()
}

#[test]
fn a_bowed_plate_is_seen_bowed_and_a_flat_one_flat() {
    let scenario = Preset::Quick.scenario();
    // 0.3 mm at 100 mm along the seam.
    let forms = [PlateForm::of_term(2, 0.3e-3), PlateForm::default()];
    let recording = scan_plates(&scenario, &Plates { forms, ..Plates::default() }, 4).unwrap();
    let calibration = calibrate(&recording, None, &Config::default()).unwrap();
    let page = page_of(&recording, &calibration);
    let mean = |id: &str, near: bool| {
        let of = heights(&page, id);
        let end_mm = of.iter().map(|[s, _]| s.abs()).fold(0.0, f64::max);
        let of =
            of.iter().filter(|[s, _]| if near { s.abs() < 0.2 * end_mm } else { s.abs() > 0.8 * end_mm });
        let (sum, count) = of.fold((0.0, 0.0), |(sum, n), [_, height]| (sum + height, n + 1.0));
        (sum / count, end_mm)
    };
    for (id, bow_mm) in [("plate-0", 0.3), ("plate-1", 0.0)] {
        let ((middle, end_mm), (ends, _)) = (mean(id, true), mean(id, false));
        // s² over cells within 0.2 and beyond 0.8 of the ends is 0.013 and 0.81 of that at the ends; cells are a twelfth of it.
        let expected = bow_mm * (end_mm / 100.0).powi(2) * 0.8;
        println!("{id}: {middle:.4} mm in the middle, {ends:.4} mm at the ends, bow {expected:.4} mm");
        assert!(((ends - middle).abs() - expected).abs() < 0.1 * expected + 0.01, "{id}");
    }
    let without = simulate(&scenario, 4).unwrap();
    let calibration = calibrate(&without, None, &Config::default()).unwrap();
    assert!(page_of(&without, &calibration).sections.iter().all(|section| section.id != "plates"));
}
