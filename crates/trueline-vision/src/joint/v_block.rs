//! The line in which the faces of a V-block would meet; a relief slot may be there instead.

use crate::detection::Detection;
use crate::evidence::Evidence;
use crate::joint::arm_pair::{ArmPair, LeastArm, pairs_over_slot};
use crate::joint::fillet::choose;
use crate::joint::turn::at_corner;
use crate::lens::Lens;
use crate::measure::stripe_meter::StripeMeter;
use crate::not_found::NotFound;
use crate::picture::Level;
use crate::stripe_choice::StripeChoice;
use std::f64::consts::PI;

/// Angles between the faces, in the sheet, rad: blocks of 60° to 120°, cut at a slant.
const OPENINGS: [f64; 2] = [0.25 * PI, 0.8 * PI];

/// Finds it.
///
/// # Errors
/// The reason why there is none.
pub fn find<L: Level>(
    evidence: &Evidence<'_, L>,
    choice: StripeChoice,
    meter: &mut StripeMeter,
) -> Result<Detection, NotFound> {
    let lens = evidence.frame.lens;
    let judged = || {
        pairs_over_slot(evidence.segments, lens).map(move |(weight, pair)| {
            let pair =
                pair.and_then(|pair| pair.on_side(false, lens)).and_then(|pair| pair.long(LeastArm::USUAL));
            (weight, pair.and_then(|pair| of_a_block(pair, lens)))
        })
    };
    let doubt = |pair: &ArmPair| at_corner(evidence.segments, pair, lens).err();
    choose(evidence, judged, doubt, choice, meter)
}

/// The pair, if its faces open as on a block.
fn of_a_block(pair: ArmPair, lens: &Lens) -> Result<ArmPair, NotFound> {
    let opening_rad = pair.opening_rad(lens).ok_or(NotFound::OutOfView)?;
    if (OPENINGS[0]..=OPENINGS[1]).contains(&opening_rad) {
        return Ok(pair);
    }
    let [least_deg, most_deg] = OPENINGS.map(f64::to_degrees);
    Err(NotFound::OtherOpening { opening_deg: opening_rad.to_degrees(), least_deg, most_deg })
}
