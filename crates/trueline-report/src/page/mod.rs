//! A report as data: sections of words, tables and charts; rendered into one HTML file that opens offline.
//!
//! A page is independent of calibrations. The modules that build pages decide the content. `assets/report.js` draws
//! it, with one function for each kind of [`Chart`].

mod chart;
mod columns;
pub mod render;

pub use chart::{Axis, Chart, Colour, Drawn, Heat, Histogram, Mark, Matrix, Part, Series};
pub use columns::{Column, Columns};

/// A whole report.
#[derive(Debug, Default)]
pub struct Page {
    /// Its title.
    pub title: String,
    /// The first thing that a reader sees.
    pub verdict: Verdict,
    /// Everything else, in order.
    pub sections: Vec<Section>,
    /// The numbers behind all charts.
    pub columns: Columns,
}

/// Kind of a verdict.
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

/// A sentence, and its kind.
#[derive(Debug, Default)]
pub struct Verdict {
    /// The sentence.
    pub text: String,
    /// Kind of the verdict.
    pub tone: Tone,
}

/// A part of a report under a heading.
#[derive(Debug, Default)]
pub struct Section {
    /// Name in the address of the section: letters and hyphens.
    pub id: &'static str,
    /// Heading; the first screen has none.
    pub heading: &'static str,
    /// Its blocks.
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
    /// Important remarks: a heading and items.
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
        /// Its label.
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
    /// Name of its robot, language or program.
    pub name: &'static str,
    /// Its units, order and axes, in words.
    pub convention: &'static str,
    /// The text to copy.
    pub text: String,
}

/// A large number with its meaning.
#[derive(Debug)]
pub struct Card {
    /// Its name.
    pub name: &'static str,
    /// The number with its ± and unit, one or several.
    pub values: Vec<String>,
    /// Its meaning.
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
    /// Target of its first cell.
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
