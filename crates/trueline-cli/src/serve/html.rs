//! Pages as text: everything that was not written here is escaped on its way in.

use crate::serve::http::{Media, Reply};
use std::fmt::Write;

/// Path of the style sheet.
pub(crate) const STYLE_PATH: &str = "/live.css";
/// Path of the script.
pub(crate) const SCRIPT_PATH: &str = "/live.js";
/// Path of the picture that browsers show beside the title.
pub(crate) const ICON_PATH: &str = "/live.svg";
/// The style sheet.
pub const STYLE: &str = include_str!("../../assets/live.css");
/// The script: it replaces the changed parts. Without it the page is whole, and stands.
pub const SCRIPT: &str = include_str!("../../assets/live.js");

/// The picture beside the title: a laser's stripe over the corner of two plates.
const ICON: &str = include_str!("../../assets/live.svg");

/// Text for a reader of HTML, also inside an attribute.
#[must_use]
pub fn escape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            c => out.push(c),
        }
    }
    out
}

/// The reply to a path of the style sheet, the script or the icon.
pub(crate) fn asset(path: &str) -> Option<Reply> {
    match path {
        STYLE_PATH => Some(Reply::text(Media::Css, STYLE)),
        SCRIPT_PATH => Some(Reply::text(Media::Script, SCRIPT)),
        ICON_PATH => Some(Reply::text(Media::Svg, ICON)),
        _ => None,
    }
}

/// A whole page; `blocks` is markup. The browser loads it again after this many milliseconds.
#[must_use]
pub fn page(title: &str, every_ms: u32, blocks: &str) -> String {
    page_under("", title, every_ms, blocks)
}

/// The same under a prefix, which style sheet, script and icon have as well.
#[must_use]
pub fn page_under(prefix: &str, title: &str, every_ms: u32, blocks: &str) -> String {
    let (prefix, title, version) = (escape(prefix), escape(title), env!("CARGO_PKG_VERSION"));
    format!(
        "<!doctype html>\n<html lang=\"en\" data-every=\"{every_ms}\"><head><meta charset=\"utf-8\">\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"><title>{title}</title>\
        <link rel=\"icon\" href=\"{prefix}{ICON_PATH}\"><link rel=\"stylesheet\" href=\"{prefix}{STYLE_PATH}\"><script src=\"{prefix}{SCRIPT_PATH}\" defer></script></head>\
         <body><p class=\"silence\" role=\"alert\">No connection: this page is outdated.</p>\
         <header><h1>{title}</h1></header><main>{blocks}</main>\
         <footer>trueline {version} · read-only</footer></body></html>\n"
    )
}

/// A block that is replaced when it changes.
#[must_use]
pub fn block(id: &str, markup: &str) -> String {
    format!("<section id=\"{}\" data-block>{markup}</section>", escape(id))
}

/// A card with a heading.
#[must_use]
pub fn card(heading: &str, class: &str, markup: &str) -> String {
    format!("<div class=\"card {class}\"><h3>{}</h3>{markup}</div>", escape(heading))
}

/// Names and values.
#[must_use]
pub fn facts<'a>(rows: impl IntoIterator<Item = (&'a str, String)>) -> String {
    let mut out = "<table>".to_owned();
    for (name, value) in rows {
        // Writing to a String cannot fail.
        let _ = write!(out, "<tr><th scope=\"row\">{}</th><td>{}</td></tr>", escape(name), escape(&value));
    }
    out + "</table>"
}

/// Items, one a line; nothing for none.
#[must_use]
pub fn list(items: impl IntoIterator<Item = String>) -> String {
    let items: String = items.into_iter().map(|item| format!("<li>{}</li>", escape(&item))).collect();
    if items.is_empty() { items } else { format!("<ul>{items}</ul>") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_not_written_here_is_text() {
        let evil = "<script>alert(\"1\")</script>' onload='x";
        for markup in
            [page(evil, 1, ""), card(evil, "", ""), facts([("a", evil.to_owned())]), list([evil.to_owned()])]
        {
            assert!(!markup.contains("<script>") && !markup.contains("' onload"), "{markup}");
        }
    }
}
