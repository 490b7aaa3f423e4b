//! The shape of a JSON value: all its paths, with the types of their values.

use std::collections::{BTreeMap, BTreeSet};

use serde_json::Value;

type Types = BTreeMap<String, BTreeSet<&'static str>>;

/// One line for each path. The items of an array share a path. Keys with a space or a slash share one too: they are
/// names of devices, stages or facts, not fields.
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
