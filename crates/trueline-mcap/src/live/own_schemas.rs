//! JSON schemas of the messages that no standard describes.

use serde_json::{Value, json};

/// How a calibration grows while it is recorded; `null` where a value is not observable yet.
pub(super) fn estimate() -> Value {
    object(&json!({
        "seam_points": { "type": "integer" },
        "time_offset_ms": number(),
        "time_offset_sigma_ms": number(),
        "translation_sigma_mm": number(),
        "rotation_sigma_deg": number(),
        "is_enough": { "type": ["boolean", "null"] },
        "advice": { "type": "array", "items": { "type": "string" } },
        "why": { "type": ["string", "null"] },
        "poses": { "type": "integer" },
        "frames": { "type": "integer" },
        "frames_missing": { "type": "integer" },
    }))
}

/// Report of `watch` on a weld, as one line of JSON.
pub(super) fn weld() -> Value {
    object(&json!({ "weld": { "type": "string" } }))
}

fn number() -> Value {
    json!({ "type": ["number", "null"] })
}

fn object(properties: &Value) -> Value {
    json!({ "type": "object", "properties": properties })
}
