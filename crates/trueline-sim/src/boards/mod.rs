//! Pictures of a chessboard, rendered forward: for every pixel the light of the board where its ray meets it.
//!
//! A pixel's light is the mean over points spread in it. Rays come from an inversion of the distortion of their own
//! (a fixed-point iteration), and meet the board in space. The detector of boards in pictures shares no line with
//! this.

mod lens;
mod moving;
mod pictures;
mod scene;

pub use moving::BoardScan;
pub use pictures::BoardPictures;
pub use scene::{BoardScene, Stripe, render};

use std::path::Path;
use trueline_dataset::Error;

/// A folder of pictures of boards.
#[derive(Clone, Debug)]
pub struct BoardFolder {
    /// Board and sensor.
    pub boards: BoardPictures,
    /// Pictures in each of the folders `boards`, `stripes` and `without-laser`.
    pub count: u32,
    /// The scan of a board before the moving robot, in `moving`.
    pub scan: BoardScan,
}

impl BoardFolder {
    /// A usual one: 60 pictures before the moving robot, 17.73 ms.
    #[must_use]
    pub fn new(corners: [usize; 2], square_m: f64, count: u32, seed: u64) -> Self {
        let scan = BoardScan { time_offset_s: 0.01773, pictures: 60, seed };
        Self { boards: BoardPictures::new(corners, square_m), count, scan }
    }

    /// Summary of the written files, and the next commands.
    #[must_use]
    pub fn words(&self, folder: &Path) -> String {
        format!(
            "{0}: simulated pictures of a board, {1} each in boards, stripes and without-laser, {2} in the scan moving with a time offset \
             of {3} ms; the truth is in truth_sensor.toml and moving/truth.toml\nnext: trueline sensor intrinsics {0}/boards, \
             trueline sensor laser-plane {0}/stripes, trueline calibrate {0}/moving --target board",
            folder.display(),
            self.count,
            self.scan.pictures,
            self.scan.time_offset_s * 1e3,
        )
    }

    /// All pictures.
    #[must_use]
    pub fn pictures(&self) -> u64 {
        3 * u64::from(self.count) + u64::from(self.scan.pictures)
    }

    /// Writes a sensor's calibration data with a board, and the truth, into an existing folder: `boards` (laser off,
    /// anywhere in the picture), `stripes` (laser on), `without-laser` (the same poses, laser off), `moving` (a dataset of a
    /// robot that moves the camera) and `truth_sensor.toml`. `drawn` is called after each picture.
    ///
    /// # Errors
    /// A board that does not fit into the picture; files that cannot be written.
    pub fn write(&self, folder: &Path, drawn: &(dyn Fn() + Sync)) -> Result<(), Error> {
        self.boards.write(folder, self.count, self.scan.seed, drawn)?;
        self.scan.write(&folder.join("moving"), &self.boards, drawn)
    }
}
