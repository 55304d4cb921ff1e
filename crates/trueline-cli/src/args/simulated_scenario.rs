//! The scan of `trueline simulate`: a preset, and the options that replace parts of it.

use crate::args::{PathArgs, SimulateArgs};
use trueline_sim::{Between, Disturbance, Joint, Look, Scan, Scenario, Timing, random_cell};

/// Offsets of random cells lie within this, s.
const RANDOM_OFFSET_S: f64 = 1.0;

/// Fields, the user's option for them, and its unit in SI.
type Overrides<'a, const N: usize> = [(&'a mut f64, Option<f64>, f64); N];

fn apply<const N: usize>(overrides: Overrides<'_, N>) {
    for (field, option, unit) in overrides {
        *field = option.map_or(*field, |value| value * unit);
    }
}

impl SimulateArgs {
    /// The preset, changed.
    pub(crate) fn scenario(&self) -> Scenario {
        let mut scenario = self.preset.scenario();
        if self.random_cell {
            scenario = random_cell(&scenario, self.seed, RANDOM_OFFSET_S);
        }
        if self.noise_free {
            scenario.disturbance = Disturbance::default();
            scenario.timing.between = Between::Straight;
        }
        self.change_timing(&mut scenario.timing);
        self.path.change(&mut scenario.scan);
        self.change_disturbance(&mut scenario.disturbance);
        scenario
    }

    /// Changes the scenario of a plan, which has its own path.
    pub(crate) fn adapt(&self, scenario: &mut Scenario) {
        if self.noise_free {
            scenario.disturbance = Disturbance::default();
        }
        self.change_timing(&mut scenario.timing);
        self.change_disturbance(&mut scenario.disturbance);
    }

    /// The joint in the pictures.
    pub(crate) fn joint(&self) -> Joint {
        match self.joint.map_or_else(Joint::fillet, |joint| joint()) {
            Joint::Fillet { .. } => Joint::Fillet {
                opening_rad: self.opening_deg.unwrap_or(90.0).to_radians(),
                roll_rad: self.roll_deg.unwrap_or(0.0).to_radians(),
                gap_m: self.corner_gap_mm.map_or(0.0, |mm| mm * 1e-3),
            },
            other => other,
        }
    }

    /// How the pictures look.
    pub(crate) fn look(&self) -> Look {
        let mut look = self.look.map_or_else(Look::speckled, |look| look());
        look.bits = self.bits.unwrap_or(look.bits);
        look.exposure_s = self.exposure_ms.map_or(look.exposure_s, |ms| ms * 1e-3);
        look
    }

    fn change_timing(&self, timing: &mut Timing) {
        apply([
            (&mut timing.time_offset_s, self.time_offset_ms, 1e-3),
            (&mut timing.duration_s, self.duration_s, 1.0),
            (&mut timing.robot_period_s, self.robot_period_ms, 1e-3),
            (&mut timing.frame_period_s, self.frame_period_ms, 1e-3),
        ]);
    }

    fn change_disturbance(&self, d: &mut Disturbance) {
        apply([
            (&mut d.outlier_fraction, self.outliers, 1.0),
            (&mut d.drop_fraction, self.drops, 1.0),
            (&mut d.feature_noise_px, self.feature_noise_px, 1.0),
            (&mut d.feature_noise_m, self.feature_noise_mm, 1e-3),
            (&mut d.robot_position_noise_m, self.robot_noise_mm, 1e-3),
            (&mut d.frame_jitter_s, self.stamp_jitter_ms, 1e-3),
            (&mut d.clock_drift_ppm, self.clock_drift_ppm, 1.0),
        ]);
    }
}

impl PathArgs {
    fn change(&self, scan: &mut Scan) {
        let degree = 1f64.to_radians();
        scan.tracked_in = self.weave_frame.unwrap_or(scan.tracked_in);
        scan.progress = self.progress.unwrap_or(scan.progress);
        scan.passes = self.passes.unwrap_or(scan.passes);
        apply([
            (&mut scan.lateral.amplitude, self.lateral_mm, 1e-3),
            (&mut scan.lateral.frequency_hz, self.lateral_hz, 1.0),
            (&mut scan.range.amplitude, self.range_mm, 1e-3),
            (&mut scan.range.frequency_hz, self.range_hz, 1.0),
            (&mut scan.length_m, self.length_mm, 1e-3),
            (&mut scan.spin_by_pass_rad, self.spin_by_pass_deg, degree),
        ]);
        for (axis, tilt) in scan.tilts.iter_mut().enumerate() {
            let own = self.tilt_hz.get(axis).or(self.tilt_hz.first()).copied();
            apply([(&mut tilt.amplitude, self.tilt_deg, degree), (&mut tilt.frequency_hz, own, 1.0)]);
        }
    }
}
