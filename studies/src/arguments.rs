//! A study's arguments, by their place.

use std::str::FromStr;

/// The number at a place, or the default if there are fewer arguments.
pub(crate) fn number<T: FromStr>(arguments: &[String], place: usize, default: T) -> Result<T, String> {
    arguments
        .get(place)
        .map_or(Ok(default), |text| text.parse().map_err(|_| format!("`{text}` is not a valid number here")))
}

/// The word at a place, or an empty one.
pub(crate) fn word(arguments: &[String], place: usize) -> &str {
    arguments.get(place).map_or("", String::as_str)
}
