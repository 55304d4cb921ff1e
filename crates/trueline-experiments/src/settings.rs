//! Settings shared by all experiments.

use crate::papers_scene::in_the_papers_base;
use trueline_sim::{Preset, Scenario};

/// Choices of a reproduction.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// First seed; repeats use the following ones.
    pub seed: u64,
    /// Calibrations and weld scans that every figure is taken over.
    pub repeats: u64,
    /// Iterations of the block-by-block baseline; the paper's figure shows about 80.
    pub iterations: usize,
    /// Speed along the C-type weld, m/s. Not published: 65 mm/s is where 18 ms make the 1.17 mm of Table I.
    pub round_speed_m_s: f64,
    /// Speeds of the table, m/s.
    pub speeds_m_s: Vec<f64>,
    /// Time offsets of the table, s.
    pub offsets_s: Vec<f64>,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            seed: 1,
            repeats: 10,
            iterations: 80,
            round_speed_m_s: 0.065,
            speeds_m_s: [10.0, 20.0, 50.0, 100.0, 200.0].map(|mm| mm * 1e-3).to_vec(),
            offsets_s: [0.0, 5.0, 10.0, 20.0, 50.0].map(|ms| ms * 1e-3).to_vec(),
        }
    }
}

impl Settings {
    /// The calibration scan: the paper's 60 s, 33 Hz camera, 4 ms robot, 17.73 ms, with noise of features, robot and
    /// stamps; in the paper's base frame.
    #[must_use]
    pub fn scenario(&self) -> Scenario {
        in_the_papers_base(Preset::Paper.scenario())
    }
}
