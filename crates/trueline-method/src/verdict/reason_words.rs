//! Reasons of more than one line.

use super::quantity::{MM_PER_M, MS_PER_S, Quantity, Significant};
use super::stream_name::StreamName;
use super::warning_words::how_far_apart;
use crate::assess::drawn_line_shift::DrawnLineShift;
use crate::assess::held_off::HeldOff;
use crate::assess::outliers::Outliers;
use crate::assess::seam_error::Largest;
use crate::input::skip::Skip;
use crate::stripe::outcome::{Apart, Because};

pub(super) fn curve_collapsed(length_m: f64, before_m: f64) -> String {
    format!(
        "the scan does not determine the size of the curve: its length changed from {:.0} to {:.0} mm during \
         the fit. Scan the whole seam two or three times and tilt the torch by ±10° about two axes",
        before_m * MM_PER_M,
        length_m * MM_PER_M
    )
}

pub(super) fn part_moved(shift_m: f64) -> String {
    format!(
        "the passes see the seam at different places, up to {:.2} mm apart: the part moved between them. Clamp it \
         and scan again, or state the scatter of its place (--part-moves MM,DEG)",
        shift_m * MM_PER_M
    )
}

pub(super) fn at_stops(stops: usize) -> String {
    format!(
        "the time offset cannot be determined, because the robot stands still at each of the {stops} \
         readings. Use --at-stops to calibrate without it, or record while the robot moves"
    )
}

pub(super) fn bent_stripes(because: Because) -> String {
    let why = match because {
        Because::Disagreement => "both answers are far apart".to_owned(),
        Because::Plates(why) => why.to_string(),
        _ => "they do not determine the whole hand-eye transform".to_owned(),
    };
    format!(
        "the stripes beside the curve do not confirm the seam points: {why}. Where straight lines through bent stripes \
         meet is beside the seam. Show both surfaces in more frames; if the seam points are measured otherwise, use \
         --use seam"
    )
}

pub(super) fn stripes_contradict(sigmas: f64, apart: &Apart) -> String {
    format!(
        "the whole stripes and the seam points contradict each other: their answers are {}. Check that both \
         tables come from one scan and one sensor; if you know which is right, choose --use stripe or --use \
         seam",
        how_far_apart(sigmas, apart)
    )
}

pub(super) fn worse_minimum(better_s: f64) -> String {
    format!(
        "the initial guess leads to a worse fit than a time offset of {:.1} ms with another hand-eye \
         transform. Leave the guess out, or correct it",
        better_s * MS_PER_S
    )
}

pub(super) fn wrong_time_offset(offsets_s: [f64; 2], explain: [f64; 2]) -> String {
    let ([found, better], [explains, better_explains]) =
        (offsets_s.map(|s| s * MS_PER_S), explain.map(|share| 100.0 * share));
    format!(
        "the estimated time offset is {found:.1} ms, but {better:.1} ms explains the scan better \
         ({better_explains:.0} % of the features instead of {explains:.0} %). Leave the initial guess out or \
         correct it; if there was none, give one"
    )
}

pub(super) fn residuals_too_large(noise_factor: f64, is_held: bool, few_stops: Option<usize>) -> String {
    let held = if is_held { " or in a value held by --fix" } else { "" };
    if let Some(stops) = few_stops {
        return format!(
            "The residuals are {noise_factor:.1} times larger than the stated noise: {stops} stops may be too few to find the answer, or \
             there is a mistake in the data. Give a guess with --initial, add stops, or run `trueline doctor`"
        );
    }
    format!(
        "This looks like a mistake in the data{held}: run `trueline doctor`. The residuals are \
         {noise_factor:.1} times larger than the stated noise. Possible causes: wrong units, orders or \
         frames, a wrong laser plane, another line, wrong time stamps, more than half of the features \
         outliers, or a sensor noisier than stated"
    )
}

pub(super) fn drawn_line_off(shift: &DrawnLineShift) -> String {
    let beside = shift.beside_m.map(|(off, sigma)| {
        format!("passes {:.2} ± {:.2} mm beside the drawing", off * MM_PER_M, sigma * MM_PER_M)
    });
    let turned = shift
        .turned_rad
        .map(|(off, sigma)| format!("is rotated by {:.2} ± {:.2}°", off.to_degrees(), sigma.to_degrees()));
    let how: Vec<String> = [beside, turned].into_iter().flatten().collect();
    format!(
        "line {} is not where it was drawn: fitted without the drawing, it {}. Check that the two points are \
         in mm and in the robot's base frame, that they lie on the scanned edge, and that the part has not \
         moved",
        shift.line,
        how.join(" and ")
    )
}

pub(super) fn held_off(off: &HeldOff) -> String {
    match *off {
        HeldOff::TimeOffset { held_s, found_s, sigma_s } => format!(
            "the time offset is held at {:.3} ms, but the scan shows {:.3} ± {:.3} ms. Leave --fix time-offset out, correct the value, or \
             state its uncertainty with --fixed-sigma",
            held_s * MS_PER_S,
            found_s * MS_PER_S,
            sigma_s * MS_PER_S
        ),
        HeldOff::HandEye { turned_rad, shifted_m, sigmas } => format!(
            "the hand-eye transform is held, but the scan shows one that differs by {:.3}° and {:.2} mm ({sigmas:.0} σ). Leave --fix \
             hand-eye out, correct the values, or state their uncertainty with --fixed-sigma",
            turned_rad.to_degrees(),
            shifted_m * MM_PER_M
        ),
    }
}

pub(super) fn too_few_used([used, features]: [usize; 2], mostly: Skip, count: usize) -> String {
    let question = match mostly {
        Skip::Outside => "; do both streams cover the scan, stamped by one clock?",
        _ => "",
    };
    format!("only {used} of {features} measurements could be used; {count}: {mostly}{question}")
}

pub(super) fn line_of_outliers(line: u32, Outliers { count, of }: Outliers) -> String {
    format!(
        "{count} of {of} features of line {line} are outliers, so the line is fitted to a minority. Leave the line out, or detect its features again"
    )
}

pub(super) fn too_many_outliers(outliers: Outliers) -> String {
    let Outliers { count, of } = outliers;
    let share = 100.0 * outliers.share();
    if count > 0 && 2 * count < of {
        return format!(
            "{count} of {of} measurements are outliers ({share:.0} %), so the rest may agree by chance. \
            Scan longer, or remove the disturbance of the detector"
        );
    }
    format!(
        "This looks like a mistake in the data: run `trueline doctor`. {share:.0} % of the measurements are outliers, so the fit \
         describes a minority"
    )
}

pub(super) fn coarse_robot_stamps(repeated: usize, rows: usize) -> String {
    format!(
        "{repeated} of {rows} robot rows repeat the previous stamp: the stamps are too coarse. Record the \
         controller's own time in device_time_s, or stamp with a finer clock"
    )
}

pub(super) fn other_time_offset([from, to]: [f64; 2], step_s: f64, clock: Option<StreamName>) -> String {
    let why = match clock {
        Some(StreamName::Robot) => {
            "the robot's clock stepped, for its stamps have a gap as long. Cut the recording there"
        }
        Some(StreamName::Images) => {
            "the camera's clock stepped, or images were queued, for their stamps have a gap as long. Cut the recording there"
        }
        None => "one of the clocks stepped, or images were queued",
    };
    format!("the time offset differs by {:+.2} ms from {from:.2} to {to:.2} s: {why}", step_s * MS_PER_S)
}

pub(super) fn robot_stream_froze([from, to]: [f64; 2]) -> String {
    format!(
        "the robot stream froze from {from:.2} to {to:.2} s: the recorded pose does not change while the \
         seam moves in the images. Cut the recording there"
    )
}

pub(super) fn clock_step([at_s, step_s, sigma_s]: [f64; 3], pictures: Option<u32>) -> String {
    let by = format!("{:+.3} ± {:.3} ms", step_s * MS_PER_S, sigma_s * MS_PER_S);
    match pictures {
        None => {
            format!(
                "the time offset changes by {by} at about {at_s:.3} s: one of the clocks stepped or is \
                 adjusted by network time. With arrival stamps a small change may also be load on the \
                 recording PC"
            )
        }
        Some(pictures) => format!(
            "the time offset changes by {by} at about {at_s:.3} s, which is {pictures} picture(s): pictures \
             are missing or doubled there and stamps were made by counting, or one of the clocks stepped"
        ),
    }
}

pub(super) fn seam_error_too_large(
    [rms_m, ceiling_m]: [f64; 2],
    mostly: Largest,
    weakest: Option<([f64; 3], f64)>,
) -> String {
    let along = weakest.map_or_else(String::new, |([x, y, z], sigma_m)| {
        format!(", {:.2} mm of it along ({x:.2}, {y:.2}, {z:.2}) in the tool", sigma_m * MM_PER_M)
    });
    format!(
        "the seam error is {:.2} mm (1 σ){along}; the limit is {} mm. {:.0} % of the variance comes from \
         {}: {}",
        rms_m * MM_PER_M,
        Significant(ceiling_m * MM_PER_M),
        100.0 * mostly.share,
        mostly.name,
        mostly.remedy
    )
}

pub(super) fn requirement_missed(quantity: Quantity, sigma_si: f64, required_si: f64) -> String {
    let unit = quantity.unit();
    format!(
        "{quantity}: ± {} {unit} exceeds the required {} {unit}. Scan longer, or with more tilt and more \
         change of stand-off",
        Significant(quantity.shown(sigma_si)),
        Significant(quantity.shown(required_si))
    )
}
