//! The parts against oracles of their own: lens, template, regression, choice of the joint.

use nalgebra::{Matrix2, Vector2};
use std::f64::consts::PI;
use trueline_sim::noise::Noise;
use trueline_sim::{Preset, SensorModel};
use trueline_vision::line::Line2;
use trueline_vision::measure::regression::{Regressor, Shift};
use trueline_vision::measure::stripe_end::{BANDS, BandSection, EndFinder, EndSearch};
use trueline_vision::measure::template::Stack;
use trueline_vision::scan::joint_choice;
use trueline_vision::scan::neighbours;
use trueline_vision::scan::two_places;
use trueline_vision::{Detection, Joint, Lens, NotFound, Seam};

fn lens() -> Lens {
    let SensorModel::CameraLaser { camera, laser_plane_in_camera } = Preset::Quick.scenario().cell.sensor
    else {
        panic!("the scan has a camera");
    };
    Lens::new(camera, laser_plane_in_camera)
}

/// Pixels spread over the picture, the border included.
fn pixels() -> impl Iterator<Item = Vector2<f64>> {
    (0..40).flat_map(|k| (0..33).map(move |j| Vector2::new(62.7 * f64::from(k), 62.4 * f64::from(j))))
}

#[test]
fn ideal_pixels_that_are_looked_up_are_those_that_distort_to_the_pixel() {
    let lens = lens();
    for pixel in pixels() {
        let ideal = lens.ideal(pixel.x as f32, pixel.y as f32);
        let back = lens.distorted(&Vector2::from(ideal.map(f64::from))).0;
        // Between the nodes of the grid, see `Lens`; and single precision, 2400 · 6e-8 px.
        assert!((back - pixel).norm() < 0.004, "{pixel:?} comes back as {back:?}");
    }
}

#[test]
fn derivatives_of_the_lens_are_differences() {
    let lens = lens();
    let step = 1e-3;
    for pixel in pixels().step_by(17) {
        let (_, distorted) = lens.distorted(&pixel);
        let (point, on_sheet) = lens.on_sheet(&pixel).unwrap();
        let (back, from_sheet) = lens.from_sheet(&point).unwrap();
        assert!((back - pixel).norm() < 1e-9);
        // Central differences err by the third derivative, 1e-7 of the first here, times step²; and by
        // rounding, 2000 px · 1e-16 / 1e-3.
        assert!((from_sheet * on_sheet - Matrix2::identity()).norm() < 1e-9);
        for axis in 0..2 {
            let mut off = Vector2::zeros();
            off[axis] = step;
            let difference =
                (lens.distorted(&(pixel + off)).0 - lens.distorted(&(pixel - off)).0) / (2.0 * step);
            assert!((distorted.column(axis) - difference).norm() < 1e-8);
            let point = |at: Vector2<f64>| lens.on_sheet(&at).unwrap().0;
            let difference = (point(pixel + off) - point(pixel - off)) / (2.0 * step);
            assert!((on_sheet.column(axis) - difference).norm() < 1e-9 * on_sheet.norm().max(1.0));
        }
    }
}

/// A stripe of a shape of its own, with whatever noise, shifted by a part of a pixel.
fn stripe(shift: f64, sigma: f64) -> impl Iterator<Item = f32> {
    (-30..=30).map(move |k| (200.0 * (-0.5 * ((f64::from(k) - shift) / sigma).powi(4)).exp()) as f32)
}

#[test]
fn a_template_learnt_from_any_symmetric_stripe_finds_its_shift_without_bias() {
    let sigma = 4.0;
    let mut stack = Stack::default();
    // Learnt at all phases of the pixel grid, as along a slanted stripe.
    for phase in 0..64 {
        let shift = f64::from(phase) / 64.0 - 0.5;
        for (k, level) in (-30..=30).zip(stripe(shift, sigma)) {
            stack.add((f64::from(k) - shift) as f32, level / 200.0);
        }
    }
    let template = stack.template().unwrap();
    let mut worst = [0.0_f64; 2];
    for phase in 0..50 {
        let place = f64::from(phase) / 50.0 - 0.5;
        // The line is where the stripe is: nothing may be left over; and moved by 0.1 px: 0.1 px must be.
        for (worst, moved) in worst.iter_mut().zip([0.0, 0.1]) {
            let [odd, ..] = template.weigh(-30.0 - place, 1.0, stripe(place + moved, sigma));
            let found = f64::from(odd) / (200.0 * template.gain);
            *worst = worst.max((found - moved).abs());
        }
    }
    // The flanks of this shape fall within 1.5 px: sampled once a pixel, sums over it depend on the phase by a
    // hundredth of a pixel; the gain is learnt from a profile smoothed over 0.75 px, a tenth of 0.1 px more.
    assert!(worst[0] < 0.02 && worst[1] < 0.025, "{worst:?} px");
}

#[test]
fn the_covariance_of_a_line_is_its_spread() {
    let mut noise = Noise::new(4, 0);
    let mut regressor = Regressor::default();
    let truth = Vector2::new(0.3, 2e-4);
    let (mut squares, mut runs) = ([0.0; 2], 0.0);
    for _ in 0..600 {
        // Neighbours share half of their noise, and one in twenty is far off.
        let mut last = 0.0;
        let shifts: Vec<Shift> = (0..400)
            .map(|k| {
                let fresh = noise.normal(0.3);
                let both = fresh + last;
                last = fresh;
                let s = f64::from(k);
                let off = if noise.happens(0.05) { noise.uniform(-20.0, 20.0) } else { 0.0 };
                Shift { s, shift_px: truth.x + truth.y * s + both + off, weight: 1.0, response: 1.0 }
            })
            .collect();
        let fit = regressor.fit(&shifts).unwrap();
        let at_zero = fit.shift_px - fit.slope * fit.centre;
        let c = fit.covariance;
        let variance = c.m11 - 2.0 * c.m12 * fit.centre + c.m22 * fit.centre * fit.centre;
        squares[0] += (at_zero - truth.x).powi(2) / variance;
        squares[1] += (fit.slope - truth.y).powi(2) / c.m22;
        runs += 1.0;
    }
    for square in squares {
        // Mean of a squared normal: 1 ± √(2/600) = 0.06; 4 of them, and a tenth for the correlation, which is
        // estimated from the same shifts.
        assert!((0.7..1.35).contains(&(square / runs)), "normalised square {:.3}", square / runs);
    }
}

/// A stripe whose bands, 1.4 of its reach together, reach three thicknesses to each side.
fn end_search(band_px: f64) -> EndSearch {
    EndSearch { within: [-30.0, 30.0], band_px, used: [true; BANDS], sigma_px: band_px * BANDS as f64 / 4.2 }
}

#[test]
fn the_end_of_a_speckled_stripe_is_found_to_within_its_sigma() {
    let mut noise = Noise::new(8, 0);
    let mut finder = EndFinder::default();
    let (mut square, mut normalised) = (0.0, 0.0);
    const RUNS: usize = 300;
    for run in 0..RUNS {
        let (edge, slant) = (noise.uniform(-8.0, 8.0), noise.uniform(-1.0, 1.0));
        let width = 1.5;
        finder.sections.clear();
        for k in -90..60 {
            let s = f64::from(k);
            let light = std::array::from_fn(|band| {
                let place = edge + slant * (band as f64 + 0.5 - 0.5 * BANDS as f64) * width;
                let part = 1.0 / (1.0 + (-1.702 * (place - s) / 0.9).exp());
                // Two independent fields: an exponential intensity.
                let speckle = 0.5 * (noise.normal(1.0).powi(2) + noise.normal(1.0).powi(2));
                150.0 * part * speckle + noise.normal(1.0)
            });
            finder.sections.push(BandSection { s, light });
        }
        let found = finder.end(&end_search(width)).unwrap();
        assert!((found.s - edge).abs() < 5.0, "run {run}: {:.2} px off", found.s - edge);
        square += (found.s - edge).powi(2);
        normalised += ((found.s - edge) / found.sigma_px).powi(2);
    }
    // Grains of one pixel in six bands: an end is known to a fraction of a pixel.
    assert!((square / RUNS as f64).sqrt() < 0.6, "RMS {:.3} px", (square / RUNS as f64).sqrt());
    assert!((0.4..2.0).contains(&(normalised / RUNS as f64)), "{:.2}", normalised / RUNS as f64);
}

/// Of fully developed speckle a lens leaves a twentieth of the variance here. Weights are −P′ / V: at 2.8 and 1 thicknesses 86 to 1 of speckle
/// alone, less of it for the noise that is assumed at least; 0.6 to 1 in the profile's slope alone.
#[test]
fn far_flanks_count_where_a_lens_leaves_a_part_of_the_speckle() {
    let (mut noise, mut stack) = (Noise::new(12, 0), Stack::default());
    const SIGMA_PX: f32 = 4.0;
    for k in 0..400_000 {
        let distance_px = (k % 4000) as f32 * 0.005;
        let profile = (-0.5 * (distance_px / SIGMA_PX).powi(2)).exp();
        stack.add(distance_px, profile * (1.0 + noise.normal(0.05_f64.sqrt()) as f32));
    }
    let template = stack.template().unwrap();
    let weight =
        |thicknesses: f64| template.weigh(thicknesses * f64::from(SIGMA_PX), 1.0, std::iter::once(1.0))[0];
    let ratio = weight(2.8) / weight(1.0);
    assert!((5.0..86.0).contains(&ratio), "{ratio:.2}");
}

/// The same where the stripe is 2.5 times as bright as can be shown, with a tenth of the variance of full speckle: its ridge is even, its shoulders
/// are not. −P′ / V at 2.8 and 1.6 thicknesses: 0.139 / 0.00065 to 1.0 / 0.04 with what is assumed of a saturated stripe, 8 to 1;
/// 0.139 / 0.010 to 1.0 / 0.05, 0.7 to 1, were the stripe taken for one without speckle as its ridge has none.
#[test]
fn far_flanks_count_where_the_ridge_is_saturated() {
    let (mut noise, mut stack) = (Noise::new(12, 0), Stack::default());
    const SIGMA_PX: f32 = 8.0;
    for k in 0..400_000 {
        let distance_px = (k % 4000) as f32 * 0.008;
        let profile = 2.5 * (-0.5 * (distance_px / SIGMA_PX).powi(2)).exp();
        stack.add(distance_px, (profile * (1.0 + noise.normal(0.1_f64.sqrt()) as f32)).clamp(0.0, 1.0));
    }
    let template = stack.template().unwrap();
    let weight =
        |thicknesses: f64| template.weigh(thicknesses * f64::from(SIGMA_PX), 1.0, std::iter::once(1.0))[0];
    let ratio = weight(2.8) / weight(1.6);
    assert!((4.0..12.0).contains(&ratio), "{ratio:.2}");
}

/// Grains of one pixel on a stripe with a sharp end, behind a lens that blurs both: neighbours share their speckle.
fn blurred_end(noise: &mut Noise, edge: f64, slant: f64, blur_px: f64, band_px: f64) -> Vec<BandSection> {
    const ROWS: usize = 41;
    const COLUMNS: usize = 240;
    let reach = (3.5 * blur_px) as usize;
    let taps: Vec<f64> =
        (0..=2 * reach).map(|k| (-0.5 * ((k as f64 - reach as f64) / blur_px).powi(2)).exp()).collect();
    let total: f64 = taps.iter().sum();
    let blurred = |line: &[f64]| -> Vec<f64> {
        let at = |k: usize, j: usize| (k + j).checked_sub(reach).and_then(|k| line.get(k)).unwrap_or(&0.0);
        (0..line.len()).map(|k| taps.iter().enumerate().map(|(j, t)| t / total * at(k, j)).sum()).collect()
    };
    let (x, y) = (|k: usize| k as f64 - 160.0, |row: usize| row as f64 - 20.0);
    let rows: Vec<Vec<f64>> = (0..ROWS)
        .map(|row| {
            let bell = (-0.5 * (y(row) / 2.0).powi(2)).exp();
            let light = (0..COLUMNS).map(|k| {
                let part = (edge + slant * y(row) - x(k) + 0.5).clamp(0.0, 1.0);
                150.0 * bell * part * 0.5 * (noise.normal(1.0).powi(2) + noise.normal(1.0).powi(2))
            });
            blurred(&light.collect::<Vec<_>>())
        })
        .collect();
    let sections = (30..COLUMNS - 20).map(|k| {
        let column = blurred(&rows.iter().map(|row| row[k]).collect::<Vec<_>>());
        let (mut light, mut counts) = ([0.0; BANDS], [0.0; BANDS]);
        for (row, level) in column.into_iter().enumerate() {
            let band = (y(row) / band_px + 0.5 * BANDS as f64).floor();
            if (0.0..BANDS as f64).contains(&band) {
                light[band as usize] += level;
                counts[band as usize] += 1.0;
            }
        }
        BandSection { s: x(k), light: std::array::from_fn(|b| light[b] / counts[b] + noise.normal(0.3)) }
    });
    sections.collect()
}

/// Its uncertainty is too small if neighbours' light counts as independent.
#[test]
fn the_end_of_a_stripe_behind_a_blurring_lens_is_found_by_what_neighbours_share() {
    let (mut noise, mut finder) = (Noise::new(9, 0), EndFinder::default());
    let blur_px = 4.0;
    let band_px = 4.2 * 2.0_f64.hypot(blur_px) / BANDS as f64;
    let [mut square, mut near_square, mut normalised] = [0.0; 3];
    const RUNS: usize = 40;
    for _ in 0..RUNS {
        let (edge, slant) = (noise.uniform(-8.0, 8.0), noise.uniform(-0.3, 0.3));
        finder.sections = blurred_end(&mut noise, edge, slant, blur_px, band_px);
        near_square += (finder.near_end(&end_search(band_px)).unwrap().s - edge).powi(2);
        let found = finder.end(&end_search(band_px)).unwrap();
        square += (found.s - edge).powi(2);
        normalised += ((found.s - edge) / found.sigma_px).powi(2);
    }
    let [rms, near_rms] = [square, near_square].map(|square| (square / RUNS as f64).sqrt());
    // A ratio of two such RMS scatters by less than 1 / √40.
    assert!(rms < 0.75 * near_rms, "RMS {rms:.2} px, {near_rms:.2} px before");
    assert!((0.2..2.0).contains(&(normalised / RUNS as f64)), "{:.2}", normalised / RUNS as f64);
}

#[test]
fn an_end_is_none_where_the_light_goes_on() {
    let mut finder = EndFinder::default();
    finder.sections.extend((-90..60).map(|k| BandSection { s: f64::from(k), light: [100.0; BANDS] }));
    assert_eq!(finder.end(&end_search(1.5)), Err(NotFound::GoesOn));
}

#[test]
fn lines_cross_where_they_should() {
    let a = Line2 { point: Vector2::new(1.0, 2.0), along: Vector2::new(0.6, 0.8) };
    let b = Line2 { point: Vector2::new(5.0, 0.0), along: Vector2::new(0.0, 1.0) };
    let crossing = a.cross(&b).unwrap();
    assert!((crossing - Vector2::new(5.0, 2.0 + 4.0 * 0.8 / 0.6)).norm() < 1e-12);
    assert_eq!(a.cross(&a), None);
    assert!((a.distance(&a.at(7.0))).abs() < 1e-12);
    // Moved by its normal, the old point lies on the other side.
    assert!((a.moved(0.5, 0.0).distance(&a.point) + 0.5).abs() < 1e-12);
}

fn seen(gap_m: f64) -> Option<Detection> {
    let mut seam =
        Seam::from_ideal(&lens(), &Vector2::new(1200.0, 1000.0), &Matrix2::identity(), 1.0).unwrap();
    seam.gap_m = gap_m;
    Some(seam.into())
}

#[test]
fn the_joint_is_the_most_special_one_that_most_pictures_show() {
    let (none, some) = (None, seen(1e-3));
    let show = |shown: &[Joint]| Joint::ALL.map(|joint| if shown.contains(&joint) { some } else { none });
    assert_eq!(joint_choice::joint(&[]), None);
    assert_eq!(joint_choice::joint(&[show(&[]); 5]), None);
    assert_eq!(joint_choice::joint(&[show(&[Joint::VGroove, Joint::Fillet]); 5]), Some(Joint::VGroove));
    assert_eq!(joint_choice::joint(&[show(&[Joint::Fillet, Joint::Butt]); 5]), Some(Joint::Fillet));
    assert_eq!(joint_choice::joint(&[show(&[Joint::Lap, Joint::Edge]); 5]), Some(Joint::Lap));
    assert_eq!(joint_choice::joint(&[show(&[Joint::Corner]); 5]), Some(Joint::Corner));
    assert_eq!(joint_choice::joint(&[show(&[Joint::Butt]); 5]), Some(Joint::Butt));
    // Evenness is no evidence in two gaps, and a joint in one of twelve pictures is chance.
    assert_eq!(joint_choice::joint(&[show(&[Joint::Butt]); 2]), None);
    let mut rare = [show(&[]); 12];
    rare[7] = show(&[Joint::VGroove]);
    assert_eq!(joint_choice::joint(&rare), None);
    assert_eq!(joint_choice::joint(&rare[5..]), Some(Joint::VGroove));
    // Every stripe ends somewhere: an edge is the joint if several pictures, and nearly all, show it.
    assert_eq!(joint_choice::joint(&[show(&[Joint::Edge]); 6]), Some(Joint::Edge));
    assert_eq!(joint_choice::joint(&[show(&[Joint::Edge]); 5]), None);
}

#[test]
fn a_gap_that_is_not_as_wide_as_the_others_is_refused() {
    let mut seams: Vec<_> =
        [1.5, 1.4, 1.6, 1.5, 3.0, 1.55].iter().map(|mm| Ok(seen(mm * 1e-3).unwrap())).collect();
    seams.push(Err(NotFound::NoStripe { contrast: 0.0 }));
    joint_choice::refuse_odd_gaps(seams.iter_mut());
    let odd: Vec<usize> = (0..seams.len()).filter(|k| seams[*k] == Err(NotFound::OddGap)).collect();
    assert_eq!(odd, [4]);
    assert_eq!(seams[6], Err(NotFound::NoStripe { contrast: 0.0 }));
    // If all differ, there is no usual width.
    let mut seams: Vec<_> = [1.0, 2.0, 4.0, 8.0].iter().map(|mm| Ok(seen(mm * 1e-3).unwrap())).collect();
    joint_choice::refuse_odd_gaps(seams.iter_mut());
    assert!(seams.iter().all(Result::is_ok));
}

fn at(u: f64, v: f64) -> Result<Detection, NotFound> {
    let mut found = seen(0.0).unwrap();
    found.seam.pixel = Vector2::new(u, v);
    Ok(found)
}

fn in_order(found: &mut [Result<Detection, NotFound>]) -> Vec<(f64, &mut Result<Detection, NotFound>)> {
    found.iter_mut().enumerate().map(|(k, found)| (k as f64 / 33.0, found)).collect()
}

#[test]
fn points_that_jump_are_refused_and_swings_are_not() {
    // A swing of 300 px at half a hertz, 33 pictures a second; two points jump, one of them the first.
    let time_s = |k: usize| k as f64 / 33.0;
    let swing = |k: usize| (PI * time_s(k)).sin() * 300.0;
    let mut seams: Vec<_> = (0..100).map(|k| at(1200.0 + swing(k), 900.0)).collect();
    seams[0] = at(1240.0, 900.0);
    seams[50] = at(1200.0 + swing(50), 870.0);
    seams[70] = Err(NotFound::NoStripe { contrast: 0.0 });
    let typical = neighbours::refuse_jumps(&mut in_order(&mut seams));
    // A parabola over ten pictures follows the swing to its fourth derivative: 300 · π⁴ · 0.15⁴ / 24 = 0.6 px.
    assert!(typical.unwrap() < 0.6);
    let refused: Vec<usize> = (0..100).filter(|k| matches!(seams[*k], Err(NotFound::Jumps { .. }))).collect();
    assert_eq!(refused, [0, 50]);
    // Pictures that have nothing to do with each other are not judged.
    let mut noise = Noise::new(1, 0);
    let mut seams: Vec<_> =
        (0..40).map(|_| at(noise.uniform(0.0, 2400.0), noise.uniform(0.0, 2000.0))).collect();
    neighbours::refuse_jumps(&mut in_order(&mut seams));
    assert_eq!(two_places::refuse_second_place(&mut in_order(&mut seams)), None);
    assert!(seams.iter().all(Result::is_ok));
}

/// A bead whose toes are 110 px apart: each picture takes one of them, by chance or mostly the same.
#[test]
fn two_tracks_that_are_entered_in_turn_are_two_places() {
    let toe = |k: usize, far: bool| {
        let swing = (PI * k as f64 / 33.0).sin() * 150.0;
        at(1200.0 + swing + if far { 105.0 } else { 0.0 }, 900.0 + if far { 30.0 } else { 0.0 })
    };
    let mut noise = Noise::new(2, 0);
    let is_second = |found: &Result<Detection, NotFound>| matches!(found, Err(NotFound::TwoPlaces { .. }));
    for (share, all) in [(0.5, true), (0.15, false)] {
        let far: Vec<bool> = (0..120).map(|_| noise.happens(share)).collect();
        let mut found: Vec<_> = far.iter().enumerate().map(|(k, far)| toe(k, *far)).collect();
        let apart_px = two_places::refuse_second_place(&mut in_order(&mut found)).unwrap();
        // √(105² + 30²) = 109 px.
        assert!((apart_px - 109.2).abs() < 3.0, "{apart_px}");
        // Half and half: neither counts. Else those of the rarer toe do not, and of the others none is lost.
        let refused = found.iter().filter(|found| is_second(found)).count();
        if all {
            assert!(refused > 100, "{refused} of 120");
        } else {
            assert!(found.iter().zip(&far).all(|(found, far)| *far || !is_second(found)));
        }
    }
    // One track, with a third of the points anywhere, is one place.
    let mut found: Vec<_> = (0..120)
        .map(|k| if noise.happens(0.33) { at(noise.uniform(0.0, 2400.0), 500.0) } else { toe(k, false) })
        .collect();
    assert_eq!(two_places::refuse_second_place(&mut in_order(&mut found)), None);
}

/// Sections without any light have no shift; whatever stands there must not reach the line.
#[test]
fn shifts_without_weight_do_not_count() {
    let mut shifts: Vec<Shift> = (0..100)
        .map(|k| Shift {
            s: f64::from(k),
            shift_px: 0.5 + 0.01 * f64::from(k % 3),
            weight: 1.0,
            response: 1.0,
        })
        .collect();
    let mut regressor = Regressor::default();
    let alone = regressor.fit(&shifts).unwrap();
    shifts.extend((100..140).map(|k| Shift { s: f64::from(k), shift_px: 9.0, weight: 0.0, response: 0.0 }));
    assert_eq!(regressor.fit(&shifts).unwrap(), alone);
    for shift in &mut shifts {
        shift.response = f64::NAN;
    }
    assert_eq!(regressor.fit(&shifts), None);
}

#[test]
fn gaps_of_all_widths_in_some_pictures_are_dirt() {
    let dirty = |k: usize| {
        let gap = if k.is_multiple_of(2) { seen(0.3e-3 * (k + 1) as f64) } else { None };
        Joint::ALL.map(|joint| gap.filter(|_| joint == Joint::Butt))
    };
    let trials: Vec<_> = (0..10).map(dirty).collect();
    assert_eq!(joint_choice::joint(&trials), None);
}
