//! A picture together with the lens that it was taken through.

use crate::lens::Lens;
use crate::picture::Picture;

/// Inputs of every measurement.
#[derive(Debug)]
pub struct Frame<'a, L> {
    /// The picture.
    pub picture: &'a Picture<'a, L>,
    /// How it was taken.
    pub lens: &'a Lens,
}

// Two references can be copied for any levels; derived, it would require that of the levels as well.
impl<L> Clone for Frame<'_, L> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<L> Copy for Frame<'_, L> {}
