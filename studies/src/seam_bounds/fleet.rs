//! What identical welded parts show together: one common program, each part at its own place in the fixture.

use super::information::{Light, PLACE, Plates, SHARED, bounds, information, known, left};
use super::seam::{Motion, Seam};
use nalgebra::{DMatrix, Isometry3, UnitQuaternion, Vector3};
use trueline_sim::curves::CurveKind;

/// Scatter of the place of a part: mm and degrees, as m and rad.
const SHIFT_M: f64 = 0.3e-3;
const TURN_RAD: f64 = 0.1 * std::f64::consts::PI / 180.0;
/// How far a welded seam is off its drawing at a control point, m.
const DRAWN_M: f64 = 0.2e-3;
/// The hand-eye transform is known to this beforehand, rad and m.
const KNOWN: (f64, f64) = (std::f64::consts::PI / 18.0, 50e-3);
/// Beyond this the hand-eye transform is not shown, m.
const SHOWN_M: f64 = 5e-3;
const PARTS: [f64; 3] = [1.0, 5.0, 20.0];
const SPEED_M_S: f64 = 10e-3;

/// What is known of the form.
#[derive(Clone, Copy)]
enum Form {
    Unknown,
    Drawn,
    Exact,
}

/// A seam of a part: kind, size, place, turn against the seam about two axes, degrees.
type Weld = (CurveKind, f64, [f64; 3], [f64; 2]);

/// A part, welded at 10 mm/s with a weave of 3 mm.
struct Case {
    name: &'static str,
    welds: Vec<Weld>,
    tilt_deg: f64,
    /// How far the range swings, m.
    range_m: f64,
    /// Figures of the design: time offset ms; seam mm with the form unknown, drawn and exact. NaN is none.
    design: [[f64; 3]; 4],
}

fn motion(
    number: usize,
    &(kind, larger, [x_m, y_m, about_z_deg], [work_deg, push_deg]): &Weld,
    case: &Case,
) -> Motion {
    let turn = |axis, deg: f64| UnitQuaternion::from_axis_angle(&axis, deg.to_radians());
    let place = Vector3::new(0.7 + x_m, 0.05 + y_m, 0.3);
    let place = Isometry3::from_parts(place.into(), turn(Vector3::z_axis(), about_z_deg));
    let seam = Seam::new(kind, larger, place);
    Motion {
        lasts_s: seam.length_m() / SPEED_M_S,
        seam,
        passes: 1.0,
        tilt_rad: case.tilt_deg.to_radians(),
        sways_m: [0.0, case.range_m],
        weave_m: 3e-3,
        // No two seams are welded with the same swings.
        phase_rad: 2.1 * number as f64,
        attitude: turn(Vector3::y_axis(), work_deg) * turn(Vector3::x_axis(), push_deg),
    }
}

/// Bounds of a number of parts.
fn of_parts(part: &DMatrix<f64>, parts: f64, form: Form) -> [f64; 2] {
    let place = SHARED..SHARED + PLACE;
    // Each part lies off the common place.
    let mut scatter = part.view((SHARED, SHARED), (PLACE, PLACE)).into_owned();
    known(&mut scatter, 0..3, SHIFT_M);
    known(&mut scatter, 3..PLACE, TURN_RAD);
    let crossed = part.columns(SHARED, PLACE).into_owned();
    let Some(root) = scatter.cholesky() else { return [f64::INFINITY; 2] };
    let mut all = (part - &crossed * root.solve(&crossed.transpose())) * parts;
    let curve = place.end..all.nrows();
    match form {
        // The curve is where it is.
        Form::Unknown => known(&mut all, place, 1e-9),
        Form::Drawn => known(&mut all, curve, DRAWN_M),
        Form::Exact => known(&mut all, curve, 1e-9),
    }
    known(&mut all, 1..4, KNOWN.0);
    known(&mut all, 4..SHARED, KNOWN.1);
    bounds(&left(&all, SHARED))
}

fn cases() -> Vec<Case> {
    use CurveKind::{Arc, Corner, Pipe, Saddle, Straight};
    const NONE: [f64; 3] = [f64::NAN; 3];
    let line = |x, y, z, turn| (Straight, 1.0, [x, y, z], turn);
    let box_of_4 = |deg: f64| {
        vec![
            line(0.0, -0.11, 0.0, [deg, 0.0]),
            line(0.11, 0.0, 90.0, [-deg, 0.0]),
            line(0.0, 0.11, 180.0, [0.0, deg]),
            line(-0.11, 0.0, 270.0, [0.0, -deg]),
        ]
    };
    let pipe_and_lines = || {
        vec![
            (Pipe, 1.2, [0.0; 3], [0.0; 2]),
            line(0.0, -0.15, 0.0, [0.0; 2]),
            line(0.15, 0.0, 90.0, [0.0; 2]),
        ]
    };
    let one = |kind, larger| vec![(kind, larger, [0.0; 3], [0.0; 2])];
    // The middle of the ranges for one seam.
    let single = [[0.055, 0.025, 0.012], NONE, NONE, NONE];
    let of_box = [[1.2, 0.9, 0.5], [0.58, 0.43, 0.29], [0.17, 0.07, 0.04]];
    let of_pipe = [[0.42, 0.24, 0.13], [0.35, 0.23, 0.13], [0.11, 0.05, 0.03]];
    let flat = [0.032, 0.014, 0.007];
    let with = |[unknown, drawn, exact]: [[f64; 3]; 3]| [flat, unknown, drawn, exact];
    let of_saddle = [[0.050, 0.022, 0.011], NONE, [3.2, 1.6, 0.9], [0.82, 0.37, 0.18]];
    let of_line = [[0.064, f64::NAN, f64::NAN], [3.6, 2.4, 1.4], [2.6, 1.7, 1.1], [1.3, 0.6, 0.3]];
    let turned = [flat, NONE, [1.3, 1.2, 0.9], [0.13, 0.06, 0.03]];
    let case = |name, welds, tilt_deg, range_mm: f64, design| Case {
        name,
        welds,
        tilt_deg,
        range_m: range_mm * 1e-3,
        design,
    };
    vec![
        case("straight", one(Straight, 1.0), 0.0, 0.0, single),
        case("arc R 280", one(Arc, 1.0), 0.0, 0.0, single),
        case("corner R 12", one(Corner, 1.0), 0.0, 0.0, single),
        case("pipe R 60", one(Pipe, 1.2), 0.0, 0.0, single),
        case("saddle r 50", one(Saddle, 50.0 / 45.0), 0.0, 0.0, of_saddle),
        case("box of 4, attitudes ±12°", box_of_4(12.0), 0.0, 0.0, turned),
        case("straight, tilts ±3°", one(Straight, 1.0), 3.0, 0.0, of_line),
        case("box of 4, tilts ±3°", box_of_4(0.0), 3.0, 0.0, with(of_box)),
        case("box of 4, tilts ±3°, range ±12 mm", box_of_4(0.0), 3.0, 12.0, with(of_box)),
        case("pipe + 2 straight, tilts ±3°, range ±12 mm", pipe_and_lines(), 3.0, 12.0, with(of_pipe)),
    ]
}

/// Figures, and those of the design behind them.
fn row(found: [f64; 3], design: [f64; 3], most: f64) -> String {
    let shown = |value: f64| if value > most { "–".to_owned() } else { format!("{:.3}", value * 1e3) };
    let own = found.map(shown).join(" / ");
    let stated = design.map(|value| if value.is_nan() { "–".to_owned() } else { value.to_string() });
    if design[0].is_nan() { own } else { format!("{own} ({})", stated.join(" / ")) }
}

pub(super) fn print() {
    println!("Bounds for 1 / 5 / 20 parts (those of the design).\n");
    println!(
        "| part | time offset, form unknown, ms | seam, form unknown, mm | drawn to 0.2 mm | drawing exact |"
    );
    println!("|---|---|---|---|---|");
    for case in cases() {
        let motions: Vec<Motion> =
            case.welds.iter().enumerate().map(|(k, weld)| motion(k, weld, &case)).collect();
        let part = information(&motions, Plates::Unseen, Light::Point);
        let of = |form| PARTS.map(|parts| of_parts(&part, parts, form));
        let [unknown, drawn, exact] = [Form::Unknown, Form::Drawn, Form::Exact].map(of);
        let seam = |found: [[f64; 2]; 3], design| row(found.map(|both| both[1]), design, SHOWN_M);
        println!(
            "| {} | {} | {} | {} | {} |",
            case.name,
            row(unknown.map(|both| both[0]), case.design[0], f64::INFINITY),
            seam(unknown, case.design[1]),
            seam(drawn, case.design[2]),
            seam(exact, case.design[3]),
        );
    }
}
