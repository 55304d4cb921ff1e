//! Robots whose stream has holes everywhere: whatever is left, there is a result or an error.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use trueline_method::{Config, calibrate};
use trueline_sim::{Preset, simulate};

/// Holes of some tenths of a second, of which a part of the stream is left.
#[test]
fn a_stream_of_holes_gives_a_result_or_an_error() {
    let whole = simulate(&Preset::Quick.scenario(), 3).unwrap();
    let mut results = 0;
    for seed in 0..24 {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut scan = whole.clone();
        let left = rng.random_range(0.05..0.5);
        let hole_ns = (rng.random_range(0.03..0.4) * 1e9) as i64;
        let begin_ns = scan.robot[0].stamp_ns;
        let blocks: Vec<bool> = (0..2000).map(|_| rng.random_bool(left)).collect();
        scan.robot.retain(|sample| blocks[((sample.stamp_ns - begin_ns) / hole_ns) as usize % blocks.len()]);
        match calibrate(&scan, None, &Config::default()) {
            Ok(_) => results += 1,
            Err(error) => assert!(!error.to_string().is_empty()),
        }
    }
    assert!(results > 3, "{results} results: nothing was tested");
}
