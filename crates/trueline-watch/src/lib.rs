//! Is the calibration still good, and what moved?
//!
//! ```text
//! Recording ─innovation─▶ WeldStatistic ─placement─▶ PieceInformation ─detect─▶ Judgement
//!  one weld                b = H x, sums over          the seam's own place       alarm, change ±,
//!                          all its features            marginalised               since, blind to
//! ```
//!
//! | symbol | code | meaning |
//! |---|---|---|
//! | θ | [`parameters`], columns 0 … 11 | change against the stored calibration: time offset, hand-eye, shape of the laser plane |
//! | ψ | [`parameters`], columns 12 … 17 | change of the fixture: where the part lies in base |
//! | H, b | [`Quadratic`] | information and score: b ~ N(H x, H) |
//! | P | [`Scatter`] | how seams scatter from piece to piece about their mean, learnt from the pieces |
//!
//! A weld's lines are unknown. A weld's numbers after marginalising them need no input by anybody. The *mean*
//! place of many pieces gives more information, but needs P. It is used as soon as P has been learnt.
//!
//! Pure functions, and [`store`], which keeps their values in one SQLite file. Nothing here prints.
//!
//! ```
//! use trueline_sim::production::{Change, Layout, ScheduledChange, piece};
//! use trueline_watch::{Store, Watched, watch};
//!
//! // Six parts; from the fifth on the camera's stamps are 1 ms late.
//! let mut production = Layout::CheckScan.production();
//! production.change = Some(ScheduledChange { change: Change::Timing(1e-3), piece: 4, after: 0.0 });
//! let welds: Vec<_> = (0..6).map(|number| piece(&production, number, 1)).collect();
//! let truth = welds[0].truth.as_ref().ok_or("a simulation knows its truth")?;
//! let calibration =
//!     Watched { name: "result.json".into(), sha256: "0".into(), guess: truth.parameters, result: None, tolerance_m: None };
//!
//! let folder = tempfile::tempdir()?;
//! let store = Store::open(&folder.path().join("cell.sqlite"))?;
//! let told = welds.iter().enumerate().map(|(k, weld)| watch(&store, &calibration, &format!("weld {k}"), weld));
//! let lines = told.collect::<Result<Vec<_>, _>>()?;
//! assert!(lines[3].alarm.is_none() && lines[5].alarm.is_some());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod alarm_message;
pub mod detect;
pub mod headline;
pub mod history_csv;
pub mod history_page;
#[cfg(feature = "parquet")]
pub mod history_parquet;
pub mod history_table;
pub mod innovation;
mod kept_regimes;
pub mod parameters;
pub mod quadratic;
pub mod reference;
pub mod repair;
pub mod store;
pub mod tell;
pub mod told;
pub mod watch;
pub mod watcher;
mod weld_content;
mod weld_folder;
mod weld_line;
pub mod weld_text;
pub mod words;

pub use detect::{Alarm, Judgement, PieceInformation, Scatter};
pub use innovation::weld_statistic::WeldStatistic;
pub use parameters::Kind;
pub use quadratic::Quadratic;
pub use reference::{Part, Reference};
pub use repair::Repair;
pub use store::Store;
pub use told::State;
pub use watch::{WatchError, Watched, watch};
pub use watcher::{Watcher, WatcherError, WatcherSettings};
pub use weld_folder::{Found, WeldFolder};
pub use weld_line::{HistoryOf, Learning, WeldLine};
