//! The report of an evaluation: figures, and every error along the seam.

use crate::evaluation_summary;
use crate::page::render::render;
use crate::page::{
    Axis, Block, Chart, Colour, Columns, Drawn, Page, Section, Series, Table, TableRow, Tone, Verdict,
};
use nalgebra::Vector3;
use trueline_dataset::unit::MM_PER_M;
use trueline_method::evaluate::evaluation::{Deviation, Evaluation, Figures, ToleranceCheck};
use trueline_method::evaluate::other_cell::OtherCell;
use trueline_method::evaluate::reference_curve::ReferenceCurve;

/// Verdicts of an evaluation besides its figures.
#[derive(Clone, Copy, Debug, Default)]
pub struct Judged<'a> {
    /// The verdict against a tolerance.
    pub check: Option<&'a ToleranceCheck>,
    /// Set if the calibration differs from the scan's own, or is another cell's.
    pub other: Option<&'a OtherCell>,
}

/// Renders the report.
#[must_use]
pub fn html(e: &Evaluation, judged: Judged<'_>, title: &str, command: &str) -> String {
    let figures = Figures::of(e.calibrated.iter().map(|d| d.error_m));
    let reference = e.references.first().map_or_else(String::new, evaluation_summary::described);
    let mut page = Page {
        title: title.to_owned(),
        verdict: Verdict {
            text: format!(
                "Median distance {:.3} mm from {} {reference}; {:.3} mm RMS, {:.3} mm at most.",
                figures.median_m * MM_PER_M,
                match e.references.first() {
                    _ if e.known => "the known",
                    Some(ReferenceCurve::Curve(_)) => "the calibration's",
                    _ => "the best-fitting",
                },
                figures.rmse_m * MM_PER_M,
                figures.max_m * MM_PER_M
            ),
            tone: Tone::Plain,
        },
        ..Page::default()
    };
    if let Some(check) = judged.check {
        page.verdict = Verdict {
            text: format!("{}. {}", evaluation_summary::tolerance_text(check), page.verdict.text),
            tone: Tone::of(check.passed()),
        };
    }
    if let Some(other) = judged.other {
        let said = evaluation_summary::other_cell_text(other) + ".";
        let text = if other.is_other_cell { said } else { format!("{} {said}", page.verdict.text) };
        page.verdict = Verdict { text, tone: Tone::of(false) };
    }
    let columns = &mut page.columns;
    page.sections = vec![
        Section { id: "figures", heading: "", blocks: first(e), folded: false },
        Section { id: "errors", heading: "Errors", blocks: charts(e, columns), folded: false },
        Section {
            id: "made",
            heading: "How this was made",
            blocks: vec![Block::Facts(vec![("command".to_owned(), command.to_owned())])],
            folded: false,
        },
    ];
    render(&page)
}

fn first(e: &Evaluation) -> Vec<Block> {
    let mut blocks = vec![Block::Table(table(e))];
    let mut mind = Vec::new();
    mind.extend(evaluation_summary::outliers_text(e));
    if !e.known {
        mind.push(
            "The reference was fitted to these same points, so it cannot show an offset of the whole seam. \
            Use --reference for that."
                .to_owned(),
        );
    }
    if e.beyond_ends > 0 {
        mind.push(format!("{} points beyond the ends of the reference are left out.", e.beyond_ends));
    }
    if !mind.is_empty() {
        blocks.push(Block::Notice { heading: "Warnings", items: mind, bad: false });
    }
    blocks
}

fn table(e: &Evaluation) -> Table {
    let row = |name: &str, f: &Figures| {
        let mm = |m: f64| format!("{:.3}", m * MM_PER_M);
        TableRow::plain(vec![
            name.to_owned(),
            f.count.to_string(),
            mm(f.rmse_m),
            mm(f.mae_m),
            mm(f.median_m),
            mm(f.max_m),
        ])
    };
    let mut rows: Vec<TableRow> =
        evaluation_summary::shown_rows(e).map(|(name, f)| row(name.trim(), &f)).collect();
    if e.references.len() > 1 {
        rows.extend(e.references.iter().enumerate().map(|(k, reference)| {
            let own = e.calibrated.iter().filter(|d| d.measured.line as usize == k).map(|d| d.error_m);
            row(&format!("seam {k}, a {}", evaluation_summary::described(reference)), &Figures::of(own))
        }));
    }
    Table {
        head: ["", "points", "RMSE (mm)", "mean (mm)", "median (mm)", "max (mm)"].map(str::to_owned).to_vec(),
        rows,
    }
}

/// Along the seam, across it and up, at a point: up is base z without its part along the seam, or base x if the seam itself
/// is vertical. If the reference has no direction these are x, y and z of base.
fn axes(e: &Evaluation, d: &Deviation) -> [Vector3<f64>; 3] {
    let reference = e.references.get(d.measured.line as usize);
    let Some(along) = reference.and_then(|reference| reference.direction_at(&d.measured.point_in_base))
    else {
        return [Vector3::x(), Vector3::y(), Vector3::z()];
    };
    let vertical = if along.z.abs() < 0.9 { Vector3::z() } else { Vector3::x() };
    let up = (vertical - along * along.dot(&vertical)).normalize();
    [along, up.cross(&along), up]
}

/// Values nearer to zero are rounding, m.
const ROUNDING_M: f64 = 1e-9;

/// More points than this are thinned out for drawing.
const MOST: usize = 50_000;

fn charts(e: &Evaluation, columns: &mut Columns) -> Vec<Block> {
    let lists = [
        ("as calibrated", &e.calibrated, Colour::A),
        ("without time offset", &e.without_offset, Colour::Bad),
    ];
    let mut chart = |id, title, axis: &str, of: &dyn Fn(&Deviation) -> f64| {
        let series = lists
            .iter()
            .rev()
            .map(|(name, list, colour)| {
                let thin = || list.iter().step_by(list.len().div_ceil(MOST).max(1));
                let x = columns.add(thin().map(|d| d.measured.stamp_s));
                let y = columns.add(thin().map(of));
                Series::points(name, x, y, *colour)
            })
            .collect();
        Block::Chart(Chart {
            id,
            title,
            explanation: String::new(),
            alternative: format!("{title} in mm over time in s"),
            wide: false,
            drawn: Drawn::Plot {
                x: Axis::of("time since the first robot row (s)"),
                y: Axis::of(axis),
                series,
                marks: Vec::new(),
            },
        })
    };
    let mut charts = vec![
        chart("distance", "Distance from the reference", "distance (mm)", &|d| d.error_m.norm() * MM_PER_M),
        chart("error-across", "Error across the seam", "across (mm)", &|d| {
            axes(e, d)[1].dot(&d.error_m) * MM_PER_M
        }),
        chart("error-height", "Error in height", "height (mm)", &|d| {
            axes(e, d)[2].dot(&d.error_m) * MM_PER_M
        }),
    ];
    // From a line without ends nothing is off along it.
    if e.calibrated.iter().any(|d| axes(e, d)[0].dot(&d.error_m).abs() > ROUNDING_M) {
        charts.push(chart("error-along", "Error along the seam", "along (mm)", &|d| {
            axes(e, d)[0].dot(&d.error_m) * MM_PER_M
        }));
    }
    charts
}
