//! How pictures are taken from a camera that may be unplugged, and whose automatics may be turned on, whatever its wire is.

use crate::error::CameraError;
use crate::frame_source::CameraFrame;
use std::time::{Duration, Instant};

/// How often the camera is looked at while no picture comes.
const LINK_LOOK: Duration = Duration::from_millis(50);

/// Memory for pictures that wait to be taken, bytes, and the least and largest number of them.
const WAITING_BYTES: usize = 64 << 20;
const LEAST_WAITING: usize = 8;
const MOST_WAITING: usize = 64;

/// How many pictures of so many bytes may wait to be taken: [`WAITING_BYTES`], or the least number where that is more.
pub(crate) fn waiting_pictures(bytes: usize) -> usize {
    (WAITING_BYTES / bytes.max(1)).clamp(LEAST_WAITING, MOST_WAITING)
}

/// A camera whose pictures are waited for.
pub(crate) trait Attended {
    /// Waits for the next picture; `None` if there is none within the time.
    ///
    /// # Errors
    /// The session is over.
    fn wait(&mut self, timeout: Duration) -> Result<Option<CameraFrame>, CameraError>;

    /// Looks at the camera, if it is time.
    ///
    /// # Errors
    /// [`CameraError::Unplugged`], or an automatic that was turned on.
    fn look(&mut self) -> Result<(), CameraError>;

    /// What a picture that was given means for the session.
    fn pending(&mut self) -> &mut Option<CameraError>;
}

/// The next picture; `None` if there is none within the time. One of another size or format is given first, without its pixels; the
/// call after it is the error.
///
/// # Errors
/// What ends the session.
pub(crate) fn next_picture(
    camera: &mut impl Attended,
    timeout: Duration,
) -> Result<Option<CameraFrame>, CameraError> {
    if let Some(error) = camera.pending().take() {
        return Err(error);
    }
    let until = Instant::now() + timeout;
    loop {
        let left = until.saturating_duration_since(Instant::now());
        if let Some(picture) = camera.wait(left.min(LINK_LOOK))? {
            // Pictures may come so fast that nothing ever is waited for. A lost link is told when the last picture has been given.
            if let Err(error @ CameraError::ExposureAuto { .. }) = camera.look() {
                camera.pending().get_or_insert(error);
            }
            return Ok(Some(picture));
        }
        camera.look()?;
        if Instant::now() >= until {
            return Ok(None);
        }
    }
}
