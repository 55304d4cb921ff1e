//! Options whose value is one of some words.

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};

/// A word, its meaning (may be empty), and its value.
pub(crate) type Choice<T> = (&'static str, &'static str, T);

/// Reads one of the words; help lists them with their meaning.
pub(crate) fn one_of<T>(choices: &'static [Choice<T>]) -> impl TypedValueParser<Value = T>
where
    T: Clone + Send + Sync + 'static,
{
    let words = choices.iter().map(|(word, meaning, _)| match *meaning {
        "" => PossibleValue::new(*word),
        meaning => PossibleValue::new(*word).help(meaning),
    });
    PossibleValuesParser::new(words).try_map(move |found| named(choices, &found))
}

/// The value of a word.
pub(crate) fn named<T: Clone>(choices: &[Choice<T>], found: &str) -> Result<T, String> {
    let value = choices.iter().find(|(word, ..)| *word == found).map(|(_, _, value)| value.clone());
    value.ok_or_else(|| {
        let words: Vec<&str> = choices.iter().map(|(word, ..)| *word).collect();
        format!("expected one of {}", words.join(", "))
    })
}
