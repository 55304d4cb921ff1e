//! Return values of functions.

use std::ffi::{CStr, c_char};
use std::panic::{AssertUnwindSafe, catch_unwind};
use trueline_rt::{AheadError, AxisError, AxisProblem, PlaceError, PoseError, SeamPointError};

/// A status; see the header.
pub type Status = i32;

/// It is done.
pub const OK: Status = 0;
/// A pointer that is needed is null.
pub const NULL_POINTER: Status = 1;
/// A number of calibration or settings is not finite or out of range.
pub const BAD_SETTING: Status = 2;
/// A pose, a point or a stamp is not a finite number in range.
pub const NOT_FINITE: Status = 3;
/// The pose is not later than the last one.
pub const NOT_LATER: Status = 4;
/// The clock of the poses went back.
pub const CLOCK_WENT_BACK: Status = 5;
/// There are too few poses or frames yet.
pub const UNSETTLED: Status = 6;
/// The frame's stamp does not fit its clock.
pub const STAMP_JUMPED: Status = 7;
/// The exposure is before the poses, or in a gap between them.
pub const NO_POSE: Status = 8;
/// The poses about the exposure are not the motion of a robot.
pub const DOUBTFUL_POSES: Status = 9;
/// The poses end before the exposure.
pub const POSES_ENDED: Status = 10;
/// The sensor does not report such points.
pub const OTHER_SENSOR: Status = 11;
/// The seam point is off the seam or not further along it.
pub const OFF_SEAM: Status = 12;
/// Another seam begins with this point.
pub const ANOTHER_SEAM: Status = 13;
/// There are too few seam points about the place.
pub const NO_SEAM: Status = 14;
/// A defect of the library.
pub const PANIC: Status = 15;

/// There is no such external axis.
pub const NO_AXIS: Status = 16;
/// An external axis has no value at the exposure.
pub const NO_AXIS_VALUE: Status = 17;

const TEXTS: [&CStr; 18] = [
    c"ok",
    c"a pointer that is needed is null",
    c"a number of calibration or settings is not finite or out of range",
    c"a pose, a point or a stamp is not a finite number in range",
    c"the pose is not later than the last one",
    c"the clock of the poses went back; the poses before are forgotten",
    c"too few poses or frames yet",
    c"the stamp of the frame does not fit its clock",
    c"the exposure is before the poses, or in a gap between them",
    c"the poses about the exposure are doubtful",
    c"the poses end before the exposure",
    c"the sensor does not report such points",
    c"the seam point is off the seam or not further along it",
    c"another seam begins here; the points before are forgotten",
    c"too few seam points about the place",
    c"a defect of the library",
    c"there is no such external axis",
    c"an external axis has no value at the exposure, or a doubtful one",
];

/// A status in words.
#[unsafe(no_mangle)]
pub extern "C" fn trueline_status_text(status: Status) -> *const c_char {
    let text = usize::try_from(status).ok().and_then(|status| TEXTS.get(status));
    text.map_or(c"unknown status", |text| text).as_ptr()
}

/// Runs the body of a function; a panic ends here.
pub(crate) fn guarded(body: impl FnOnce() -> Result<(), Status>) -> Status {
    match catch_unwind(AssertUnwindSafe(body)) {
        Ok(Ok(())) => OK,
        Ok(Err(status)) => status,
        Err(_) => PANIC,
    }
}

pub(crate) fn of_pose(error: PoseError) -> Status {
    match error {
        PoseError::NotFinite => NOT_FINITE,
        PoseError::NotLater { .. } => NOT_LATER,
        PoseError::ClockWentBack { .. } => CLOCK_WENT_BACK,
    }
}

pub(crate) fn of_axis(error: AxisError) -> Status {
    match error {
        AxisError::NotFinite => NOT_FINITE,
        AxisError::NoSuchAxis { .. } => NO_AXIS,
        AxisError::NotLater { .. } => NOT_LATER,
        AxisError::ClockWentBack { .. } => CLOCK_WENT_BACK,
    }
}

pub(crate) fn of_place(error: PlaceError) -> Status {
    match error {
        PlaceError::Unsettled { .. } | PlaceError::FramesUnsettled => UNSETTLED,
        PlaceError::StampOutOfRange => NOT_FINITE,
        PlaceError::StampJumped { .. } => STAMP_JUMPED,
        PlaceError::BeforePoses { .. } | PlaceError::InGap { .. } => NO_POSE,
        PlaceError::DoubtfulPoses => DOUBTFUL_POSES,
        PlaceError::PosesEnded { .. } => POSES_ENDED,
        PlaceError::Axis { problem: AxisProblem::Unsettled { .. }, .. } => UNSETTLED,
        PlaceError::Axis { .. } => NO_AXIS_VALUE,
        // Buffers are as long as the caller states.
        PlaceError::BufferTooShort { .. } => PANIC,
        PlaceError::OtherSensor => OTHER_SENSOR,
    }
}

pub(crate) fn of_seam_point(error: SeamPointError) -> Status {
    match error {
        SeamPointError::NotFinite => NOT_FINITE,
        SeamPointError::NotAhead { .. } | SeamPointError::OffSeam { .. } => OFF_SEAM,
        SeamPointError::AnotherSeam => ANOTHER_SEAM,
    }
}

pub(crate) fn of_ahead(error: AheadError) -> Status {
    match error {
        AheadError::NotFinite => NOT_FINITE,
        AheadError::TooFewPoints { .. } | AheadError::BeforeSeam { .. } | AheadError::BeyondSeam { .. } => {
            NO_SEAM
        }
    }
}
