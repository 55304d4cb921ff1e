//! Replies of a site.

/// Media type of a reply.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Media {
    /// A page.
    Html,
    /// A style sheet.
    Css,
    /// A script.
    Script,
    /// A picture.
    Png,
    /// A drawing.
    Svg,
    /// Numbers for Prometheus: the OpenMetrics text format.
    Metrics,
}

impl Media {
    /// The value of the header Content-Type.
    #[must_use]
    pub const fn content_type(self) -> &'static str {
        match self {
            Self::Html => "text/html; charset=utf-8",
            Self::Css => "text/css; charset=utf-8",
            Self::Script => "text/javascript; charset=utf-8",
            Self::Png => "image/png",
            Self::Svg => "image/svg+xml",
            Self::Metrics => "application/openmetrics-text; version=1.0.0; charset=utf-8",
        }
    }
}

/// A reply with its bytes.
#[derive(Clone, Debug)]
pub struct Reply {
    /// Its media type.
    pub media: Media,
    /// Its bytes.
    pub body: Vec<u8>,
}

impl Reply {
    /// A reply of text.
    #[must_use]
    pub fn text(media: Media, text: impl Into<String>) -> Self {
        Self { media, body: text.into().into_bytes() }
    }
}

/// A site: a function from a path to a reply. It is called in a thread of its own, so it may read a database, and by several
/// requests at once.
pub trait Site: Send + Sync + 'static {
    /// All paths there are; any other is 404.
    fn paths(&self) -> &'static [&'static str];

    /// The reply to one of them.
    ///
    /// # Errors
    /// A sentence with the reason for a missing page; the browser gets status 503.
    fn reply(&self, path: &str) -> Result<Reply, String>;
}
