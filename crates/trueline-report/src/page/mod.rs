//! A report as data: sections of words, tables and charts; rendered into one HTML file that opens offline.
//!
//! A page knows nothing of calibrations. What is shown is decided by the modules that build pages; how it is drawn, by
//! `assets/report.js`, one function for each kind of [`Chart`].

mod chart;
mod columns;
pub mod render;

pub use chart::{Axis, Chart, Colour, Drawn, Heat, Histogram, Mark, Matrix, Part, Series};
pub use columns::{Column, Columns};

/// A whole report.
#[derive(Debug, Default)]
pub struct Page {
    /// What it is about.
    pub title: String,
    /// The first thing that a reader sees.
    pub verdict: Verdict,
    /// Everything else, in order.
    pub sections: Vec<Section>,
    /// The numbers behind all charts.
    pub columns: Columns,
}

/// What kind of news a verdict is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Tone {
    /// Neither good nor bad.
    #[default]
    Plain,
    /// Good.
    Good,
    /// Good, but there is something to look at.
    Doubtful,
    /// Bad.
    Bad,
}

impl Tone {
    /// Good or bad.
    #[must_use]
    pub fn of(good: bool) -> Self {
        if good { Self::Good } else { Self::Bad }
    }
}

/// A sentence, and what kind of news it is.
#[derive(Debug, Default)]
pub struct Verdict {
    /// The sentence.
    pub text: String,
    /// What kind of news.
    pub tone: Tone,
}

/// A part of a report under a heading.
#[derive(Debug, Default)]
pub struct Section {
    /// Name in the address of the section: letters and hyphens.
    pub id: &'static str,
    /// Heading; the first screen has none.
    pub heading: &'static str,
    /// What stands there.
    pub blocks: Vec<Block>,
    /// Whether it is closed at first: for readers who look for it.
    pub folded: bool,
}

/// A piece of a section.
#[derive(Debug)]
pub enum Block {
    /// Words.
    Text(String),
    /// Items, one a line.
    List(Vec<String>),
    /// What must not be overlooked: a heading and items.
    Notice {
        /// Heading.
        heading: &'static str,
        /// Items.
        items: Vec<String>,
        /// Whether it is why something failed.
        bad: bool,
    },
    /// Large numbers beside each other.
    Cards(Vec<Card>),
    /// Names and values.
    Facts(Vec<(String, String)>),
    /// A table with a header.
    Table(Table),
    /// The same thing written in several ways; the reader chooses and copies.
    Choice {
        /// What it is.
        label: &'static str,
        /// Ways to write it.
        forms: Vec<Form>,
    },
    /// A drawing that is part of the program.
    Drawing(&'static str),
    /// A chart.
    Chart(Chart),
    /// A picture, PNG.
    Picture {
        /// Name in its address.
        id: String,
        /// Its measurements.
        caption: String,
        /// The file's bytes.
        png: Vec<u8>,
    },
}

/// One way to write something.
#[derive(Debug)]
pub struct Form {
    /// Whose way.
    pub name: &'static str,
    /// Its units, order and axes, in words.
    pub convention: &'static str,
    /// The text to copy.
    pub text: String,
}

/// A large number with what it means.
#[derive(Debug)]
pub struct Card {
    /// What it is.
    pub name: &'static str,
    /// The number with its ± and unit, one or several.
    pub values: Vec<String>,
    /// What it means.
    pub meaning: String,
}

/// A table; cells may name a place on the page.
#[derive(Debug, Default)]
pub struct Table {
    /// Heads of the columns.
    pub head: Vec<String>,
    /// Rows of cells.
    pub rows: Vec<TableRow>,
}

/// A row of a table.
#[derive(Debug, Default)]
pub struct TableRow {
    /// Name in its address, where something points to it.
    pub id: Option<String>,
    /// Where its first cell leads.
    pub link: Option<String>,
    /// Its cells.
    pub cells: Vec<String>,
}

impl TableRow {
    /// A row of cells that nothing points to.
    #[must_use]
    pub fn plain(cells: Vec<String>) -> Self {
        Self { id: None, link: None, cells }
    }
}
