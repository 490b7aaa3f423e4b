//! The shape of a JSON value: every path that it has, with the types found there.

use std::collections::{BTreeMap, BTreeSet};

use serde_json::Value;

type Types = BTreeMap<String, BTreeSet<&'static str>>;

/// A line for every path; items of an array share theirs. Whatever is named after a device, a stage or a fact shows as
/// one path too: keys with spaces are no fields.
pub(crate) fn of(value: &Value) -> String {
    let mut types = Types::new();
    add(value, "", &mut types);
    types
        .iter()
        .map(|(path, types)| format!("{path}: {}\n", Vec::from_iter(types.iter().copied()).join(" | ")))
        .collect()
}

fn add(value: &Value, path: &str, types: &mut Types) {
    let mut found = |what| _ = types.entry(path.to_owned()).or_default().insert(what);
    match value {
        Value::Null => found("null"),
        Value::Bool(_) => found("boolean"),
        Value::Number(_) => found("number"),
        Value::String(_) => found("string"),
        Value::Array(items) => {
            found("array");
            items.iter().for_each(|item| add(item, &format!("{path}[]"), types));
        }
        Value::Object(fields) => {
            found("object");
            for (name, field) in fields {
                let name = if name.contains([' ', '/']) { "*" } else { name };
                add(field, &format!("{path}.{name}"), types);
            }
        }
    }
}
