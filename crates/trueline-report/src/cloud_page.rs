//! The report of a cloud: a flat patch that was scanned forth and back, with the time offset and without it.

use crate::page::render::render;
use crate::page::{
    Axis, Block, Chart, Colour, Columns, Drawn, Page, Section, Series, Table, TableRow, Tone, Verdict,
};
use trueline_dataset::unit::MM_PER_M;
use trueline_method::evaluate::thickness::Thickness;

/// Points of a patch in side view: distance along the scan, and from the patch, m, for the pass forth and for that back.
pub type SideView = [Vec<[f64; 2]>; 2];

/// Plotted data of a cloud.
#[derive(Clone, Debug, Default)]
pub struct CloudView {
    /// Points of the whole cloud.
    pub points: usize,
    /// Its frames.
    pub frames: u64,
    /// Its file.
    pub file: String,
    /// Time offset, s.
    pub time_offset_s: f64,
    /// Thickness of flat patches with the time offset and without it.
    pub thickness: [Option<Thickness>; 2],
    /// One patch with the time offset and without it.
    pub views: Option<[SideView; 2]>,
}

/// Part of the height of the points that is left free above and below.
const MARGIN: f64 = 0.1;
/// Least height of the charts, mm.
const LEAST_MM: f64 = 0.02;

/// Renders the report.
#[must_use]
pub fn html(cloud: &CloudView, title: &str, command: &str) -> String {
    let mut page = Page { title: title.to_owned(), verdict: verdict(cloud), ..Page::default() };
    let mut blocks = vec![Block::Table(table(cloud))];
    match &cloud.views {
        Some(views) => blocks.extend(charts(views, &mut page.columns)),
        None => blocks.push(Block::Text(
            "No flat patch was scanned forth and back. Scan a plate in both directions to see what the time offset does."
                .to_owned(),
        )),
    }
    let facts = [
        ("cloud", format!("{} points of {} frames in {}", cloud.points, cloud.frames, cloud.file)),
        ("time offset", format!("{:.3} ms", cloud.time_offset_s * 1e3)),
        ("command", command.to_owned()),
    ];
    page.sections = vec![
        Section { id: "patch", heading: "", blocks, folded: false },
        Section {
            id: "made",
            heading: "How this was made",
            blocks: vec![Block::Facts(facts.map(|(name, value)| (name.to_owned(), value)).to_vec())],
            folded: false,
        },
    ];
    render(&page)
}

fn mm(m: f64) -> String {
    format!("{:.3}", m * MM_PER_M)
}

fn verdict(cloud: &CloudView) -> Verdict {
    let (text, tone) = match cloud.thickness {
        [Some(with), Some(without)] => (
            format!(
                "Passes forth and back lie {} mm apart with the time offset, and {} mm without it.",
                mm(with.apart_m),
                mm(without.apart_m)
            ),
            // As far apart as without the offset, or further: the offset is not that of this scan.
            Tone::of(with.apart_m <= without.apart_m.max(with.thickness_m)),
        ),
        [Some(with), None] => (
            format!(
                "Passes forth and back lie {} mm apart with the time offset; without it no patch is flat.",
                mm(with.apart_m)
            ),
            Tone::Good,
        ),
        _ => ("No flat patch was scanned forth and back.".to_owned(), Tone::Plain),
    };
    Verdict { text, tone }
}

fn table(cloud: &CloudView) -> Table {
    let names = ["with the time offset", "without it"];
    let rows = names.iter().zip(&cloud.thickness).map(|(name, thickness)| {
        let cells = thickness.map_or_else(
            || ["0".to_owned(), "–".to_owned(), "–".to_owned()],
            |it| [it.patches.to_string(), mm(it.thickness_m), mm(it.apart_m)],
        );
        TableRow::plain([(*name).to_owned()].into_iter().chain(cells).collect())
    });
    let head = ["", "flat patches", "thickness (mm, median)", "passes apart (mm, median)"];
    Table { head: head.map(str::to_owned).to_vec(), rows: rows.collect() }
}

/// Both charts have the same axes, so that thickness can be compared.
fn charts(views: &[SideView; 2], columns: &mut Columns) -> Vec<Block> {
    let heights = || views.iter().flatten().flatten().map(|[_, off_m]| off_m * MM_PER_M);
    let [low, high] = [heights().fold(f64::INFINITY, f64::min), heights().fold(f64::NEG_INFINITY, f64::max)];
    let middle = 0.5 * (low + high);
    let half = (0.5 + MARGIN) * (high - low).max(LEAST_MM);
    let ids = [("patch-with", "With the time offset"), ("patch-without", "Without it")];
    let chart = |((id, title), view): ((&'static str, &'static str), &SideView)| {
        let passes = ["forth", "back"].iter().zip([Colour::A, Colour::B]).zip(view);
        let series = passes.map(|((name, colour), points)| {
            let x = columns.add(points.iter().map(|[along_m, _]| along_m * MM_PER_M));
            let y = columns.add(points.iter().map(|[_, off_m]| off_m * MM_PER_M));
            Series::points(name, x, y, colour)
        });
        Block::Chart(Chart {
            id,
            title,
            explanation: "One patch from the side.".to_owned(),
            alternative: format!(
                "{title}: height of points over the way along the scan, in mm, forth and back"
            ),
            wide: false,
            drawn: Drawn::Plot {
                x: Axis::of("along the scan (mm)"),
                y: Axis::of("square to the patch (mm)").between(middle - half, middle + half),
                series: series.collect(),
                marks: Vec::new(),
            },
        })
    };
    ids.into_iter().zip(views).map(chart).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn thickness(apart_m: f64) -> Option<Thickness> {
        Some(Thickness { patches: 7, thickness_m: 2e-5, apart_m })
    }

    #[test]
    fn both_thicknesses_and_both_charts_are_on_the_page() {
        let view = |off_m: f64| [vec![[0.0, off_m]; 3], vec![[0.001, -off_m]; 3]];
        let cloud = CloudView {
            points: 12,
            frames: 3,
            file: "cloud.ply".to_owned(),
            time_offset_s: 0.02,
            thickness: [thickness(1e-6), thickness(1.789e-3)],
            views: Some([view(1e-6), view(0.9e-3)]),
        };
        let page = html(&cloud, "A cloud", "trueline cloud scan");
        for wanted in [
            "lie 0.001 mm apart with the time offset, and 1.789 mm without it",
            "patch-with",
            "patch-without",
            "12 points of 3 frames in cloud.ply",
            "20.000 ms",
            "trueline cloud scan",
        ] {
            assert!(page.contains(wanted), "{wanted}");
        }
        let empty = html(&CloudView::default(), "A cloud", "");
        assert!(empty.contains("No flat patch was scanned forth and back"));
    }

    #[test]
    fn a_time_offset_that_makes_it_worse_is_no_good_news() {
        let cloud =
            |with| CloudView { thickness: [thickness(with), thickness(1e-3)], ..CloudView::default() };
        assert_eq!(verdict(&cloud(1e-5)).tone, Tone::Good);
        assert_eq!(verdict(&cloud(2e-3)).tone, Tone::Bad);
    }
}
