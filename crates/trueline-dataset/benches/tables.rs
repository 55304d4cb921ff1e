//! How many bytes a second tables are read at: robot.csv, features.csv, whole profiles as CSV, and the same profiles as Parquet, counted as the
//! bytes of their CSV.
#![allow(clippy::unwrap_used, missing_docs, reason = "a benchmark")]

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use std::fmt::Write;
use std::path::Path;
use trueline_dataset::profile::{Profile, ProfilePoint};
use trueline_dataset::{Sensor, dialect, features_csv, profiles_csv, profiles_parquet, robot_csv};

const ROWS: i64 = 100_000;

/// Numbers as programs print them: with all their digits.
fn robot() -> String {
    let mut text = "time_s,x_mm,y_mm,z_mm,qw,qx,qy,qz\n".to_owned();
    for k in 0..ROWS {
        let t = k as f64 * 0.004;
        let (s, c) = (0.05 * (0.7 * t).sin(), 0.05 * (1.1 * t).cos());
        let (qw, qx) = ((1.0 - s * s - c * c).sqrt(), 0.0);
        let [x, y, z] = [1193.0 + 0.3 * t, 49.0 - 20.0 * s, 336.0 + 17.0 * c];
        writeln!(text, "{}.{:09},{x},{y},{z},{qw},{qx},{s},{c}", k / 250, k % 250 * 4_000_000 + 63_982)
            .unwrap();
    }
    text
}

fn features() -> String {
    let mut text = "time_s,x_mm,z_mm,frame\n".to_owned();
    for k in 0..ROWS {
        let t = k as f64 * 0.01;
        let [x, z] = [12.0 * (0.7 * t).sin(), 211.0 + 8.0 * (1.3 * t).cos()];
        writeln!(text, "{}.{:09},{x},{z},{k}", k / 100, k % 100 * 10_000_000 + 2).unwrap();
    }
    text
}

fn profiles() -> Vec<Profile> {
    let point = |k: i64, j: i64| {
        let (x_mm, z_mm) = (-20.0 + 0.04 * j as f64, 200.0 + (0.01 * (k + j) as f64).sin());
        // Sensors give micrometres.
        let round = |mm: f64| (mm * 1e3).round() / 1e6;
        ProfilePoint { x_m: round(x_mm), z_m: round(z_mm), intensity: None }
    };
    let profile = |k| Profile {
        stamp_ns: k * 10_000_000,
        frame: Some(k as u64),
        points: (0..1000).map(|j| point(k, j)).collect(),
    };
    (0..100).map(profile).collect()
}

fn tables(c: &mut Criterion) {
    let file = Path::new("table");
    let plain = |text: &str| dialect::plain_csv(file, text.as_bytes().to_vec(), None).unwrap().0;
    let mut group = c.benchmark_group("tables");
    group.sample_size(20);
    let (robot, features, profiles) = (robot(), features(), profiles());
    group.throughput(Throughput::Bytes(robot.len() as u64));
    group
        .bench_function("robot.csv", |b| b.iter(|| robot_csv::read(file, plain(&robot).as_slice()).unwrap()));
    group.throughput(Throughput::Bytes(features.len() as u64));
    group.bench_function("features.csv", |b| {
        b.iter(|| features_csv::read(file, plain(&features).as_slice(), &Sensor::Profiler).unwrap());
    });
    let mut text = Vec::new();
    profiles_csv::write(&mut text, &profiles).unwrap();
    let text = String::from_utf8(text).unwrap();
    group.throughput(Throughput::Bytes(text.len() as u64));
    group.bench_function("profiles.csv", |b| {
        b.iter(|| profiles_csv::read(file, plain(&text).as_slice()).unwrap())
    });
    let parquet = profiles_parquet::bytes(&profiles).unwrap();
    group.bench_function("profiles.parquet", |b| {
        b.iter(|| profiles_parquet::read(file, parquet.clone()).unwrap());
    });
}

criterion_group!(benches, tables);
criterion_main!(benches);
