//! Stripes on surfaces that are lit themselves, with arms of 40 px, within a region that was stated.

use crate::daylight_scene;
use crate::drawn;

use daylight_scene::{CLUTTERS, CORNER, SIZE, TURN_DEG, arm, clutter, metal};
use drawn::{Paper, Stroke, detector};
use nalgebra::Vector2;
use trueline_vision::{Detection, Joint, NotFound, Picture, PictureRegion};

/// The sheet of metal: the part of the picture that its user looks at. Beyond it is a bright edge.
const REGION: [[f64; 2]; 2] = [[240.0, 378.0], [150.0, 270.0]];

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

#[test]
fn what_is_no_arm_is_not_taken_for_one() {
    for kind in 0..CLUTTERS {
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
