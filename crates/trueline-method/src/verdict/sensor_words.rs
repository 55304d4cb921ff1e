//! Sentences about a sensor whose own calibration is off, and about its confounded causes.

use super::quantity::{MM_PER_M, MS_PER_S};
use crate::assess::cause_kind::CauseKind;
use crate::assess::confounded_causes::ConfoundedCause;
use crate::assess::sensor_shape::SensorShape;

/// For a sensor that was corrected.
pub(super) fn sensor_off(shape: &SensorShape, instead: &[ConfoundedCause]) -> String {
    let found = shape.words().join("; ");
    if shape.stated {
        return format!(
            "the sensor differs from its file, within its stated uncertainty: {found}. This result corrects \
             it, and holds only for the corrected sensor"
        );
    }
    if instead.is_empty() {
        return format!(
            "the sensor's own calibration is off: {found}. This result corrects it, and holds only for the \
            corrected sensor"
        );
    }
    format!(
        "either the sensor's own calibration is off: {found}; or it is right, and {}. To find out, scan \
         again at another speed or weave frequency; this result corrects the sensor, and holds only for the \
         corrected sensor",
        words(instead)
    )
}

/// For a sensor that was held fixed, or had its file's uncertainty.
pub(super) fn contradicted_sensor(
    shape: &SensorShape,
    instead: &[ConfoundedCause],
    beyond_stated: bool,
) -> String {
    let found = shape.words().join("; ");
    let off = if beyond_stated {
        "the sensor's own calibration is off by more than its file states"
    } else {
        "the sensor's own calibration is off, and the sensor was held fixed"
    };
    if instead.is_empty() {
        return format!("{off}: {found}");
    }
    format!(
        "either {off}: {found}; or it is right, and {}. To find out, scan again at another speed or weave \
         frequency",
        words(instead)
    )
}

fn words(instead: &[ConfoundedCause]) -> String {
    instead.iter().map(word).collect::<Vec<_>>().join(", or ")
}

fn word(ConfoundedCause { kind, size }: &ConfoundedCause) -> String {
    let (mm, ms) = (size.abs() * MM_PER_M, size.abs() * MS_PER_S);
    match kind {
        CauseKind::Flex => format!("the arm bends by about {mm:.2} mm for each m/s²"),
        CauseKind::Backlash => format!("the robot has backlash of about {mm:.2} mm"),
        CauseKind::AttitudeLag if *size < 0.0 => {
            format!("the robot reports its attitude about {ms:.1} ms earlier than its position")
        }
        CauseKind::AttitudeLag => {
            format!("the robot reports its attitude about {ms:.1} ms later than its position")
        }
        CauseKind::RollingShutter => {
            format!("the camera has a rolling shutter of about {ms:.0} ms")
        }
        CauseKind::SideBias => {
            format!(
                "the detector has a bias of about {:.1} px with opposite signs in the two halves of the \
                picture",
                size.abs()
            )
        }
        CauseKind::CommandedPose => format!(
            "the recorded poses are commanded poses, which the arm follows with a time constant of about \
             {:.0} ms (the time offset contains that delay)",
            size.max(0.0).sqrt() * MS_PER_S
        ),
        CauseKind::Lens => "the lens distortion differs from sensor.toml".to_owned(),
        CauseKind::TiltBias => {
            format!("the detector's point moves by about {:.1} px for each 10° of tilt", size.abs())
        }
    }
}
