//! The path under which a proxy shows a site.

/// A path such as `/cells/7`, without a slash at its end; empty without a proxy.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Prefix(String);

impl Prefix {
    /// A prefix; `None` if the text is invalid.
    #[must_use]
    pub fn new(text: &str) -> Option<Self> {
        let text = text.strip_suffix('/').unwrap_or(text);
        let is_plain = |part: &str| {
            let allowed = |c: char| c.is_ascii_alphanumeric() || "-_.~".contains(c);
            !part.is_empty() && !part.chars().all(|c| c == '.') && part.chars().all(allowed)
        };
        if text.is_empty() {
            return Some(Self::default());
        }
        let parts = text.strip_prefix('/')?;
        parts.split('/').all(is_plain).then(|| Self(text.to_owned()))
    }

    /// The prefix in the form of links.
    #[must_use]
    pub fn text(&self) -> &str {
        &self.0
    }

    /// A path without it, empty if nothing follows; unchanged if it does not have it.
    pub(super) fn taken_off<'a>(&self, path: &'a str) -> &'a str {
        path.strip_prefix(&self.0).filter(|rest| rest.is_empty() || rest.starts_with('/')).unwrap_or(path)
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_path_is_no_prefix() {
        for (text, wanted) in [("/cells/7", "/cells/7"), ("/cells/7/", "/cells/7"), ("", ""), ("/", "")] {
            assert_eq!(Prefix::new(text).unwrap().text(), wanted);
        }
        for wrong in ["cells", "/a//b", "/../b", "/a b", "/a?b", "/{a}", "//", "/\"x"] {
            assert_eq!(Prefix::new(wrong), None, "{wrong}");
        }
    }

    #[test]
    fn only_a_whole_prefix_is_taken_off() {
        let prefix = Prefix::new("/cell").unwrap();
        for (path, wanted) in
            [("/cell/", "/"), ("/cell/watch/", "/watch/"), ("/cells/", "/cells/"), ("/", "/"), ("/cell", "")]
        {
            assert_eq!(prefix.taken_off(path), wanted);
        }
    }
}
