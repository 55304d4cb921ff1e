//! Weaves and S-paths with commensurable frequencies, as a robot's own weave function makes them. A straight line then
//! looks the same, or nearly the same, one period or half a period later.

use crate::noise::Noise;
use crate::presets::Preset;
use crate::random_cell::random_cell;
use crate::scenario::{Progress, Scan, Scenario, Sine, TrackedIn};

/// A family of such paths.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Weave {
    /// Lateral and range both at 0.75 Hz in the sensor's frame, tilts at frequencies of their own.
    SPath,
    /// Lateral at 0.5 to 2 Hz, range at half of it, tilts at 1, 1/2, 1/3 or 1/4 of it, in the sensor's frame.
    Harmonic,
    /// The same with tilts 5 % off these frequencies.
    Detuned,
    /// Everything at 2 Hz, in base.
    Base2Hz,
    /// Everything at 1 Hz, in base.
    Base1Hz,
    /// Everything at 0.75 Hz, in base, tilts the same, at half or at frequencies of their own.
    Base075Hz,
}

impl Weave {
    /// All families.
    pub const ALL: [Self; 6] =
        [Self::SPath, Self::Harmonic, Self::Detuned, Self::Base2Hz, Self::Base1Hz, Self::Base075Hz];

    /// A short description.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::SPath => "S-path, 0.75 Hz, tracked in the sensor frame",
            Self::Harmonic => "weave 0.5-2 Hz, range at half, tilts at 1..1/4",
            Self::Detuned => "the same, tilts detuned by 5 %",
            Self::Base2Hz => "weave in base, everything at 2 Hz",
            Self::Base1Hz => "weave in base, everything at 1 Hz",
            Self::Base075Hz => "weave in base, 0.75 Hz, tilts same, half or free",
        }
    }

    /// A drawn member of the family: a random cell with a true offset of 0 to 100 ms.
    #[must_use]
    pub fn scenario(self, seed: u64) -> Scenario {
        let mut noise = Noise::new(seed, WEAVE_STREAM);
        let mut scenario = random_cell(&Preset::Quick.scenario(), seed, 0.0);
        scenario.timing.time_offset_s = noise.uniform(0.0, 0.1);
        scenario.timing.duration_s = if self == Self::SPath && seed.is_multiple_of(2) { 60.0 } else { 20.0 };
        scenario.scan = self.scan(&mut noise, seed);
        scenario
    }

    fn scan(self, noise: &mut Noise, seed: u64) -> Scan {
        let weave_hz = match self {
            Self::SPath | Self::Base075Hz => 0.75,
            Self::Harmonic | Self::Detuned => noise.uniform(0.5, 2.0),
            Self::Base2Hz => 2.0,
            Self::Base1Hz => 1.0,
        };
        let range_hz = if matches!(self, Self::Harmonic | Self::Detuned) { 0.5 * weave_hz } else { weave_hz };
        let tilts = [0, 1, 2].map(|axis| {
            let frequency_hz = match self {
                Self::SPath => noise.uniform(0.1, 0.4),
                Self::Harmonic => weave_hz / f64::from(1 + (seed as u32 + axis) % 4),
                Self::Detuned => 1.05 * weave_hz / f64::from(1 + (seed as u32 + axis) % 4),
                Self::Base2Hz | Self::Base1Hz => weave_hz,
                Self::Base075Hz => match seed % 3 {
                    0 => weave_hz,
                    1 => 0.5 * weave_hz,
                    _ => noise.uniform(0.1, 0.4),
                },
            };
            sine(noise, noise_amplitude(5.0_f64.to_radians()), frequency_hz)
        });
        let in_sensor = matches!(self, Self::SPath | Self::Harmonic | Self::Detuned);
        Scan {
            length_m: 0.3,
            lateral: sine(noise, [0.008, 0.012], weave_hz),
            range: sine(noise, [0.004, 0.010], range_hz),
            attitude_rad: [10.0, 12.0, 8.0].map(f64::to_radians),
            tilts,
            tracked_in: if in_sensor { TrackedIn::Sensor } else { TrackedIn::Base },
            progress: if seed % 4 < 2 { Progress::Even } else { Progress::Eased },
            passes: 1,
            spin_by_pass_rad: 0.0,
        }
    }
}

/// Stream of random numbers for the paths.
const WEAVE_STREAM: u64 = 23;

/// Amplitudes between one and three times a least one.
fn noise_amplitude(least: f64) -> [f64; 2] {
    [least, 3.0 * least]
}

fn sine(noise: &mut Noise, amplitude: [f64; 2], frequency_hz: f64) -> Sine {
    Sine {
        amplitude: noise.uniform(amplitude[0], amplitude[1]),
        frequency_hz,
        phase_rad: noise.uniform(0.0, std::f64::consts::TAU),
    }
}
