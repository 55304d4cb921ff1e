//! Writing and reading a picture of 2448 × 2000 with 8 bits on one core: as a file of its own, and as it is kept in a recording.
#![allow(missing_docs, clippy::unwrap_used, clippy::panic, reason = "benchmarks fail by panicking")]

use criterion::{Criterion, criterion_group, criterion_main};
use std::hint::black_box;
use std::io::Cursor;
use std::path::Path;
use trueline_dataset::{GrayImage, gray_png};
use trueline_sim::{Joint as Scene, Look, PictureScan, Preset};

fn picture(look: Look) -> GrayImage {
    let scenario = Preset::Quick.scenario();
    let scan = PictureScan::new(&scenario, Scene::fillet(), look, 1).unwrap();
    let mut renderer = scan.renderer();
    scan.draw(&mut renderer, &scan.exposures()[0]).image
}

fn pictures(criterion: &mut Criterion) {
    let file = std::env::temp_dir().join(format!("trueline-pictures-{}.png", std::process::id()));
    for (name, look) in [("clean", Look::clean()), ("speckle", Look::speckled())] {
        let image = picture(look);
        let mut group = criterion.benchmark_group(name);
        group.bench_function("file: write", |bench| bench.iter(|| gray_png::write(&file, &image).unwrap()));
        let mut spare = Vec::new();
        group.bench_function("file: read", |bench| {
            bench.iter(|| black_box(gray_png::read(&file, &mut spare).unwrap()));
        });
        group.bench_function("recording: before its compression", |bench| {
            bench.iter(|| black_box(gray_png::encode_gray(&image).unwrap()));
        });
        let stored = gray_png::encode_gray(&image).unwrap();
        group.bench_function("recording: after its decompression", |bench| {
            bench.iter(|| {
                black_box(gray_png::decode(Path::new(name), Cursor::new(&stored), &mut spare).unwrap())
            });
        });
        group.finish();
    }
    let _ = std::fs::remove_file(&file);
}

criterion_group!(benches, pictures);
criterion_main!(benches);
