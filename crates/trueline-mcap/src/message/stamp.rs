//! Which numbers of nanoseconds can be the stamp of a message.

use crate::message::content_error::ContentError;
use trueline_dataset::stamp::is_in_range;

/// A stamp that can be calculated with.
///
/// # Errors
/// [`ContentError::Stamp`] for one further from its clock's zero than any clock is.
pub(crate) fn in_range(nanoseconds: i64) -> Result<i64, ContentError> {
    if is_in_range(nanoseconds) { Ok(nanoseconds) } else { Err(ContentError::Stamp) }
}

/// The same of a time of a recording's own.
///
/// # Errors
/// As [`in_range`].
pub(crate) fn of_log(nanoseconds: u64) -> Result<i64, ContentError> {
    i64::try_from(nanoseconds).map_err(|_| ContentError::Stamp).and_then(in_range)
}
