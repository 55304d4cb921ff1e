//! Stripes on surfaces that are lit themselves, with arms of 40 px, within a region that was stated: a drawn equivalent of an
//! aluminium angle in daylight before a web camera.
#![allow(clippy::unwrap_used, clippy::panic, missing_docs, reason = "tests fail by panicking")]

mod drawn;

use drawn::{Paper, Stroke, detector};
use nalgebra::Vector2;
use trueline_vision::{Detection, Joint, NotFound, Picture, PictureRegion};

const SIZE: [usize; 2] = [640, 480];
/// Where the arms meet, px: they lead downwards from there, and downwards is towards the camera.
const CORNER: [f64; 2] = [351.3, 177.6];
/// The sheet of metal: the part of the picture that its user looks at. Beyond it is a bright edge.
const REGION: [[f64; 2]; 2] = [[240.0, 378.0], [150.0, 270.0]];
const TURN_DEG: [f64; 2] = [153.0, 38.0];

/// A sheet of metal in daylight, of which the border is brighter than any stripe, with shades on it, before a dark ground.
fn metal(paper: &mut Paper) {
    let grain = |u: f64, v: f64, cell: f64| {
        let hash = ((u / cell).floor() * 12.9898 + (v / cell).floor() * 78.233).sin() * 43758.545;
        hash - hash.floor()
    };
    paper.surface(0.45, |u, _| (220.0..390.0).contains(&u));
    paper.surface(0.12, |u, v| (220.0..318.0 - 0.05 * v).contains(&u));
    paper.surface(0.9, |u, _| (383.0..391.0).contains(&u));
    for (part, cell) in [(0.3, 1.0), (0.5, 2.0), (0.7, 3.0)] {
        paper.surface(0.012, |u, v| (220.0..383.0).contains(&u) && grain(u, v, cell) < part);
    }
}

fn arm(heading_deg: f64, length_px: f64, brightness: f64) -> Stroke {
    Stroke { brightness, ..Stroke::new(CORNER, heading_deg, length_px, 1.3) }
}

fn found(paper: &mut Paper, region: bool, joint: Joint) -> Result<Detection, NotFound> {
    let levels = paper.levels(0.0);
    let picture = Picture::new(SIZE[0], SIZE[1], &levels).unwrap();
    let region = region.then(|| PictureRegion::rectangle(REGION[0], REGION[1]).unwrap());
    detector(SIZE).within(region).detect(&picture, joint)
}

#[test]
fn an_arm_of_40_px_in_daylight_is_found_where_it_is_said_where_to_look() {
    for seed in 0..8 {
        let mut paper = Paper::new(SIZE, seed);
        paper.stroke(&arm(TURN_DEG[0], 110.0, 0.22));
        paper.stroke(&arm(TURN_DEG[1], 40.0, 0.11));
        metal(&mut paper);
        let seam = found(&mut paper, true, Joint::Fillet).unwrap().seam;
        let off = seam.pixel - Vector2::from(CORNER);
        let sigmas = off.dot(&(seam.covariance_px2.try_inverse().unwrap() * off)).sqrt();
        // Of eight points the worst of a normal distribution in two dimensions is beyond 4.5 in 1 of 3000 such tests; and none is
        // further away than a person would see.
        assert!(off.norm() < 3.0 && sigmas < 4.5, "seed {seed}: {off} px, {sigmas:.1} sigma");
    }
}

#[test]
fn without_a_region_nothing_is_claimed_of_it() {
    let mut paper = Paper::new(SIZE, 1);
    paper.stroke(&arm(TURN_DEG[0], 110.0, 0.22));
    paper.stroke(&arm(TURN_DEG[1], 40.0, 0.11));
    metal(&mut paper);
    assert!(found(&mut paper, false, Joint::Fillet).is_err());
}

#[test]
fn the_other_side_of_a_corner_is_another_joint() {
    let mut paper = Paper::new(SIZE, 2);
    paper.stroke(&arm(TURN_DEG[0], 110.0, 0.22));
    paper.stroke(&arm(TURN_DEG[1], 40.0, 0.11));
    metal(&mut paper);
    assert!(found(&mut paper, true, Joint::Corner).is_err());
}

/// What stands where a short arm could.
fn clutter(paper: &mut Paper, kind: usize, seed: u64) {
    let turn = 7.0 * seed as f64;
    match kind {
        // The metal alone.
        0 => {}
        // Glints in a row, a stripe's thickness each.
        1 => (0..4).for_each(|k| {
            let (sin, cos) = (TURN_DEG[1] + turn).to_radians().sin_cos();
            let s = 6.0 + 11.0 * f64::from(k);
            let from = [CORNER[0] + s * cos, CORNER[1] + s * sin];
            paper.stroke(&Stroke { brightness: 0.3, ..Stroke::new(from, TURN_DEG[1] + turn, 3.0, 1.3) });
        }),
        // The border of a shade.
        2 => {
            let slope = (0.4 + 0.05 * seed as f64).tan();
            paper.surface(0.15, |u, v| u > CORNER[0] && v > CORNER[1] + slope * (u - CORNER[0]));
        }
        // A dark joint between two sheets, along which both are equally bright.
        3 => paper.surface(-0.2, |u, _| (u - CORNER[0] + 0.1 * turn).abs() < 1.5),
        // A chessboard.
        _ => {
            paper.surface(0.3, |u, v| ((u + turn) / 14.0).floor() as i64 % 2 == (v / 14.0).floor() as i64 % 2)
        }
    }
}

#[test]
fn what_is_no_arm_is_not_taken_for_one() {
    for kind in 0..5 {
        for seed in 0..6 {
            for stripe in [false, true] {
                let mut paper = Paper::new(SIZE, 100 + seed);
                if stripe {
                    paper.stroke(&arm(TURN_DEG[0], 110.0, 0.22));
                }
                clutter(&mut paper, kind, seed);
                metal(&mut paper);
                for joint in [Joint::Fillet, Joint::Corner] {
                    let found = found(&mut paper, true, joint).map(|found| found.seam);
                    assert!(found.is_err(), "kind {kind}, seed {seed}, stripe {stripe}: {found:?}");
                }
            }
        }
    }
}

#[test]
fn a_scratch_across_the_arm_is_no_corner() {
    // A stripe that goes on beyond the place where another line meets it does not end there.
    for seed in 0..6 {
        let mut paper = Paper::new(SIZE, 200 + seed);
        let (sin, cos) = TURN_DEG[0].to_radians().sin_cos();
        let from = [CORNER[0] - 26.0 * cos, CORNER[1] - 26.0 * sin];
        paper.stroke(&Stroke { brightness: 0.22, ..Stroke::new(from, TURN_DEG[0], 136.0, 1.3) });
        paper.stroke(&arm(60.0 + 5.0 * seed as f64, 45.0, 0.15));
        metal(&mut paper);
        let found = found(&mut paper, true, Joint::Fillet).map(|found| found.seam);
        assert!(found.is_err(), "seed {seed}: {found:?}");
    }
}
