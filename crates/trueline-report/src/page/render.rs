//! Page → one HTML file with its style, its charting library and its data inside.

use super::{Block, Card, Chart, Form, Page, Section, Table, Tone};
use crate::markup::escape;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde_json::{Value, json};
use sha2::{Digest, Sha256};
use std::fmt::Write;

const TEMPLATE: &str = include_str!("../../assets/report.html");
const STYLE: &str = include_str!("../../assets/report.css");
/// Runs before anything is painted.
const FIRST: &str = include_str!("../../assets/first.js");
const CHARTS: &str = include_str!("../../assets/charts.js");
const SCRIPT: &str = include_str!("../../assets/report.js");
/// Apache ECharts 6.1.0: see assets/third_party/echarts.
const ECHARTS: &str = include_str!("../../assets/third_party/echarts/echarts-custom.min.js");
const CHARTS_HINT: &str = " · charts: Apache ECharts 6.1.0 (Apache-2.0). <span class=\"hint\">Charts: drag to zoom, double click to reset, Ctrl and wheel zooms; with the keyboard arrows walk through the points, + and − zoom, 0 resets.</span>";

/// Renders a page; the charting library is included only if there are charts.
#[must_use]
pub fn render(page: &Page) -> String {
    let verdict_class = match page.verdict.tone {
        Tone::Good => "good",
        Tone::Doubtful => "doubtful",
        Tone::Bad => "bad",
        Tone::Plain => "plain",
    };
    let echarts = if has_charts(page) { ECHARTS } else { "" };
    let parts = [
        ("{{script_hashes}}", [FIRST, echarts, CHARTS, SCRIPT].map(hash).join(" ")),
        ("{{first}}", FIRST.to_owned()),
        ("{{title}}", escape(&page.title)),
        ("{{style}}", STYLE.to_owned()),
        ("{{verdict_class}}", verdict_class.to_owned()),
        ("{{verdict}}", escape(&page.verdict.text)),
        ("{{links}}", links(&page.sections)),
        ("{{sections}}", page.sections.iter().map(section).collect()),
        ("{{version}}", env!("CARGO_PKG_VERSION").to_owned()),
        ("{{charts_hint}}", if has_charts(page) { CHARTS_HINT.to_owned() } else { String::new() }),
        ("{{echarts}}", echarts.to_owned()),
        ("{{charts}}", CHARTS.to_owned()),
        ("{{data}}", in_script(&data(page))),
        ("{{script}}", SCRIPT.to_owned()),
    ];
    // One pass over the template, so that text inside a part is never a placeholder.
    let mut out = String::new();
    let mut rest = TEMPLATE;
    while let Some(start) = rest.find("{{") {
        out.push_str(&rest[..start]);
        rest = &rest[start..];
        let known = parts.iter().find(|(name, _)| rest.starts_with(name));
        let (text, taken) = known.map_or(("{{", 2), |(name, text)| (text.as_str(), name.len()));
        out.push_str(text);
        rest = &rest[taken..];
    }
    out.push_str(rest);
    out
}

fn has_charts(page: &Page) -> bool {
    page.sections.iter().flat_map(|section| &section.blocks).any(|block| matches!(block, Block::Chart(_)))
}

fn data(page: &Page) -> Value {
    let charts = page.sections.iter().flat_map(|section| &section.blocks).filter_map(|block| match block {
        Block::Chart(chart) => Some(chart.json(&page.columns)),
        _ => None,
    });
    json!({ "columns": page.columns.json(), "charts": charts.collect::<Vec<_>>() })
}

fn links(sections: &[Section]) -> String {
    let named = sections.iter().filter(|section| !section.heading.is_empty());
    named.map(|s| format!("<a href=\"#{}\">{}</a>", s.id, escape(s.heading))).collect()
}

fn section(section: &Section) -> String {
    let mut out = format!("<section id=\"{}\">", section.id);
    // Writing to a String cannot fail.
    if section.folded {
        // Open until its charts are drawn, and on paper.
        let _ = write!(out, "<details open><summary><h2>{}</h2></summary>", escape(section.heading));
    } else if !section.heading.is_empty() {
        let _ = write!(out, "<h2>{}</h2>", escape(section.heading));
    }
    out.push_str("<div class=\"blocks\">");
    let spans = spanning(&section.blocks);
    for (block, spans) in section.blocks.iter().zip(spans) {
        out.push_str(&html_of(block, spans));
    }
    out.push_str(if section.folded { "</div></details></section>\n" } else { "</div></section>\n" });
    out
}

/// Charts of full width: those that request it, and the last of an odd number of others in a row.
fn spanning(blocks: &[Block]) -> Vec<bool> {
    let is_half = |block: &Block| matches!(block, Block::Chart(chart) if !chart.wide);
    let mut spans: Vec<bool> =
        blocks.iter().map(|block| matches!(block, Block::Chart(chart) if chart.wide)).collect();
    let mut run = 0;
    for (k, block) in blocks.iter().enumerate() {
        run = if is_half(block) { run + 1 } else { 0 };
        let is_last = blocks.get(k + 1).is_none_or(|next| !is_half(next));
        spans[k] |= is_last && run % 2 == 1;
    }
    spans
}

fn html_of(block: &Block, spans: bool) -> String {
    match block {
        Block::Text(text) => format!("<p class=\"full\">{}</p>", escape(text)),
        Block::List(items) => format!("<ul class=\"full\">{}</ul>", list(items)),
        Block::Notice { heading, items, bad } => format!(
            "<div class=\"notice full {}\"><h3>{}</h3><ul>{}</ul></div>",
            if *bad { "bad" } else { "mind" },
            escape(heading),
            list(items)
        ),
        Block::Cards(cards) => {
            format!("<div class=\"cards full\">{}</div>", cards.iter().map(card).collect::<String>())
        }
        Block::Facts(facts) => {
            let row = |(name, value): &(String, String)| {
                format!("<tr><th scope=\"row\">{}</th><td>{}</td></tr>", escape(name), escape(value))
            };
            format!("<table class=\"facts full\">{}</table>", facts.iter().map(row).collect::<String>())
        }
        Block::Table(table) => table_html(table),
        Block::Choice { label, forms } => choice(label, forms),
        Block::Drawing(svg) => format!("<figure class=\"wide drawing\">{svg}</figure>"),
        Block::Chart(chart) => figure(chart, spans),
        Block::Picture { id, caption, png } => format!(
            "<figure id=\"{0}\" class=\"picture\"><img alt=\"{1}\" src=\"data:image/png;base64,{2}\"><p>{1}</p></figure>",
            escape(id),
            escape(caption),
            STANDARD.encode(png)
        ),
    }
}

fn list(items: &[String]) -> String {
    items.iter().map(|item| format!("<li>{}</li>", escape(item))).collect()
}

fn card(card: &Card) -> String {
    let values: String =
        card.values.iter().map(|v| format!("<div class=\"value\">{}</div>", escape(v))).collect();
    format!(
        "<div class=\"card\"><h3>{}</h3>{values}<p>{}</p></div>",
        escape(card.name),
        escape(&card.meaning)
    )
}

fn table_html(table: &Table) -> String {
    let head: String = table.head.iter().map(|h| format!("<th scope=\"col\">{}</th>", escape(h))).collect();
    // A table longer than a screen scrolls separately.
    let long = if table.rows.len() > 30 { " long" } else { "" };
    let mut out = format!(
        "<div class=\"scroll full{long}\" tabindex=\"0\"><table><thead><tr>{head}</tr></thead><tbody>"
    );
    for row in &table.rows {
        let id = row.id.as_ref().map_or_else(String::new, |id| format!(" id=\"{}\"", escape(id)));
        let _ = write!(out, "<tr{id}>");
        for (k, cell) in row.cells.iter().enumerate() {
            match row.link.as_ref().filter(|_| k == 0) {
                Some(link) => {
                    let _ = write!(out, "<td><a href=\"#{}\">{}</a></td>", escape(link), escape(cell));
                }
                None => {
                    let _ = write!(out, "<td>{}</td>", escape(cell));
                }
            }
        }
        out.push_str("</tr>");
    }
    out.push_str("</tbody></table></div>");
    out
}

/// All forms are on the page, so that it is complete without a script, and on paper.
fn choice(label: &str, forms: &[Form]) -> String {
    let mut out =
        format!("<div class=\"choice full\"><h3>{}</h3><div class=\"choose\"></div>", escape(label));
    for form in forms {
        let _ = write!(
            out,
            "<div class=\"form\" data-name=\"{0}\"><h4>{0}</h4><p>{1}</p><pre tabindex=\"0\" aria-label=\"{0}\">{2}</pre></div>",
            escape(form.name),
            escape(form.convention),
            escape(&form.text)
        );
    }
    out.push_str("</div>");
    out
}

fn figure(chart: &Chart, spans: bool) -> String {
    let tools = match chart.drawn {
        super::Drawn::Scene(_) | super::Drawn::Film { .. } => {
            "<button data-look=\"iso\">Oblique</button><button data-look=\"top\">Top</button>\
             <button data-look=\"front\">Front</button><button data-look=\"side\">Side</button>\
             <button data-scale=\"1.25\" aria-label=\"nearer\">+</button>\
             <button data-scale=\"0.8\" aria-label=\"further\">−</button>"
        }
        super::Drawn::Matrix(_) | super::Drawn::Bars { .. } => "",
        _ => &format!(
            "<button data-reset aria-label=\"Reset view: {}\">Reset view</button>",
            escape(chart.title)
        ),
    };
    let is_scene = matches!(chart.drawn, super::Drawn::Scene(_) | super::Drawn::Film { .. });
    let slider = match chart.drawn {
        super::Drawn::Film { .. } => {
            "<div class=\"film\"><button data-play>Play</button><input type=\"range\" min=\"0\" value=\"0\" data-time \
             aria-label=\"Time of the scan\"><output></output></div>"
        }
        _ => "",
    };
    format!(
        "<figure class=\"chart{0}{6}\" aria-label=\"{1}\"><figcaption><h3>{1}</h3><span class=\"tools\">{tools}</span></figcaption>\
         <p>{2}</p><div class=\"plot\" id=\"{3}\" role=\"application\" aria-roledescription=\"chart\" aria-label=\"{4}\"></div>{5}<div class=\"live\" aria-live=\"polite\"></div></figure>",
        if spans { " wide" } else { "" },
        escape(chart.title),
        escape(&chart.explanation),
        chart.id,
        escape(&chart.alternative),
        slider,
        if is_scene { " scene" } else { "" }
    )
}

/// The name of a script in a content security policy: a browser runs no other, even if foreign text became a script.
fn hash(script: &str) -> String {
    // A browser reads ends of lines as one character, however they were stored where the program was built.
    format!("'sha256-{}'", STANDARD.encode(Sha256::digest(script.replace("\r\n", "\n"))))
}

/// JSON inside a script element: no text of the data may end it.
fn in_script(value: &Value) -> String {
    value.to_string().replace('<', "\\u003c")
}
