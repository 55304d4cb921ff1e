//! From a picture to its seam point: the recipe.

use crate::evidence::Evidence;
use crate::frame::Frame;
use crate::joint::butt::ButtFinder;
use crate::joint::lap::LapFinder;
use crate::joint::{fillet, v_groove};
use crate::lens::Lens;
use crate::locate::edgel::{Edgel, edgels};
use crate::locate::line_segment::{LineSegment, SegmentFinder};
use crate::locate::tiles::{Candidate, MOST_CANDIDATES, Tiles};
use crate::measure::stripe_meter::StripeMeter;
use crate::picture::{Level, Picture};
use crate::seam::{Joint, NotFound, Seam};
use trueline_dataset::{GrayImage, Pixels, Sensor};

/// Finds the seam in pictures of one camera. Keeps its memory from one picture to the next, and nothing else:
/// every picture is looked at as a whole, so that no reflection can be locked on to.
#[derive(Clone, Debug)]
pub struct Detector {
    lens: Lens,
    tiles: Tiles,
    candidates: Vec<Candidate>,
    edgels: Vec<Edgel>,
    finder: SegmentFinder,
    segments: Vec<LineSegment>,
    corners: StripeMeter,
    laps: LapFinder,
    butts: ButtFinder,
}

impl Detector {
    /// A detector for a lens.
    #[must_use]
    pub fn new(lens: Lens) -> Self {
        Self {
            lens,
            tiles: Tiles::default(),
            candidates: Vec::new(),
            edgels: Vec::new(),
            finder: SegmentFinder::default(),
            segments: Vec::new(),
            corners: StripeMeter::default(),
            laps: LapFinder::default(),
            butts: ButtFinder::default(),
        }
    }

    /// A detector for a recording's sensor; `None` if it takes no pictures.
    #[must_use]
    pub fn for_sensor(sensor: &Sensor) -> Option<Self> {
        match sensor {
            Sensor::CameraLaser { camera, laser_plane_in_camera } => {
                Some(Self::new(Lens::new(*camera, *laser_plane_in_camera)))
            }
            Sensor::Profiler | Sensor::Points { .. } => None,
        }
    }

    /// The straight segments of the last picture's stripe, the strongest first.
    #[must_use]
    pub fn segments(&self) -> &[LineSegment] {
        &self.segments
    }

    /// How pictures are taken.
    #[must_use]
    pub fn lens(&self) -> &Lens {
        &self.lens
    }

    /// The seam point of a joint in a picture.
    ///
    /// # Errors
    /// Why there is none; a point that cannot be relied on is none.
    pub fn seam<L: Level>(&mut self, picture: &Picture<'_, L>, joint: Joint) -> Result<Seam, NotFound> {
        self.locate(picture);
        if self.segments.is_empty() {
            return Err(NotFound::NoStripe);
        }
        let frame = Frame { picture, lens: &self.lens };
        let evidence = Evidence { frame, segments: &self.segments };
        match joint {
            Joint::Fillet => fillet::find(&evidence, &mut self.corners),
            Joint::Lap => self.laps.find(&evidence),
            Joint::VGroove => v_groove::find(&evidence, &mut self.corners),
            Joint::Butt => self.butts.find(&evidence),
        }
    }

    /// The seam point of a joint in a picture of whichever depth.
    ///
    /// # Errors
    /// As [`Self::seam`].
    pub fn seam_in(&mut self, image: &GrayImage, joint: Joint) -> Result<Seam, NotFound> {
        let (width, height) = (image.width, image.height);
        match &image.pixels {
            Pixels::Eight(levels) => {
                Picture::new(width, height, levels).map_or(Err(NotFound::NoStripe), |p| self.seam(&p, joint))
            }
            Pixels::Sixteen(levels) => {
                Picture::new(width, height, levels).map_or(Err(NotFound::NoStripe), |p| self.seam(&p, joint))
            }
        }
    }

    /// Tiles that stand out → edgels of a stripe → straight segments.
    fn locate<L: Level>(&mut self, picture: &Picture<'_, L>) {
        self.tiles.measure(picture);
        let contrast = self.tiles.contrast();
        self.candidates.clear();
        self.candidates.extend(self.tiles.standing_out(contrast));
        if self.candidates.len() > MOST_CANDIDATES {
            let excess = |candidate: &Candidate| candidate.peak - candidate.around;
            self.candidates.select_nth_unstable_by(MOST_CANDIDATES, |a, b| excess(b).total_cmp(&excess(a)));
            self.candidates.truncate(MOST_CANDIDATES);
        }
        edgels(picture, &self.candidates, &mut self.edgels);
        self.finder.find(&self.edgels, &self.lens, &mut self.segments);
    }
}
