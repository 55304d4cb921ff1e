//! Which of several corners, grooves, gaps, edges or ends is meant.

use crate::drawn;

use drawn::{Paper, Stroke, detector};
use nalgebra::Vector2;
use trueline_vision::{Joint, StripeChoice};

const SIZE: [usize; 2] = [1280, 1024];

/// Higher in these pictures is further away.
fn chosen(strokes: &[Stroke], joint: Joint, [upper, lower]: [[f64; 2]; 2], most_px: f64) {
    let mut paper = Paper::new(SIZE, 5);
    strokes.iter().for_each(|stroke| paper.stroke(stroke));
    for (choice, truth) in [
        (StripeChoice::Upper, upper),
        (StripeChoice::Farthest, upper),
        (StripeChoice::Lower, lower),
        (StripeChoice::Nearest, lower),
    ] {
        let seam = paper.seam(&mut detector(SIZE).choosing(choice), joint).unwrap();
        let off_px = (seam.pixel - Vector2::from(truth)).norm();
        assert!(off_px < most_px, "{joint:?}, {choice:?}: {off_px:.2} px");
    }
}

/// The arms of the upper stripe cross those of the lower one.
#[test]
fn of_two_corners_whose_stripes_cross() {
    let places = [[600.0, 300.0], [620.0, 420.0]];
    let [upper, lower] = places;
    let strokes = [(upper, 125.0), (upper, 55.0), (lower, 160.0), (lower, 20.0)]
        .map(|(at, heading_deg)| Stroke::new(at, heading_deg, 500.0, 2.0));
    chosen(&strokes, Joint::Fillet, places, 0.5);
}

#[test]
fn of_two_laps() {
    let lap = |[u, v]: [f64; 2]| {
        [Stroke::new([u, v], 180.0, 500.0, 2.0), Stroke::new([u + 20.0, v - 60.0], 0.0, 500.0, 2.0)]
    };
    let places = [[600.0, 300.0], [640.0, 760.0]];
    chosen(&places.map(lap).concat(), Joint::Lap, places, 0.9);
}

#[test]
fn of_two_grooves() {
    let groove = |[u, v]: [f64; 2]| {
        [
            Stroke::new([u, v], 135.0, 120.0, 2.0),
            Stroke::new([u, v], 45.0, 120.0, 2.0),
            Stroke::new([u - 85.0, v + 85.0], 180.0, 400.0, 2.0),
            Stroke::new([u + 85.0, v + 85.0], 0.0, 400.0, 2.0),
        ]
    };
    let places = [[600.0, 200.0], [640.0, 660.0]];
    chosen(&places.map(groove).concat(), Joint::VGroove, places, 0.9);
}

#[test]
fn of_two_gaps() {
    let gap = |[u, v]: [f64; 2]| {
        [Stroke::new([u - 20.0, v], 180.0, 500.0, 2.0), Stroke::new([u + 20.0, v], 0.0, 500.0, 2.0)]
    };
    let places = [[600.0, 300.0], [640.0, 700.0]];
    chosen(&places.map(gap).concat(), Joint::Butt, places, 0.9);
}

#[test]
fn of_two_ends() {
    let places = [[600.0, 300.0], [640.0, 700.0]];
    chosen(&places.map(|at| Stroke::new(at, 185.0, 2000.0, 2.0)), Joint::Edge, places, 0.9);
}

/// A stripe that has both of its ends in the picture.
#[test]
fn of_the_two_ends_of_one_stripe() {
    let mut paper = Paper::new(SIZE, 6);
    paper.stroke(&Stroke::new([300.0, 500.0], 0.0, 600.0, 2.0));
    for (choice, u) in [(StripeChoice::Left, 300.0), (StripeChoice::Right, 900.0)] {
        let seam = paper.seam(&mut detector(SIZE).choosing(choice), Joint::Edge).unwrap();
        assert!((seam.pixel.x - u).abs() < 0.9, "{choice:?}: {seam:?}");
    }
}
