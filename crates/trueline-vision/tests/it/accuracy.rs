//! Promises: errors, gross errors, found and invented features on rendered pictures with known truth.

use crate::scenes;

use scenes::{Score, detector, pictures, scenario};
use trueline_dataset::Pixels;
use trueline_sim::{Joint as Scene, Look};
use trueline_vision::frame::Frame;
use trueline_vision::joint::arm_pair::pairs;
use trueline_vision::measure::stripe_meter::StripeMeter;
use trueline_vision::{Joint, Picture};

const PICTURES: usize = 30;

/// Limits of the issue this answers: RMS error in px, no error above 10 px, 98 % found. Half a percent of
/// thirty pictures is none, so one may be missed.
fn promised(scene: Scene, look: Look, joint: Joint, rms_px: f64) {
    let scenario = scenario(PICTURES);
    let pictures = pictures(&scenario, scene, look, 11);
    let score = Score::of(&mut detector(&scenario), &pictures, joint);
    assert!(score.visible >= PICTURES * 2 / 3, "the scan shows the seam in {} pictures only", score.visible);
    assert!(score.found + 1 >= score.visible, "{} of {} found", score.found, score.visible);
    assert!(score.rms_px() <= rms_px, "RMS {:.4} px", score.rms_px());
    assert!(score.worst_px() < 10.0, "worst {:.2} px", score.worst_px());
}

#[test]
fn clean_fillet() {
    promised(Scene::fillet(), Look::clean(), Joint::Fillet, 0.02);
}

#[test]
fn speckled_fillet() {
    promised(Scene::fillet(), Look::speckled(), Joint::Fillet, 0.2);
}

#[test]
fn fillet_of_mirrors() {
    promised(Scene::fillet(), Look::shiny(), Joint::Fillet, 0.3);
}

#[test]
fn fillet_while_welding() {
    promised(Scene::fillet(), Look::welding(), Joint::Fillet, 0.3);
}

#[test]
fn fillet_with_a_gap_at_the_corner() {
    // 0.6 mm missing on each plate is 10 to 40 px between the stripe's ends.
    let scene = Scene::Fillet { opening_rad: 1.6, roll_rad: 0.1, gap_m: 0.6e-3 };
    promised(scene, Look::speckled(), Joint::Fillet, 0.3);
}

/// Outside the stripe a picture without noise is exactly dark.
#[test]
fn clean_fillet_with_a_gap_at_the_corner() {
    let scene = Scene::Fillet { opening_rad: 1.6, roll_rad: 0.1, gap_m: 1.2e-3 };
    promised(scene, Look::clean(), Joint::Fillet, 0.02);
}

#[test]
fn speckled_lap() {
    promised(Scene::Lap { step_m: 3e-3 }, Look::speckled(), Joint::Lap, 0.9);
}

#[test]
fn lap_of_mirrors() {
    promised(Scene::Lap { step_m: 3e-3 }, Look::shiny(), Joint::Lap, 0.9);
}

#[test]
fn speckled_groove() {
    // No figure is asked for. Its faces are 150 px long where a fillet's plates are 1000: an error of a line
    // at its end goes with the square root of its length, 2.6 times that of the fillet's 0.2 px; a face seen
    // at a slant doubles it.
    promised(Scene::VGroove { depth_m: 5e-3, opening_rad: 1.6 }, Look::speckled(), Joint::VGroove, 1.0);
}

#[test]
fn speckled_gap() {
    // The middle of two edges, each as good as a lap's: 0.9 / √2.
    promised(Scene::Butt { gap_m: 1.5e-3, mismatch_m: 0.0 }, Look::speckled(), Joint::Butt, 0.64);
}

#[test]
fn nothing_is_found_where_there_is_no_seam() {
    let scenario = scenario(12);
    let mut detector = detector(&scenario);
    for (scene, look) in [
        (Scene::Nothing, Look::clean()),
        (Scene::Nothing, Look::welding()),
        (Scene::Plate, Look::speckled()),
        (Scene::Plate, Look { spatter: 60.0, ..Look::speckled() }),
    ] {
        let pictures = pictures(&scenario, scene, look, 5);
        for joint in [Joint::Fillet, Joint::Lap, Joint::VGroove, Joint::Butt] {
            let score = Score::of(&mut detector, &pictures, joint);
            assert_eq!(score.invented, 0, "{joint:?} in {scene:?}");
        }
    }
}

/// The normalised squared error has mean 2 and, over n pictures, the standard deviation 2/√n: within 4 of them
/// for 60 pictures it lies between 1 and 3. Covariances are learnt from the same pictures, so half as much again is
/// granted.
#[test]
fn errors_are_as_large_as_the_covariance_says() {
    let scenario = scenario(60);
    let mut detector = detector(&scenario);
    let score =
        Score::of(&mut detector, &pictures(&scenario, Scene::fillet(), Look::speckled(), 3), Joint::Fillet);
    let mean = score.mean_normalised();
    assert!((0.67..4.5).contains(&mean), "mean normalised squared error {mean:.2}");
}

/// Users may want the centre line besides the seam: its points scatter about the fitted line by their standard
/// deviation. Outliers of a heavy-tailed distribution count in full here, so that half as much again is granted.
#[test]
fn points_of_the_centre_line_scatter_as_their_sigma_says() {
    let scenario = scenario(4);
    let mut detector = detector(&scenario);
    let mut meter = StripeMeter::default();
    for (image, _) in pictures(&scenario, Scene::fillet(), Look::speckled(), 7) {
        let Pixels::Eight(levels) = &image.pixels else { panic!("eight bits are simulated") };
        let picture = Picture::new(image.width, image.height, levels).unwrap();
        if detector.seam(&picture, Joint::Fillet).is_err() {
            continue;
        }
        let frame = Frame { picture: &picture, lens: detector.lens() };
        let pair = pairs(detector.segments(), frame.lens)
            .filter_map(|(_, pair)| pair.ok())
            .max_by(|a, b| a.score().total_cmp(&b.score()))
            .unwrap();
        let (arm, span) = (pair.arms[0], [20.0, pair.lengths[0]]);
        let (line, template) = meter.learn(&arm, span, 2.0, frame).unwrap();
        let start = arm.station(&line.point);
        let fit = meter.fit_with(&line, span.map(|s| s - start), &template, frame).unwrap();
        let normalised: Vec<f64> =
            meter.middles(&fit).map(|m| (fit.line.distance(&m.ideal) / m.sigma_px).powi(2)).collect();
        assert!(normalised.len() > 300, "{} points", normalised.len());
        let mean = normalised.iter().sum::<f64>() / normalised.len() as f64;
        assert!((0.6..2.5).contains(&mean), "mean normalised square {mean:.2}");
    }
}

/// Turned to light the upper plate's end face. Its light must not pass as the plate's, and it begins at the edge.
/// Without noise that is known as well as a corner is.
#[test]
fn lap_with_a_lit_end_face() {
    let mut scenario = scenario(8);
    scenario.scan.attitude_rad[0] = -0.5;
    scenario.scan.tilts = Default::default();
    let pictures = pictures(&scenario, Scene::Lap { step_m: 3e-3 }, Look::clean(), 1);
    let score = Score::of(&mut detector(&scenario), &pictures, Joint::Lap);
    assert!(score.found >= 6, "{} of {} found", score.found, score.visible);
    assert!(score.rms_px() < 0.05, "RMS {:.3} px", score.rms_px());
}
