//! What records beside the robot: the camera, the estimate, the screen; all end when the robot's side does.

use crate::args::CameraArgs;
use crate::failure::Failure;
use crate::live_camera::LiveCamera;
use crate::live_estimate::{LiveEstimate, Said};
use crate::live_screen::LiveScreen;
use crate::planned_scan::read_text;
use crate::{output, requirement};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;
use trueline_camera::CameraError;
use trueline_dataset::{Sensor, sensor_toml};
use trueline_live::HostClock;
use trueline_mcap::RecorderHandle;

/// Between two looks at the screen.
const REFRESH: Duration = Duration::from_millis(200);

/// Says on its end that there is no camera any more.
struct Blinded<'a>(&'a AtomicBool);

impl Drop for Blinded<'_> {
    fn drop(&mut self) {
        self.0.store(true, Ordering::SeqCst);
    }
}

/// Camera and estimate.
pub struct LiveCell {
    camera: Option<LiveCamera>,
    estimate: Option<Arc<LiveEstimate>>,
    /// The robot's side has ended.
    pub over: AtomicBool,
    /// The camera has failed: nothing is to be gained by going on.
    pub blind: AtomicBool,
}

impl LiveCell {
    /// Opens the camera that the user named, if any.
    pub fn open(args: &CameraArgs, sensor: Option<&Path>, clock: HostClock) -> Result<Self, Failure> {
        let want = args.want.as_deref().map(|text| requirement::parse("--want", text)).transpose()?;
        let sensor: Option<Sensor> = match sensor {
            Some(file) => Some(sensor_toml::parse(file, &read_text(file)?)?),
            None => None,
        };
        let camera = LiveCamera::open(args, sensor.as_ref(), clock)?;
        let estimate = match (&camera, sensor) {
            (Some(_), Some(sensor)) => Some(Arc::new(LiveEstimate::new(sensor, want))),
            _ if want.is_some() => {
                return Err(Failure::new(
                    "--want needs a camera and its sensor.toml",
                    "--camera IP or --replay DATASET, and --sensor FILE",
                ));
            }
            _ => None,
        };
        Ok(Self { camera, estimate, over: AtomicBool::new(false), blind: AtomicBool::new(false) })
    }

    /// What gives pictures, in words.
    pub fn meaning(&self) -> Option<String> {
        self.camera.as_ref().map(LiveCamera::meaning)
    }

    /// Who wants the poses.
    pub fn estimate(&self) -> Option<Arc<LiveEstimate>> {
        self.estimate.clone()
    }

    /// Runs everything beside `robot`, which runs until it is done; `line` says how it is doing. Returns what came of the
    /// robot, and of the camera.
    pub fn run<T: Send>(
        &mut self,
        handle: &RecorderHandle,
        quiet: bool,
        robot: impl FnOnce(&AtomicBool) -> T + Send,
        line: impl Fn() -> String,
    ) -> (Option<T>, Result<(), CameraError>) {
        let Self { camera, estimate, over, blind } = self;
        let (mut camera, counts) = match camera.as_mut().map(LiveCamera::parts) {
            Some((recording, counts)) => (Some(recording), Some(counts)),
            None => (None, None),
        };
        let (over, blind, estimate) = (&*over, &*blind, estimate.as_deref());
        thread::scope(|scope| {
            let leading = scope.spawn(move || {
                let outcome = robot(blind);
                over.store(true, Ordering::SeqCst);
                outcome
            });
            let looking = scope.spawn(move || {
                // Should it panic, the scan is to be stopped as well.
                let blinded = Blinded(blind);
                let seen = camera.as_mut().map_or(Ok(()), |camera| camera.run(handle, estimate, over));
                if seen.is_ok() {
                    std::mem::forget(blinded);
                }
                seen
            });
            let estimating = estimate.map(|estimate| scope.spawn(move || estimate.run(over)));
            let screen = LiveScreen::new(quiet);
            // The robot's thread may end without a word of its own.
            while !over.load(Ordering::SeqCst) && !leading.is_finished() {
                thread::sleep(REFRESH);
                let seen = counts.map(|counts| counts.text());
                screen.show(&line(), seen.as_deref(), estimate.map(LiveEstimate::said).as_ref());
            }
            over.store(true, Ordering::SeqCst);
            drop(screen);
            let panicked = || CameraError::Io(std::io::Error::other("the camera's thread panicked"));
            let seen = looking.join().unwrap_or_else(|_| Err(panicked()));
            if let Some(Err(_)) = estimating.map(thread::ScopedJoinHandle::join) {
                output::words("warning: the estimate failed; what is recorded is not touched by that");
            }
            (leading.join().ok(), seen)
        })
    }

    /// Says what camera and estimate came to; whether all is well.
    pub fn tell(&self, camera: &Result<(), CameraError>, quiet: bool) -> bool {
        let (losses, much) = self.camera.as_ref().map(|camera| camera.counts().losses()).unwrap_or_default();
        for loss in losses {
            output::words(&format!("warning: {loss}"));
        }
        self.tell_rest(camera, quiet);
        camera.is_ok() && !much
    }

    fn tell_rest(&self, camera: &Result<(), CameraError>, quiet: bool) {
        if let Err(error) = camera {
            output::words(&format!("warning: {error}; what was recorded is kept\n\nhint: {}", error.hint()));
        }
        if quiet {
            return;
        }
        if let Some(camera) = &self.camera {
            output::words(&format!("camera: {}", camera.counts().text()));
        }
        if let Some(Said { line, missing, .. }) = self.estimate.as_ref().map(|estimate| estimate.said()) {
            output::words(&format!("estimate: {line}"));
            for advice in missing {
                output::words(&format!("not visible: {advice}"));
            }
        }
    }
}
