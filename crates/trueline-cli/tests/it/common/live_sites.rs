//! A production with an alarm, and a recording that grows, for tests.
#![allow(dead_code, clippy::unwrap_used, reason = "each test uses a part of it, and fails by panicking")]

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use trueline_cell::{CameraCounts, CellState, LiveEstimate, LivePicture, RobotBrief};
use trueline_cli::serve::CellSite;
use trueline_dataset::{Feature, GrayImage, Measured, Pixels, Recording};
use trueline_sim::production::{Change, Layout, ScheduledChange, piece};
use trueline_sim::{Preset, simulate};
use trueline_watch::{Store, Watched, watch};

/// Six pieces, the clock 1 ms late from the fifth on. One of them has a name that is markup.
pub(crate) fn state_with_an_alarm(folder: &Path) -> PathBuf {
    late_state(folder, "cell-7", None)
}

/// The same where that is within a tolerance of 1 mm.
pub(crate) fn state_within_tolerance(folder: &Path) -> PathBuf {
    late_state(folder, "cell-8", Some(1e-3))
}

fn late_state(folder: &Path, cell: &str, tolerance_m: Option<f64>) -> PathBuf {
    let file = folder.join(format!("{cell}.sqlite"));
    let store = Store::open(&file).unwrap();
    let mut production = Layout::CheckScan.production();
    production.speed_m_s = 0.12;
    production.change = Some(ScheduledChange { change: Change::Timing(1e-3), piece: 4, after: 0.0 });
    let guess = piece(&production, 0, 1).truth.unwrap().parameters;
    let known =
        Watched { name: "result.json".to_owned(), sha256: "0".to_owned(), guess, result: None, tolerance_m };
    store.receiver("http://plc.example/alarm?token=secret", "plc.example").unwrap();
    for number in 0..6 {
        let name =
            if number == 4 { "<img src=x onerror=alert(1)>".to_owned() } else { format!("weld-{number:04}") };
        watch(&store, &known, &name, &piece(&production, number, 1)).unwrap();
    }
    file
}

/// A recording as it grows: an estimate from a part of a scan, then from more of it.
pub(crate) struct Growing {
    pub site: CellSite,
    pub picture: Arc<LivePicture>,
    scan: Recording,
}

impl Growing {
    pub(crate) fn new() -> Self {
        let scan = simulate(&Preset::Quick.scenario(), 1).unwrap();
        let picture = Arc::new(LivePicture::default());
        let site = CellSite::new("trueline record".to_owned(), Some(Arc::clone(&picture)));
        Self { site, picture, scan }
    }

    /// Shows what there is when so much of the scan has come.
    pub(crate) fn grow(&self, share: f64) {
        let part = |count: usize| (count as f64 * share) as usize;
        let estimate = LiveEstimate::new(self.scan.sensor.clone(), None);
        let mut poses = self.scan.robot[..part(self.scan.robot.len())].to_vec();
        let last = poses.last().map(|sample| sample.base_from_tool);
        let features = &self.scan.features[..part(self.scan.features.len())];
        estimate.offer_poses(&mut poses);
        features.iter().for_each(|feature| estimate.add_feature(*feature));
        estimate.run(&AtomicBool::new(true));
        let counts =
            CameraCounts { frames: 300, unusable: 2, missing: 4, seams: 280, ..CameraCounts::default() };
        let state = CellState { camera: Some(counts), estimate: Some(estimate.progress()) };
        let brief = RobotBrief { poses: 2500, base_from_tool: last, ..RobotBrief::default() };
        self.site.show("travelling: 250 Hz".to_owned(), brief, &state);
    }
}

/// A picture of a stripe with its seam, as a camera would leave it for a page that looks.
pub(crate) fn offer_picture(to: &LivePicture, frame: u64) {
    let (width, height) = (640, 480);
    let level = |k: usize| {
        let (x, y) = ((k % width) as f64, (k / width) as f64);
        let stripe = 200.0 + 0.4 * (x - 320.0).abs();
        (30.0 + 220.0 * (-0.5 * ((y - stripe) / 2.0).powi(2)).exp()) as u8
    };
    let image = GrayImage { width, height, pixels: Pixels::Eight((0..width * height).map(level).collect()) };
    let seam = Feature {
        stamp_ns: 0,
        line: 0,
        frame: None,
        device_ns: None,
        measured: Measured::Pixel([320.0, 200.0]),
        sigma: None,
        correlation: 0.0,
    };
    let _looked = to.look();
    assert!(to.offer(&image, frame, Some(&seam)));
}
