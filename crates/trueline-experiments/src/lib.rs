//! The paper's experiments \[Yang2025, Sect. IV\], simulated with known truth.
//!
//! Nothing here is part of the method: scans are simulated, calibrated in several ways, and compared. Everything follows
//! from [`Settings`]; the same settings give the same numbers. The paper's published figures are in [`published`], to
//! keep them apart.
//!
//! ```
//! use trueline_experiments::{Settings, published, reproduce};
//!
//! let all = reproduce(&Settings { repeats: 1, ..Settings::default() }, |_| ())?;
//! assert!(!all.welds.is_empty());
//! assert_eq!(published::TIME_OFFSET_S, 0.01773);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod block_by_block;
pub mod calibrated;
pub mod convergence;
pub mod papers_scene;
pub mod planned;
pub mod published;
pub mod settings;
pub mod speed_table;
pub mod static_board;
pub mod weld_errors;

pub use convergence::{Step, Track};
pub use settings::Settings;
pub use speed_table::SpeedTable;
pub use static_board::StaticRow;
pub use weld_errors::{WeldErrors, WeldKind};

/// Everything that is reproduced.
#[derive(Clone, Debug)]
pub struct Reproduction {
    /// How.
    pub settings: Settings,
    /// Figs. 6 to 8: every method's way from the paper's start.
    pub convergence: Vec<Track>,
    /// True values of the convergence scan.
    pub truth: Step,
    /// Fig. 9, and Fig. 10 with Table I.
    pub welds: Vec<WeldErrors>,
    /// Errors over speed and offset.
    pub speeds: SpeedTable,
    /// The static checkerboard by every method; empty where the sensor has no camera.
    pub boards: Vec<StaticRow>,
}

/// Runs all experiments; `tick` is called after each part with its name.
///
/// # Errors
/// Error of calibrating a simulated scan; none of them should occur.
pub fn reproduce(
    settings: &Settings,
    mut tick: impl FnMut(&str),
) -> Result<Reproduction, trueline_method::Error> {
    let (convergence, truth) = convergence::run(settings)?;
    tick("convergence");
    let mut welds = Vec::new();
    for kind in [WeldKind::Straight, WeldKind::Round] {
        welds.push(weld_errors::run(settings, kind)?);
        tick(kind.name());
    }
    let speeds = speed_table::run(settings)?;
    tick("speeds and offsets");
    let boards = static_board::run(settings).unwrap_or_default();
    tick("static checkerboard");
    Ok(Reproduction { settings: settings.clone(), convergence, truth, welds, speeds, boards })
}
