//! Corners of whole profiles on one core, in points a second.
#![allow(missing_docs, clippy::unwrap_used, reason = "benchmarks fail by panicking")]

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use std::hint::black_box;
use trueline_sim::{Plates, Preset, ProfileLook, scan_profiles};
use trueline_vision::profile::ProfileFinder;

fn profiles(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("profile");
    // About 700 points of a usual profiler, and 3,500 of one with fine columns.
    for (name, column_m) in [("columns of 0.1 mm", 1e-4), ("columns of 0.02 mm", 2e-5)] {
        let mut scenario = Preset::Profiler.scenario();
        scenario.timing.duration_s = 4.0;
        let look = ProfileLook { column_m, ..ProfileLook::default() };
        let (_, profiles) = scan_profiles(&scenario, &Plates::default(), &look, 1).unwrap();
        let in_mm = profiles.iter().map(|profile| profile.points.iter().map(|p| [p.x_m * 1e3, p.z_m * 1e3]));
        let in_mm: Vec<Vec<[f64; 2]>> = in_mm.map(Iterator::collect).collect();
        let points: usize = in_mm.iter().map(Vec::len).sum();
        group.throughput(Throughput::Elements(points as u64));
        let mut finder = ProfileFinder::default();
        group.bench_function(name, |bench| {
            bench.iter(|| in_mm.iter().filter(|points| black_box(finder.find(points)).is_ok()).count());
        });
    }
    group.finish();
}

criterion_group!(benches, profiles);
criterion_main!(benches);
