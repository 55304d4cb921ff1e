//! A picture together with the lens that it was taken through.

use crate::lens::Lens;
use crate::picture::Picture;

/// What every measurement looks at.
#[derive(Debug)]
pub struct Frame<'a, L> {
    /// The picture.
    pub picture: &'a Picture<'a, L>,
    /// How it was taken.
    pub lens: &'a Lens,
}

// Two references can be copied whatever the levels are; derived, it would ask that of the levels as well.
impl<L> Clone for Frame<'_, L> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<L> Copy for Frame<'_, L> {}
