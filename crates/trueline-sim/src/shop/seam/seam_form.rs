//! Displacement of the seam from its straight line.

use super::super::drawn_errors::DrawnErrors;
use super::bow::Bow;
use super::heat_bend::HeatBend;
use super::tacks::Tacks;
use super::waviness;
use crate::faults::Wobble;
use nalgebra::Vector3;

/// The form.
pub(crate) struct SeamForm {
    /// Unit vectors in base: across the seam, and towards the sensor.
    axes: [Vector3<f64>; 2],
    bow: Option<Bow>,
    heat: Option<HeatBend>,
    tacks: Option<Tacks>,
    waves: Option<Wobble>,
}

impl SeamForm {
    /// The form of a seam that is scanned over a length, m, and seen from `height` (unit vector in base, square to it).
    pub(crate) fn new(
        errors: &DrawnErrors,
        along: &Vector3<f64>,
        height: &Vector3<f64>,
        length_m: f64,
    ) -> Self {
        Self {
            axes: [along.cross(height), *height],
            bow: Bow::of(errors),
            heat: HeatBend::of(errors, length_m),
            tacks: Tacks::of(errors, length_m),
            waves: waviness::waves(errors, length_m),
        }
    }

    /// Displacement in base at a place along the seam, counted from the middle of the scan, m.
    pub(crate) fn displacement(&self, along_m: f64) -> Vector3<f64> {
        let tacks = self.tacks.as_ref().map_or([0.0; 2], |tacks| tacks.at(along_m));
        self.displacement_beside(along_m) + self.axes[0] * tacks[0] + self.axes[1] * tacks[1]
    }

    /// The same for the plates next to the seam, without a tack.
    pub(crate) fn displacement_beside(&self, along_m: f64) -> Vector3<f64> {
        let parts = [
            self.bow.as_ref().map(|bow| bow.at(along_m)),
            self.heat.as_ref().map(|heat| heat.at(along_m)),
            self.waves.as_ref().map(|waves| waves.at(along_m)),
        ];
        let sum = |axis: usize| parts.iter().flatten().map(|part| part[axis]).sum::<f64>();
        self.axes[0] * sum(0) + self.axes[1] * sum(1)
    }
}
