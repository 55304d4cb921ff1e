//! A sensor whose own calibration is off, and what may be there in its place, in words.

use super::quantity::{MM_PER_M, MS_PER_S};
use crate::assess::cause_kind::CauseKind;
use crate::assess::instead_of_sensor::InsteadOfSensor;
use crate::assess::sensor_shape::SensorShape;

/// Of a sensor that was corrected.
pub(super) fn sensor_off(shape: &SensorShape, instead: &[InsteadOfSensor]) -> String {
    let found = shape.words().join("; ");
    if shape.stated {
        return format!(
            "the sensor differs from its file, within what that states of it: {found}; this result corrects it, and holds for the corrected \
             sensor only"
        );
    }
    if instead.is_empty() {
        return format!(
            "the sensor's own calibration is off: {found}; this result corrects it, and holds for the corrected sensor only"
        );
    }
    format!(
        "either the sensor's own calibration is off: {found}; or it is right, and {}. This scan does not tell: scan once more at another \
         speed, or with a weave of another frequency. This result corrects the sensor, and holds for the corrected sensor only",
        words(instead)
    )
}

/// Of a sensor that was held, or taken for as good as its file states.
pub(super) fn contradicted_sensor(
    shape: &SensorShape,
    instead: &[InsteadOfSensor],
    beyond_stated: bool,
) -> String {
    let found = shape.words().join("; ");
    let off = if beyond_stated {
        "the sensor's own calibration is off by more than its file states"
    } else {
        "the sensor's own calibration is off, and it was held"
    };
    if instead.is_empty() {
        return format!("{off}: {found}");
    }
    format!(
        "either {off}: {found}; or it is right, and {}. This scan does not tell: scan once \
         more at another speed, or with a weave of another frequency",
        words(instead)
    )
}

fn words(instead: &[InsteadOfSensor]) -> String {
    instead.iter().map(word).collect::<Vec<_>>().join(", or ")
}

fn word(InsteadOfSensor { kind, size }: &InsteadOfSensor) -> String {
    let (mm, ms) = (size.abs() * MM_PER_M, size.abs() * MS_PER_S);
    match kind {
        CauseKind::Flex => format!("the arm gives way by about {mm:.2} mm for each m/s²"),
        CauseKind::Backlash => format!("the robot has play of about {mm:.2} mm"),
        CauseKind::AttitudeLag if *size < 0.0 => {
            format!("the robot's attitude is reported about {ms:.1} ms earlier than its position")
        }
        CauseKind::AttitudeLag => {
            format!("the robot's attitude is reported about {ms:.1} ms later than its position")
        }
        CauseKind::RollingShutter => {
            format!("the rows of a picture are exposed one after the other, over about {ms:.0} ms")
        }
        CauseKind::SideBias => {
            format!(
                "the detector errs by about {:.1} px to different sides on the two halves of the picture",
                size.abs()
            )
        }
        CauseKind::CommandedPose => format!(
            "the recorded poses are the commanded ones, which the arm follows with a time constant of about {:.0} ms (and the time offset \
             contains that delay)",
            size.max(0.0).sqrt() * MS_PER_S
        ),
        CauseKind::Lens => "the distortion of the lens is not what sensor.toml states".to_owned(),
        CauseKind::TiltBias => {
            format!("the detector's point moves with the tilt by about {:.1} px for each 10°", size.abs())
        }
    }
}
