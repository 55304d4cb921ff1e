//! Productions with a name: those for which the delays of the detector are stated.

use super::settings::{PlacementScatter, Production, SeamPass};
use crate::presets::Preset;
use crate::scenario::Sine;
use nalgebra::Vector3;

/// A kind of production.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Layout {
    /// One straight seam of 300 mm without weave, the torch steady within 1°.
    OneSeam,
    /// Four seams around a box of 300 mm, the torch going round with them.
    Box,
    /// The same with a weave of 3 mm at 2 Hz.
    BoxWeave,
    /// The same with work angles of 0, 10, −10 and 5° and attitudes that swing by 5°.
    BoxAngles,
    /// The same in a fixture that repeats within 0.05 mm and 0.02°.
    BoxGoodFixture,
    /// A scan of 5 s over a fixed reference edge, moving and tilting.
    CheckScan,
}

impl Layout {
    /// All layouts.
    pub const ALL: [Self; 6] =
        [Self::OneSeam, Self::Box, Self::BoxWeave, Self::BoxAngles, Self::BoxGoodFixture, Self::CheckScan];

    /// The name on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::OneSeam => "one-seam",
            Self::Box => "box",
            Self::BoxWeave => "box-weave",
            Self::BoxAngles => "box-angles",
            Self::BoxGoodFixture => "box-good-fixture",
            Self::CheckScan => "check-scan",
        }
    }

    /// The production, in which nothing changes yet.
    #[must_use]
    pub fn production(self) -> Production {
        let scenario = Preset::Quick.scenario();
        let degree = 1f64.to_radians();
        let sine = |amplitude, frequency_hz, phase_rad| Sine { amplitude, frequency_hz, phase_rad };
        let tilts = |amplitude: f64| {
            [sine(amplitude, 0.23, 0.5), sine(amplitude, 0.17, 2.0), sine(amplitude, 0.13, 4.0)]
        };
        let usual = PlacementScatter { translation_m: 0.3e-3, rotation_rad: 0.1 * degree, seam_m: 0.1e-3 };
        let good = PlacementScatter { translation_m: 0.05e-3, rotation_rad: 0.02 * degree, seam_m: 0.1e-3 };
        let weave = sine(0.003, 2.0, 0.0);
        let plain = Production {
            seams: around_a_box([0.0; 4]),
            speed_m_s: 0.015,
            weave: Sine::default(),
            range: Sine::default(),
            tilts: tilts(degree),
            pivot_m: None,
            plates: None,
            scatter: usual,
            change: None,
            scenario,
        };
        let angles = [0.0, 10.0, -10.0, 5.0].map(|angle| angle * degree);
        match self {
            Self::OneSeam => Production { seams: around_a_box([0.0; 4])[..1].to_vec(), ..plain },
            Self::Box => plain,
            Self::BoxWeave => Production { weave, ..plain },
            Self::BoxAngles => {
                Production { seams: around_a_box(angles), weave, tilts: tilts(5.0 * degree), ..plain }
            }
            Self::BoxGoodFixture => Production {
                seams: around_a_box(angles),
                weave,
                tilts: tilts(5.0 * degree),
                scatter: good,
                ..plain
            },
            Self::CheckScan => Production {
                seams: around_a_box([0.0; 4])[..1].to_vec(),
                speed_m_s: 0.060,
                weave: sine(0.020, 0.9, 0.0),
                range: sine(0.025, 0.7, 1.0),
                tilts: [
                    sine(20.0 * degree, 0.5, 0.5),
                    sine(20.0 * degree, 0.4, 2.0),
                    sine(20.0 * degree, 0.6, 4.0),
                ],
                scatter: PlacementScatter { seam_m: 0.0, ..good },
                ..plain
            },
        }
    }
}

const SIDE_M: f64 = 0.3;

/// The four lower edges of a box on a table, seen from above.
fn around_a_box(work_angles_rad: [f64; 4]) -> Vec<SeamPass> {
    let corner = |x: f64, y: f64| Vector3::new(1.0 + x * SIDE_M, y * SIDE_M, 0.12);
    let corners = [corner(0.0, 0.0), corner(1.0, 0.0), corner(1.0, 1.0), corner(0.0, 1.0)];
    (0..4)
        .map(|k| SeamPass {
            start: corners[k],
            end: corners[(k + 1) % 4],
            approach: -Vector3::z_axis(),
            work_angle_rad: work_angles_rad[k],
        })
        .collect()
}
