//! Taking pictures from a camera that may be unplugged or have automatic settings on, for any wire.

use crate::error::CameraError;
use crate::frame_source::CameraFrame;
use std::time::{Duration, Instant};

/// Interval of the checks of the camera while no picture comes.
const LINK_LOOK: Duration = Duration::from_millis(50);

/// Memory for pictures that wait to be taken, bytes, and the least and largest number of them.
const WAITING_BYTES: usize = 64 << 20;
const LEAST_WAITING: usize = 8;
const MOST_WAITING: usize = 64;

/// Number of pictures of `bytes` that may wait to be taken: [`WAITING_BYTES`], or the least number if that is more.
pub(crate) fn waiting_pictures(bytes: usize) -> usize {
    (WAITING_BYTES / bytes.max(1)).clamp(LEAST_WAITING, MOST_WAITING)
}

/// A camera with pictures to wait for.
pub(crate) trait Attended {
    /// Waits for the next picture; `None` if none comes within the time.
    ///
    /// # Errors
    /// The session is over.
    fn wait(&mut self, timeout: Duration) -> Result<Option<CameraFrame>, CameraError>;

    /// Looks at the camera, if it is time.
    ///
    /// # Errors
    /// [`CameraError::Unplugged`], or an automatic that was turned on.
    fn look(&mut self) -> Result<(), CameraError>;

    /// Consequence of the last bad picture for the session.
    fn pending(&mut self) -> &mut Option<CameraError>;
}

/// The next picture; `None` if none comes within the time. One of another size or format is given first, without its pixels;
/// the call after it is the error.
///
/// # Errors
/// Error that ends the session.
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
            // Pictures may come so fast that nothing ever is waited for. A lost link is reported after the last picture.
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
