//! From a picture to its seam point: the recipe.

use crate::detection::Detection;
use crate::evidence::Evidence;
use crate::frame::Frame;
use crate::joint::arm_pair::LeastArm;
use crate::joint::butt::ButtFinder;
use crate::joint::coloured_corner::{ColouredCornerFinder, ColouredFrame};
use crate::joint::groove::GrooveFinder;
use crate::joint::lap::LapFinder;
use crate::joint::plain_corner::PlainCornerFinder;
use crate::joint::plate_end::PlateEndFinder;
use crate::joint::{edge, fillet, step, v_block, v_groove};
use crate::lens::Lens;
use crate::locate::binning::{BinnedLevels, FACTORS, bin, binned_lens, factor};
use crate::locate::edgel::{Edgel, edgels};
use crate::locate::line_segment::{LineSegment, SegmentFinder};
use crate::locate::tiles::{Candidate, MOST_CANDIDATES, Tiles};
use crate::measure::stripe_meter::StripeMeter;
use crate::not_found::NotFound;
use crate::picture::{Level, Picture};
use crate::picture_light::PictureLight;
use crate::region::PictureRegion;
use crate::seam::{Joint, Seam};
use crate::stripe_choice::StripeChoice;
use trueline_dataset::{GrayImage, Pixels, Sensor};

/// Finds the seam in pictures of one camera. Keeps its buffers from one picture to the next, and nothing else: every
/// picture is searched as a whole, so no reflection can be locked on to.
#[derive(Clone, Debug)]
pub struct Detector {
    /// For each of [`FACTORS`]: the lens of pictures made smaller by it.
    lenses: [Option<Lens>; FACTORS.len()],
    lens: Lens,
    locator: Locator,
    finders: JointFinders,
    binned: BinnedLevels,
    segments: Vec<LineSegment>,
    colour_locator: Locator,
    /// The straight segments in the laser's colour of the last picture.
    coloured: Vec<LineSegment>,
    region: Option<PictureRegion>,
    /// Ratio of the levels of the last searched picture to those of the picture itself: smaller pictures hold sums.
    level_scale: f64,
}

impl Detector {
    /// A detector for a lens.
    #[must_use]
    pub fn new(lens: Lens) -> Self {
        Self {
            lenses: FACTORS.map(|factor| binned_lens(&lens, factor)),
            lens,
            locator: Locator::default(),
            finders: JointFinders::default(),
            binned: BinnedLevels::default(),
            segments: Vec::new(),
            colour_locator: Locator::default(),
            coloured: Vec::new(),
            region: None,
            level_scale: 1.0,
        }
    }

    /// The same, looking for the seam in a part of the pictures only.
    #[must_use]
    pub fn within(self, region: Option<PictureRegion>) -> Self {
        Self { region, ..self }
    }

    /// The same, taking that one of several corners, grooves, gaps or ends that is meant.
    #[must_use]
    pub fn choosing(mut self, choice: StripeChoice) -> Self {
        self.finders.choice = choice;
        self
    }

    /// Search region of the seam, if not everywhere.
    #[must_use]
    pub fn region(&self) -> Option<&PictureRegion> {
        self.region.as_ref()
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

    /// How the last picture is lit.
    #[must_use]
    pub fn light(&self) -> PictureLight {
        PictureLight::of(&self.locator.tiles, &self.segments, self.level_scale)
    }

    /// How pictures are taken.
    #[must_use]
    pub fn lens(&self) -> &Lens {
        &self.lens
    }

    /// The seam point of a joint in a picture; of a joint with two lines, that of line 0.
    ///
    /// # Errors
    /// The reason why there is none; an unreliable point counts as none.
    pub fn seam<L: SeamLevel>(&mut self, picture: &Picture<'_, L>, joint: Joint) -> Result<Seam, NotFound> {
        self.detect(picture, joint).map(|found| found.seam)
    }

    /// Findings in a picture of a joint: seam points and the stripes on its plates.
    ///
    /// # Errors
    /// As [`Self::seam`].
    pub fn detect<L: SeamLevel>(
        &mut self,
        picture: &Picture<'_, L>,
        joint: Joint,
    ) -> Result<Detection, NotFound> {
        L::detect(self, picture, joint)
    }

    fn detect_at_any_brightness<L: Level>(
        &mut self,
        picture: &Picture<'_, L>,
        joint: Joint,
    ) -> Result<Detection, NotFound> {
        self.detect_bright(picture, joint)
            .or_else(|reason| self.detect_plain_corner(picture, joint).ok_or(reason))
    }

    /// Findings in a stated region of a corner with a faint stripe or a short arm.
    fn detect_plain_corner<L: Level>(&mut self, picture: &Picture<'_, L>, joint: Joint) -> Option<Detection> {
        let region = self.region.as_ref()?;
        let ridge = is_ridge(joint)?;
        let frame = Frame { picture, lens: &self.lens };
        let JointFinders { choice, corners, plain_corners, .. } = &mut self.finders;
        let found = plain_corners.find(frame, region, ridge, *choice, corners)?;
        self.level_scale = 1.0;
        self.segments.clear();
        self.segments.extend_from_slice(plain_corners.segments());
        Some(found)
    }

    /// As [`Self::detect_in`]; if levels show no fillet or corner, the colour may show its long arm. `colour` is the excess
    /// of the laser's colour over the others, in a picture of the same size ([`trueline_dataset::PictureSource::colour`]),
    /// and is requested only then.
    ///
    /// # Errors
    /// As [`Self::seam`], for the levels.
    pub fn detect_in_colour<'c>(
        &mut self,
        image: &GrayImage,
        colour: impl FnOnce() -> Option<&'c GrayImage>,
        joint: Joint,
    ) -> Result<Detection, NotFound> {
        self.detect_in(image, joint).or_else(|reason| {
            let ridge = is_ridge(joint).ok_or(reason)?;
            colour().and_then(|colour| self.coloured_corner_in(image, colour, ridge)).ok_or(reason)
        })
    }

    fn coloured_corner_in(
        &mut self,
        image: &GrayImage,
        colour: &GrayImage,
        ridge: bool,
    ) -> Option<Detection> {
        let [[width, height], [columns, rows]] = [image, colour].map(|image| [image.width, image.height]);
        match (&image.pixels, &colour.pixels) {
            (Pixels::Eight(levels), Pixels::Eight(above)) => {
                let colour = Picture::new(columns, rows, above)?;
                self.coloured_corner(&Picture::new(width, height, levels)?, &colour, ridge)
            }
            (Pixels::Sixteen(levels), Pixels::Sixteen(above)) => {
                let colour = Picture::new(columns, rows, above)?;
                self.coloured_corner(&Picture::new(width, height, levels)?, &colour, ridge)
            }
            // The channels of a picture have one depth.
            _ => None,
        }
    }

    fn coloured_corner<L: Level>(
        &mut self,
        picture: &Picture<'_, L>,
        colour: &Picture<'_, L>,
        ridge: bool,
    ) -> Option<Detection> {
        if [picture.width(), picture.height()] != [colour.width(), colour.height()] {
            return None;
        }
        self.colour_locator.candidates_in(colour, self.region.as_ref(), 1);
        self.colour_locator.segments_in(colour, &self.lens, &mut self.coloured);
        let JointFinders { corners, coloured_corners, .. } = &mut self.finders;
        let frame = Frame { picture, lens: &self.lens };
        let coloured = ColouredFrame { frame, colour, bright: &self.segments, coloured: &self.coloured };
        let (found, segments) = coloured_corners.find(&coloured, ridge, corners)?;
        let pixel = found.seam.pixel;
        if self.region.as_ref().is_some_and(|region| !region.contains(pixel.x, pixel.y)) {
            return None;
        }
        self.level_scale = 1.0;
        self.segments = segments;
        Some(found)
    }

    /// Findings in a picture with a stripe that stands out clearly.
    fn detect_bright<L: Level>(
        &mut self,
        picture: &Picture<'_, L>,
        joint: Joint,
    ) -> Result<Detection, NotFound> {
        self.level_scale = 1.0;
        self.locator.candidates_in(picture, self.region.as_ref(), 1);
        let factor = factor(picture, &self.locator.tiles, &self.locator.candidates);
        if factor == 1 {
            self.locator.segments_in(picture, &self.lens, &mut self.segments);
            return self.finders.find(
                joint,
                Frame { picture, lens: &self.lens },
                &self.segments,
                &self.locator,
            );
        }
        let lens =
            FACTORS.iter().zip(&self.lenses).find(|(k, _)| **k == factor).and_then(|(_, lens)| lens.as_ref());
        let smaller = bin(picture, factor, &mut self.binned);
        let (Some(lens), Some(smaller)) = (lens, smaller) else { return Err(self.locator.no_stripe()) };
        self.level_scale =
            (factor * factor) as f64 / f64::from(1_u32 << L::excess_bits(factor.trailing_zeros()));
        self.locator.candidates_in(&smaller, self.region.as_ref(), factor);
        self.locator.segments_in(&smaller, lens, &mut self.segments);
        let frame = Frame { picture: &smaller, lens };
        let found = self.finders.find(joint, frame, &self.segments, &self.locator);
        for segment in &mut self.segments {
            segment.unbin(factor);
        }
        found
            .map(|found| found.unbinned(factor))
            .map_err(|reason| reason.scaled(factor as f64, self.level_scale))
    }

    /// As [`Self::seam`], in a picture of whichever depth.
    ///
    /// # Errors
    /// As [`Self::seam`].
    pub fn seam_in(&mut self, image: &GrayImage, joint: Joint) -> Result<Seam, NotFound> {
        self.detect_in(image, joint).map(|found| found.seam)
    }

    /// As [`Self::detect`], in a picture of whichever depth.
    ///
    /// # Errors
    /// As [`Self::seam`].
    pub fn detect_in(&mut self, image: &GrayImage, joint: Joint) -> Result<Detection, NotFound> {
        let (width, height) = (image.width, image.height);
        const EMPTY: NotFound = NotFound::NoStripe { contrast: 0.0 };
        match &image.pixels {
            Pixels::Eight(levels) => {
                Picture::new(width, height, levels).map_or(Err(EMPTY), |picture| self.detect(&picture, joint))
            }
            Pixels::Sixteen(levels) => {
                Picture::new(width, height, levels).map_or(Err(EMPTY), |picture| self.detect(&picture, joint))
            }
        }
    }
}

/// Levels of pictures for the search. All of the detector is compiled for each of them here. A generic function would be
/// compiled again in every crate that calls it, which took each test and each program some ten seconds.
pub trait SeamLevel: Level {
    /// [`Detector::detect`] in a picture of these levels.
    ///
    /// # Errors
    /// As [`Detector::seam`].
    fn detect(
        detector: &mut Detector,
        picture: &Picture<'_, Self>,
        joint: Joint,
    ) -> Result<Detection, NotFound>;
}

impl SeamLevel for u8 {
    fn detect(
        detector: &mut Detector,
        picture: &Picture<'_, u8>,
        joint: Joint,
    ) -> Result<Detection, NotFound> {
        detector.detect_at_any_brightness(picture, joint)
    }
}

impl SeamLevel for u16 {
    fn detect(
        detector: &mut Detector,
        picture: &Picture<'_, u16>,
        joint: Joint,
    ) -> Result<Detection, NotFound> {
        detector.detect_at_any_brightness(picture, joint)
    }
}

/// Whether a joint is a corner in front of its arms; `None` for joints that are no corner of two arms.
fn is_ridge(joint: Joint) -> Option<bool> {
    match joint {
        Joint::Fillet => Some(false),
        Joint::Corner => Some(true),
        _ => None,
    }
}

/// Tiles that stand out → edgels of a stripe → straight segments.
#[derive(Clone, Debug, Default)]
struct Locator {
    tiles: Tiles,
    candidates: Vec<Candidate>,
    edgels: Vec<Edgel>,
    finder: SegmentFinder,
}

impl Locator {
    fn candidates_in<L: Level>(
        &mut self,
        picture: &Picture<'_, L>,
        region: Option<&PictureRegion>,
        factor: usize,
    ) {
        self.tiles.measure(picture);
        let contrast = self.tiles.contrast();
        self.candidates.clear();
        self.candidates.extend(self.tiles.standing_out(contrast));
        if let Some(region) = region {
            let k = factor as f64;
            let full = |at: f32| f64::from(at) * k;
            self.candidates.retain(|candidate| region.contains(full(candidate.u), full(candidate.v)));
        }
        if self.candidates.len() > MOST_CANDIDATES {
            let excess = |candidate: &Candidate| candidate.peak - candidate.around;
            self.candidates.select_nth_unstable_by(MOST_CANDIDATES, |a, b| excess(b).total_cmp(&excess(a)));
            self.candidates.truncate(MOST_CANDIDATES);
        }
    }

    fn segments_in<L: Level>(
        &mut self,
        picture: &Picture<'_, L>,
        lens: &Lens,
        segments: &mut Vec<LineSegment>,
    ) {
        edgels(picture, &self.candidates, &mut self.edgels);
        self.finder.find(&self.edgels, lens, segments);
    }

    fn no_stripe(&self) -> NotFound {
        NotFound::NoStripe { contrast: f64::from(self.tiles.greatest_excess()) }
    }
}

/// One finder for each kind of joint.
#[derive(Clone, Debug, Default)]
struct JointFinders {
    choice: StripeChoice,
    corners: StripeMeter,
    plain_corners: PlainCornerFinder,
    coloured_corners: ColouredCornerFinder,
    laps: LapFinder,
    butts: ButtFinder,
    edges: PlateEndFinder,
    grooves: GrooveFinder,
}

impl JointFinders {
    fn find<L: Level>(
        &mut self,
        joint: Joint,
        frame: Frame<'_, L>,
        segments: &[LineSegment],
        locator: &Locator,
    ) -> Result<Detection, NotFound> {
        if segments.is_empty() {
            return Err(locator.no_stripe());
        }
        let evidence = Evidence { frame, segments, least_arm: LeastArm::USUAL };
        let choice = self.choice;
        match joint {
            Joint::Fillet => fillet::find(&evidence, false, choice, &mut self.corners),
            Joint::Corner => fillet::find(&evidence, true, choice, &mut self.corners),
            Joint::VGroove => v_groove::find(&evidence, choice, &mut self.corners),
            Joint::VBlock => v_block::find(&evidence, choice, &mut self.corners),
            Joint::Step => step::find(&evidence, choice, &mut self.corners),
            Joint::Groove => self.grooves.find(&evidence, choice),
            Joint::Lap => self.laps.find(&evidence, choice),
            Joint::Butt => self.butts.find(&evidence, choice),
            Joint::Edge => edge::find(&evidence, choice, &mut self.edges),
        }
    }
}
