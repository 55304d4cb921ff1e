//! Whole cells of an ordinary shop, with all errors at once.
//!
//! A [`Shop`] has a level and a seed; [`Shop::cast`] draws arm, sensor, mounting, seam and motion, then the size of every
//! error of the [table](error_table::TABLE), and casts the scan forward. Each error is a file of its own. With the scan
//! comes a check pass: readings without noise, and their true places. It judges a calibration by its use.
//!
//! ```
//! use trueline_sim::shop::{Level, Shop};
//!
//! let cell = Shop::new(Level::Calm, 4).cast().ok_or("no arm reaches this scan")?;
//! assert!(cell.truth.bound_m > 0.0);
//! # Ok::<(), &str>(())
//! ```

mod bound;
mod cast;
mod check_pass;
mod course;
mod detector;
pub mod drawn_errors;
pub mod error_table;
mod joint_path;
mod layout;
pub mod level;
mod mounting;
mod plates;
mod robot;
mod seam;
mod sensor;
mod statements;
mod streams;
mod torch;
pub mod truth;
mod truth_json;

pub use cast::{Shop, ShopCell};
pub use course::Motion;
pub use drawn_errors::DrawnErrors;
pub use error_table::{ErrorRow, ShopError, TABLE};
pub use level::Level;
pub use truth::{CheckPoint, ShopTruth};
