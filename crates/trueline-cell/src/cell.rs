//! The recorders beside the robot's: the camera and the estimate, a thread each. Both end with the robot's
//! side.

use crate::camera_counts::CameraCounts;
use crate::camera_recorder::{CameraRecorder, SeamPoints};
use crate::cell_listener::CellListener;
use crate::live_estimate::{LiveEstimate, Progress};
use crate::live_picture::LivePicture;
use crate::live_welds::LiveWelds;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::Duration;
use trueline_camera::CameraError;
use trueline_mcap::RecorderHandle;

/// Between calls of the observer.
const REFRESH: Duration = Duration::from_millis(200);

/// Camera and estimate beside a robot.
#[derive(Default)]
pub struct Cell {
    camera: Option<CameraRecorder>,
    estimate: Option<Arc<LiveEstimate>>,
    welds: Option<Arc<LiveWelds>>,
    listener: Option<Arc<dyn CellListener>>,
    counts: Mutex<CameraCounts>,
}

/// How a cell is doing.
#[derive(Clone, Debug)]
pub struct CellState {
    /// The camera, if there is one.
    pub camera: Option<CameraCounts>,
    /// The estimate, if there is one.
    pub estimate: Option<Progress>,
}

/// How the threads of a cell ended.
pub struct CellOutcome<T> {
    /// Result of the robot's side; `None` if it panicked.
    pub robot: Option<T>,
    /// Why the camera ended early, if it did.
    pub camera: Result<(), CameraError>,
    /// The estimate panicked; the recording is not touched by that.
    pub estimate_panicked: bool,
}

/// Reports at its end that there is no camera any more.
struct Blinded<'a>(&'a AtomicBool);

impl Drop for Blinded<'_> {
    fn drop(&mut self) {
        self.0.store(true, Ordering::SeqCst);
    }
}

impl Cell {
    /// A robot with a camera, an estimate, both or neither beside it.
    #[must_use]
    pub fn new(camera: Option<CameraRecorder>, estimate: Option<Arc<LiveEstimate>>) -> Self {
        Self { camera, estimate, welds: None, listener: None, counts: Mutex::default() }
    }

    /// The same, with its seam points cut into welds.
    #[must_use]
    pub fn with_welds(self, welds: Arc<LiveWelds>) -> Self {
        Self { welds: Some(welds), ..self }
    }

    /// The same, with a listener for all recorded entries.
    #[must_use]
    pub fn heard_by(self, listener: Arc<dyn CellListener>) -> Self {
        Self { listener: Some(listener), ..self }
    }

    /// The listener for all recorded entries.
    #[must_use]
    pub fn listener(&self) -> Option<Arc<dyn CellListener>> {
        self.listener.clone()
    }

    /// Source of the pictures and meaning of their stamps, in the words of the recording.
    #[must_use]
    pub fn stamp_meaning(&self) -> Option<String> {
        self.camera.as_ref().map(CameraRecorder::stamp_meaning)
    }

    /// The camera's last picture, for observers.
    #[must_use]
    pub fn picture(&self) -> Option<Arc<LivePicture>> {
        self.camera.as_ref().map(CameraRecorder::picture)
    }

    /// The live estimate, which is given every pose.
    #[must_use]
    pub fn estimate(&self) -> Option<Arc<LiveEstimate>> {
        self.estimate.clone()
    }

    /// The watch, which divides the stream into welds.
    #[must_use]
    pub fn welds(&self) -> Option<Arc<LiveWelds>> {
        self.welds.clone()
    }

    /// How it is doing.
    #[must_use]
    pub fn state(&self) -> CellState {
        state(self.camera.is_some(), &self.counts, self.estimate.as_deref())
    }

    /// Runs camera and estimate beside `robot`, until it is done. The flag that it is given reports that the camera
    /// has failed. `observe` is called in this thread five times a second.
    pub fn run<T: Send>(
        &mut self,
        handle: &RecorderHandle,
        robot: impl FnOnce(&AtomicBool) -> T + Send,
        mut observe: impl FnMut(&CellState),
    ) -> CellOutcome<T> {
        let Self { camera, estimate, welds, listener, counts } = self;
        let (counts, estimate, has_camera) = (&*counts, estimate.as_deref(), camera.is_some());
        let goal = SeamPoints { estimate, welds: welds.as_deref(), listener: listener.as_deref(), counts };
        let (over, blind) = (&AtomicBool::new(false), &AtomicBool::new(false));
        thread::scope(|scope| {
            let leading = scope.spawn(move || {
                let outcome = robot(blind);
                over.store(true, Ordering::SeqCst);
                outcome
            });
            let looking = scope.spawn(move || {
                // Should it panic, the scan is to be stopped as well.
                let blinded = Blinded(blind);
                let seen = camera.as_mut().map_or(Ok(()), |camera| camera.run(handle, &goal, over));
                if seen.is_ok() {
                    std::mem::forget(blinded);
                }
                seen
            });
            let estimating = estimate.map(|estimate| scope.spawn(move || estimate.run(over)));
            // The robot's thread may panic.
            while !over.load(Ordering::SeqCst) && !leading.is_finished() {
                thread::sleep(REFRESH);
                observe(&state(has_camera, counts, estimate));
            }
            over.store(true, Ordering::SeqCst);
            let panicked = || CameraError::Io(std::io::Error::other("the camera's thread panicked"));
            CellOutcome {
                camera: looking.join().unwrap_or_else(|_| Err(panicked())),
                estimate_panicked: estimating.is_some_and(|thread| thread.join().is_err()),
                robot: leading.join().ok(),
            }
        })
    }
}

fn state(has_camera: bool, counts: &Mutex<CameraCounts>, estimate: Option<&LiveEstimate>) -> CellState {
    let counts = has_camera.then(|| *counts.lock().unwrap_or_else(PoisonError::into_inner));
    CellState { camera: counts, estimate: estimate.map(LiveEstimate::progress) }
}
