//! Support points of the two plates beside a curved seam, as ruled strips: what would they add to the seam points?

use super::information::{Light, PLACE, Plates, SHARED, bounds, information, known, left};
use super::seam::{Motion, Seam};
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use trueline_sim::curves::CurveKind;

/// A scan of 20 s with three passes, of a closed curve two.
fn scan(kind: CurveKind, larger: f64, tilt_deg: f64) -> Motion {
    let place = Isometry3::new(Vector3::new(0.7, 0.05, 0.3), Vector3::new(0.2, -0.1, 0.3));
    Motion {
        seam: Seam::new(kind, larger, place),
        lasts_s: 20.0,
        passes: if kind.is_closed() { 2.0 } else { 3.0 },
        tilt_rad: f64::to_radians(tilt_deg),
        sways_m: [8e-3, 12e-3],
        weave_m: 0.0,
        phase_rad: 0.0,
        attitude: UnitQuaternion::identity(),
    }
}

/// The part is where it is: its place is that of the curve.
const HELD: f64 = 1e-9;

pub(super) fn print() {
    for light in [Light::Point, Light::Lines] {
        table(light);
        println!();
    }
}

fn table(light: Light) {
    println!(
        "{}\n",
        match light {
            Light::Point => "Seam points with noise of their own",
            Light::Lines => "Seam points where the lines meet",
        }
    );
    println!(
        "| seam, tilts | time offset, seam points ms | with free strips | with constant angles | seam error, seam points mm | with free strips | with constant angles |"
    );
    println!("|---|---|---|---|---|---|---|");
    let kinds = [
        ("straight", CurveKind::Straight, 1.0),
        ("arc R 400", CurveKind::Arc, 400.0 / 280.0),
        ("pipe R 60", CurveKind::Pipe, 1.2),
        ("free", CurveKind::Free, 1.0),
    ];
    for tilt_deg in [18.0, 5.0] {
        for (name, kind, larger) in kinds {
            let motion = [scan(kind, larger, tilt_deg)];
            let of = |plates| {
                let mut all = information(&motion, plates, light);
                known(&mut all, SHARED..SHARED + PLACE, HELD);
                bounds(&left(&all, SHARED))
            };
            let [points, free, constant] = [Plates::Unseen, Plates::Free, Plates::Constant].map(of);
            let cell = |k: usize| {
                let with = |other: [f64; 2]| format!("{:.4} (× {:.2})", other[k] * 1e3, other[k] / points[k]);
                format!("{:.4} | {} | {}", points[k] * 1e3, with(free), with(constant))
            };
            println!("| {name}, ±{tilt_deg}° | {} | {} |", cell(0), cell(1));
        }
    }
}
