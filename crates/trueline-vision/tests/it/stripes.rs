//! Any stripe, any target: thick, short, blurred, rounded, hidden by a bead, one of several.

use crate::drawn;

use drawn::{Paper, Stroke, arms, between, detector};
use nalgebra::Vector2;
use trueline_dataset::{Error, FrameStamp, GrayImage, PictureSource, Pixels, Problem};
use trueline_vision::{Joint, NotFound, Picture, PictureRegion, StripeChoice, find_seams};

const SIZE: [usize; 2] = [1280, 1024];
const CORNER: [f64; 2] = [651.3, 380.7];

fn paper(strokes: &[Stroke], seed: u64) -> Paper {
    let mut paper = Paper::new(SIZE, seed);
    strokes.iter().for_each(|stroke| paper.stroke(stroke));
    paper
}

/// Distance of what is found from the truth, px and in its own sigma.
fn off(paper: &mut Paper, joint: Joint, truth: [f64; 2]) -> [f64; 2] {
    let seam = paper.seam(&mut detector(paper.size), joint).unwrap();
    let error = seam.pixel - Vector2::from(truth);
    let inverse = seam.covariance_px2.try_inverse().unwrap();
    [error.norm(), (error.transpose() * inverse * error)[0].sqrt()]
}

/// At every factor by which pictures are made smaller: an error of its half pixel would be 0.5, 1.5 or 3.5 px.
#[test]
fn stripes_of_any_thickness_are_found() {
    for (number, sigma_px) in [0.7, 2.0, 8.0, 14.0, 22.0].into_iter().enumerate() {
        let mut paper = paper(&arms(CORNER, 2000.0, sigma_px, false), number as u64);
        let [off_px, sigmas] = off(&mut paper, Joint::Fillet, CORNER);
        assert!(off_px < 0.4 && sigmas < 4.5, "sigma {sigma_px}: {off_px:.3} px, {sigmas:.1} sigma");
    }
}

#[test]
fn arms_of_80_px_are_enough_and_shorter_ones_are_refused_with_their_length() {
    let [off_px, sigmas] = off(&mut paper(&arms(CORNER, 85.0, 1.5, false), 1), Joint::Fillet, CORNER);
    assert!(off_px < 0.5 && sigmas < 4.5, "{off_px:.3} px, {sigmas:.1} sigma");
    let refused = paper(&arms(CORNER, 45.0, 1.5, false), 2).seam(&mut detector(SIZE), Joint::Fillet);
    let Err(NotFound::ArmsTooShort { arms_px, needed_px }) = refused else { panic!("{refused:?}") };
    // Known to half a tile at each end.
    assert!(arms_px.iter().all(|px| (20.0..62.0).contains(px)) && needed_px == 80.0, "{refused:?}");
    assert_eq!(refused.unwrap_err().code(), "arms-too-short");
}

#[test]
fn glints_along_two_lines_are_no_arms() {
    // A fifth of each line is lit, in pieces of 16 px.
    let glints = arms(CORNER, 2000.0, 1.5, false).into_iter().flat_map(|arm| {
        let (sin, cos) = arm.heading_deg.to_radians().sin_cos();
        (0..8).map(move |k| {
            let s = 20.0 + 80.0 * f64::from(k);
            let from = [arm.from[0] + s * cos, arm.from[1] + s * sin];
            Stroke { from, length_px: 16.0, ..arm }
        })
    });
    let found = paper(&glints.collect::<Vec<_>>(), 3).seam(&mut detector(SIZE), Joint::Fillet);
    assert!(found.is_err(), "{found:?}");
}

#[test]
fn an_outside_corner_is_a_corner_and_no_fillet_and_the_reverse() {
    for ridge in [false, true] {
        let (right, wrong) =
            if ridge { (Joint::Corner, Joint::Fillet) } else { (Joint::Fillet, Joint::Corner) };
        let mut paper = paper(&arms(CORNER, 500.0, 2.0, ridge), 4);
        let [off_px, sigmas] = off(&mut paper, right, CORNER);
        assert!(off_px < 0.3 && sigmas < 4.5, "{off_px:.3} px, {sigmas:.1} sigma");
        let refused = paper.seam(&mut detector(SIZE), wrong);
        assert_eq!(refused, Err(NotFound::WrongSide { towards_camera: ridge }));
    }
}

/// A stripe along an arc about a centre in equal chords; its middle is towards the top.
fn arc(centre: [f64; 2], radius_px: f64, chord_deg: f64, sigma_px: f64) -> Vec<Stroke> {
    let at = |deg: f64| {
        let (sin, cos) = deg.to_radians().sin_cos();
        [centre[0] + radius_px * sin, centre[1] - radius_px * cos]
    };
    let begins = (0..(100.0 / chord_deg) as i32).map(|k| f64::from(k) * chord_deg - 50.0);
    begins.map(|deg| between(at(deg), at(deg + chord_deg), sigma_px)).collect()
}

/// Smooth, or with facets as of a mesh: two stretches of it are as long and as straight as arms, and cross outside it.
#[test]
fn a_stripe_on_something_round_has_no_corner() {
    let arcs = [[300.0, 4.0], [600.0, 4.0], [300.0, 20.0], [250.0, 25.0], [280.0, 25.0], [350.0, 20.0]];
    for (seed, [radius_px, chord_deg]) in arcs.into_iter().enumerate() {
        let centre = [CORNER[0], CORNER[1] + 300.0];
        let mut paper = paper(&arc(centre, radius_px, chord_deg, 1.5), seed as u64);
        for joint in [Joint::Fillet, Joint::VBlock, Joint::VGroove] {
            let found = paper.seam(&mut detector(SIZE), joint);
            assert!(found.is_err(), "radius {radius_px} px, {}: {found:?}", joint.name());
        }
    }
}

/// Plates that are bowed by 0.2 mm over 25 mm, either way: a parabola's end is two thirds of its sagitta beside the line through
/// all of it, 2.1 px here, which moves the crossing by 2.1 px / sin 30° at most.
#[test]
fn plates_that_are_bowed_a_little_have_a_corner() {
    for (seed, sagitta) in [0.008, -0.008].into_iter().enumerate() {
        const LENGTH_PX: f64 = 400.0;
        let bowed =
            arms(CORNER, LENGTH_PX, 2.0, false).into_iter().zip([1.0, -1.0]).flat_map(|(arm, side)| {
                let (sin, cos) = arm.heading_deg.to_radians().sin_cos();
                let point = move |k: i32| {
                    let part = f64::from(k) / 20.0;
                    let [along, beside] =
                        [LENGTH_PX * part, side * sagitta * LENGTH_PX * 4.0 * part * (1.0 - part)];
                    [CORNER[0] + along * cos - beside * sin, CORNER[1] + along * sin + beside * cos]
                };
                (0..20).map(move |k| between(point(k), point(k + 1), 2.0))
            });
        let [off_px, _] = off(&mut paper(&bowed.collect::<Vec<_>>(), seed as u64), Joint::Fillet, CORNER);
        assert!(off_px < 4.2, "{sagitta}: {off_px:.2} px");
    }
}

/// The light of these ends falls linearly over four blurs, which is no shape that the detector knows.
#[test]
fn the_end_of_a_stripe_is_found_whatever_its_blur() {
    for (blur_px, most_px) in [(0.5, 0.4), (2.0, 0.6), (4.0, 0.9)] {
        let mut squares = 0.0;
        const RUNS: u64 = 6;
        for seed in 0..RUNS {
            let stroke = Stroke { blur_px, ..Stroke::new(CORNER, 184.0, 2000.0, 3.0) };
            let [off_px, sigmas] = off(&mut paper(&[stroke], seed), Joint::Edge, CORNER);
            assert!(sigmas < 4.0, "blur {blur_px}: {off_px:.2} px, {sigmas:.1} sigma");
            squares += off_px * off_px / RUNS as f64;
        }
        assert!(squares.sqrt() < most_px, "blur {blur_px}: RMS {:.2} px", squares.sqrt());
    }
}

#[test]
fn a_rounded_plate_edge_is_refused_or_its_sigma_says_so() {
    let stroke = Stroke { rounding_px: 30.0, blur_px: 1.5, ..Stroke::new([-900.0, 400.0], 0.0, 1600.0, 3.0) };
    match paper(&[stroke], 5).seam(&mut detector(SIZE), Joint::Edge) {
        Err(NotFound::RoundedEnd { .. } | NotFound::NoClearEnd { .. } | NotFound::Uncertain { .. }) => {}
        Ok(seam) => assert!((seam.pixel.x - 700.0).abs() < 4.0 * seam.sigma_px()[0], "{seam:?}"),
        other => panic!("{other:?}"),
    }
}

/// The upper plate bends by 7°, 125 px before its edge: one line within reach of both parts leaves the stripe at its end.
#[test]
fn a_bent_plate_is_followed_to_its_edge() {
    for seed in 0..4 {
        let bend = [CORNER[0] - 125.0, CORNER[1]];
        let before = [bend[0] - 175.0, CORNER[1] + 21.5];
        let lower = Stroke::new([CORNER[0], CORNER[1] - 70.0], 0.0, 500.0, 2.5);
        let strokes = [between(before, bend, 2.5), between(bend, CORNER, 2.5), lower];
        let [off_px, sigmas] = off(&mut paper(&strokes, seed), Joint::Lap, CORNER);
        assert!(off_px < 1.5 && sigmas < 4.5, "seed {seed}: {off_px:.2} px, {sigmas:.1} sigma");
    }
}

/// The lower plate is bright, so that its stripe is twice as thick: a step of less than four of its thicknesses, 94 px of it. The flank
/// on the side that is away from it ends where the upper plate does.
#[test]
fn a_step_that_is_small_for_the_stripe_on_a_bright_lower_plate_is_a_lap() {
    for seed in 0..4 {
        let upper = Stroke::new(CORNER, 180.0, 500.0, 1.8);
        let lower =
            Stroke { brightness: 1.4, ..Stroke::new([CORNER[0] + 8.0, CORNER[1] - 10.0], 0.0, 94.0, 4.0) };
        let [off_px, sigmas] = off(&mut paper(&[upper, lower], seed), Joint::Lap, CORNER);
        assert!(off_px < 3.0 && sigmas < 4.5, "seed {seed}: {off_px:.2} px, {sigmas:.1} sigma");
        // On one line they are one plate with a dark spot.
        let same = Stroke { from: [lower.from[0], CORNER[1] - 3.0], ..lower };
        paper(&[upper, same], seed).seam(&mut detector(SIZE), Joint::Lap).expect_err("no step");
    }
}

/// The middle of such a stripe is unknown, and the uncertainty states it.
#[test]
fn a_tail_on_one_side_is_in_the_uncertainty() {
    for seed in 0..4 {
        let tailed = arms(CORNER, 600.0, 3.0, false).map(|arm| Stroke { tail: 0.35, ..arm });
        let [off_px, sigmas] = off(&mut paper(&tailed, seed), Joint::Fillet, CORNER);
        assert!(off_px > 0.15 && sigmas < 4.0, "seed {seed}: {off_px:.2} px, {sigmas:.1} sigma");
        let mut plain = paper(&arms(CORNER, 600.0, 3.0, false), seed);
        let seam = plain.seam(&mut detector(SIZE), Joint::Fillet).unwrap();
        assert!(seam.sigma_px().iter().all(|px| *px < 0.1), "{seam:?}");
    }
}

/// Of a bead over the corner only a third is seen as a straight piece. The lines of the plates cross at (663.67, 525.33).
#[test]
fn a_bead_gives_the_crossing_of_the_plates_or_nothing_and_never_a_toe() {
    for (seed, (left, right)) in
        [([603.0, 578.0], [744.0, 553.0]), ([580.0, 597.97], [765.0, 560.23])].into_iter().enumerate()
    {
        let strokes = [
            between([110.0, 1006.0], left, 2.3),
            between(right, [1255.0, 729.0], 2.3),
            between([640.0, 577.0], [724.0, 557.0], 2.3),
        ];
        match paper(&strokes, seed as u64).seam(&mut detector(SIZE), Joint::Fillet) {
            Ok(seam) => assert!((seam.pixel - Vector2::new(663.67, 525.33)).norm() < 0.5, "{seam:?}"),
            Err(NotFound::ArmsApart { .. }) => {}
            other => panic!("{other:?}"),
        }
    }
}

/// A face of a box before a wall leads from the floor to the wall, and meets only the floor.
#[test]
fn a_face_along_a_plate_further_away_is_no_bead() {
    let foot = [600.0, 300.0];
    let strokes = [
        between(foot, [350.0, 600.0], 2.0),
        between(foot, [800.0, 420.0], 2.0),
        between([830.0, 340.0], [1250.0, 592.0], 2.0),
    ];
    let [off_px, sigmas] = off(&mut paper(&strokes, 3), Joint::Fillet, foot);
    assert!(off_px < 0.5 && sigmas < 4.5, "{off_px:.3} px, {sigmas:.1} sigma");
}

/// The right plate is lit itself, up to 14 px beyond the stripe on it, where it ends before a dark wall. The slightly
/// brighter area next to the wall is the plate, and has no direction.
#[test]
fn the_stripe_on_a_bright_plate_before_a_dark_wall_is_found() {
    let mut paper = paper(&arms(CORNER, 500.0, 2.0, false), 10);
    let (sin, cos) = 30.0_f64.to_radians().sin_cos();
    paper.surface(0.45, |u, v| {
        let (x, y) = (u - CORNER[0], v - CORNER[1]);
        x * cos + y * sin > 6.0 && y * cos - x * sin > -14.0 && y * cos - x * sin < 40.0
    });
    let [off_px, sigmas] = off(&mut paper, Joint::Fillet, CORNER);
    assert!(off_px < 0.5 && sigmas < 4.5, "{off_px:.3} px, {sigmas:.1} sigma");
}

/// A gap in a second stripe is a rival if that is as bright, and none if it is a mirror image with a sixth of the light.
#[test]
fn a_gap_in_dim_light_is_no_rival() {
    let gap = |v: f64, brightness: f64| {
        let left = Stroke { brightness, ..Stroke::new([620.0, v], 180.0, 450.0, 2.0) };
        [left, Stroke { brightness, ..Stroke::new([660.0, v + 1.0], 0.0, 450.0, 2.0) }]
    };
    let seam = |brightness: f64| {
        let strokes = [gap(400.0, 1.0), gap(600.0, brightness)].concat();
        paper(&strokes, 11).seam(&mut detector(SIZE), Joint::Butt)
    };
    let found = seam(1.0 / 6.0).unwrap();
    assert!((found.pixel - Vector2::new(640.0, 400.5)).norm() < 0.6, "{found:?}");
    assert!(matches!(seam(1.0), Err(NotFound::Ambiguous { .. })));
}

/// The plates end 75 px from the corner, and a bead leads from one to the other.
#[test]
fn a_bead_over_the_corner_leaves_the_crossing_of_the_plates() {
    let plates = arms(CORNER, 600.0, 2.0, false).map(|arm| {
        let (sin, cos) = arm.heading_deg.to_radians().sin_cos();
        Stroke { from: [arm.from[0] + 75.0 * cos, arm.from[1] + 75.0 * sin], ..arm }
    });
    let [left, right] = plates.map(|plate| plate.from);
    let bead = Stroke::new(left, 0.0, right[0] - left[0], 2.0);
    let [off_px, sigmas] = off(&mut paper(&[plates[0], plates[1], bead], 6), Joint::Fillet, CORNER);
    assert!(off_px < 0.5 && sigmas < 4.5, "{off_px:.3} px, {sigmas:.1} sigma");
}

#[test]
fn half_a_percent_of_hot_pixels_hides_nothing() {
    let levels = paper(&arms(CORNER, 600.0, 2.0, false), 7).levels(0.005);
    let picture = Picture::new(SIZE[0], SIZE[1], &levels).unwrap();
    let seam = detector(SIZE).seam(&picture, Joint::Fillet).unwrap();
    assert!((seam.pixel - Vector2::from(CORNER)).norm() < 0.3, "{seam:?}");
}

#[test]
fn of_two_stripes_the_region_or_the_choice_takes_one() {
    let (upper, lower) = ([640.0, 200.0], [640.0, 600.0]);
    let mut paper = paper(&[arms(upper, 300.0, 2.0, false), arms(lower, 300.0, 2.0, false)].concat(), 8);
    let refused = paper.seam(&mut detector(SIZE), Joint::Fillet);
    let Err(NotFound::Ambiguous { distance_px }) = refused else { panic!("{refused:?}") };
    assert!((distance_px - 400.0).abs() < 3.0, "{distance_px}");
    for (choice, truth) in [
        (StripeChoice::Upper, upper),
        (StripeChoice::Lower, lower),
        // Higher in these pictures is further away.
        (StripeChoice::Nearest, lower),
        (StripeChoice::Farthest, upper),
    ] {
        let seam = paper.seam(&mut detector(SIZE).choosing(choice), Joint::Fillet).unwrap();
        assert!((seam.pixel - Vector2::from(truth)).norm() < 0.4, "{choice:?}: {seam:?}");
    }
    for (rows, truth) in [([0.0, 420.0], upper), ([560.0, 1024.0], lower)] {
        let region = PictureRegion::rectangle([0.0, 1280.0], rows);
        let seam = paper.seam(&mut detector(SIZE).within(region), Joint::Fillet).unwrap();
        assert!((seam.pixel - Vector2::from(truth)).norm() < 0.4, "{seam:?}");
    }
}

/// Pictures in memory, of which some are broken.
struct Pictures {
    good: GrayImage,
    broken: Vec<bool>,
}

impl PictureSource for Pictures {
    fn count(&self) -> usize {
        self.broken.len()
    }

    fn stamp(&self, number: usize) -> FrameStamp {
        FrameStamp { stamp_ns: number as i64 * 30_000_000, frame: number as u64, device_ns: None }
    }

    fn name(&self, number: usize) -> String {
        format!("picture {number}")
    }

    fn read(&self, number: usize, _: &mut Vec<u8>) -> Result<GrayImage, Error> {
        let broken = || Error::in_file(self.name(number).as_ref(), Problem::Missing);
        if self.broken[number] { Err(broken()) } else { Ok(self.good.clone()) }
    }
}

#[test]
fn a_broken_picture_is_named_and_stops_nothing_and_no_whole_picture_is_an_error() {
    let pixels = Pixels::Eight(paper(&arms(CORNER, 600.0, 2.0, false), 9).levels(0.0));
    let good = GrayImage { width: SIZE[0], height: SIZE[1], pixels };
    let pictures = Pictures { good, broken: vec![false, true, false, false] };
    let scan = find_seams(&pictures, &detector(SIZE), None, &()).unwrap();
    assert_eq!((scan.joint, scan.seams().count(), scan.frames.len()), (Joint::Fillet, 3, 4));
    assert_eq!(
        scan.features().iter().map(|feature| feature.frame).collect::<Vec<_>>(),
        [Some(0), Some(2), Some(3)]
    );
    assert_eq!(scan.unreadable.len(), 1);
    assert!(scan.unreadable[0].to_string().contains("picture 1"), "{:?}", scan.unreadable);
    let pictures = Pictures { broken: vec![true; 3], ..pictures };
    let refused = find_seams(&pictures, &detector(SIZE), None, &()).map(|scan| scan.frames.len());
    assert!(refused.unwrap_err().to_string().contains("picture 0"));
}
