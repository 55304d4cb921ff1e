//! Parts with curved seams are watched: one curve for all of them, a place for each, and the time offset from every weave.

use trueline_dataset::Recording;
use trueline_sim::curves::{CurveKind, CurveProduction, CurveScan};
use trueline_watch::detect::PieceInformation;
use trueline_watch::innovation::{Weld, shape_origin_m};
use trueline_watch::parameters::UNITS;
use trueline_watch::{Kind, Part, Reference, Store, Watched, watch};

/// One woven pass at the torch's attitude: 10 mm/s, 3 mm to each side, 2 Hz, at hardly any tilt.
fn production(kind: CurveKind) -> CurveProduction {
    let scan = CurveScan {
        passes: 1.0,
        lasts_s: 30.0,
        tilt_rad: 0.0,
        weave_hz: 2.0,
        outliers: 0.0,
        ..CurveScan::good(kind)
    };
    CurveProduction { scan, off_m: 0.3e-3, turned_rad: 0.1_f64.to_radians(), seed: 7 }
}

fn calibration(weld: &Recording) -> Watched {
    let guess = weld.truth.as_ref().unwrap().parameters;
    Watched { name: "result.json".into(), sha256: "0".into(), guess, result: None, tolerance_m: None }
}

/// What a weld says about θ, wherever its seam lies, in units: estimate of the time offset alone and its ±.
fn time_offset_s(weld: &Recording, parts: &[Part], reference: &Reference) -> (f64, f64) {
    let seams = Weld::of_known(weld, reference, parts).unwrap();
    let part = parts.first().cloned().unwrap_or(Part { lines: seams.seams() });
    let evidence = seams.evidence(&part, reference).unwrap();
    let piece = PieceInformation::of(&evidence.statistic, 0, &part, None);
    let information = piece.within.matrix[(0, 0)];
    (piece.within.vector[0] / information * UNITS[0], information.sqrt().recip() * UNITS[0])
}

/// The table of the design (section 7): the time offset of a woven part to 0.05 to 0.06 ms of noise 0.04 mm, within 20 % of what the parts scatter by.
#[test]
fn every_woven_part_gives_the_time_offset_it_promises() {
    for kind in [CurveKind::Arc, CurveKind::Pipe] {
        let production = production(kind);
        let first = production.piece(0, 0.0);
        let guess = first.truth.as_ref().unwrap().parameters;
        let reference = Reference::of_value(guess, shape_origin_m(&first, &guess).unwrap());
        let part = Part { lines: Weld::of(&first, &reference).unwrap().seams() };
        assert!(part.lines.len() > 2, "{}", part.lines.len());
        let (mut squares, mut said, mut late_s) = (0.0, 0.0, 0.0);
        const PIECES: u64 = 24;
        for number in 1..=PIECES {
            let weld = production.piece(number, 0.5e-3);
            let (found_s, sigma_s) = time_offset_s(&weld, std::slice::from_ref(&part), &reference);
            squares += ((found_s - 0.5e-3) / sigma_s).powi(2) / PIECES as f64;
            (said, late_s) = (said + sigma_s / PIECES as f64, late_s + found_s / PIECES as f64);
        }
        // χ²₂₄/24 is within 1 ± 4·√(2/24); the mean of 24 pieces within 4 of its ±.
        assert!((0.2..2.2).contains(&squares), "{} {squares} {said}", kind.name());
        assert!((late_s - 0.5e-3).abs() < 4.0 * said / (PIECES as f64).sqrt(), "{} {late_s}", kind.name());
        assert!((0.03e-3..0.09e-3).contains(&said), "{} {said}", kind.name());
    }
}

/// Parts that lie elsewhere raise no alarm, late images do, and what no weld at one attitude shows is named.
#[test]
fn late_images_of_curved_parts_raise_an_alarm() {
    let production = production(CurveKind::Arc);
    let first = production.piece(0, 0.0);
    let folder = tempfile::tempdir().unwrap();
    let store = Store::open(&folder.path().join("cell.sqlite")).unwrap();
    let calibration = calibration(&first);
    let told = |number: u64, late_s: f64| {
        watch(&store, &calibration, &format!("weld {number}"), &production.piece(number, late_s)).unwrap()
    };
    for number in 0..4 {
        let line = told(number, 0.0);
        assert!(line.alarm.is_none(), "{number}: {}", line.to_json());
        // One part, whichever place it lies at.
        assert_eq!(line.part, 1);
        assert!(
            line.blind_to.iter().any(|what| what.starts_with(Kind::Bracket.name())),
            "{:?}",
            line.blind_to
        );
        assert!(line.blind_to.iter().all(|what| what != Kind::Timing.name()), "{:?}", line.blind_to);
    }
    let line = told(4, 1e-3);
    let alarm = line.alarm.as_ref().unwrap();
    assert_eq!(alarm.alarm.change.kind, Kind::Timing);
    let value = alarm.alarm.change.value[0].unwrap();
    assert!((value - 1e-3).abs() < 4.0 * alarm.alarm.change.sigma[0].unwrap(), "{value}");
}
