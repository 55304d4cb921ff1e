//! A reason or a warning in the file.

use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::BTreeMap;

/// A stable code to act on, a sentence to read, and the values in it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(from = "Form")]
pub struct Fact {
    /// A stable kebab-case word. Empty in files of schema 1.
    pub code: String,
    /// The sentence.
    pub text: String,
    /// The values; every number has its unit in the key.
    #[serde(flatten)]
    pub values: BTreeMap<String, Value>,
}

/// How schemas 1 and 2 write it.
#[derive(Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(untagged)]
enum Form {
    Text(String),
    Typed {
        code: String,
        text: String,
        #[serde(flatten)]
        values: BTreeMap<String, Value>,
    },
}

impl From<Form> for Fact {
    fn from(form: Form) -> Self {
        match form {
            Form::Text(text) => Self { text, ..Self::default() },
            Form::Typed { code, text, values } => Self { code, text, values },
        }
    }
}
