//! A progress bar while pictures are examined.

use crate::progress;
use indicatif::ProgressBar;
use std::sync::Mutex;
use trueline_vision::scan::{ScanObserver, Stage};

/// One bar for each stage.
pub(crate) struct PictureProgress {
    quiet: bool,
    bar: Mutex<Option<ProgressBar>>,
}

impl PictureProgress {
    /// No bar yet.
    pub(crate) fn new(quiet: bool) -> Self {
        Self { quiet, bar: Mutex::default() }
    }

    fn with_bar(&self, then: impl FnOnce(&mut Option<ProgressBar>)) {
        if let Ok(mut bar) = self.bar.lock() {
            then(&mut bar);
        }
    }
}

impl ScanObserver for PictureProgress {
    fn begins(&self, stage: Stage, pictures: usize) {
        let what = match stage {
            Stage::ChoosingJoint => "pictures, to see which joint",
            Stage::FindingSeams => "pictures",
        };
        self.with_bar(|bar| *bar = Some(progress::bar(pictures as u64, what, self.quiet)));
    }

    fn advances(&self, _: Stage) {
        self.with_bar(|bar| bar.iter().for_each(|bar| bar.inc(1)));
    }

    fn ends(&self, _: Stage) {
        self.with_bar(|bar| bar.take().iter().for_each(ProgressBar::finish_and_clear));
    }
}
