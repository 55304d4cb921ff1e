//! The file of a result: written files are read again, older files are read, newer ones are refused, and the JSON Schema in
//! `docs` matches the type.

use serde_json::{Value, json};
use std::path::Path;
use trueline_dataset::result_file::{Fact, ResultFile, Status, json_schema};

fn parse(value: &Value) -> ResultFile {
    ResultFile::parse(Path::new("result.json"), &value.to_string()).unwrap()
}

fn refusal(text: &str) -> String {
    ResultFile::parse(Path::new("result.json"), text).unwrap_err().to_string()
}

fn full() -> Value {
    let identity = json!({ "translation_mm": [1.5, null, -0.1], "rotation_wxyz": [1.0, 0.0, 0.0, 0.0] });
    json!({
        "schema_version": 3,
        "status": "not_accepted",
        "reasons": [{ "code": "clock-step", "text": "a clock stepped", "at_s": 1.25, "step_s": 0.1 }],
        "time_offset_s": 0.1 + 0.2,
        "tool_from_camera": identity,
        "stamps": { "robot": { "used": "regular", "period_s": 0.004, "drift_ppm": 3.0 } },
        "checks": { "disruptions": [
            { "span_s": [1.0, 2.0], "features": 7, "cause": "other_line", "amount": { "beside_mm": 2.0 } },
        ] },
    })
}

#[test]
fn what_is_written_is_read_again_to_the_last_digit() {
    let result = parse(&full());
    assert_eq!(result.time_offset_s, Some(0.1 + 0.2));
    assert_eq!(result.reasons[0].values["at_s"], json!(1.25));
    assert_eq!(result.stamps.robot.stream.period_s, Some(0.004));
    let text = result.to_json().unwrap();
    assert_eq!(ResultFile::parse(Path::new("again.json"), &text).unwrap(), result);
}

#[test]
fn a_result_of_schema_1_is_read_with_reasons_that_have_no_code() {
    let mut old = full();
    old["schema_version"] = json!(1);
    old["reasons"] = json!(["a clock stepped"]);
    let result = parse(&old);
    assert_eq!(result.reasons, [Fact { text: "a clock stepped".to_owned(), ..Fact::default() }]);
    assert_eq!(result.status, Some(Status::NotAccepted));
}

#[test]
fn a_result_of_a_later_schema_is_refused_with_both_versions() {
    let mut new = full();
    new["schema_version"] = json!(4);
    assert!(
        refusal(&new.to_string()).ends_with("has schema version 4; this program supports versions up to 3")
    );
}

#[test]
fn another_json_is_no_result() {
    assert!(refusal(r#"{ "time_offset_s": 0.1 }"#).contains("missing field `tool_from_camera`"));
    assert!(refusal("[1, 2").contains("result.json, line 1"));
}

/// `UPDATE=1 cargo test -p trueline-dataset` writes it anew.
#[test]
fn the_schema_in_the_repository_is_that_of_the_type() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/result.schema.json");
    let text = serde_json::to_string_pretty(&json_schema()).unwrap() + "\n";
    if std::env::var_os("UPDATE").is_some() {
        std::fs::write(&file, &text).unwrap();
    }
    assert_eq!(std::fs::read_to_string(&file).unwrap(), text, "run this test with UPDATE=1");
}
