//! A log of commanded poses: the joints follow the command with a first-order lag, each with its own.

use super::super::drawn_errors::DrawnErrors;
use super::super::error_table::ShopError;
use trueline_geometry::arm::six_axes::AXES;

/// Standard deviation of the joints' time constants, as a part.
const BETWEEN_JOINTS: f64 = 0.08;
/// Nodes and weights of the five-point Gauss–Laguerre rule \[Abramowitz1964, table 25.9\].
const LAGUERRE: [(f64, f64); 5] = [
    (0.263_560_319_718, 0.521_755_610_583),
    (1.413_403_059_107, 0.398_666_811_083),
    (3.596_425_771_041, 0.075_942_449_682),
    (7.085_810_005_859, 0.003_611_758_680),
    (12.640_800_844_276, 0.000_023_369_972),
];

/// The lag of a robot that logs commands.
pub(crate) struct CommandLag {
    constants_s: [f64; AXES],
}

impl CommandLag {
    pub(crate) fn of(errors: &DrawnErrors) -> Option<Self> {
        let size_s = errors.size(ShopError::CommandedPoses)?;
        let mut noise = errors.noise(ShopError::CommandedPoses, 1);
        Some(Self { constants_s: [0.0; AXES].map(|_| size_s * (1.0 + noise.normal(BETWEEN_JOINTS))) })
    }

    /// Joint angles, rad: the mean of past commands, weighted with exp(−age / time constant).
    pub(crate) fn following(&self, command: &dyn Fn(f64) -> [f64; AXES], time_s: f64) -> [f64; AXES] {
        std::array::from_fn(|k| {
            let past =
                LAGUERRE.iter().map(|(age, weight)| command(time_s - age * self.constants_s[k])[k] * weight);
            past.sum()
        })
    }

    /// Shortest, mean and longest time constant, s: the delay of the motion behind its log.
    pub(crate) fn delays_s(&self) -> [f64; 3] {
        let sum: f64 = self.constants_s.iter().sum();
        let ends =
            [f64::min, f64::max].map(|pick| self.constants_s.iter().copied().fold(self.constants_s[0], pick));
        [ends[0], sum / AXES as f64, ends[1]]
    }
}
