//! Text inside HTML and XML.

/// The text with the characters that mark-up reserves as entities.
pub(crate) fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::escape;

    #[test]
    fn reserved_characters_are_entities() {
        assert_eq!(escape("a\"<&>b"), "a&quot;&lt;&amp;&gt;b");
    }
}
