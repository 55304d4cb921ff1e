//! Tests that the clock behind receive stamps is found, or reported as missing.

use trueline_method::input::clock_model::{FitKind, StreamClock, Ticks, fit, missing};

/// Deterministic numbers between 0 and 1.
fn uniform(count: usize) -> Vec<f64> {
    let mut state = 7_u64;
    let mut next = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64
    };
    (0..count).map(|_| next()).collect()
}

fn grid(count: usize, period_s: f64) -> Vec<f64> {
    (0..count).map(|k| 5.0 + k as f64 * period_s).collect()
}

/// The worst regular stamp may be off by four standard deviations of a line's end, 2σ/√n.
fn assert_recovers(clock: &StreamClock, truth: &[f64], sigma: f64) {
    let limit = 8.0 * sigma / (truth.len() as f64).sqrt() + 1e-9;
    for (regular, truth) in clock.regular_s.iter().zip(truth) {
        assert!((regular - truth).abs() < limit, "{} > {limit}", (regular - truth).abs());
    }
}

#[test]
fn uniform_jitter_and_drops_are_seen_through() {
    let all = grid(900, 0.03);
    let (truth, stamps): (Vec<f64>, Vec<f64>) = all
        .iter()
        .zip(uniform(900))
        .enumerate()
        .filter(|(k, _)| !(k % 7 == 3 || (200..290).contains(k)))
        .map(|(_, (t, u))| (*t, t + 2e-3 * (u - 0.5)))
        .unzip();
    let clock = fit(&stamps, Ticks::Counted).unwrap();
    assert_recovers(&clock, &truth, 2e-3 / 12.0_f64.sqrt());
    // The last one is lost too, which no stamp reveals.
    assert_eq!(missing(&stamps, clock.period_s), 899 - truth.len());
    assert_eq!((clock.pieces, clock.fit_kind), (1, FitKind::LeastSquares));
}

#[test]
fn more_than_half_of_the_samples_may_be_lost() {
    let all = grid(3000, 0.004);
    for part in [0.45, 0.6, 0.7] {
        let chance: Vec<f64> = uniform(6000);
        let kept = all.iter().zip(&chance[..3000]).zip(&chance[3000..]).enumerate();
        let kept = kept.filter(|(k, ((_, lost), _))| **lost >= part || [0, 2999].contains(k));
        let (truth, stamps): (Vec<f64>, Vec<f64>) =
            kept.map(|(_, ((t, _), u))| (*t, t + 0.4e-3 * (u - 0.5))).unzip();
        let clock = fit(&stamps, Ticks::Counted).unwrap_or_else(|| panic!("{part}"));
        assert_recovers(&clock, &truth, 0.4e-3 / 12.0_f64.sqrt());
        assert_eq!(missing(&stamps, clock.period_s), 3000 - truth.len(), "{part}");
    }
    // Stamps in whole milliseconds of a source without a regular tick are no clock of a millisecond.
    let mut at = 0.0;
    let uneven = uniform(2000).into_iter().map(|u| {
        at += 0.004 + 0.012 * u;
        f64::round(at * 1e3) * 1e-3
    });
    assert!(fit(&uneven.collect::<Vec<_>>(), Ticks::Counted).is_none());
}

#[test]
fn delays_to_one_side_leave_the_floor() {
    let truth = grid(2000, 0.004);
    let late = uniform(2000).into_iter().map(|u| -0.3e-3 * (1.0 - u).ln());
    let stamps: Vec<f64> = truth.iter().zip(late).map(|(t, late)| t + late).collect();
    let clock = fit(&stamps, Ticks::Counted).unwrap();
    assert_eq!(clock.fit_kind, FitKind::LowerEnvelope, "{:?} {}", clock.steps, clock.jitter_s);
    // The floor of n exponential delays is τ/n high, and the hull's ends some ten times that.
    for (regular, truth) in clock.regular_s.iter().zip(&truth) {
        assert!((regular - truth).abs() < 20.0 * 0.3e-3 / 2000.0, "{}", regular - truth);
    }
}

#[test]
fn a_step_of_the_clock_is_found_where_it_is() {
    let truth = grid(1000, 0.004);
    let stamps: Vec<f64> = truth
        .iter()
        .zip(uniform(1000))
        .enumerate()
        .map(|(k, (t, u))| t + 0.1e-3 * (u - 0.5) + if k >= 600 { 1.3e-3 } else { 0.0 })
        .collect();
    let clock = fit(&stamps, Ticks::Counted).unwrap();
    assert_eq!(clock.steps.len(), 1);
    assert!((clock.steps[0].0 - stamps[600]).abs() < 1e-12);
    // Two medians of at least 400 stamps with a deviation of 0.03 ms: 0.003 ms. The limit is five of that.
    assert!((clock.steps[0].1 - 1.3e-3).abs() < 15e-6, "{}", clock.steps[0].1);
}

#[test]
fn device_stamps_tell_the_drift_and_a_counter_its_wrap() {
    let truth = grid(1000, 0.004);
    let stamps: Vec<f64> = truth.iter().zip(uniform(1000)).map(|(t, u)| t + 0.2e-3 * (u - 0.5)).collect();
    // A device clock that runs fast by 80 ppm counts more of its own seconds.
    let device: Vec<f64> = truth.iter().map(|t| 77.0 + t * (1.0 + 80e-6)).collect();
    let clock = fit(&stamps, Ticks::Device(&device)).unwrap();
    // Slope of a line through n stamps of deviation σ over T: σ √12 / (T √n) = 1.6 ppm. The limit is four of that.
    assert!((clock.device_drift_ppm.unwrap() - 80.0).abs() < 6.4, "{:?}", clock.device_drift_ppm);
    assert!((clock.period_s - 0.004).abs() < 1e-8);
    let counter: Vec<u64> = (0..1000).map(|k| (k + 200) % 256).collect();
    assert_eq!(fit(&stamps, Ticks::Counter(&counter)).unwrap().pieces, 1);
}

#[test]
fn row_numbers_that_hide_drops_are_not_believed() {
    let truth: Vec<f64> =
        grid(900, 0.03).into_iter().enumerate().filter(|(k, _)| k % 9 != 4).map(|(_, t)| t).collect();
    let stamps: Vec<f64> = truth.iter().zip(uniform(900)).map(|(t, u)| t + 1e-3 * (u - 0.5)).collect();
    let rows: Vec<u64> = (0..truth.len() as u64).collect();
    let clock = fit(&stamps, Ticks::Counter(&rows)).unwrap();
    assert_recovers(&clock, &truth, 1e-3 / 12.0_f64.sqrt());
}

#[test]
fn uneven_sources_are_left_alone() {
    // Each step between 20 and 40 ms: the source itself has no regular tick.
    let mut time = 0.0;
    let stamps: Vec<f64> = uniform(500)
        .into_iter()
        .map(|u| {
            time += 0.02 + 0.02 * u;
            time
        })
        .collect();
    assert_eq!(fit(&stamps, Ticks::Counted), None);
    assert_eq!(fit(&grid(10, 0.03), Ticks::Counted), None);
}
