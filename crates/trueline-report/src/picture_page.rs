//! The report of a look at pictures: how many show the seam, where, how well, and why others do not.

use crate::page::render::render;
use crate::page::{
    Axis, Block, Chart, Colour, Columns, Drawn, Page, Section, Series, Table, TableRow, Tone, Verdict,
};
use std::collections::BTreeMap;

/// One picture.
#[derive(Clone, Debug)]
pub struct Looked {
    /// Its stamp since the first, s.
    pub stamp_s: f64,
    /// Its file.
    pub file: String,
    /// The seam, or the reason why there is none.
    pub seam: Result<SeamPixel, MissingSeam>,
}

/// A seam in a picture.
#[derive(Clone, Copy, Debug)]
pub struct SeamPixel {
    /// Its place, px.
    pub at_px: [f64; 2],
    /// Its standard deviations, px.
    pub sigma_px: [f64; 2],
}

/// Why a picture has no seam.
#[derive(Clone, Debug)]
pub struct MissingSeam {
    /// The kind of reason.
    pub code: &'static str,
    /// The reason with its numbers.
    pub text: String,
}

/// Inputs of the report.
#[derive(Clone, Copy, Debug)]
pub struct Source<'a> {
    /// Title, for the heading.
    pub title: &'a str,
    /// Every picture.
    pub looked: &'a [Looked],
    /// Some pictures to show, PNG, with their numbers.
    pub samples: &'a [(usize, Vec<u8>)],
    /// Width and height of the pictures, px.
    pub size_px: [u32; 2],
    /// How to make it again.
    pub command: &'a str,
}

/// Renders the report.
#[must_use]
pub fn html(source: &Source<'_>) -> String {
    let Source { title, looked, samples, size_px, command } = *source;
    let found = looked.iter().filter(|l| l.seam.is_ok()).count();
    let mut page = Page {
        title: title.to_owned(),
        verdict: Verdict {
            text: format!("The seam is found in {found} of {} pictures.", looked.len()),
            tone: Tone::of(found > 0),
        },
        ..Page::default()
    };
    let columns = &mut page.columns;
    page.sections = vec![
        Section {
            id: "pictures",
            heading: "Across the scan, and one picture of each kind without a seam",
            blocks: samples.iter().filter_map(|sample| picture(sample, looked)).collect(),
            folded: false,
        },
        Section {
            id: "seams",
            heading: "Position of the seam",
            blocks: charts(looked, size_px, columns),
            folded: false,
        },
        Section { id: "missing", heading: "Pictures without a seam", blocks: missing(looked), folded: false },
        Section {
            id: "made",
            heading: "How this was made",
            blocks: vec![Block::Facts(vec![("command".to_owned(), command.to_owned())])],
            folded: false,
        },
    ];
    render(&page)
}

fn picture((number, png): &(usize, Vec<u8>), looked: &[Looked]) -> Option<Block> {
    let picture = looked.get(*number)?;
    let found = match &picture.seam {
        Ok(SeamPixel { at_px: [u, v], .. }) => format!("the seam at ({u:.1}, {v:.1}) px"),
        Err(missing) => format!("no seam: {}", missing.text),
    };
    let caption = format!("{}, {:.2} s: {found}", picture.file, picture.stamp_s);
    Some(Block::Picture { id: format!("picture-{number}"), caption, png: png.clone() })
}

fn charts(looked: &[Looked], size_px: [u32; 2], columns: &mut Columns) -> Vec<Block> {
    let seams: Vec<(f64, [f64; 2], [f64; 2])> = looked
        .iter()
        .filter_map(|l| l.seam.as_ref().ok().map(|seam| (l.stamp_s, seam.at_px, seam.sigma_px)))
        .collect();
    let time = columns.add(seams.iter().map(|s| s.0));
    let [u, v] = [0, 1].map(|k| columns.add(seams.iter().map(|s| s.1[k])));
    let [sigma_u, sigma_v] = [0, 1].map(|k| columns.add(seams.iter().map(|s| s.2[k])));
    let plot = |id, title, explanation: &str, x: Axis, y: Axis, series| {
        let alternative = format!("{title}: {} over {}", y.name, x.name);
        let drawn = Drawn::Plot { x, y, series, marks: Vec::new() };
        Block::Chart(Chart {
            id,
            title,
            explanation: explanation.to_owned(),
            alternative,
            wide: false,
            drawn,
        })
    };
    let [width, height] = size_px.map(f64::from);
    let down = Axis { inverse: true, ..Axis::of("v (px)").between(0.0, height) };
    vec![
        plot(
            "over-time",
            "Seam over time",
            "Points that jump away from their neighbours are rejected.",
            Axis::of("time (s)"),
            Axis::of("px"),
            vec![Series::points("u", time, u, Colour::A), Series::points("v", time, v, Colour::B)],
        ),
        plot(
            "in-picture",
            "Seam in the picture",
            "The part of the view that the scan has swept: more of it makes a better calibration.",
            Axis::of("u (px)").between(0.0, width),
            down,
            vec![Series::points("seam", u, v, Colour::A)],
        ),
        plot(
            "sigma",
            "Uncertainty",
            "One standard deviation along both axes.",
            Axis::of("time (s)"),
            Axis::log("± (px)"),
            vec![
                Series::points("u", time, sigma_u, Colour::A),
                Series::points("v", time, sigma_v, Colour::B),
            ],
        ),
    ]
}

/// Rows of the list.
const MOST: usize = 300;

fn missing(looked: &[Looked]) -> Vec<Block> {
    let mut reasons: BTreeMap<&str, (usize, &str)> = BTreeMap::new();
    let without: Vec<(&Looked, &str, &String)> = looked
        .iter()
        .filter_map(|l| l.seam.as_ref().err().map(|reason| (l, reason.code, &reason.text)))
        .collect();
    for (_, code, text) in &without {
        reasons.entry(code).or_insert((0, text)).0 += 1;
    }
    if without.is_empty() {
        return vec![Block::Text("None.".to_owned())];
    }
    let mut blocks =
        vec![Block::List(reasons.values().map(|(count, text)| format!("{count}: {text}")).collect())];
    if without.len() > MOST {
        blocks.push(Block::Text(format!("The first {MOST} of {}:", without.len())));
    }
    blocks.push(Block::Table(Table {
        head: ["time (s)", "file", "why"].map(str::to_owned).to_vec(),
        rows: (without.iter().take(MOST))
            .map(|(l, _, reason)| {
                TableRow::plain(vec![format!("{:.3}", l.stamp_s), l.file.clone(), (*reason).clone()])
            })
            .collect(),
    }));
    blocks
}
