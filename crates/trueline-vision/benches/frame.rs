//! A frame of 2448 × 2000 with 8 bits on one core, and beside it what reading it once costs.
#![allow(missing_docs, clippy::unwrap_used, clippy::panic, reason = "benchmarks fail by panicking")]

use criterion::{Criterion, criterion_group, criterion_main};
use std::hint::black_box;
use trueline_dataset::{GrayImage, Pixels};
use trueline_sim::{Joint as Scene, Look, PictureScan, Preset, SensorModel};
use trueline_vision::locate::tiles::Tiles;
use trueline_vision::{Detector, Joint, Lens, Picture};

/// Pictures that are looked at in turn: more than the caches hold.
const PICTURES: f64 = 12.0;

fn eight(image: &GrayImage) -> Picture<'_, u8> {
    let Pixels::Eight(levels) = &image.pixels else { panic!("eight bits are simulated") };
    Picture::new(image.width, image.height, levels).unwrap()
}

fn frame(criterion: &mut Criterion) {
    let mut scenario = Preset::Quick.scenario();
    scenario.timing.frame_period_s = scenario.timing.duration_s / (PICTURES + 1.0);
    let SensorModel::CameraLaser { camera, laser_plane_in_camera } = scenario.cell.sensor else { panic!() };
    let lens = Lens::new(camera, laser_plane_in_camera);
    for (name, scene, joint) in [
        ("fillet", Scene::fillet(), Joint::Fillet),
        ("lap", Scene::Lap { step_m: 3e-3 }, Joint::Lap),
        ("groove", Scene::VGroove { depth_m: 5e-3, opening_rad: 1.6 }, Joint::VGroove),
        ("gap", Scene::Butt { gap_m: 1.5e-3, mismatch_m: 0.0 }, Joint::Butt),
    ] {
        let scan = PictureScan::new(&scenario, scene, Look::speckled(), 1).unwrap();
        let mut renderer = scan.renderer();
        let images: Vec<GrayImage> =
            scan.exposures().iter().map(|exposed| scan.draw(&mut renderer, exposed).image).collect();
        let mut group = criterion.benchmark_group(name);
        let mut turn = 0;
        let mut next = || {
            turn = (turn + 1) % images.len();
            eight(&images[turn])
        };
        group.bench_function("read once (brightest pixel)", |bench| {
            bench.iter(|| black_box(next().levels().iter().copied().max()));
        });
        let mut tiles = Tiles::default();
        group.bench_function("tiles", |bench| bench.iter(|| tiles.measure(&next())));
        let mut detector = Detector::new(lens.clone());
        group.bench_function("seam", |bench| bench.iter(|| black_box(detector.seam(&next(), joint).is_ok())));
        group.finish();
    }
}

criterion_group!(benches, frame);
criterion_main!(benches);
