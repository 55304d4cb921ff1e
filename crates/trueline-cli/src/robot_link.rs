//! A robot's stream that cannot be opened.

use crate::failure::Failure;
use trueline_live::LinkError;

impl From<LinkError> for Failure {
    fn from(error: LinkError) -> Self {
        let (message, hint) = crate::args::link_hint(&error);
        Self::new(message, hint)
    }
}
