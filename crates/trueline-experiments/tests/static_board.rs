//! Hand-eye calibration with a board at standstill, simulated.
#![allow(clippy::print_stdout, reason = "figures of the statistics, shown by --nocapture")]
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

use trueline_experiments::Settings;
use trueline_experiments::static_board::{self, JOINT};

#[test]
fn the_static_board_is_as_good_as_the_bound_of_an_independent_computation() {
    let rows = static_board::run(&Settings { repeats: 10, ..Settings::default() }).unwrap();
    assert_eq!(rows.len(), 12);
    let of = |method: &str, stops: usize| {
        rows.iter().find(|row| row.method == method && row.stops == stops).unwrap().clone()
    };
    for row in &rows {
        println!("{row:?}");
    }
    // The Cramér–Rao bound of these stops, and what Park's form makes of them, computed with numpy from the same poses and
    // noise: 0.0579 mm and 0.065, 0.0338 and 0.038, 0.0203 and 0.019 (15 sets). The root mean square over 40 sets of six
    // numbers, of which about two matter, is good to 1/√(2·80) = 8 %.
    for (stops, bound_m) in [(8, 0.0579e-3), (15, 0.0338e-3), (30, 0.0203e-3)] {
        let joint = of(JOINT, stops);
        assert!((joint.standing_m / bound_m - 1.0).abs() < 0.25, "{stops}: {}", joint.standing_m);
        for method in ["Tsai", "Park"] {
            let ratio = of(method, stops).standing_m / joint.standing_m;
            assert!((0.97..1.5).contains(&ratio), "{method}, {stops} stops: {ratio} of maximum likelihood");
        }
        // 17.73 ms at 50 mm/s are 0.887 mm.
        assert!((joint.moving_m - 0.887e-3).abs() < 0.01e-3, "{}", joint.moving_m);
        assert_eq!(joint.lasts_s, 6.0 * f64::from(stops as u32));
    }
}
