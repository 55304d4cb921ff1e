//! Restrictions for the browser in every reply: no scripts or styles except files of this server, no frames, no forms,
//! no guessing of types.

use axum::http::header::{self, HeaderName};
use axum::http::{HeaderMap, HeaderValue};

const FORBIDDEN: [(HeaderName, &str); 8] = [
    (
        header::CONTENT_SECURITY_POLICY,
        "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self'; connect-src 'self'; base-uri 'none'; \
         form-action 'none'; frame-ancestors 'none'",
    ),
    (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
    (header::X_FRAME_OPTIONS, "DENY"),
    (header::REFERRER_POLICY, "no-referrer"),
    (header::CACHE_CONTROL, "no-store"),
    (HeaderName::from_static("cross-origin-resource-policy"), "same-origin"),
    (HeaderName::from_static("cross-origin-opener-policy"), "same-origin"),
    (HeaderName::from_static("permissions-policy"), "camera=(), microphone=(), geolocation=(), usb=()"),
];

/// Adds them.
pub(super) fn forbid(headers: &mut HeaderMap) {
    for (name, value) in FORBIDDEN {
        headers.insert(name, HeaderValue::from_static(value));
    }
}
