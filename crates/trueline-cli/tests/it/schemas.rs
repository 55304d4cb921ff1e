//! The output of `evaluate`, `features` and `plan` follows their JSON Schemas in `docs`, key by key.

use serde_json::{Value, json};
use std::fs;
use std::path::Path;
use std::process::Command;

fn trueline(folder: &Path, line: &str) {
    let program = env!("CARGO_BIN_EXE_trueline");
    let output = Command::new(program).current_dir(folder).args(line.split(' ')).output().unwrap();
    assert!(output.status.code().unwrap() < 2, "{line}: {}", String::from_utf8_lossy(&output.stderr));
}

fn read(file: &Path) -> Value {
    serde_json::from_str(&fs::read_to_string(file).unwrap()).unwrap()
}

fn schema(name: &str) -> Value {
    read(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs").join(format!("{name}.schema.json")))
}

/// Violations of a schema by a value; only the JSON Schema keywords of these files are known, and any other one is an
/// error.
fn faults(schema: &Value, value: &Value, at: &str) -> Vec<String> {
    let mut found = Vec::new();
    for (word, rule) in schema.as_object().unwrap() {
        let allowed = match word.as_str() {
            "$schema" | "title" | "description" => true,
            "type" => match rule {
                Value::Array(kinds) => kinds.iter().any(|kind| is_a(value, kind)),
                kind => is_a(value, kind),
            },
            "const" => rule == value,
            "enum" => rule.as_array().unwrap().contains(value),
            "minimum" => value.as_f64().is_some_and(|number| number >= rule.as_f64().unwrap()),
            "maximum" => value.as_f64().is_some_and(|number| number <= rule.as_f64().unwrap()),
            "minItems" => length(value).is_some_and(|length| length >= rule.as_u64().unwrap()),
            "maxItems" => length(value).is_some_and(|length| length <= rule.as_u64().unwrap()),
            "required" => {
                rule.as_array().unwrap().iter().all(|key| value.get(key.as_str().unwrap()).is_some())
            }
            "anyOf" => rule.as_array().unwrap().iter().any(|one| faults(one, value, at).is_empty()),
            "items" => {
                let items = value.as_array().into_iter().flatten().enumerate();
                found.extend(items.flat_map(|(k, item)| faults(rule, item, &format!("{at}[{k}]"))));
                true
            }
            "properties" => {
                let known = rule.as_object().unwrap().iter();
                let there = known.filter_map(|(key, rule)| Some((key, rule, value.get(key)?)));
                found.extend(there.flat_map(|(key, rule, item)| faults(rule, item, &format!("{at}.{key}"))));
                true
            }
            "additionalProperties" => {
                let known = schema.get("properties").and_then(Value::as_object);
                let others = value.as_object().into_iter().flatten();
                let others = others.filter(|(key, _)| known.is_none_or(|known| !known.contains_key(*key)));
                for (key, item) in others {
                    match rule {
                        Value::Bool(false) => found.push(format!("{at}.{key} is not in the schema")),
                        rule => found.extend(faults(rule, item, &format!("{at}.{key}"))),
                    }
                }
                true
            }
            other => panic!("{other} is a word of JSON Schema that this test does not know"),
        };
        if !allowed {
            found.push(format!("{at}: {word} {rule} forbids {value}"));
        }
        if word == "type" && !allowed {
            return found;
        }
    }
    found
}

fn length(value: &Value) -> Option<u64> {
    Some(value.as_array()?.len() as u64)
}

fn is_a(value: &Value, kind: &Value) -> bool {
    match kind.as_str().unwrap() {
        "object" => value.is_object(),
        "array" => value.is_array(),
        "string" => value.is_string(),
        "boolean" => value.is_boolean(),
        "integer" => value.is_u64() || value.is_i64(),
        "number" => value.is_number(),
        "null" => value.is_null(),
        other => panic!("{other} is no type"),
    }
}

#[test]
fn what_commands_write_is_what_their_schemas_say() {
    let dir = tempfile::tempdir().unwrap();
    for line in [
        "simulate --preset quick --out scan --quiet",
        "calibrate scan --json result.json --quiet",
        "evaluate scan --calibration result.json --json plain.json --quiet",
        "evaluate scan --calibration result.json --reference scan/truth.toml --tolerance 1mm --json known.json --quiet",
        "simulate --preset quick --random-cell --seed 9 --out other --quiet",
        "evaluate other --calibration result.json --json other.json --quiet",
        "simulate --images --duration-s 2 --frame-period-ms 200 --out pictures --quiet",
        "features pictures --json features.json --quiet",
        "plan --example --out plan --tries 400 --shape s --quiet",
    ] {
        trueline(dir.path(), line);
    }
    for (name, file) in [
        ("evaluation", "plain.json"),
        ("evaluation", "known.json"),
        ("evaluation", "other.json"),
        ("features", "features.json"),
        ("plan", "plan/plan.json"),
    ] {
        let found = faults(&schema(name), &read(&dir.path().join(file)), "");
        assert!(found.is_empty(), "{file} is not as docs/{name}.schema.json has it: {found:#?}");
    }
    // Both sides of what may be null were seen.
    assert!(read(&dir.path().join("known.json"))["tolerance"].is_object());
    assert!(read(&dir.path().join("other.json"))["other_cell"].is_object());
}

#[test]
fn a_key_that_is_missing_renamed_or_of_another_type_is_noticed() {
    let schema = schema("features");
    let good = json!({
        "joint": "fillet", "joint_chosen_by_pictures": true, "pictures": 3, "found": 2, "not_found": [], "unreadable": [],
        "median_sigma_px": [0.1, 0.1], "median_quality": 0.9, "median_px_from_neighbours": null, "picture_faults": [], "second_place_px": null,
        "median_gap_mm": null, "ms_per_picture": 1.5,
    });
    assert_eq!(faults(&schema, &good, ""), Vec::<String>::new());
    for (key, value) in [
        ("found", json!("two")),
        ("found", json!(-1)),
        ("renamed", json!(1)),
        ("median_sigma_px", json!([0.1])),
        ("not_found", json!([{ "code": "dark" }])),
    ] {
        let mut bad = good.clone();
        bad[key] = value.clone();
        assert!(!faults(&schema, &bad, "").is_empty(), "{key}: {value}");
    }
    let mut short = good;
    short.as_object_mut().unwrap().remove("pictures");
    assert!(!faults(&schema, &short, "").is_empty());
}
