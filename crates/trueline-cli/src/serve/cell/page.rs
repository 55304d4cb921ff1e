//! The page of a recording: the picture, the robot, the losses, the estimate with its ±, and the missing motion.

use super::growth::Point;
use super::picture;
use super::shown::{PICTURE_PATH, Shown};
use crate::serve::html::{block, card, escape, facts, list};
use crate::serve::trend::{Series, Trend};
use trueline_cell::{CellState, Estimated, Progress, RobotBrief, SmallPicture};

/// The blocks of a recording.
#[must_use]
pub(super) fn blocks(shown: &Shown, picture: Option<&SmallPicture>, has_camera: bool) -> String {
    let Some(state) = &shown.state else {
        return block("state", "<p class=\"state\">Nothing received yet.</p>");
    };
    let mut out = block("state", &state_words(state, shown.at_s));
    let mut cards = card("Robot", "", &robot(shown));
    if has_camera {
        let drawn = picture.map_or_else(
            || "<p class=\"soft\">no picture yet</p>".to_owned(),
            |picture| self::picture::markup(picture, PICTURE_PATH),
        );
        cards = card("Camera: the last picture", "", &drawn)
            + &cards
            + &card("Camera", "", &camera(shown, state));
    }
    if let Some(progress) = &state.estimate {
        cards += &card("Estimate", "", &estimate(progress));
        cards += &card(
            "Time offset (ms), ± one standard deviation",
            "",
            &time_offset(shown.growth.points()).svg(),
        );
        cards += &card("Hand-eye: one standard deviation", "", &hand_eye(shown.growth.points()).svg());
    }
    out += &block("cell", &format!("<div class=\"blocks\">{cards}</div>"));
    out
}

fn state_words(state: &CellState, at_s: f64) -> String {
    let time = format!("<p class=\"soft\">{:.0} s of recording</p>", at_s);
    let Some(progress) = &state.estimate else {
        return format!("<p class=\"state\">Recording.</p>{time}");
    };
    let (class, text) = match progress {
        Progress::Estimated(Estimated { is_enough: Some(true), .. }) => {
            ("good", "The required accuracy is reached.")
        }
        Progress::Estimated(e) if !e.advice.is_empty() => ("mind", "A motion is missing."),
        Progress::Estimated(Estimated { is_enough: Some(false), .. }) => {
            ("mind", "Not yet as accurate as required.")
        }
        Progress::Estimated(_) => ("good", "All unknowns can be determined."),
        Progress::Waiting { .. } => ("mind", "Too few seam points for an estimate yet."),
        Progress::Refused { .. } => ("bad", "No estimate."),
    };
    let missing = list(progress.advice().iter().cloned());
    let missing = if missing.is_empty() { missing } else { card("Missing motion", "alarm", &missing) };
    format!("<p class=\"state {class}\">{text}</p>{missing}{time}")
}

fn rate(hz: Option<f64>) -> String {
    hz.map_or_else(|| "–".to_owned(), |hz| format!("{hz:.1} Hz"))
}

fn robot(shown: &Shown) -> String {
    let RobotBrief { poses, base_from_tool, .. } = &shown.brief;
    let mut rows = vec![
        ("stream", shown.robot.clone()),
        ("poses", format!("{poses}, {} lately", rate(shown.poses.hz()))),
    ];
    if let Some(pose) = base_from_tool {
        let [x, y, z] = [0, 1, 2].map(|k| pose.translation.vector[k] * 1e3);
        let q = pose.rotation.quaternion();
        let sign = if q.w < 0.0 { -1.0 } else { 1.0 };
        let [w, i, j, k] = [q.w, q.i, q.j, q.k].map(|part| sign * part);
        rows.push(("x y z (mm)", format!("{x:.1} {y:.1} {z:.1}")));
        rows.push(("quaternion w x y z", format!("{w:.4} {i:.4} {j:.4} {k:.4}")));
    }
    facts(rows)
}

fn camera(shown: &Shown, state: &CellState) -> String {
    let Some(counts) = &state.camera else { return String::new() };
    let share = |part: u64, of: u64| if of == 0 { 0.0 } else { 100.0 * part as f64 / of as f64 };
    let mut rows = vec![
        ("pictures", format!("{}, {} lately", counts.frames, rate(shown.pictures.hz()))),
        (
            "lost",
            format!(
                "{} of {} ({:.1} %)",
                counts.lost(),
                counts.taken(),
                share(counts.lost(), counts.taken())
            ),
        ),
        ("seam found", format!("in {} ({:.0} %)", counts.seams, share(counts.seams, counts.frames))),
        ("went away", format!("{} times", counts.interruptions)),
        ("clock was set", format!("{} times", counts.clock_set)),
    ];
    if !counts.signals.is_empty() {
        rows.push(("inputs", counts.signals.to_string()));
    }
    facts(rows) + &list(counts.losses())
}

fn estimate(progress: &Progress) -> String {
    let Progress::Estimated(estimated) = progress else {
        return format!("<p>{}</p>", escape(&progress.to_string()));
    };
    let unknown = || "not determined yet".to_owned();
    let offset = estimated.time_offset_s.map(|s| s.map(|s| s * 1e3));
    facts([
        ("time offset", offset.map_or_else(unknown, |[value, sigma]| format!("{value:+.3} ± {sigma:.3} ms"))),
        (
            "hand-eye translation",
            estimated.translation_sigma_m.map_or_else(unknown, |m| format!("± {:.3} mm", m * 1e3)),
        ),
        (
            "hand-eye rotation",
            estimated.rotation_sigma_rad.map_or_else(unknown, |rad| format!("± {:.4}°", rad.to_degrees())),
        ),
        ("seam points", estimated.seam_points.to_string()),
    ])
}

fn time_offset(points: &[Point]) -> Trend {
    let series = Series {
        name: "time offset",
        points: points.iter().map(|p| [p.at_s, p.time_offset_s[0] * 1e3]).collect(),
        sigma: points.iter().map(|p| p.time_offset_s[1] * 1e3).collect(),
        dotted: false,
    };
    Trend {
        alternative: "Time offset by time".to_owned(),
        along: "s",
        series: vec![series],
        limits: Vec::new(),
    }
}

fn hand_eye(points: &[Point]) -> Trend {
    let of = |name, value: &dyn Fn(&Point) -> f64| Series {
        name,
        points: points.iter().map(|p| [p.at_s, value(p)]).collect(),
        ..Series::default()
    };
    let series = vec![
        of("translation (mm)", &|p| p.translation_sigma_m * 1e3),
        of("rotation (°)", &|p| p.rotation_sigma_rad.to_degrees()),
    ];
    let alternative = "Standard deviations of the hand-eye transform by time".to_owned();
    Trend { alternative, along: "s", series, limits: Vec::new() }
}
