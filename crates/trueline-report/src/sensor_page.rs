//! The report of a camera's calibration: places of the corners, their residuals, and the camera's uncertainty over the
//! picture.

use crate::page::render::render;
use crate::page::{
    Axis, Block, Card, Chart, Colour, Columns, Drawn, Heat, Page, Section, Series, Table, TableRow, Tone,
    Verdict,
};
use crate::sensor_json::CameraReport;
use crate::sensor_text;
use trueline_sensor::View;
use trueline_sensor::intrinsics::Field;
use trueline_sensor::intrinsics::field::GRID;

/// Residuals are drawn this many times larger than the picture.
const MAGNIFIED: f64 = 100.0;

/// Renders the report; `views` are the boards that were found, in the order of the fit.
#[must_use]
pub fn html(report: &CameraReport<'_>, views: &[View], command: &str) -> String {
    let fit = report.fit;
    let accepted = report.reasons.is_empty();
    let mut page = Page {
        title: "Camera intrinsics".to_owned(),
        verdict: Verdict {
            text: if accepted {
                format!("Camera calibrated: ± {:.3} px over its picture.", report.uncertainty.rms_px())
            } else {
                "The camera's calibration is not accepted.".to_owned()
            },
            tone: Tone::of(accepted),
        },
        ..Page::default()
    };
    let columns = &mut page.columns;
    let mut first = vec![cards(report)];
    for (heading, list, bad) in
        [("Not accepted", report.reasons, true), ("Please note", report.warnings, false)]
    {
        if !list.is_empty() {
            first.push(Block::Notice { heading, items: list.iter().map(ToString::to_string).collect(), bad });
        }
    }
    if let Some(next) = report.next {
        first.push(Block::Text(format!("The best picture to add: {}.", sensor_text::next_picture(next))));
    }
    let size = fit.state.camera.size;
    page.sections = vec![
        Section { id: "camera", heading: "", blocks: first, folded: false },
        Section { id: "corners", heading: "Corners", blocks: corners(report, views, columns), folded: false },
        Section {
            id: "uncertainty",
            heading: "Uncertainty by place",
            blocks: fields(report, size),
            folded: false,
        },
        Section { id: "models", heading: "Distortion", blocks: vec![evidence(report)], folded: false },
        Section { id: "made", heading: "How this was made", blocks: made(report, command), folded: false },
    ];
    render(&page)
}

/// The pictures that were not used, and the command.
fn made(report: &CameraReport<'_>, command: &str) -> Vec<Block> {
    let left_out = report.not_used().into_iter();
    let left_out = left_out.map(|(file, reason)| ("not used".to_owned(), format!("{file}: {reason}")));
    let command = ("command".to_owned(), command.to_owned());
    vec![Block::Facts(left_out.chain([command]).collect())]
}

fn cards(report: &CameraReport<'_>) -> Block {
    let (fit, sigma) = (report.fit, report.fit.sigma());
    let camera = &fit.state.camera;
    Block::Cards(vec![
        Card {
            name: "Focal length",
            values: vec![
                format!("{:.2} ± {:.2} px", camera.focal.x, sigma[0]),
                format!("{:.2} ± {:.2} px", camera.focal.y, sigma[1]),
            ],
            meaning: "along u and v".to_owned(),
        },
        Card {
            name: "Principal point",
            values: vec![
                format!("{:.2} ± {:.2} px", camera.centre.x, sigma[2]),
                format!("{:.2} ± {:.2} px", camera.centre.y, sigma[3]),
            ],
            meaning: "u and v".to_owned(),
        },
        Card {
            name: "Corners",
            values: vec![format!("{:.3} px", fit.rms_px)],
            meaning: format!("RMS residual of {} corners in {} pictures", fit.corners(), fit.pictures()),
        },
    ])
}

fn picture_axes(size: [u32; 2]) -> (Axis, Axis) {
    let [width, height] = size.map(f64::from);
    (
        Axis::of("u (px)").between(0.0, width),
        Axis { inverse: true, ..Axis::of("v (px)").between(0.0, height) },
    )
}

/// A corner in the chart: its picture, its place, whether it counts, and its residual.
type SeenCorner = (usize, nalgebra::Vector2<f64>, bool, nalgebra::Vector2<f64>);

/// Corners found, a colour for one picture in four.
fn found(all: &[SeenCorner], columns: &mut Columns) -> Vec<Series> {
    let mut seen = Vec::new();
    for (remainder, name) in
        ["every fourth picture", "the next", "the third", "the fourth"].into_iter().enumerate()
    {
        let of: Vec<_> = all.iter().filter(|(k, _, used, _)| k % 4 == remainder && *used).collect();
        let (u, v) = (columns.add(of.iter().map(|c| c.1.x)), columns.add(of.iter().map(|c| c.1.y)));
        seen.push(Series::points(name, u, v, Colour::of(remainder)));
    }
    let out: Vec<_> = all.iter().filter(|c| !c.2).collect();
    if !out.is_empty() {
        let (u, v) = (columns.add(out.iter().map(|c| c.1.x)), columns.add(out.iter().map(|c| c.1.y)));
        seen.push(Series::points("left out", u, v, Colour::Bad));
    }
    seen
}

fn corners(report: &CameraReport<'_>, views: &[View], columns: &mut Columns) -> Vec<Block> {
    let fit = report.fit;
    let mut all: Vec<SeenCorner> = Vec::new();
    for (k, ((view, used), residuals)) in views.iter().zip(&fit.used).zip(&fit.residuals_px).enumerate() {
        let corners = view.corners.iter().zip(used).zip(residuals);
        all.extend(corners.map(|((corner, used), r)| (k, corner.pixel, *used, *r)));
    }
    let seen = found(&all, columns);
    // A gap ends each stroke.
    let strokes = |part: fn(&SeenCorner) -> [f64; 2]| {
        all.iter().filter(|c| c.2).flat_map(move |c| {
            let [from, to] = part(c);
            [from, to, f64::NAN]
        })
    };
    let u = columns.add(strokes(|c| [c.1.x, c.1.x + MAGNIFIED * c.3.x]));
    let v = columns.add(strokes(|c| [c.1.y, c.1.y + MAGNIFIED * c.3.y]));
    let size = fit.state.camera.size;
    let plot = |id, title, explanation: String, series| {
        let (x, y) = picture_axes(size);
        Block::Chart(Chart {
            id,
            title,
            explanation,
            alternative: format!("{title} over the picture"),
            wide: false,
            drawn: Drawn::Plot { x, y, series, marks: Vec::new() },
        })
    };
    vec![
        plot(
            "detected",
            "Corners that were found",
            "Each colour is one picture in four. Parts that no board covers are extrapolated.".to_owned(),
            seen,
        ),
        plot(
            "residuals",
            "Residual field",
            format!(
                "Residual of each corner, enlarged {MAGNIFIED:.0} times. Neighbours that point the same way \
                show a distortion that the model does not have."
            ),
            vec![Series::line("seen − expected", u, v, Colour::A)],
        ),
        coverage(&all.iter().map(|c| c.1).collect::<Vec<_>>(), size),
    ]
}

fn coverage(corners: &[nalgebra::Vector2<f64>], size: [u32; 2]) -> Block {
    let [columns, rows] = GRID;
    let cell = [f64::from(size[0]) / columns as f64, f64::from(size[1]) / rows as f64];
    let mut counts = vec![0_usize; columns * rows];
    for corner in corners {
        let column = ((corner.x / cell[0]).max(0.0) as usize).min(columns - 1);
        let row = ((corner.y / cell[1]).max(0.0) as usize).min(rows - 1);
        counts[row * columns + column] += 1;
    }
    let most = counts.iter().copied().max().unwrap_or(0) as f64;
    let cells = counts.iter().enumerate().map(|(k, count)| {
        let (c, r) = ((k % columns) as f64 + 0.5, (k / columns) as f64 + 0.5);
        [c * cell[0], r * cell[1], *count as f64, *count as f64]
    });
    heat(
        ("coverage", "Coverage"),
        "Corners in each part of the picture; empty parts are extrapolated.",
        (cells.collect(), most, "corners"),
        (cell, size),
    )
}

fn fields(report: &CameraReport<'_>, size: [u32; 2]) -> Vec<Block> {
    let mut blocks = vec![field_chart(
        ("uncertainty-map", "Uncertainty over the picture"),
        "One standard deviation of a measured direction, excluding a common rotation of the camera.",
        report.uncertainty,
        size,
    )];
    if let Some(halves) = report.halves {
        blocks.push(field_chart(
            ("halves", "Comparison of two halves of the pictures"),
            "Difference between two calibrations, each from every second picture.",
            &halves.difference,
            size,
        ));
        blocks.push(Block::Text(format!(
            "RMS {:.3} px; {:.3} px expected from their covariances.",
            halves.difference.rms_px(),
            halves.expected_px
        )));
    }
    blocks
}

fn field_chart(name: (&'static str, &'static str), words: &str, field: &Field, size: [u32; 2]) -> Block {
    let [columns, rows] = GRID;
    let cell = [f64::from(size[0]) / columns as f64, f64::from(size[1]) / rows as f64];
    let cells = field.pixels.iter().zip(&field.values_px).map(|(p, value)| [p.x, p.y, *value, 1.0]).collect();
    let strongest = field.values_px.iter().copied().fold(0.0, f64::max);
    heat(name, words, (cells, strongest, "px"), (cell, size))
}

fn heat(
    (id, title): (&'static str, &'static str),
    words: &str,
    (cells, strongest, unit): (Vec<[f64; 4]>, f64, &str),
    (cell, size): ([f64; 2], [u32; 2]),
) -> Block {
    let (x, y) = picture_axes(size);
    let heat = Heat {
        x,
        y,
        cell,
        cells,
        strongest,
        unit: unit.to_owned(),
        short: unit.to_owned(),
        signed: false,
        equal: true,
    };
    Block::Chart(Chart {
        id,
        title,
        explanation: words.to_owned(),
        alternative: format!("{title}, a colour for each part of the picture"),
        wide: false,
        drawn: Drawn::Heat(Box::new(heat)),
    })
}

fn evidence(report: &CameraReport<'_>) -> Block {
    let best = report.fit.evidence.iter().map(|e| e.akaike).fold(f64::INFINITY, f64::min);
    Block::Table(Table {
        head: ["coefficients", "corners, rms px", "Akaike, above the best", ""].map(str::to_owned).to_vec(),
        rows: (report.fit.evidence.iter())
            .map(|e| {
                let chosen = if e.model == report.fit.model { "used" } else { "" };
                TableRow::plain(vec![
                    e.model.name().to_owned(),
                    format!("{:.4}", e.rms_px),
                    format!("{:.1}", e.akaike - best),
                    chosen.to_owned(),
                ])
            })
            .collect(),
    })
}
