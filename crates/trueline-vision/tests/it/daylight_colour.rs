//! The pictures of `daylight.rs` in colour: nothing but the laser has its colour, so that no region must be stated.

use crate::daylight_scene;
use crate::drawn;

use daylight_scene::{CLUTTERS, CORNER, SIZE, TURN_DEG, arm, bench, clutter, glints, metal};
use drawn::{Paper, Stroke, detector};
use nalgebra::Vector2;
use trueline_dataset::{Error, FrameStamp, GrayImage, PictureSource, Pixels};
use trueline_vision::{Detection, Detector, Joint, PictureRegion, find_seams};

fn image(paper: &mut Paper) -> GrayImage {
    GrayImage { width: SIZE[0], height: SIZE[1], pixels: Pixels::Eight(paper.levels(0.0)) }
}

/// Only the light of the laser's colour.
fn colour(laser: &[Stroke], seed: u64) -> GrayImage {
    let mut paper = Paper::new(SIZE, 1000 + seed);
    laser.iter().for_each(|stroke| paper.stroke(stroke));
    image(&mut paper)
}

/// A picture with light of the laser, and something else, on metal.
fn picture(laser: &[Stroke], seed: u64, besides: impl Fn(&mut Paper)) -> GrayImage {
    let mut paper = Paper::new(SIZE, seed);
    laser.iter().for_each(|stroke| paper.stroke(stroke));
    besides(&mut paper);
    metal(&mut paper);
    bench(&mut paper);
    image(&mut paper)
}

fn in_colour(
    mut detector: Detector,
    picture: &GrayImage,
    colour: &GrayImage,
    joint: Joint,
) -> Option<Detection> {
    detector.detect_in_colour(picture, || Some(colour), joint).ok()
}

fn long_and_short() -> [Stroke; 2] {
    [arm(TURN_DEG[0], 110.0, 0.22), arm(TURN_DEG[1], 40.0, 0.11)]
}

fn is_right(found: &Detection) -> bool {
    let off = found.seam.pixel - Vector2::from(CORNER);
    let sigmas = off.dot(&(found.seam.covariance_px2.try_inverse().unwrap() * off)).sqrt();
    // As in `daylight.rs`.
    off.norm() < 3.0 && sigmas < 4.5
}

#[test]
fn an_arm_of_40_px_in_daylight_is_found_where_the_laser_s_colour_shows_the_other_one() {
    for seed in 0..8 {
        let picture = picture(&long_and_short(), seed, |_| ());
        let both = colour(&long_and_short(), seed);
        let found = in_colour(detector(SIZE), &picture, &both, Joint::Fillet);
        assert!(found.as_ref().is_some_and(is_right), "seed {seed}: {found:?}");
        assert!(in_colour(detector(SIZE), &picture, &both, Joint::Corner).is_none());
        // A short arm of another colour is the border of something.
        let long = colour(&long_and_short()[..1], seed);
        assert!(in_colour(detector(SIZE), &picture, &long, Joint::Fillet).is_none());
    }
}

#[test]
fn what_is_no_arm_is_not_taken_for_one_beside_an_arm_of_the_laser_s_colour() {
    for kind in 0..CLUTTERS {
        for seed in 0..6 {
            let long = [arm(TURN_DEG[0], 110.0, 0.22)];
            let picture = picture(&long, 100 + seed, |paper| clutter(paper, kind, seed));
            // Glints may be of the laser's light as well.
            let with_glints: Vec<Stroke> = long.into_iter().chain(glints(seed)).collect();
            for laser in [&long[..], &with_glints] {
                for joint in [Joint::Fillet, Joint::Corner] {
                    let found = in_colour(detector(SIZE), &picture, &colour(laser, seed), joint);
                    assert!(found.is_none(), "kind {kind}, seed {seed}: {found:?}");
                }
            }
        }
    }
}

#[test]
fn a_corner_of_which_no_arm_has_the_laser_s_colour_is_none() {
    let picture = picture(&long_and_short(), 3, |_| ());
    // Nothing has it, or something else.
    let elsewhere = [Stroke { brightness: 0.22, ..Stroke::new([420.0, 300.0], 10.0, 130.0, 1.3) }];
    for laser in [&[][..], &elsewhere] {
        assert!(in_colour(detector(SIZE), &picture, &colour(laser, 3), Joint::Fillet).is_none());
    }
}

#[test]
fn of_two_corners_neither_is_claimed_and_a_region_says_which_one_is_meant() {
    let second = [CORNER[0], CORNER[1] + 150.0];
    let moved = |stroke: Stroke| Stroke { from: second, ..stroke };
    let laser: Vec<Stroke> = long_and_short().into_iter().flat_map(|one| [one, moved(one)]).collect();
    let (picture, colour) = (picture(&laser, 4, |_| ()), colour(&laser, 4));
    assert!(in_colour(detector(SIZE), &picture, &colour, Joint::Fillet).is_none());
    let upper = PictureRegion::rectangle([0.0, 640.0], [0.0, CORNER[1] + 75.0]).unwrap();
    let found = in_colour(detector(SIZE).within(Some(upper)), &picture, &colour, Joint::Fillet);
    assert!(found.as_ref().is_some_and(is_right), "{found:?}");
}

/// One picture, with its colour or without.
struct One {
    picture: GrayImage,
    colour: Option<GrayImage>,
}

impl PictureSource for One {
    fn count(&self) -> usize {
        1
    }

    fn stamp(&self, _number: usize) -> FrameStamp {
        FrameStamp { stamp_ns: 0, frame: 0, device_ns: None }
    }

    fn name(&self, _number: usize) -> String {
        "one".to_owned()
    }

    fn read(&self, _number: usize, _spare: &mut Vec<u8>) -> Result<GrayImage, Error> {
        Ok(self.picture.clone())
    }

    fn colour(&self, _number: usize) -> Result<Option<GrayImage>, Error> {
        Ok(self.colour.clone())
    }
}

#[test]
fn scans_are_looked_at_in_colour_where_they_have_any() {
    let (picture, colour) = (picture(&long_and_short(), 5, |_| ()), colour(&long_and_short(), 5));
    for (colour, joint) in
        [(Some(colour.clone()), Some(Joint::Fillet)), (Some(colour), None), (None, Some(Joint::Fillet))]
    {
        let has_colour = colour.is_some();
        let source = One { picture: picture.clone(), colour };
        let scan = find_seams(&source, &detector(SIZE), joint, &()).unwrap();
        assert_eq!(scan.joint, Joint::Fillet);
        assert_eq!(
            scan.frames[0].found.as_ref().is_ok_and(is_right),
            has_colour,
            "{:?}",
            scan.frames[0].found
        );
    }
}
