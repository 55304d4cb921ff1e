//! From a picture to its seam point: the recipe.

use crate::butt::Gap;
use crate::edge::EndFinder;
use crate::element::{Element, elements};
use crate::face::FaceFinder;
use crate::lens::Lens;
use crate::picture::{Level, Picture};
use crate::pieces::{Piece, PieceFinder};
use crate::seam::{Joint, NotFound, Seam};
use crate::stripe::StripeMeter;
use crate::tiles::{Candidate, Tiles};
use crate::{butt, fillet, lap, v_groove};

/// More tiles than this are no stripe; the ones that stand out most are kept.
pub const MOST_CANDIDATES: usize = 1500;

/// What a picture shows, before a joint is looked for.
#[derive(Clone, Copy, Debug)]
pub struct Evidence<'a, L> {
    /// The picture.
    pub picture: &'a Picture<'a, L>,
    /// How it was taken.
    pub lens: &'a Lens,
    /// The straight pieces of the stripe, the strongest first.
    pub pieces: &'a [Piece],
}

impl<L> Evidence<'_, L> {
    /// Why there is no joint among the pieces.
    #[must_use]
    pub fn no_joint(&self) -> NotFound {
        if self.pieces.len() == 1 { NotFound::OnePiece } else { NotFound::NotThisJoint }
    }
}

/// Memory that detection works in.
#[derive(Clone, Debug, Default)]
pub struct Workspace {
    /// Measures pieces of stripe.
    pub meter: StripeMeter,
    /// Finds where they end.
    pub ends: EndFinder,
    /// Finds where the end face of a plate begins.
    pub faces: FaceFinder,
    /// Gaps between plates.
    pub gaps: Vec<Gap>,
}

/// Finds the seam in pictures of one camera. Keeps its memory from one picture to the next, and nothing else:
/// every picture is looked at as a whole, so that no reflection can be locked on to.
#[derive(Clone, Debug)]
pub struct Detector {
    lens: Lens,
    tiles: Tiles,
    candidates: Vec<Candidate>,
    elements: Vec<Element>,
    finder: PieceFinder,
    pieces: Vec<Piece>,
    work: Workspace,
}

impl Detector {
    /// A detector for a lens.
    #[must_use]
    pub fn new(lens: Lens) -> Self {
        Self {
            lens,
            tiles: Tiles::default(),
            candidates: Vec::new(),
            elements: Vec::new(),
            finder: PieceFinder::default(),
            pieces: Vec::new(),
            work: Workspace::default(),
        }
    }

    /// The straight pieces of the last picture's stripe, the strongest first.
    #[must_use]
    pub fn pieces(&self) -> &[Piece] {
        &self.pieces
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
        self.look(picture);
        if self.pieces.is_empty() {
            return Err(NotFound::NoStripe);
        }
        let evidence = Evidence { picture, lens: &self.lens, pieces: &self.pieces };
        match joint {
            Joint::Fillet => fillet::find(&evidence, &mut self.work),
            Joint::Lap => lap::find(&evidence, &mut self.work),
            Joint::VGroove => v_groove::find(&evidence, &mut self.work),
            Joint::Butt => butt::find(&evidence, &mut self.work),
        }
    }

    /// Tiles that stand out → elements of a stripe → straight pieces.
    fn look<L: Level>(&mut self, picture: &Picture<'_, L>) {
        self.tiles.measure(picture);
        let contrast = self.tiles.contrast();
        self.candidates.clear();
        self.candidates.extend(self.tiles.standing_out(contrast));
        if self.candidates.len() > MOST_CANDIDATES {
            let excess = |candidate: &Candidate| candidate.peak - candidate.around;
            self.candidates.select_nth_unstable_by(MOST_CANDIDATES, |a, b| excess(b).total_cmp(&excess(a)));
            self.candidates.truncate(MOST_CANDIDATES);
        }
        elements(picture, &self.candidates, &mut self.elements);
        self.finder.find(&self.elements, &self.lens, &mut self.pieces);
    }
}
