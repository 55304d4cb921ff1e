//! Faults of a scan's pictures, with the setting to change.

use crate::measure::regression::median;
use crate::picture_light::PictureLight;

/// A picture with its brightest place below this part of full scale is dark.
const DARK: f64 = 0.08;
/// A stripe is dim below this part of full scale.
const DIM: f64 = 0.1;
/// A picture with half of it above this part of full scale is overexposed.
const GLARING: f64 = 0.6;
/// Surroundings above this part of full scale, and not less than half as bright as the stripe is above them, are lit.
const LIT: f64 = 0.2;
const LIT_BESIDE: f64 = 0.5;
/// A stripe that typically reaches this part of full scale is cut off there.
const CUT_OFF: f64 = 0.95;
/// Largest thickness of a stripe in focus (standard deviation), px.
const THICK_PX: f64 = 10.0;

/// Fault of most pictures of a scan. Seams may be found all the same; with it cured they are better.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PictureFault {
    /// Next to no light.
    #[error(
        "underexposed: the brightest place is at {percent:.0} % of full scale; lengthen the exposure, open \
         the aperture, raise the gain, or switch the laser on"
    )]
    Underexposed {
        /// The brightest place, percent of full scale.
        percent: f64,
    },
    /// A stripe that hardly stands out.
    #[error(
        "the stripe is too dim: {percent:.0} % of full scale above its surroundings; lengthen the exposure, or raise the laser's \
         power"
    )]
    DimStripe {
        /// The stripe, percent of full scale.
        percent: f64,
    },
    /// Pictures that are bright all over.
    #[error(
        "overexposed: half of the picture is above {percent:.0} % of full scale; shorten the exposure, or lower the gain"
    )]
    Overexposed {
        /// The surroundings, percent of full scale.
        percent: f64,
    },
    /// Light that is not the laser's.
    #[error(
        "ambient light: the surroundings of the stripe are at {percent:.0} % of full scale; shade the sensor, use a filter for the \
         laser's colour, or a shorter exposure with more laser power"
    )]
    AmbientLight {
        /// The surroundings, percent of full scale.
        percent: f64,
    },
    /// A stripe with a clipped middle.
    #[error(
        "the stripe is saturated: typically {percent:.0} % of full scale; shorten the exposure, or lower the \
        gain"
    )]
    SaturatedStripe {
        /// The stripe, percent of full scale.
        percent: f64,
    },
    /// A thick stripe.
    #[error(
        "out of focus: the stripe has a width of {sigma_px:.0} px (standard deviation); a sharp one has at \
        most {most_px:.0} px; focus lens and laser on the seam"
    )]
    OutOfFocus {
        /// Its thickness, px.
        sigma_px: f64,
        /// Largest width of a sharp stripe, px.
        most_px: f64,
    },
}

impl PictureFault {
    /// A stable word for programs.
    #[must_use]
    pub fn code(&self) -> &'static str {
        match self {
            Self::Underexposed { .. } => "underexposed",
            Self::DimStripe { .. } => "dim-stripe",
            Self::Overexposed { .. } => "overexposed",
            Self::AmbientLight { .. } => "ambient-light",
            Self::SaturatedStripe { .. } => "saturated-stripe",
            Self::OutOfFocus { .. } => "out-of-focus",
        }
    }
}

/// The faults of pictures by their typical light; `wide` pictures have 16 bits, and the brightest shows how many are
/// used.
#[must_use]
pub(crate) fn picture_faults(lights: &[PictureLight], wide: bool) -> Vec<PictureFault> {
    let brightest = lights.iter().fold(0.0, |top: f64, light| top.max(light.brightest));
    let full = full_scale(brightest, wide);
    let typical = |of: &dyn Fn(&PictureLight) -> Option<f64>| -> Option<f64> {
        let mut values: Vec<f64> = lights.iter().filter_map(of).collect();
        (!values.is_empty()).then(|| median(&mut values))
    };
    let percent = |of: &dyn Fn(&PictureLight) -> f64| typical(&|light| Some(100.0 * of(light) / full));
    let (Some(top), Some(ambient), Some(stripe)) =
        (percent(&|light| light.brightest), percent(&|light| light.ambient), percent(&|light| light.stripe))
    else {
        return Vec::new();
    };
    let light = if top < 100.0 * DARK {
        Some(PictureFault::Underexposed { percent: top })
    } else if ambient > 100.0 * GLARING {
        Some(PictureFault::Overexposed { percent: ambient })
    } else if ambient > 100.0 * LIT && ambient > LIT_BESIDE * stripe {
        Some(PictureFault::AmbientLight { percent: ambient })
    } else if stripe < 100.0 * DIM {
        Some(PictureFault::DimStripe { percent: stripe })
    } else if ambient + stripe > 100.0 * CUT_OFF {
        // A stripe that is flat at full scale holds more light than a bell of that height, which the brightness assumes:
        // nothing else is reported.
        Some(PictureFault::SaturatedStripe { percent: (ambient + stripe).min(100.0) })
    } else {
        None
    };
    let thick = typical(&|light| light.sigma_px).filter(|sigma_px| *sigma_px > THICK_PX);
    let focus = thick.map(|sigma_px| PictureFault::OutOfFocus { sigma_px, most_px: THICK_PX });
    light.into_iter().chain(focus).collect()
}

/// Full scale of levels of 8 bits, or of 10, 12, 14 or 16 bits in 16: the least that holds the brightest.
fn full_scale(brightest: f64, wide: bool) -> f64 {
    let scales: &[f64] = if wide { &[1023.0, 4095.0, 16383.0, 65535.0] } else { &[255.0] };
    scales.iter().copied().find(|full| brightest <= *full).unwrap_or(65535.0)
}
